"""This package's two engines, through the interface that the other engines are measured by."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import ClassVar

import numpy as np

from drillrig_pin.kinematics import Array
from drillrig_pin.simulation import Case
from peers.problem import Problem, Setting, Stopwatch, divided

#: Steps per sample of the methods whose longest step is bounded, and relative tolerances of the others, as powers.
EXPONENTIAL = (1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 14, 16, 18, 20)
FIXED = (3, 4, 5, 8, 10, 15, 20, 30, 40, 60)
ADAPTIVE = {"DOP853": range(3, 13), "RODAS": range(3, 12)}
PYTHON = {"DOP853": range(3, 12), "LSODA": range(2, 12)}


@contextlib.contextmanager
def core_time() -> Iterator[list[Stopwatch]]:
    """Time that runs inside this block spend in the compiled core, one entry a run."""
    from drillrig_pin.core import CompiledDynamics

    original = CompiledDynamics.run
    spent: list[Stopwatch] = []

    def timed(*arguments: object) -> object:
        with Stopwatch() as watch:
            spent.append(watch)
            return original(*arguments)

    CompiledDynamics.run = timed
    try:
        yield spent
    finally:
        CompiledDynamics.run = original


class _Package:
    """A bound case per setting, made when first asked for."""

    name: str
    engine: str
    package = "drillrig-pin"
    orders: ClassVar = {"RK4": 4}

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.cases: dict[Setting, Case] = {}

    def case(self, setting: Setting) -> Case:
        """Bound: assembled, in equilibrium, compiled."""
        if setting not in self.cases:
            self.cases[setting] = Case(self.problem.rig, self.problem.scenario.changed(self.changes(setting)))
        return self.cases[setting]

    def changes(self, setting: Setting) -> dict[str, object]:
        """Fields of the scenario."""
        chosen: dict[str, object] = {"engine": self.engine, "integrator.method": setting.method}
        # For two seconds Baumgarte's terms are enough, as they are for the engines by hand.
        chosen["stabilization.projection"] = False
        if setting.method == "RK4":
            chosen["integrator.step"] = setting.step
        elif setting.step:
            # Under a tolerance that always accepts it.
            chosen |= {"integrator.max_step": setting.step, "integrator.rtol": 1e-2, "integrator.atol": 1.0}
        else:
            chosen |= {"integrator.rtol": setting.rtol, "integrator.atol": setting.rtol / 100}
        return chosen


class Core(_Package):
    """The compiled core."""

    name = "this package, core"
    engine = "core"

    def __init__(self, problem: Problem) -> None:
        import drillrig_pin.core  # noqa: F401  # says at once whether it can be loaded

        super().__init__(problem)

    def sweep(self) -> list[list[Setting]]:
        """Every method of the core."""
        return [
            # Its equal steps divide the way to the next sample; a bound chooses the division itself.
            [Setting("ExpAdams", step) for step in divided(*EXPONENTIAL)],
            *([Setting(method, rtol=10.0**-k) for k in powers] for method, powers in ADAPTIVE.items()),
            [Setting("RK4", step) for step in divided(*FIXED)],
        ]

    def run(self, setting: Setting) -> tuple[Stopwatch, Array]:
        """Time inside the core."""
        case = self.case(setting)
        with core_time() as spent:
            positions = case.run().of("q")
        (watch,) = spent
        return watch, positions[1:]

    def acceleration(self, t: float, q: Array, v: Array) -> Array:
        """Evaluated in the core."""
        from drillrig_pin.core import CompiledDynamics

        y = np.concatenate([q, v, np.zeros(2)])
        return np.asarray(CompiledDynamics(self.problem.dynamics).evaluate(t, y)["a"])


class Python(_Package):
    """The readable engine."""

    name = "this package, Python"
    engine = "python"

    def sweep(self) -> list[list[Setting]]:
        """Tolerances of SciPy's quickest integrators for it."""
        return [[Setting(method, rtol=10.0**-k) for k in powers] for method, powers in PYTHON.items()]

    def run(self, setting: Setting) -> tuple[Stopwatch, Array]:
        """Time of the run of a bound case."""
        case = self.case(setting)
        with Stopwatch() as watch:
            trajectory = case.run()
        return watch, trajectory.of("q")[1:]

    def acceleration(self, t: float, q: Array, v: Array) -> Array:
        """Assembled and solved in Python."""
        return self.problem.acceleration(t, q, v)
