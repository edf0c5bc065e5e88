"""Time against error: this package and other engines on the same two seconds of drilling, in the same run.

    python scripts/bench_peers.py                       two or three minutes: a table, JSON lines, the figure
    python scripts/bench_peers.py --only core mujoco    some of the engines
    python scripts/bench_peers.py --rounds 21           more repetitions

Every engine is set up as its expert would (scripts/peers/), first shows that it solves the same problem, and is then
run over a range of steps or tolerances, all engines in turn. Compared is the time at equal error: the largest over all
joints [rad, m] and the same 400 samples, against one reference of the core's DOP853 at 1e-13. Setting up (reading the
model, binding laws, compiling) is left out for all; time is that of the loop over time alone, without Python around it
where the engine's own loop is compiled. Counted is the processor's time of the quickest of several runs: every engine
runs on one thread and waits for nothing, so that on an idle machine this is wall time, and on a busy one still is the
engine's own; how far the two were apart is printed.

MuJoCo needs a C compiler (gcc); Drake is installed with requirements-peers.lock. An engine that is missing is named.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import sys
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from statistics import median
from typing import Any

from peers import race
from peers.problem import Engine, Problem, apart, drilling
from peers.registry import ENGINES, bound

PICTURE = Path(__file__).parent / "pictures" / "peers.png"
LEVELS = (1e-5, 1e-6, 1e-7, 1e-8, 1e-9)
#: Times faster than the best peer that the core is to be.
BAR = 5.0
OURS = ("core", "python")


def results(
    wanted: list[str] | None = None,
    rounds: int = 11,
    told: Callable[[str], None] = lambda text: None,
    methods: frozenset[str] | None = None,
) -> tuple[list[dict[str, Any]], list[race.Point]]:
    """Findings as they are printed, and all settings measured.

    Args:
        wanted: keys of the engines; None: all.
        rounds: how often each setting runs; slow ones once or twice.
        told: takes a line of progress.
        methods: integrators tried; None: all.
    """
    problem = drilling()
    engines, missing = bound(problem, wanted)
    truth, uncertain = race.reference(problem)
    points = race.measure(engines, truth, rounds, told, methods)
    findings: list[dict[str, Any]] = [
        {"what": "machine", "processor": processor(), "cores": os.cpu_count()},
        {"what": "reference", "change_when_tolerance_and_step_are_doubled": uncertain, "bar": 1e-12},
    ]
    findings += [{"what": "missing", "engine": key, "why": why} for key, why in missing.items()]
    findings += [same_problem(key, engine, problem, points) for key, engine in engines.items()]
    findings += [at_level(level, points) for level in LEVELS]
    findings.append({"what": "wall time over processor time", "median": median(p.wall / p.least for p in points)})
    return findings, points


def same_problem(key: str, engine: Engine, problem: Problem, points: list[race.Point]) -> dict[str, Any]:
    """Accelerations at the start under half the loads and in motion, and how the error falls with the step."""
    states = problem.states()
    found: dict[str, Any] = {
        "relative_difference_of_accelerations": max(
            apart(engine.acceleration(*state), problem.acceleration(*state)) for state in states
        )
    }
    free = getattr(engine, "free_acceleration", None)  # of an engine whose hold is soft
    if free is not None:
        found["the_same_without_the_hold"] = max(
            apart(free(*state), problem.free_acceleration(*state)) for state in states
        )
    return {
        "what": "same problem",
        "engine": engine.name,
        "version": version(engine.package),
        **found,
        "order_of_the_error": {
            method: {"measured": slope, "theory": engine.orders[method]}
            for method, slope in race.orders(engine, key, points, 3e-9).items()
        },
        "smallest_error_measured": min((p.error for p in points if p.key == key), default=None),
    }


def at_level(level: float, points: list[race.Point]) -> dict[str, Any]:
    """Time of every engine at one error, and the core's lead over the best of the others."""
    times: dict[str, Any] = {}
    for key in dict.fromkeys(point.key for point in points):
        found = race.time_at([p for p in points if p.key == key], level)
        if found is not None:
            seconds, point = found
            times[key] = {"engine": point.engine, "milliseconds": 1e3 * seconds, "method": point.setting.method}
    peers = {key: entry for key, entry in times.items() if key not in OURS}
    best = min(peers, key=lambda key: peers[key]["milliseconds"], default=None)
    ratio = peers[best]["milliseconds"] / times["core"]["milliseconds"] if best and "core" in times else None
    return {"what": "at error", "level": level, "best_peer": best, "ratio": ratio, "bar": BAR, "times": times}


def processor() -> str:
    """Its name, as the system tells it."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor()
    return next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), platform.machine())


def table(findings: list[dict[str, Any]]) -> str:
    """Milliseconds of every engine at every error."""
    levels = [finding for finding in findings if finding["what"] == "at error"]
    names = {key: entry["engine"] for finding in levels for key, entry in finding["times"].items()}
    last = "best peer / core"
    width = max(map(len, [*names.values(), last])) + 2
    lines = [
        "milliseconds for 2 s of drilling, at an error of [rad, m]",
        "".ljust(width) + _cells(f["level"] for f in levels),
    ]
    for key, name in names.items():
        cells = [finding["times"].get(key, {}).get("milliseconds") for finding in levels]
        lines.append(name.ljust(width) + _cells(cells))
    lines.append(last.ljust(width) + _cells(finding["ratio"] for finding in levels))
    lines += [
        f"left out: {finding['engine']} ({finding['why']})" for finding in findings if finding["what"] == "missing"
    ]
    return "\n".join(lines)


def _cells(values: Any) -> str:
    def cell(value: float | None) -> str:
        if value is None:
            return "-"
        return f"{value:.0e}" if value < 1e-3 else f"{value:.3g}" if value < 100 else f"{value:.0f}"

    return "".join(cell(value).rjust(10) for value in values)


def main() -> int:
    """Measure, print, draw."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", choices=list(ENGINES), metavar="ENGINE", help=", ".join(ENGINES))
    parser.add_argument("--rounds", type=int, default=11, help="runs of each setting (default 11; slow ones: 1 or 2)")
    parser.add_argument("--figure", type=Path, default=PICTURE, help=f"where to draw; default: {PICTURE.name}")
    parser.add_argument("--no-figure", action="store_true", help="draw nothing")
    given = parser.parse_args()
    findings, points = results(given.only, given.rounds, lambda text: print(text, file=sys.stderr, flush=True))
    for finding in findings:
        print(json.dumps(_short(finding)))
    print("\n" + table(findings))
    if not given.no_figure:
        from peers.figure import draw

        draw(points, given.figure)
        print(given.figure, file=sys.stderr)
    return 0


def _short(value: Any) -> Any:
    """Four figures are what a measurement has."""
    if isinstance(value, dict):
        return {key: _short(item) for key, item in value.items()}
    return float(f"{value:.4g}") if isinstance(value, float) else value


if __name__ == "__main__":
    sys.exit(main())
