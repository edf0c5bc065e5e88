"""Errors and times of the compiled core and of MuJoCo on the same two seconds of drilling, and their figure.

The error is the largest over all joints [rad, m] and all samples, against a reference of the core's DOP853 at its
tightest, itself checked against one with doubled tolerance and step. Every round runs every setting once: a slow
spell of the machine hits all alike.
"""

from __future__ import annotations

import contextlib
import statistics
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from peer_mujoco import MujocoPeer

from drillrig_pin import Rig, Scenario, Trajectory, core, simulate
from drillrig_pin.errors import DrillrigError
from drillrig_pin.scenario import CORE_METHODS

DURATION = 2.0
RATE = 1000.0
#: Samples per second at which MuJoCo's positions are compared: its step divides them.
GRID = 200
RTOL = [10.0**-k for k in range(4, 13)]
#: A setting slower than this [s] ends the sweep of its method: sharper ones are slower still.
PATIENCE = 0.4


@dataclass
class Point:
    """One setting of one engine."""

    engine: str
    method: str
    setting: str
    scenario: Scenario | None = None
    steps: int = 0
    rate: float = RATE
    error: float = float("nan")
    seconds: list[float] = field(default_factory=list)
    whole: list[float] = field(default_factory=list)

    @property
    def median(self) -> float:
        """Seconds of the time loop."""
        return statistics.median(self.seconds)

    @property
    def least(self) -> float:
        """Seconds of the quickest run: what choices and the figure go by."""
        return min(self.seconds)


@contextlib.contextmanager
def core_time() -> Iterator[list[float]]:
    """Seconds that runs inside this block spend in the compiled core, one entry a run."""
    original, spent = core.CompiledDynamics.run, []

    def timed(*arguments: object) -> object:
        start = time.perf_counter()
        try:
            return original(*arguments)
        finally:
            spent.append(time.perf_counter() - start)

    core.CompiledDynamics.run = timed
    try:
        yield spent
    finally:
        core.CompiledDynamics.run = original


def timed_run(rig: Rig, scenario: Scenario) -> tuple[float, float, Trajectory]:
    """Seconds of a whole ``simulate``, of the core's run within it, and the trajectory."""
    with core_time() as spent:
        start = time.perf_counter()
        trajectory = simulate(rig, scenario)
        whole = time.perf_counter() - start
    return whole, sum(spent), trajectory


def case(method: str = "DOP853", projection: bool = True, rate: float = RATE, **integrator: float) -> Scenario:
    """The default case over two seconds."""
    return Scenario(
        duration=DURATION,
        output_rate=rate,
        engine="core",
        integrator={"method": method, **integrator},
        stabilization={"projection": projection},
    )


def reference(rig: Rig) -> tuple[np.ndarray, float]:
    """Positions every 1 / RATE, and how far a reference with doubled tolerance and step is from them."""
    tight = simulate(rig, case(rtol=1e-13, atol=1e-16, max_step=2.5e-4)).of("q")
    loose = simulate(rig, case(rtol=2e-13, atol=2e-16, max_step=5e-4)).of("q")
    return tight, float(np.abs(tight - loose).max())


def error_of(positions: np.ndarray, truth: np.ndarray) -> float:
    """Largest difference where both have samples; not a number if the run went astray."""
    every = (len(truth) - 1) // (len(positions) - 1)
    return float(np.abs(positions - truth[::every]).max())


def our_points() -> list[Point]:
    """Settings of the core worth trying; with fewer samples a second a step may be longer."""
    points = []
    for projection, rate in ((True, RATE), (False, RATE), (False, GRID)):
        note = ("" if projection else ", no projection") + ("" if rate == RATE else f", {rate} samples/s")
        for k in (0.6, 1, 2, 3, 4, 6, 8, 12):
            if k >= 1 or rate < RATE:
                scenario = case("RK4", projection, rate, step=1 / RATE / k)
                points.append(Point("core", "RK4", f"step {1 / k:.3g} ms{note}", scenario, rate=rate))
        for method in CORE_METHODS:
            if method == "RK4":
                continue
            if method == "ExpAdams" and rate < RATE:
                # Its equal steps divide the way to the next sample; a bound chooses the division itself.
                for k in (3, 4, 5, 6, 7, 8, 10, 12, 14):
                    scenario = case(method, projection, rate, rtol=1e-2, atol=1e-4, max_step=1 / rate / k)
                    points.append(Point("core", method, f"step {1e3 / rate / k:.3g} ms{note}", scenario, rate=rate))
                continue
            for rtol in RTOL:
                scenario = case(method, projection, rate, rtol=rtol, atol=rtol / 100)
                points.append(Point("core", method, f"rtol {rtol:.0e}{note}", scenario, rate=rate))
    return points


