"""The compiled twin of the time loop: hands a bound rig over as plain numbers. The only importer of the C++ module."""

from __future__ import annotations

import math
from collections.abc import Callable
from importlib.metadata import version
from typing import Any, NamedTuple

import numpy as np

from drillrig_pin.beat import beat, listened
from drillrig_pin.coordinates import Angle, CoordinateSet, Line, Slide, Turn
from drillrig_pin.dependence import RANK
from drillrig_pin.dynamics import Dynamics
from drillrig_pin.elements.base import Element, Law
from drillrig_pin.elements.contact import BilateralContact, UnilateralContact
from drillrig_pin.elements.cylinder import Cylinder, LockedOil, LockedOilAsPrinted
from drillrig_pin.elements.friction import FrictionLaw
from drillrig_pin.elements.loads import HarmonicLaw, TableLaw
from drillrig_pin.elements.springs import ConstantForce, SpringDamper
from drillrig_pin.errors import EngineError, SingularConfigurationError, Status
from drillrig_pin.kinematics import Anchor, Array
from drillrig_pin.scenario import CORE_METHODS
from drillrig_pin.stepping import NOT_FINITE, Plan, Settings

try:
    from drillrig_pin._drillrig import PINOCCHIO_VERSION, CompiledRig, CompiledTree
except ImportError as error:
    raise EngineError(
        f"the compiled core cannot be loaded ({error})",
        todo="It needs the very version of pin it was built with: reinstall drillrig-pin, or choose engine: python.",
    ) from None

Progress = Callable[[float], None]


def require_version(built: str, installed: str) -> None:
    """Refuse another Pinocchio than the core was built with: its binary interface changes with every release.

    Raises:
        EngineError: the versions differ.
    """
    if built != installed:
        raise EngineError(
            f"the compiled core was built with pin {built}, but pin {installed} is installed",
            todo=f"Install pin=={built}, reinstall drillrig-pin, or choose engine: python.",
        )


require_version(PINOCCHIO_VERSION, version("pin"))

#: Law classes in the order of LawKind in _core/laws.hpp, with the fields each hands over.
OIL = ("x0", "E0", "S_A", "S_B", "l_A", "l_B", "p_A0", "p_B0", "k")
KINDS: dict[type[Law], tuple[int, tuple[str, ...]]] = {
    LockedOil: (0, OIL),
    LockedOilAsPrinted: (1, OIL),
    SpringDamper: (2, ("x0", "F0", "c", "k")),
    ConstantForce: (3, ("F0",)),
    BilateralContact: (4, ("x0", "N0", "c", "k")),
    UnilateralContact: (5, ("x0", "N0", "c", "k")),
    HarmonicLaw: (6, ("mean", "ramp")),
    TableLaw: (7, ("ramp",)),
    FrictionLaw: (8, ("k", "F_c", "w")),
}
CALLBACK = 9


#: Status codes of the core (_core/dynamics.hpp) with their causes.
STATUS: tuple[tuple[Status, str], ...] = (
    (Status.COMPLETED, ""),
    (Status.INTERRUPTED, ""),
    (Status.DIVERGED, NOT_FINITE),
    (Status.STEP_TOO_SMALL, "no step is short enough for the tolerance"),
    (Status.SINGULAR, ""),
    (Status.DIVERGED, "a force law failed"),
    (Status.DRIFTED, ""),
)


class Report(NamedTuple):
    """How a compiled run ended: the exception to raise, if any, status, cause, and what it cost.

    ``rows`` of the plan were filled; ``extra`` holds further rows, all arrays of a row behind one another.
    """

    error: BaseException | None
    status: Status
    cause: str
    time: float
    rows: int
    steps: int
    evaluations: int
    switches: int
    state: Array
    extra: Array


