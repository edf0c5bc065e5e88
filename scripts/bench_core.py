"""Measure what the compiled core promises; one JSON object a line, each with its bar.

    python scripts/bench_core.py                    about two minutes
    python scripts/bench_core.py --install          and build a wheel from source
    python scripts/bench_core.py --only rhs run     some of them

Medians over repetitions. What is compared is measured in turn, and ratios are formed turn by turn: they survive a noisy
machine, times do not. Against other engines: bench_peers.py.
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
from peers import race
from peers.ours import Core, core_time
from peers.problem import DURATION, RATE, drilling

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
            with core_time() as spent:
                start = time.perf_counter()
                call()
                seconds = time.perf_counter() - start
            whole[name].append(1e3 * seconds)
            added[name].append(1e3 * (seconds - sum(watch.wall for watch in spent)))
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
    cases = [(rig, Scenario(duration=DURATION))] * 64
    seconds: dict[int, list[float]] = {1: [], 2: []}
    for _ in range(5):
        for threads, times in seconds.items():
            start = time.perf_counter()
            simulate_many(cases, threads=threads, keep=lambda trajectory: trajectory.outcome.status)
            times.append(time.perf_counter() - start)
    ratio = median(one / two for one, two in zip(seconds[1], seconds[2], strict=True))
    one, two = median(seconds[1]), median(seconds[2])
    say("simulate_many, 64 runs, 2 threads against 1", ratio, 1.9, False, one=one, two=two, cores=os.cpu_count())


def real_time() -> None:
    """The fastest setting of the core that meets 1e-8."""
    problem = drilling()
    core = Core(problem)
    truth, _ = race.reference(problem)
    good = [point for point in race.measure({"core": core}, truth, rounds=3) if point.error <= 1e-8]
    best = min(good, key=lambda point: point.least)
    scenario = problem.scenario.changed(core.changes(best.setting))
    whole, alone = [], []
    for _ in range(21):
        with core_time() as spent:
            start = time.perf_counter()
            simulate(problem.rig, scenario)
            whole.append(time.perf_counter() - start)
        alone.append(sum(watch.wall for watch in spent))
    say(
        "times real time at 1e-8: simulate()",
        DURATION / median(whole),
        50,
        False,
        core_alone=DURATION / median(alone),
        method=best.setting.method,
        setting=str(best.setting),
        error=best.error,
        samples_per_second=RATE,
    )


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
    parser.add_argument("--install", action="store_true", help="also time an installation from source")
    parser.add_argument(
        "--only", nargs="+", choices=["rhs", "run", "overhead", "real_time", "many"], help="some of them"
    )
    arguments = parser.parse_args()
    rig = load_rig("mkz49")
    parts: dict[str, Callable[[], None]] = {
        "rhs": lambda: right_hand_side(rig),
        "run": whole_command,
        "overhead": lambda: overhead(rig),
        "real_time": real_time,
        "many": lambda: many(rig),
    }
    for name, part in parts.items():
        if arguments.only is None or name in arguments.only:
            part()
    if arguments.install:
        installation()


if __name__ == "__main__":
    main()