def peer_points() -> list[Point]:
    """Settings of MuJoCo: steps that divide 1 / GRID."""
    sweep = {"RK4": (3, 4, 5, 6, 8, 10, 11, 12, 13, 14, 16, 20, 28, 40, 80), "implicitfast": (5, 10, 20, 40, 80, 160)}
    return [
        Point("MuJoCo", method, f"step {1e3 / GRID / k:.3g} ms", steps=k, rate=GRID)
        for method, all_k in sweep.items()
        for k in all_k
    ]


def run_point(point: Point, rig: Rig, peer: MujocoPeer) -> np.ndarray:
    """Run a setting once, note its time, return its positions including the start."""
    if point.scenario is not None:
        whole, seconds, trajectory = timed_run(rig, point.scenario)
        point.whole.append(whole)
        positions = trajectory.of("q")
    else:
        seconds, later = peer.run(point.method, 1 / (GRID * point.steps), DURATION, point.steps)
        positions = np.vstack([peer.dynamics.equilibrium.assembly.q, later])
    point.seconds.append(seconds)
    return positions


def measure(points: list[Point], rig: Rig, peer: MujocoPeer, truth: np.ndarray, rounds: int = 5) -> list[Point]:
    """Error and times of all points; those that fail or stray are left out."""
    sound: list[Point] = []
    given_up: set[tuple[str, str, str]] = set()
    for point in points:
        group = point.engine, point.method, point.setting.partition(",")[2]
        if group in given_up:
            continue
        try:
            positions = run_point(point, rig, peer)
        except DrillrigError:
            continue
        if point.seconds[0] > PATIENCE:
            given_up.add(group)
        if len(positions) == 1 + round(DURATION * point.rate):
            point.error = error_of(positions, truth)
        if np.isfinite(point.error):
            sound.append(point)
    for _ in range(rounds - 1):
        for point in sound:
            run_point(point, rig, peer)
    return sound


def fastest(points: list[Point], engine: str, error: float, rate: float = RATE) -> Point | None:
    """The quickest setting of an engine that meets an error."""
    good = [p for p in points if p.engine == engine and p.error <= error and p.rate == rate]
    return min(good, key=lambda p: p.least, default=None)


def draw(points: list[Point], truth_error: float, path: Path) -> None:
    """The figure: time of two seconds of drilling against the largest error, both logarithmic."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    styles = {"core": ("-", "o", True), "MuJoCo": ("--", "s", False)}
    figure, axes = plt.subplots(figsize=(8.0, 6.2), constrained_layout=True)
    methods = list(dict.fromkeys((p.engine, p.method) for p in points))
    groups: dict[tuple[str, str, str], list[Point]] = {}
    for point in points:
        note = point.setting.partition(", ")[2]
        if note != "no projection":
            groups.setdefault((point.engine, point.method, note), []).append(point)
    for (engine, method, note), members in groups.items():
        line, marker, filled = styles[engine] if not note else (":", ".", True)
        members = sorted(members, key=lambda p: p.error)
        axes.loglog(
            [1e3 * p.least for p in members],
            [p.error for p in members],
            line,
            marker=marker,
            markersize=5,
            color=f"C{methods.index((engine, method))}",
            markerfacecolor=None if filled else "white",
            label=f"{'this package' if engine == 'core' else engine}: {method}{note and ' (' + note + ')'}",
        )
    axes.axhline(max(truth_error, 1e-16), color="0.6", linewidth=1, linestyle=":")
    axes.annotate(
        "reference", (0.01, max(truth_error, 1e-16)), xycoords=("axes fraction", "data"), color="0.4", va="bottom"
    )
    axes.set_xlabel("wall time for 2 s of drilling [ms]")
    axes.set_ylabel("largest error of a joint [rad, m]")
    axes.set_title("MK-Z49, hole no. 9: work and precision, one thread")
    axes.grid(True, which="major", color="0.88")
    figure.legend(*axes.get_legend_handles_labels(), frameon=False, fontsize=8, loc="outside lower center", ncols=2)
    figure.savefig(path, dpi=150)
    plt.close(figure)
