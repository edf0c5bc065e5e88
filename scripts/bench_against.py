"""Measure what the default run costs against another checkout of the package; one JSON object a line, with its bar.

    python scripts/bench_against.py ../before/.venv/bin/python

Both are run in turn, in processes of their own, and processor time is compared: it survives a busy machine, seconds on
the wall do not. The ratio is that of the medians; the quartiles of the ratios turn by turn say how sure it is.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

BAR = 1.05
CASE_RUN = """
import time
from drillrig_pin import Scenario, load_rig
from drillrig_pin.simulation import Case
case = Case(load_rig("mkz49"), Scenario())
case.run()
start = time.process_time()
for _ in range(10):
    case.run()
print((time.process_time() - start) / 10)
"""


def case_run(python: str) -> float:
    """Seconds of ``Case.run`` on the default run of 10 s, the case bound and warm."""
    return float(subprocess.run([python, "-c", CASE_RUN], check=True, capture_output=True, text=True).stdout)


def command(python: str) -> float:
    """Seconds of ``drillrig run``, file included."""
    with tempfile.TemporaryDirectory() as folder:
        words = [str(Path(python).with_name("drillrig")), "run", "-o", str(Path(folder, "run.nc"))]
        process = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        _, status, usage = os.wait4(process.pid, 0)
    if status:
        raise SystemExit(f"{' '.join(words)} failed")
    return usage.ru_utime


def main() -> None:
    """Print one line per measurement."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("other", help="the Python of the other checkout")
    parser.add_argument("--turns", type=int, default=15, help="default 15")
    given = parser.parse_args()
    for what, measure in [("Case.run", case_run), ("drillrig run", command)]:
        ours, theirs = [], []
        for turn in range(given.turns + 1):
            # Whoever goes second finds the files warm: take turns at that too, and throw the first turn away.
            order = [(ours, sys.executable), (theirs, given.other)]
            for seconds, python in order if turn % 2 else reversed(order):
                seconds.append(measure(python))
        ratio = statistics.median(ours[1:]) / statistics.median(theirs[1:])
        low, _, high = statistics.quantiles(a / b for a, b in zip(ours[1:], theirs[1:], strict=True))
        line = {
            "what": f"{what}, default 10 s, processor time against the other checkout",
            "value": round(ratio, 4),
            "bar": BAR,
            "met": ratio <= BAR,
            "quartiles": [round(low, 4), round(high, 4)],
            "seconds": round(statistics.median(ours[1:]), 4),
            "other": round(statistics.median(theirs[1:]), 4),
        }
        print(json.dumps(line), flush=True)


if __name__ == "__main__":
    main()