class CompiledDynamics:
    """A :class:`~drillrig_pin.dynamics.Dynamics` compiled once; ``run`` and ``evaluate`` make their own workspaces."""

    def __init__(self, dynamics: Dynamics) -> None:
        self.dynamics = dynamics
        rig, space = dynamics.rig, dynamics.space
        coordinates: CoordinateSet = space.coordinates
        joints, turns, lines, slides, angles, gears = coordinates.kinds
        order = np.argsort(space.index)
        self._laws = [dynamics.laws[i] for i in order]
        laws = _Laws(self._laws)
        a, b, c, base, moving = _wrenches(turns, lines, slides, angles)
        kind, values = dynamics.correction.parameters
        self.rig = CompiledRig(
            tree=rig.once("compiled tree", lambda: CompiledTree(rig.model.saveToString())),
            joints=[n for j in joints for n in (j.index_q, j.index_v)],
            counts=[len(turns), len(lines), len(slides), len(angles)],
            gears=[n for g in gears for j in (g.follower, g.leader) for n in (j.index_q, j.index_v)],
            ratios=[gear.ratio for gear in gears],
            a=a,
            b=b,
            c=c,
            base=base,
            moving=moving,
            constraints=space.m,
            kinds=laws.kinds,
            loads=[int(dynamics.forces[i].load) for i in order],
            parameters=laws.parameters,
            ranges=laws.ranges,
            series=laws.series,
            lowest=[_range_of(dynamics.forces[i])[0] for i in order],
            highest=[_range_of(dynamics.forces[i])[1] for i in order],
            targets=dynamics.targets.tolist(),
            support=space.support.astype(int).ravel().tolist(),
            points=_rows([rig.point(name) for name in rig.tracked]),
            formulation={"multipliers": 0, "null_space": 1, "damped": 2}[dynamics.formulation],
            correction=kind,
            correction_values=values,
            rank=dynamics.rank,
            rank_threshold=RANK,
        )

    def _callback(self, index: int, x: float, x_dot: float, t: float) -> tuple[float, float]:
        """A law of the user's, one element at a time."""
        law, position, rate = self._laws[index], np.array([x]), np.array([x_dot])
        force = float(np.ravel(law.force(position, rate, t))[0])
        return force, float(np.ravel(law.dissipation(position, rate))[0])

    def _switches(self, index: int, x: float, x_dot: float) -> list[float]:
        """Its switching functions."""
        values = self._laws[index].switches(np.array([x]), np.array([x_dot]))
        return [] if values is None else np.ravel(values).tolist()

    def run(self, y0: Array, settings: Settings, plan: Plan, arrays: list[Array], progress: Progress | None) -> Report:
        """Integrate over the rows of the plan into the given arrays, with the GIL released.

        Ctrl-C and errors of a callback stop the run within about 50 ms; what was computed stays in the arrays.
        ``progress`` is called about as often with the time reached [s].
        """

        def heard(t: float) -> None:
            beat()
            if progress is not None:
                progress(t)

        error, status, *rest = self.rig.run(
            y0=y0,
            method=CORE_METHODS.index(settings.method),
            step=settings.step,
            rtol=settings.rtol,
            atol=settings.atol,
            relative=settings.relative,
            max_step=settings.max_step if np.isfinite(settings.max_step) else 0.0,
            projection=settings.projection,
            times=plan.times,
            ends=plan.ends,
            starts=plan.starts,
            stops=plan.stops.astype(np.uint8),
            breaks=plan.breaks.astype(np.uint8),
            arrays=arrays,
            law=self._callback,
            switches=self._switches,
            # Signals are looked at in any case.
            beat=heard if progress is not None or listened() else None,
        )
        return Report(error, *STATUS[status], *rest)

    def rates(self, times: Array, states: Array) -> Array:
        """dy/dt (k, size) at times (k) and states (k, size).

        Raises:
            SingularConfigurationError: the constraint Jacobian has no full rank at one of them.
        """
        rates = np.empty_like(states)
        beat()
        at, states = np.ascontiguousarray(times), np.ascontiguousarray(states)
        singular = self.rig.rates(at, states, rates, self._callback, lambda _: beat())
        if singular:
            raise SingularConfigurationError("the constraint Jacobian has lost rank")
        return rates

    def evaluate(self, t: float, y: Array) -> dict[str, Any]:
        """All that the right-hand side computes, by name."""
        result: dict[str, Any] = self.rig.evaluate(t, np.ascontiguousarray(y), self._callback)
        return result


class _Laws:
    """Numbers of all laws, flattened."""

    def __init__(self, laws: list[Law]) -> None:
        self.kinds: list[int] = []
        self.parameters: list[float] = []
        self.ranges: list[int] = []
        self.series: list[float] = []
        for law in laws:
            kind, fields = KINDS.get(type(law), (CALLBACK, ()))
            numbers = [float(getattr(law, name)) for name in fields]
            start, count = len(self.series), 0
            if isinstance(law, HarmonicLaw):
                count = len(law.amplitude)
                self.series += np.column_stack([law.amplitude, law.frequency, law.phase]).ravel().tolist()
            elif isinstance(law, TableLaw):
                knots = law.knots()
                count = len(knots)
                self.series += knots.ravel().tolist()
            elif kind == CALLBACK:
                switches = law.switches(np.zeros(1), np.zeros(1))
                count = 0 if switches is None else np.size(switches)
            self.kinds.append(kind)
            self.parameters += numbers + [0.0] * (9 - len(numbers))
            self.ranges += [start, count]


def _range_of(element: Element) -> tuple[float, float]:
    """Where the coordinate of an element may lie: a cylinder has ends."""
    return element.length_range if isinstance(element, Cylinder) else (-math.inf, math.inf)


def _rows(anchors: list[Anchor]) -> list[float]:
    return [float(n) for anchor in anchors for n in (anchor.joint, *anchor.vector, anchor.w)]


_NOTHING = Anchor(0, (0.0, 0.0, 0.0), 0)


def _wrenches(
    turns: list[Turn], lines: list[Line], slides: list[Slide], angles: list[Angle]
) -> tuple[list[float], list[float], list[float], list[int], list[int]]:
    a = [t.direction for t in turns] + [x.start for x in lines] + [s.origin for s in slides] + [g.base for g in angles]
    b = [_NOTHING for _ in turns] + [x.end for x in lines] + [s.point for s in slides] + [g.moving for g in angles]
    c = [_NOTHING for _ in [*turns, *lines]] + [s.direction for s in slides] + [_NOTHING for _ in angles]
    base = [t.base for t in turns] + [anchor.joint for anchor in a[len(turns) :]]
    moving = [t.body for t in turns] + [anchor.joint for anchor in b[len(turns) :]]
    return _rows(a), _rows(b), _rows(c), base, moving
