"""Measure what the compiled core promises; one JSON object a line, each with its bar.

    python scripts/bench_core.py                    about two minutes
    python scripts/bench_core.py --figure wp.png    and draw error against time for all integrators
    python scripts/bench_core.py --install          and build a wheel from source
    python scripts/bench_core.py --only rhs run     some of them

Medians over repetitions. What is compared is measured in turn, and ratios are formed turn by turn: they survive a noisy
machine, times do not. MuJoCo needs a C compiler (gcc).
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import work_precision as wp
from peer_mujoco import STIFFNESS, MujocoPeer

from drillrig_pin import Rig, Scenario, load_rig, simulate, simulate_many
from drillrig_pin.core import CompiledDynamics
from drillrig_pin.simulation import Case, prepare

median = statistics.median


def say(what: str, value: float | None, bar: float, at_most: bool = True, **more: object) -> None:
    """One line: value, bar, whether it is met, and whatever explains it."""
    met = value is not None and (value <= bar if at_most else value >= bar)
    line = {
        "what": what,
        "value": _short(value),
        "bar": bar,
        "wanted": "at most" if at_most else "at least",
        "met": met,
    }
    print(json.dumps(line | {key: _short(item) for key, item in more.items()}), flush=True)


def _short(value: object) -> object:
    if isinstance(value, dict):
        return {key: _short(item) for key, item in value.items()}
    return float(f"{value:.4g}") if isinstance(value, float) else value


def moving_state(dynamics: object) -> np.ndarray:
    """A state on the constraints with every joint in motion."""
    y, n = dynamics.initial(), dynamics.rig.model.nq
    y[n:-2] = 0.05 * np.random.default_rng(1).standard_normal(dynamics.rig.model.nv)
    return dynamics.project(y)


def right_hand_side(rig: Rig) -> None:
    """The whole right-hand side against Pinocchio's crba + rnea of the same state, timed in C++."""
    dynamics = prepare(rig, Scenario())
    compiled, y = CompiledDynamics(dynamics).rig, moving_state(dynamics)
    turns = [compiled.time_rate(0.5, y, 20_000) for _ in range(21)]
    say(
        "right-hand side / (crba + rnea)",
        median(whole / both for whole, both in turns),
        1.3,
        nanoseconds=median(whole for whole, _ in turns),
        crba_and_rnea_nanoseconds=median(both for _, both in turns),
    )


def whole_command() -> None:
    """``drillrig run`` from the shell, file included."""
    drillrig = str(Path(sys.executable).with_name("drillrig"))
    seconds = []
    with tempfile.TemporaryDirectory() as folder:
        for i in range(6):
            start = time.perf_counter()
            command = [drillrig, "run", "-o", str(Path(folder, f"run{i}.nc"))]
            subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            seconds.append(time.perf_counter() - start)
    say("drillrig run, default 10 s, seconds", median(seconds[1:]), 1.5, first=seconds[0])


def overhead(rig: Rig) -> None:
    """What Python adds to a run of 0.01 s: whole ``simulate``, and a bound case run again."""
    scenario = Scenario(duration=0.01)
    bound = Case(rig, scenario)
    calls: dict[str, Callable[[], object]] = {"simulate": lambda: simulate(rig, scenario), "bound": bound.run}
    whole: dict[str, list[float]] = {name: [] for name in calls}
    added: dict[str, list[float]] = {name: [] for name in calls}
    for _ in range(101):
        for name, call in calls.items():
            with wp.core_time() as spent:
                start = time.perf_counter()
                call()
                seconds = time.perf_counter() - start
            whole[name].append(1e3 * seconds)
            added[name].append(1e3 * (seconds - sum(spent)))
    say(
        "Python overhead of a short run, model ready, milliseconds",
        median(added["bound"]),
        1.0,
        total=median(whole["bound"]),
        overhead_of_simulate=median(added["simulate"]),
        total_of_simulate=median(whole["simulate"]),
        note="model ready: a Case bound once, run again; simulate also assembles, finds equilibrium and compiles",
    )


def many(rig: Rig) -> None:
    """64 runs over one thread and over two, in turn."""
    cases = [(rig, Scenario(duration=wp.DURATION))] * 64
    seconds: dict[int, list[float]] = {1: [], 2: []}
    for _ in range(5):
        for threads, times in seconds.items():
            start = time.perf_counter()
            simulate_many(cases, threads=threads, keep=lambda trajectory: trajectory.outcome.status)
            times.append(time.perf_counter() - start)
    ratio = median(one / two for one, two in zip(seconds[1], seconds[2], strict=True))
    one, two = median(seconds[1]), median(seconds[2])
    say("simulate_many, 64 runs, 2 threads against 1", ratio, 1.9, False, one=one, two=two, cores=os.cpu_count())


