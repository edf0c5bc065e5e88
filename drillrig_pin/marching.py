"""Carry a bound rig through time, in Python or in the compiled core, into the same recorder."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from functools import lru_cache

import numpy as np

from drillrig_pin.dependence import RANK
from drillrig_pin.dynamics import WEAK, Dynamics
from drillrig_pin.elements.cylinder import Cylinder
from drillrig_pin.errors import SingularConfigurationError, Status
from drillrig_pin.kinematics import Array
from drillrig_pin.recorder import Recorder
from drillrig_pin.stepping import Counter, Settings, StoppedError, stops_of

Progress = Callable[[float], None]
#: Integrates over the samples into the recorder; StoppedError if it cannot go on.
March = Callable[[Settings, Array, Recorder, Counter, Progress | None], None]
#: dy/dt (k, size) at times (k) and states (k, size).
Rates = Callable[[Array, Array], Array]


def march_python(dynamics: Dynamics) -> tuple[March, Rates]:
    """A bound rig in Python, to be marched and to be looked at."""

    def march(
        settings: Settings, samples: Array, recorder: Recorder, counter: Counter, progress: Progress | None
    ) -> None:
        # SciPy's integrators take a third of a second to import, which a run in the core need not wait for.
        from drillrig_pin.integrators import integrate

        watch = RankWatch() if dynamics.formulation != "damped" else None
        every = max(1, len(samples) // 200)
        with np.errstate(all="ignore"):
            stops = stops_of(samples, dynamics.breakpoints(), dynamics.jumps())
            for t, y in integrate(dynamics, dynamics.initial(), stops, settings, counter):
                broken = broken_cylinder(dynamics)
                if broken:
                    raise StoppedError(Status.DIVERGED, t, broken, y)
                if watch is not None:
                    watch.look(dynamics.space.J)
                recorder.record(t, y)
                if progress is not None and recorder.count % every == 0:
                    progress(t)

    def rates(times: Array, states: Array) -> Array:
        with np.errstate(all="ignore"):
            return np.array([dynamics.rate(t, y) for t, y in zip(times.tolist(), states, strict=True)])

    return march, rates


def march_core(dynamics: Dynamics) -> tuple[March, Rates]:
    """The same in the compiled core, which marches without the GIL."""
    from drillrig_pin.core import CompiledDynamics

    compiled = CompiledDynamics(dynamics)

    def march(
        settings: Settings, samples: Array, recorder: Recorder, counter: Counter, progress: Progress | None
    ) -> None:
        report = compiled.run(dynamics.initial(), settings, samples, recorder.arrays(), progress)
        recorder.count = report.samples
        counter.steps, counter.evaluations, counter.switches = report.steps, report.evaluations, report.switches
        if report.error is not None:
            raise report.error
        if progress is not None:
            progress(report.time)
        if report.status is Status.SINGULAR:
            raise SingularConfigurationError("the constraint Jacobian has lost rank")
        if report.status is not Status.COMPLETED:
            raise StoppedError(report.status, report.time, report.cause, report.state)

    return march, compiled.rates


@lru_cache(maxsize=1)
def core_is_installed() -> bool:
    """True if the package was built with a C++ compiler."""
    return importlib.util.find_spec("drillrig_pin._drillrig") is not None


class RankWatch:
    """Notices that the constraint Jacobian loses rank at a sample, or has passed through a loss since the last one.

    Where it does, its smallest singular value s crosses zero: the value itself is positive again behind it, but one of
    its two singular vectors has changed sign, or both have turned because the motion took another path. Beyond such a
    point there is more than one path, and the equations cannot say which one the machine takes.

    By Weyl's inequality s changes by no more than the Frobenius norm of the change of J. As long as J stays within
    s / 2 of where it was last looked at, there is nothing to see.
    """

    #: Cosine above which the vectors of two samples are those of one smooth motion; below its negative, one has turned.
    SAME = 0.5

    def __init__(self) -> None:
        self._rank = 0
        self._largest = 0.0
        self._last: tuple[Array, float, Array, Array] | None = None

    def look(self, J: Array) -> None:
        """Take in the Jacobian of the next sample; SingularConfigurationError if rank is or was lost."""
        if not len(J):
            return
        if self._last is not None and np.linalg.norm(J - self._last[0]) <= 0.5 * self._last[1]:
            return
        U, values, V = np.linalg.svd(J, full_matrices=False)
        self._largest = max(self._largest, float(values[0]))
        rank = int((values > RANK * self._largest).sum())
        if self._last is None:
            self._rank = rank
        if rank < self._rank or rank == 0:
            raise SingularConfigurationError("the constraint Jacobian has lost rank")
        value, left, right = float(values[rank - 1]), U[:, rank - 1], V[rank - 1]
        if self._last is not None:
            _, before, left_before, right_before = self._last
            same = float((left @ left_before) * (right @ right_before))
            weak = max(value, before) < WEAK * self._largest
            if same < (self.SAME if weak else -self.SAME):
                raise SingularConfigurationError("the constraint Jacobian has passed through a loss of rank")
        self._last = J.copy(), value, left, right


def broken_cylinder(dynamics: Dynamics, spare: float = 0.0) -> str:
    """Says which cylinder left its stroke, or moves towards an end that is nearer than ``spare`` of its stroke."""
    for element, i in zip(dynamics.forces, dynamics.space.index, strict=True):
        if isinstance(element, Cylinder):
            shortest, longest = element.length_range
            length, rate = float(dynamics.x[i]), float(dynamics.x_dot[i])
            margin = spare * element.stroke
            if length <= shortest or length >= longest:
                return f"cylinder {element.name!r} left its stroke (length {length:.4f} m)"
            if (length <= shortest + margin and rate < 0) or (length >= longest - margin and rate > 0):
                return f"cylinder {element.name!r} runs against the end of its stroke (length {length:.4f} m)"
    return ""
