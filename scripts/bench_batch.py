"""Measure what studies promise; one JSON object a line, each with its bar.

    python scripts/bench_batch.py                 1,000 cases of 10 s, some five minutes
    python scripts/bench_batch.py --cases 200     fewer, when in a hurry: starting the workers then weighs more
    python scripts/bench_batch.py --only share    one of share, fixed, scaling

The cases differ in the scenario only; what another model costs is told beside the first line.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import psutil

from drillrig_pin.batch.runner import run_study
from drillrig_pin.batch.study import Study
from drillrig_pin.batch.summary import Tally
from drillrig_pin.rig import load_rig

median = statistics.median
METRICS = ["S.across.rms", "S.*.rms", "*.p_max", "*.p_min"]


def say(what: str, value: float, bar: float, at_most: bool, **more: object) -> None:
    """One line: value, bar, whether it is met, and whatever explains it."""
    line = {"what": what, "value": value, "bar": bar, "wanted": "at most" if at_most else "at least"}
    line |= {"met": value <= bar if at_most else value >= bar} | more
    print(json.dumps({k: float(f"{v:.4g}") if isinstance(v, float) else v for k, v in line.items()}), flush=True)


def study(cases: int) -> Study:
    """Cases of hole 9 that start with different speeds of swing."""
    axis: Any = {"name": "scenario.velocities.boom_swing", "range": {"start": 0, "stop": 0.01, "count": cases}}
    return Study(axes=[axis], metrics=METRICS)


class Memory:
    """Resident memory of this process and its workers [MB], from a tenth of the cases on."""

    def __init__(self) -> None:
        self.parent: list[float] = []
        self.workers: list[float] = []
        self._process = psutil.Process()
        self._last = 0.0

    def __call__(self, tally: Tally) -> None:
        if tally.done < 0.1 * tally.total or time.monotonic() - self._last < 1.0:
            return
        self._last = time.monotonic()
        self.parent.append(self._process.memory_info().rss / 1e6)
        sizes = []
        for child in self._process.children():
            try:
                sizes.append(child.memory_info().rss / 1e6)
            except psutil.Error:
                continue
        self.workers.append(max(sizes, default=0.0))


def timed(cases: int, workers: int, listener: Callable[[Tally], None] | None = None) -> tuple[float, float]:
    """Wall time of a whole study, and the sum of its solve times [s]."""
    with tempfile.TemporaryDirectory() as folder:
        start = time.perf_counter()
        finished = run_study(study(cases), folder, workers=workers, listener=listener)
        return time.perf_counter() - start, finished.tally.solve_time


def share(cases: int) -> None:
    """Share of two cores' time spent in the core."""
    memory = Memory()
    wall, solved = timed(cases, 2, memory)
    loading = []
    for length in (2.0, 2.1, 2.2):
        start = time.perf_counter()
        load_rig("mkz49", boom_length=length)
        loading.append(time.perf_counter() - start)
    say(
        "sum of solve times / (2 x wall)",
        solved / (2 * wall),
        0.9,
        False,
        cases=cases,
        wall=wall,
        solve_milliseconds=1e3 * solved / cases,
        parent_megabytes=[round(memory.parent[0]), round(memory.parent[-1])] if memory.parent else [],
        worker_megabytes=[round(memory.workers[0]), round(memory.workers[-1])] if memory.workers else [],
        another_model_milliseconds=1e3 * median(loading),
        cores=os.cpu_count(),
    )


def fixed() -> None:
    """What a study of one case costs more than the run, both as commands."""
    drillrig = str(Path(sys.executable).with_name("drillrig"))
    seconds: dict[str, list[float]] = {"run": [], "sweep": []}
    with tempfile.TemporaryDirectory() as place:
        path = Path(place, "one.yaml")
        path.write_text(f"axes:\n- {{name: scenario.duration, list: [10]}}\nmetrics: {json.dumps(METRICS)}\n")
        for i in range(6):
            commands = {
                "run": [drillrig, "run", "-o", f"{place}/{i}.nc"],
                "sweep": [drillrig, "sweep", str(path), "-o", f"{place}/{i}"],
            }
            for name, command in commands.items():
                start = time.perf_counter()
                subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
                seconds[name].append(time.perf_counter() - start)
    more = [b - a for a, b in zip(seconds["run"][1:], seconds["sweep"][1:], strict=True)]
    say(
        "a study of one case less drillrig run, seconds",
        median(more),
        1.5,
        True,
        run=median(seconds["run"][1:]),
        sweep=median(seconds["sweep"][1:]),
    )


def scaling(cases: int) -> None:
    """Two workers against one, start of the workers included."""
    one, two = timed(cases, 1)[0], timed(cases, 2)[0]
    say("wall time of 1 worker / of 2 workers", one / two, 1.85, False, cases=cases, one=one, two=two)


def main() -> None:
    """Print one line per promise."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=1000, help="cases of the first line; the last takes half of them")
    parser.add_argument("--only", nargs="+", choices=["share", "fixed", "scaling"], help="some of them")
    given = parser.parse_args()
    parts: dict[str, Callable[[], None]] = {
        "share": lambda: share(given.cases),
        "fixed": fixed,
        "scaling": lambda: scaling(max(1, given.cases // 2)),
    }
    for name, part in parts.items():
        if given.only is None or name in given.only:
            part()


if __name__ == "__main__":
    main()
