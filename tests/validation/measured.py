"""Figures of measurements too long for the page: their scripts leave them in tests/measured, with the date."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from drillrig_pin.files import write_aside
from validation.record import Row

FOLDER = Path(__file__).resolve().parent.parent / "measured"

TEXT = """\
What takes an hour is not measured for every page: these scripts leave their figures in `tests/measured/`, and the
reference says from which day they are.

`scripts/fuzz.py --inputs 100000` spoils valid files of every kind the package reads, in their structure (XML elements,
YAML fields, table cells, HDF5 variables dropped, doubled, renamed, given hostile values) and in their bytes, and does
with each what its user would do next. Each must end in success or in one of the package's own errors of one sentence:
no other exception, no crash, nothing above 5 s of computing or 1 GB. The tests run 2,000 of them. `scripts/coverage.sh`
counts the lines of Python that the whole suite runs, child processes included. `scripts/mutation.sh` plants faults in
the force laws and in what assembles and solves the constraints, and counts those that the tests notice;
`tests/MUTATION.md` lists the others.
"""


def keep(name: str, figures: dict[str, Any]) -> Path:
    """Write figures with today's date; gives the file."""
    FOLDER.mkdir(exist_ok=True)
    target = FOLDER / f"{name}.json"
    dated = {"date": datetime.now(UTC).strftime("%Y-%m-%d"), **figures}
    with write_aside(target) as aside:
        Path(aside).write_text(json.dumps(dated, indent=1) + "\n", encoding="utf-8")
    return target


def kept(name: str) -> dict[str, Any]:
    """Figures kept under a name; none if they were never measured."""
    path = FOLDER / f"{name}.json"
    figures: dict[str, Any] = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    return figures


def rows(short: bool) -> Iterator[Row]:
    """Fuzzing, coverage, mutation."""
    fuzz, by = kept("fuzz"), "scripts/fuzz.py"
    slowest = fuzz.get("slowest", [math.nan])[0]
    yield _row("spoiled files tried", by, fuzz, fuzz.get("inputs"), low=100_000)
    ended = "of them that ended in anything but success or an error of the package"
    yield _row(ended, by, fuzz, fuzz.get("findings"), high=0)
    yield _row("slowest of them", by, fuzz, slowest, high=5.0, unit="s")
    memory = "largest memory of a process that read them"
    yield _row(memory, by, fuzz, fuzz.get("peak_memory", math.nan) / 1e9, high=1.0, unit="GB")
    coverage, by = kept("coverage"), "scripts/coverage.sh"
    lines = f"lines of Python that the tests run, of {coverage.get('lines', 0)}"
    yield _row(lines, by, coverage, coverage.get("percent"), low=95.0, unit="%")
    mutation, by = kept("mutation"), "scripts/mutation.sh"
    faults = f"planted faults that the tests notice, of {mutation.get('mutants', 0)}"
    # Part of the faults says nothing about the others.
    percent = None if mutation.get("untried") else mutation.get("percent")
    yield _row(faults, by, mutation, percent, low=90.0, unit="%")


def _row(claim: str, by: str, figures: dict[str, Any], value: float | None, **bounds: Any) -> Row:
    if value is None or math.isnan(value):
        return Row(claim, by, math.nan, miss="not measured yet", **bounds)
    return Row(claim, f"{by}, {figures['date']}", value, **bounds)
