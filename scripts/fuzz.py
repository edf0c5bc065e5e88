"""Files of every kind the package reads: each must end in success or in one of the package's own errors.

    python scripts/fuzz.py                                 2,000 spoiled files, half a minute
    python scripts/fuzz.py --table legal                   2,000 models, scenarios, studies that the grammar allows
    python scripts/fuzz.py --inputs 100000 --workers 2     the long form; prints JSON, --keep keeps it for the page
    python scripts/fuzz.py --first 40000 ...               goes on behind the first 40,000 of the seed
    python scripts/fuzz.py --show 1234 --into folder       make one input again and use it in this process
    python scripts/fuzz.py --reduce 1234 --into folder     make it as small as it can be while it ends in the same way

Leaves with status 1 if anything else happens: another exception, a crash, more than 5 s of computing, more than 1 GB,
an error that is not one sentence. Legal files are run, and what comes of it must be right or said to be wrong: every
number of a completed run finite, its energy balanced, both engines alike, no warning of a library.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from dataclasses import asdict
from pathlib import Path

# Threads of linear algebra would count several times as computing, and small machines gain nothing from them.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))

from fuzz.campaign import Summary, campaign, told
from fuzz.kinds import TABLES, files_of, kind_of
from fuzz.moment import warm_up
from fuzz.reduce import reduced
from validation.measured import keep


def main() -> int:
    """Run what was asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--table", choices=sorted(TABLES), default="spoiled", help="which inputs; default: spoiled")
    parser.add_argument("--inputs", type=int, default=2000, metavar="N", help="how many; default: 2000")
    parser.add_argument("--workers", type=int, default=1, metavar="N", help="processes; default: 1")
    parser.add_argument("--seed", type=int, default=1, help="another seed gives other inputs; default: 1")
    parser.add_argument("--first", type=int, default=0, metavar="N", help="number of the first input; default: 0")
    parser.add_argument(
        "--json", type=Path, metavar="FILE", help="write the summary there now and then, and at the end"
    )
    parser.add_argument("--keep", action="store_true", help="keep the figures for tests/VALIDATION.md")
    parser.add_argument("--show", type=int, metavar="N", help="make input N again and use it here, traceback and all")
    parser.add_argument("--reduce", type=int, metavar="N", help="make input N again, and smaller")
    parser.add_argument("--into", type=Path, default=Path("fuzz_input"), help="where these two put it: fuzz_input")
    given = parser.parse_args()
    if given.show is not None or given.reduce is not None:
        return _show(given)
    summary = Summary(given.seed, given.table)
    try:
        campaign(given.inputs, given.workers, given.seed, given.first, Told(given.json), summary, given.table)
    except KeyboardInterrupt:
        print("stopped; this is what was found so far", file=sys.stderr)
    print(summary.as_json())
    print(told(summary), file=sys.stderr)
    if given.json is not None:
        given.json.write_text(summary.as_json())
    if given.keep:
        figures = asdict(summary) | {"findings": len(summary.findings)}
        print(keep("fuzz" if given.table == "spoiled" else f"fuzz_{given.table}", figures), file=sys.stderr)
    return int(bool(summary.findings))


class Told:
    """Says now and then how far it is, and every finding when it comes."""

    def __init__(self, file: Path | None) -> None:
        self.last, self.found, self.file = time.monotonic(), 0, file

    def __call__(self, summary: Summary) -> None:
        """Called after every look at the workers."""
        for finding in summary.findings[self.found :]:
            print(f"input {finding.number}, {finding.kind}: {finding.what[:200]}", file=sys.stderr, flush=True)
            print(f"    {finding.where}", file=sys.stderr, flush=True)
        self.found = len(summary.findings)
        if time.monotonic() > self.last + 10:
            self.last = time.monotonic()
            rate = summary.inputs / max(summary.cpu_seconds, 1e-3)
            print(
                f"{summary.inputs} inputs, {rate:.0f} a second of computing, {self.found} findings",
                file=sys.stderr,
                flush=True,
            )
            if self.file is not None:
                self.file.write_text(summary.as_json())


def _show(given: argparse.Namespace) -> int:
    number = given.reduce if given.show is None else given.show
    kind, files = kind_of(number, given.table), files_of(given.seed, number, given.table)
    if given.show is None:
        files, fault = reduced(files, number, given.table, lambda text: print(text, file=sys.stderr))
        print(fault, file=sys.stderr)
    given.into.mkdir(parents=True, exist_ok=True)
    for name, data in files.items():
        (given.into / name).write_bytes(data)
    print(f"{kind.name}: {given.into}", file=sys.stderr)
    if given.show is not None:
        warm_up()
        kind.use(given.into)
    return 0


if __name__ == "__main__":
    sys.exit(main())
