"""Time at equal error, of this package and of other engines."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import bench_peers

from validation.record import Row
from validation.settings import ENGINES

TEXT = f"""\
The problem of the section above, measured by `scripts/bench_peers.py`: every engine with a range of steps or
tolerances, all in turn on one machine and one thread, quickest of several repetitions. The time at an error is
interpolated between settings on a straight line of the logarithms; the error is the largest of any joint [rad, m] at
400 samples. Setting up (reading the model, binding laws, compiling) is left out for all of them. Time is that of the
loop over time alone: of this core and of MuJoCo, driven from C, without any Python; of Exudyn's solver, SciPy and Drake
as called. Every engine runs on one thread and waits for nothing; counted is the processor's time, which on an idle
machine is wall time and on a busy one still the engine's own. The core is to be {bench_peers.BAR:g} times as fast as
the best of the others. Times vary by some ten per cent; the figure is of a run of its own.

![Time against error for 2 s of drilling in several engines](../scripts/pictures/peers.png)
"""
#: What the short form asks for: a test on a busy machine can say no more.
CERTAIN = 2.0


def rows(short: bool) -> Iterator[Row]:
    """Leads of the core over the best peer."""
    if "core" not in ENGINES:
        yield Row("the compiled core takes part", "installed", 0.0, low=1.0, miss="it was not built here")
        return
    if short:
        findings, _ = bench_peers.results(["core", "mujoco"], rounds=2, methods=frozenset(("ExpAdams", "RK4")))
    else:
        findings, _ = bench_peers.results()
    for finding in findings:
        if finding["what"] == "missing":
            yield Row(f"{finding['engine']} takes part", "installed", 0.0, low=1.0, miss=f"not here: {finding['why']}")
        if finding["what"] == "at error" and finding["ratio"] and (not short or finding["level"] <= 1e-7):
            yield _lead(finding, CERTAIN if short else bench_peers.BAR)


def _lead(finding: dict[str, Any], bar: float) -> Row:
    times = finding["times"]
    told = "; ".join(
        f"{entry['engine']} ({entry['method']}) {_shown(entry['milliseconds'])} ms"
        for entry in sorted(times.values(), key=lambda entry: entry["milliseconds"])
    )
    best, ours = times[finding["best_peer"]], times["core"]
    late = f"{best['engine']} takes {_shown(best['milliseconds'])} ms, the core {_shown(ours['milliseconds'])} ms"
    claim = f"error {finding['level']:.0e}: time of the best other engine over the core's"
    return Row(claim, told, finding["ratio"], low=bar, miss="" if finding["ratio"] >= bar else late)


def _shown(value: float) -> str:
    return f"{value:.0f}" if value >= 100 else f"{value:.3g}"
