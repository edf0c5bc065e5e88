"""Measure everything the software is held to and write the page a user can read, `tests/VALIDATION.md`.

    python scripts/validate.py                  some minutes, most of them for the other engines
    python scripts/validate.py --short          the short form, as in the tests: seconds
    python scripts/validate.py --only order     sections whose title holds a word, to the screen; the page is left alone

Leaves with status 1 if a claim fails that is not known to.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

TESTS = Path(__file__).resolve().parent.parent / "tests"
PAGE = TESTS / "VALIDATION.md"
sys.path.insert(0, str(TESTS))

from validation.page import render  # noqa: E402
from validation.record import Row  # noqa: E402
from validation.sections import SECTIONS  # noqa: E402

from drillrig_pin.files import write_aside  # noqa: E402


def main() -> int:
    """Run what was asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--short", action="store_true", help="smaller cases")
    parser.add_argument("--only", nargs="+", metavar="WORD", help="sections whose title holds one of these words")
    parser.add_argument("-o", "--output", type=Path, help=f"where to write the page; default: {PAGE}")
    given = parser.parse_args()
    words = [word.lower() for word in given.only or ()]
    chosen = [s for s in SECTIONS if not words or any(word in s.title.lower() for word in words)]
    if not chosen:
        parser.error("no section is called so; they are: " + "; ".join(section.title for section in SECTIONS))
    measured = []
    for section in chosen:
        started = time.perf_counter()
        print(section.title, file=sys.stderr, end=" ... ", flush=True)
        rows = list(section.rows(given.short))
        print(f"{sum(row.met for row in rows)} of {len(rows)}, {time.perf_counter() - started:.1f} s", file=sys.stderr)
        measured.append((section, rows))
    page = render(measured)
    if given.output is None and (words or given.short):
        print(page)
    else:
        target = given.output or PAGE
        _write(target, page)
        print(target, file=sys.stderr)
    return int(any(_surprising(row) for _, rows in measured for row in rows))


def _surprising(row: Row) -> bool:
    return row.met == bool(row.miss)


def _write(target: Path, page: str) -> None:
    with write_aside(target) as beside:
        Path(beside).write_text(page, encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
