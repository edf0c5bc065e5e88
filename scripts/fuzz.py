"""Spoiled files of every kind the package reads: each must end in success or in one of the package's own errors.

    python scripts/fuzz.py                                 2,000 inputs, half a minute
    python scripts/fuzz.py --inputs 100000 --workers 2     the long form; prints JSON, --keep keeps it for the page
    python scripts/fuzz.py --show 1234 --into folder       make one input again and use it in this process

Leaves with status 1 if anything else happens: another exception, a crash, more than 5 s, more than 1 GB, an error
that is not one sentence.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import asdict
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))

from fuzz.campaign import Summary, campaign, told
from fuzz.kinds import files_of, kind_of
from validation.measured import keep


def main() -> int:
    """Run what was asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--inputs", type=int, default=2000, metavar="N", help="how many; default: 2000")
    parser.add_argument("--workers", type=int, default=1, metavar="N", help="processes; default: 1")
    parser.add_argument("--seed", type=int, default=1, help="another seed gives other inputs; default: 1")
    parser.add_argument("--first", type=int, default=0, metavar="N", help="number of the first input; default: 0")
    parser.add_argument("--keep", action="store_true", help="keep the figures for tests/VALIDATION.md")
    parser.add_argument("--show", type=int, metavar="N", help="make input N again and use it here, traceback and all")
    parser.add_argument("--into", type=Path, default=Path("fuzz_input"), help="where --show puts it: fuzz_input")
    given = parser.parse_args()
    if given.show is not None:
        return _show(given.seed, given.show, given.into)
    summary = Summary(given.seed)
    try:
        campaign(given.inputs, given.workers, given.seed, given.first, Told(), summary)
    except KeyboardInterrupt:
        print("stopped; this is what was found so far", file=sys.stderr)
    print(summary.as_json())
    print(told(summary), file=sys.stderr)
    if given.keep:
        figures = asdict(summary) | {"findings": len(summary.findings)}
        print(keep("fuzz", figures), file=sys.stderr)
    return int(bool(summary.findings))


class Told:
    """Says now and then how far it is, and every finding when it comes."""

    def __init__(self) -> None:
        self.last, self.found = time.monotonic(), 0

    def __call__(self, summary: Summary) -> None:
        """Called after every look at the workers."""
        for finding in summary.findings[self.found :]:
            print(f"input {finding.number}, {finding.kind}: {finding.what[:200]}", file=sys.stderr, flush=True)
        self.found = len(summary.findings)
        if time.monotonic() > self.last + 10:
            self.last = time.monotonic()
            print(f"{summary.inputs} inputs, {self.found} findings", file=sys.stderr, flush=True)


def _show(seed: int, number: int, folder: Path) -> int:
    folder.mkdir(parents=True, exist_ok=True)
    for name, data in files_of(seed, number).items():
        (folder / name).write_bytes(data)
    print(f"{kind_of(number).name}: {folder}", file=sys.stderr)
    kind_of(number).use(folder)
    return 0


if __name__ == "__main__":
    sys.exit(main())
