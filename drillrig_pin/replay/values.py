"""Key numbers of a version as a table, for the page and, as rows of text, for the terminal."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape
from typing import Literal

from drillrig_pin.replay.design_loop import Change, Version

Row = tuple[str, str, str, Literal["better", "worse", ""]]


def rows(version: Version) -> Iterator[Row]:
    """Name, value and change of every key number, and whether the change is for the better."""
    for change in version.changes:
        now = change.now
        judged: Literal["better", "worse", ""] = "" if change.better is None else "better" if change.better else "worse"
        yield now.name, f"{digits(now.shown)} {now.unit}", _difference(change), judged


def table(version: Version) -> str:
    """The same as HTML, with the parameters that changed above it and the warnings of the run below."""
    lines = [f"<p>{escape(words)}</p>" for words in version.parameters]
    if version.changes:
        lines.append("<table><tr><th></th><th>now</th><th>change</th></tr>")
        for name, value, difference, judged in rows(version):
            cells = f'<td>{escape(name)}</td><td>{escape(value)}</td><td class="{judged}">{escape(difference)}</td>'
            lines.append(f"<tr>{cells}</tr>")
        lines.append("</table>")
    lines += [f"<p>warning: {escape(words)}</p>" for words in version.warnings]
    return "".join(lines)


def digits(value: float) -> str:
    """A number with three digits, without an exponent where it can be helped."""
    return f"{value:.0f}" if 100 <= abs(value) < 1e6 else f"{value:.3g}"


def _difference(change: Change) -> str:
    if change.difference is None or change.before is None:
        return ""
    if abs(change.difference) <= 5e-4 * abs(change.before.shown):
        return "="
    part = change.difference / change.before.shown if change.before.shown else None
    share = "" if part is None else f" ({part:+.0%})" if abs(part) >= 0.1 else f" ({part:+.1%})"
    sign = "+" if change.difference > 0 else "−"
    return f"{sign}{digits(abs(change.difference))}{share}".replace("(-", "(−")