def same_problem(dynamics: object, peer: MujocoPeer, points: list[wp.Point]) -> None:
    """MuJoCo's accelerations at a moving, loaded state are ours, and its error falls as its method says."""
    y, n = moving_state(dynamics), dynamics.rig.model.nq
    ours = CompiledDynamics(dynamics).evaluate(0.5, y)
    rows = ours["rows"][: len(ours["F"])]
    free = np.linalg.solve(ours["M"], ours["F"] @ rows - ours["bias"])
    theirs_free, theirs = peer.accelerations(0.5, y[:n], y[n:-2])
    orders = {}
    for method, steps in {"RK4": (5, 10), "implicitfast": (5, 10)}.items():
        pair = [p.error for k in steps for p in points if (p.engine, p.method, p.steps) == ("MuJoCo", method, k)]
        orders[method] = float(np.log2(pair[0] / pair[1])) if len(pair) == 2 else None
    say(
        "MuJoCo solves the same problem: relative difference of free accelerations",
        float(np.abs(free - theirs_free).max() / np.abs(free).max()),
        1e-10,
        with_soft_hold=float(np.abs(ours["a"] - theirs).max() / np.abs(free).max()),
        order_of_the_error_at_1_ms=orders,
        hold=f"tendon equalities, solref {STIFFNESS} dt, impedance 0.9999",
    )


def real_time(points: list[wp.Point], rig: Rig, peer: MujocoPeer) -> None:
    """The fastest setting of the core that meets 1e-8."""
    best = wp.fastest(points, "core", 1e-8)
    if best is None:
        say("times real time at 1e-8", None, 50, False)
        return
    best.seconds.clear()
    best.whole.clear()
    for _ in range(21):
        wp.run_point(best, rig, peer)
    say(
        "times real time at 1e-8: simulate()",
        wp.DURATION / median(best.whole),
        50,
        False,
        core_alone=wp.DURATION / best.median,
        method=best.method,
        setting=best.setting,
        error=best.error,
    )


def against_mujoco(points: list[wp.Point], rig: Rig, peer: MujocoPeer, level: float) -> None:
    """Both at their fastest for an error level and the same samples, in turn; and the core with more samples."""
    ours, dense = (wp.fastest(points, "core", level, rate) for rate in (wp.GRID, wp.RATE))
    theirs = wp.fastest(points, "MuJoCo", level, wp.GRID)
    what = f"MuJoCo's time / the core's at error {level:.0e}"
    if ours is None or theirs is None:
        sharpest = {e: min((p for p in points if p.engine == e), key=lambda p: p.error) for e in ("core", "MuJoCo")}
        say(what, None, 5, False, best={engine: _told(point) for engine, point in sharpest.items()})
        return
    group = [point for point in (ours, theirs, dense) if point is not None]
    for point in group:
        point.seconds.clear()
        point.whole.clear()
    for _ in range(31):
        for point in group:
            wp.run_point(point, rig, peer)
    more = {} if dense is None else {"core_at_1000_samples": _told(dense), "against_that": _times(dense, theirs)}
    say(
        what,
        _times(ours, theirs),
        5,
        False,
        samples_per_second=wp.GRID,
        against_whole_simulate=median(b / a for a, b in zip(ours.whole, theirs.seconds, strict=True)),
        core=_told(ours),
        mujoco=_told(theirs),
        **more,
    )


def _times(ours: wp.Point, theirs: wp.Point) -> float:
    return float(median(b / a for a, b in zip(ours.seconds, theirs.seconds, strict=True)))


def _told(point: wp.Point) -> dict[str, object]:
    return {"seconds": point.median, "error": point.error, "method": point.method, "setting": point.setting}


def precision(rig: Rig, figure: Path | None) -> None:
    """Everything that compares times at equal errors."""
    truth, truth_error = wp.reference(rig)
    say("reference: change when tolerance and step are doubled", truth_error, 1e-12)
    dynamics = prepare(rig, wp.case())
    peer = MujocoPeer(dynamics)
    points = wp.measure(wp.our_points() + wp.peer_points(), rig, peer, truth)
    same_problem(dynamics, peer, points)
    if figure is not None:
        wp.draw(points, truth_error, figure)
    real_time(points, rig, peer)
    for level in (1e-6, 1e-8):
        against_mujoco(points, rig, peer, level)


def installation() -> None:
    """A wheel from a clean copy of the sources."""
    root = Path(__file__).resolve().parents[1]
    with tempfile.TemporaryDirectory() as folder:
        sources, wheels = Path(folder, "sources"), Path(folder, "wheels")
        unwanted = shutil.ignore_patterns(".*", "build", "__pycache__", "*.so")
        shutil.copytree(root, sources, ignore=unwanted)
        command = [sys.executable, "-m", "pip", "wheel", "--no-deps", "--no-build-isolation", "-w", str(wheels)]
        start = time.perf_counter()
        subprocess.run([*command, str(sources)], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        seconds = time.perf_counter() - start
        built = [path.name for path in wheels.glob("*.whl")]
    say("installation from source, seconds", seconds, 300, wheel=built[0], compiled="none-any" not in built[0])


def main() -> None:
    """Print one line per promise."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--figure", type=Path, help="write the work-precision figure to this PNG file")
    parser.add_argument("--install", action="store_true", help="also time an installation from source")
    parser.add_argument(
        "--only", nargs="+", choices=["rhs", "run", "overhead", "precision", "many"], help="some of them"
    )
    arguments = parser.parse_args()
    rig = load_rig("mkz49")
    parts: dict[str, Callable[[], None]] = {
        "rhs": lambda: right_hand_side(rig),
        "run": whole_command,
        "overhead": lambda: overhead(rig),
        "precision": lambda: precision(rig, arguments.figure),
        "many": lambda: many(rig),
    }
    for name, part in parts.items():
        if arguments.only is None or name in arguments.only:
            part()
    if arguments.install:
        installation()


if __name__ == "__main__":
    main()
