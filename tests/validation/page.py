"""Rows as a Markdown page."""

from __future__ import annotations

from collections.abc import Iterable
from datetime import UTC, datetime

from drillrig_pin.trajectory import versions
from validation.record import Row, Section

HEAD = """\
# Validation

What this software computes, against results and laws that nobody here wrote. Every figure was measured in the run that
wrote this page, by

    python scripts/validate.py

on {date} with {versions}; those of the last section come from scripts that take longer, each with its date. {verdict}
"""


def render(measured: Iterable[tuple[Section, list[Row]]]) -> str:
    """The whole page."""
    measured = list(measured)
    every = [row for _, rows in measured for row in rows]
    used = ", ".join(f"{name} {version}" for name, version in versions().items())
    date = datetime.now(UTC).strftime("%Y-%m-%d")
    parts = [HEAD.format(date=date, versions=used, verdict=_verdict(every)), _summary(measured)]
    parts += [_section(section, rows) for section, rows in measured]
    return "\n".join(parts)


def _verdict(rows: list[Row]) -> str:
    missed = [row for row in rows if not row.met]
    told = sum(bool(row.miss) for row in missed)
    text = f"{len(rows) - len(missed)} of {len(rows)} claims hold"
    if not missed:
        return text + "."
    text += f"; {told} known not to hold, each with its reason"
    return text + (f"; **{len(missed) - told} fail**." if len(missed) > told else ".")


def _summary(measured: list[tuple[Section, list[Row]]]) -> str:
    lines = ["| | claims | hold |", "|---|---:|---:|"]
    for section, rows in measured:
        anchor = "".join(c for c in section.title.lower() if c.isalnum() or c in " -").replace(" ", "-")
        lines.append(f"| [{section.title}](#{anchor}) | {len(rows)} | {sum(row.met for row in rows)} |")
    return "\n".join(lines) + "\n"


def _section(section: Section, rows: list[Row]) -> str:
    lines = [
        f"## {section.title}\n",
        section.text,
        "| claim | reference | measured | bar | |",
        "|---|---|---:|---:|---|",
    ]
    for row in rows:
        unit = f" {row.unit}" if row.unit else ""
        told = ("holds" if row.met else "**fails**") if not row.miss or row.met else "no: " + row.miss
        cells = (_cell(row.claim), _cell(row.reference), f"{row.measured:.3g}{unit}", row.bar + unit, _cell(told))
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def _cell(text: str) -> str:
    return text.replace("|", "\\|")
