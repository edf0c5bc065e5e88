"""Printing: readable tables for people, one JSON document for machines."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from drillrig_pin.escaping import json_visible
from drillrig_pin.words import decimals as decimals
from drillrig_pin.words import number as number
from drillrig_pin.words import percent as percent
from drillrig_pin.words import plain as plain

if TYPE_CHECKING:
    from rich.console import Console, JustifyMethod, RenderableType

#: Width of text that goes to a file or a pipe.
WIDTH = 100


def console(*, stderr: bool = False) -> Console:
    """A console on stdout (or stderr) that wraps nothing a machine may read."""
    from drillrig_pin.cli.plain_console import PlainConsole

    stream = sys.stderr if stderr else sys.stdout
    width = None if stream.isatty() or "COLUMNS" in os.environ else WIDTH
    return PlainConsole(stderr=stderr, highlight=False, width=width)


@contextmanager
def working(what: str) -> Iterator[None]:
    """A sign of life on a terminal while something takes its seconds."""
    out = console(stderr=True)
    if not out.is_terminal:
        yield
        return
    with out.status(f"{what} ..."):
        yield


def table(title: str, columns: Sequence[str], rows: Iterable[Sequence[str]], *, text: int = 1) -> RenderableType:
    """A plain table under its title; the first ``text`` columns are words, the others numbers."""
    from rich.console import Group
    from rich.table import Table
    from rich.text import Text

    body = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0))
    for i, column in enumerate(columns):
        justify: JustifyMethod = "left" if i < text else "right"
        body.add_column(column, justify=justify, header_style="dim", no_wrap=i == 0 or i >= text)
    for row in rows:
        body.add_row(*(Text(cell) for cell in row))
    # A table wraps its own title to its own width; a line of text above it does not.
    return Group(Text(title, style="bold", no_wrap=True), body) if title else body


def print_json(document: Mapping[str, Any]) -> None:
    """Write one JSON document to stdout; NaN and infinity, which JSON lacks, become null."""
    write_json(document, indent=2)


def write_json(document: Mapping[str, Any], indent: int | None = None) -> None:
    """Write a JSON document and the end of a line to stdout, escaping what it or a terminal must not show."""
    text = json_visible(json.dumps(plain(document), indent=indent, ensure_ascii=False, allow_nan=False))
    try:
        text.encode(sys.stdout.encoding or "utf-8")
    except UnicodeEncodeError:
        text = json.dumps(plain(document), indent=indent, allow_nan=False)
    sys.stdout.write(f"{text}\n")
