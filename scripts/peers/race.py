"""Errors and times of all engines on one problem, measured in turn."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

import numpy as np

from drillrig_pin import Scenario, simulate
from drillrig_pin.errors import DrillrigError
from drillrig_pin.kinematics import Array
from peers.problem import RATE, Engine, Problem, Setting, Stopwatch

#: A run slower than the first of these [s] is repeated once, than the second not at all; a method slower than the third
#: is not sharpened further.
SLOW, TEDIOUS, PATIENCE = 0.5, 2.0, 8.0
#: Nothing sharper is asked for.
SHARPEST = 3e-10


@dataclass
class Point:
    """One setting of one engine, its error and the times of all its runs."""

    key: str
    engine: str
    setting: Setting
    error: float
    runs: list[Stopwatch] = field(default_factory=list)

    @property
    def least(self) -> float:
        """Seconds of the quickest run, as if the machine had done nothing else: what disturbs it only ever adds."""
        return min(run.processor for run in self.runs)

    @property
    def wall(self) -> float:
        """Seconds that passed in the quickest run."""
        return min(run.wall for run in self.runs)


def reference(problem: Problem) -> tuple[Array, float]:
    """Positions at the samples, and how far a reference with doubled tolerance and step is from them."""
    runs = []
    for factor in (1.0, 2.0):
        tight = {"method": "DOP853", "rtol": 1e-13 * factor, "atol": 1e-16 * factor, "max_step": 2.5e-4 * factor}
        case = Scenario(duration=problem.scenario.duration, output_rate=RATE, integrator=tight)
        runs.append(simulate(problem.rig, case).of("q")[1:])
    return runs[0], float(np.abs(runs[0] - runs[1]).max())


def measure(
    engines: dict[str, Engine],
    truth: Array,
    rounds: int = 11,
    told: Callable[[str], None] = lambda text: None,
    methods: frozenset[str] | None = None,
) -> list[Point]:
    """Every setting once for its error, then all in turn for their times.

    What fails, strays or is not a number is left out. A slow spell of the machine hits all engines alike.
    """
    points: list[Point] = []
    for key, engine in engines.items():
        for settings in engine.sweep():
            if methods is not None and settings[0].method not in methods:
                continue
            for setting in settings:
                point = _first(key, engine, setting, truth)
                if point is None:
                    continue
                points.append(point)
                if point.error < SHARPEST or point.least > PATIENCE:
                    break
        told(f"{engine.name}: {sum(point.key == key for point in points)} settings")
    for i in range(1, rounds):
        for point in points:
            if point.least < SLOW or (i == 1 and point.least < TEDIOUS):
                point.runs.append(engines[point.key].run(point.setting)[0])
        told(f"round {i + 1} of {rounds}")
    return points


def _first(key: str, engine: Engine, setting: Setting, truth: Array) -> Point | None:
    try:
        watch, positions = engine.run(setting)
    except DrillrigError:
        return None
    if positions.shape != truth.shape:
        return None
    error = float(np.abs(positions - truth).max())
    return Point(key, engine.name, setting, error, [watch]) if math.isfinite(error) else None


def time_at(points: Iterable[Point], level: float) -> tuple[float, Point] | None:
    """Least time [s] in which a method reaches an error, between its settings on a straight line of the logarithms.

    Beyond its coarsest setting a method is credited with that one's time. None: no method is that sharp.
    """
    methods: dict[tuple[str, str], list[Point]] = {}
    for point in points:
        methods.setdefault((point.key, point.setting.method), []).append(point)
    best: tuple[float, Point] | None = None
    for members in methods.values():
        front = _front(members)
        reached = next((i for i, point in enumerate(front) if point.error <= level), None)
        if reached is None:
            continue
        sharp = front[reached]
        seconds = sharp.least
        if reached:
            coarse = front[reached - 1]
            share = math.log(coarse.error / level) / math.log(coarse.error / sharp.error)
            seconds = math.exp((1 - share) * math.log(coarse.least) + share * math.log(sharp.least))
        if best is None or seconds < best[0]:
            best = seconds, sharp
    return best


def _front(points: list[Point]) -> list[Point]:
    """From coarse to fine, without those that another beats in both error and time."""
    front: list[Point] = []
    for point in sorted(points, key=lambda p: (p.least, p.error)):
        if not front or point.error < front[-1].error:
            front.append(point)
    return front


def orders(engine: Engine, key: str, points: list[Point], above: float) -> dict[str, float]:
    """Measured order of every method with a fixed step: slope of the errors above a floor, by least squares."""
    found = {}
    for method in engine.orders:
        group = [p for p in points if (p.key, p.setting.method) == (key, method) and p.error > above]
        if len(group) >= 3:
            group = sorted(group, key=lambda p: p.setting.step)[:4]
            steps, errors = (np.log([f(p) for p in group]) for f in (lambda p: p.setting.step, lambda p: p.error))
            found[method] = float(np.polyfit(steps, errors, 1)[0])
    return found
