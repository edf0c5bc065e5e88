"""Samples over time in a text file: two columns, `time,value`, with or without a header that names units."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from decimal import Decimal
from typing import Literal

from drillrig_pin.errors import DrillrigError
from drillrig_pin.units import factor_of, legal_units, quantity_of

#: Numbers beyond it no measurement has.
LARGEST = 1e30
#: Times nearer than this [s] are one time: two rows there are a jump.
SHORTEST = 1e-12
NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")
#: What readers of tables write for a missing value; `inf` and `nan` are numbers that are not finite.
NOT_FINITE = re.compile(r"[-+]?(nan|inf(inity)?)", re.IGNORECASE)
DECIMAL_COMMA = re.compile(r"[-+]?\d+,\d+([eE][-+]?\d+)?")
BRACKETED = re.compile(r"[\[({]\s*([^\])}]*?)\s*[\])}]")

#: Units that are no other word.
PLAIN = frozenset(
    ("N", "kN", "MN", "daN", "Nm", "kNm", "MNm", "lbf", "kgf", "mm", "cm", "um", "µm", "kPa", "MPa", "bar", "psi", "kg")
)

Place = Callable[[int], object]


@dataclass(frozen=True, slots=True)
class Series:
    """Samples in SI, in the order of the file.

    Attributes:
        rows: (time [s], value) of every sample; times increase, at most two are one (a jump).
        lines: the line each of them stands on.
        units: units the header names, of time and of value; empty where it names none.
        header: the words of the header; empty without one.
    """

    rows: tuple[tuple[float, float], ...]
    lines: tuple[int, ...]
    units: tuple[str, str]
    header: tuple[str, ...]


def read_series(
    text: str,
    noun: str,
    place: Place,
    error: type[DrillrigError],
    *,
    quantity: str,
    what: str,
    unit: str = "",
    time_factor: float = 1.0,
    time_offset: float | Literal["auto"] = 0.0,
    jumps: bool = True,
) -> Series:
    """Parse `time,value` lines: separators comma, semicolon or tab, decimal points, comments after #.

    A header may name the units in brackets, behind a slash or as last word: ``time [ms],force [kN]``, ``t / ms``,
    ``force_kN``; a second line of the header may hold them alone, and so may the last comment before the samples.
    The time of a sample is its time in the file, times the unit, times ``time_factor``, plus ``time_offset``.

    Args:
        text: the file.
        noun: what the file is, for sentences.
        place: where a line is, given its number.
        error: what is raised.
        quantity: what the values measure, a key of :data:`drillrig_pin.units.QUANTITIES`.
        what: whose values they are, e.g. ``the force``.
        unit: unit of the values, whatever the header says; empty: that of the header, or SI.
        time_factor: factor on all times.
        time_offset: added to all times [s]; ``auto``: such that the first sample is at 0.
        jumps: whether two samples may stand at one time.

    Raises:
        DrillrigError: as ``error``; a missing, misread or non-finite value, a unit that is not known or measures
            something else, time that does not increase, more than two samples at one time.
    """
    reader = _Reader(noun, place, error)
    lines = list(_lines(text))
    data = next((i for i, (_, line) in enumerate(lines) if line[0] != "#" and _starts_with_number(line)), len(lines))
    samples = [(number, line) for number, line in lines[data:] if line[0] != "#"]
    head = [(number, line) for number, line in lines[:data] if line[0] != "#"]
    separator = next((mark for mark in (";", "\t") if any(mark in line for _, line in (samples or head)[:1])), ",")
    names, units = _header(head, lines[:data], separator, quantity, reader)
    factors = [1.0, 1.0]
    for column, (given, measures) in enumerate(((units[0], "time"), (unit or units[1], quantity))):
        factor = factor_of(given, measures) if given else 1.0
        if factor is None:
            raise reader.wrong_unit(head[0][0] if head else 1, given, measures, what if column else "the first column")
        factors[column] = factor
    if len(names) == 2 and _is_time(names[1]) and not _is_time(names[0]):
        raise reader.at(head[0][0], f"the first column of the {noun} is {names[0]!r}", "Time comes first.")
    rows: list[tuple[float, float]] = []
    first = ""
    for number, line in samples:
        t_text, v_text = reader.cells(number, line, separator)
        first = first or t_text
        t = _time(t_text, factors[0], time_factor, first if time_offset == "auto" else time_offset)
        value = _times(float(v_text), factors[1])
        if abs(t) > LARGEST or abs(value) > LARGEST:
            raise reader.at(number, f"line {number} of the {noun} is beyond {LARGEST:g}")
        if rows and t - rows[-1][0] < max(SHORTEST, 16 * math.ulp(t)):
            if t < rows[-1][0] or not jumps:
                raise reader.at(number, f"time does not increase at line {number} of the {noun}", "Sort the lines.")
            if len(rows) > 1 and rows[-2][0] == rows[-1][0]:
                words = f"time does not increase at line {number} of the {noun}, the third row at one time"
                raise reader.at(number, words, "Two rows at one time are a jump from the first to the second.")
            t = rows[-1][0]
        rows.append((t, value))
    return Series(tuple(rows), tuple(number for number, _ in samples), units, names)


def _time(text: str, unit: float, factor: float, offset: float | str) -> float:
    """Time in SI; ``offset`` as text: the time, as written, that becomes 0.

    Time stamps of today, in seconds since 1970, leave a float no microseconds: they are shifted as written.
    """
    if isinstance(offset, str):
        return _times(_times(float(Decimal(text) - Decimal(offset)), unit), factor)
    if offset:
        return float(Decimal(text) * Decimal(repr(unit)) * Decimal(repr(factor)) + Decimal(repr(offset)))
    return _times(_times(float(text), unit), factor)


def _times(value: float, factor: float) -> float:
    """A product by a unit; division where that is exact: 300 ms are 0.3 s."""
    return value / round(1 / factor) if 0 < factor < 1 and 1 / factor == round(1 / factor) else value * factor


def _lines(text: str) -> Iterator[tuple[int, str]]:
    for number, line in enumerate(text.lstrip("\ufeff").strip().splitlines(), start=1):
        if line.strip(" \t,;"):
            yield number, line.strip(" \r")


def _starts_with_number(line: str) -> bool:
    word = re.split(r"[;,\t ]", line.strip().strip('"'), maxsplit=1)[0].strip().strip('"')
    return bool(NUMBER.fullmatch(word) or NOT_FINITE.fullmatch(word))


def _is_time(name: str) -> bool:
    return bool(re.match(r"(time|t|zeit|sec|seconds)\b", name.strip().lower().replace("_", " ")))


def _header(
    head: list[tuple[int, str]], before: list[tuple[int, str]], separator: str, quantity: str, reader: _Reader
) -> tuple[tuple[str, ...], tuple[str, str]]:
    """Words of the header, and the units it names."""
    if not head:
        # A header behind a comment sign is one only if it names units in brackets, a column each.
        for _, line in reversed(before):
            cells = _split(line.lstrip("# "), separator)
            if len(cells) == 2 and all(BRACKETED.search(cell) for cell in cells):
                return tuple(cells), (_bracketed(cells[0]), _bracketed(cells[1]))
        return (), ("", "")
    cells = _split(head[0][1], separator)
    # A first line that holds a number was meant as a row: it is not passed over as words.
    if len(cells) != 2 or len(head) > 2 or any(NUMBER.fullmatch(cell) for cell in cells):
        raise reader.not_two(*head[-1], separator)
    found = [_unit_in(cell, measures) for cell, measures in zip(cells, ("time", quantity), strict=True)]
    if len(head) == 2:
        found = [_bracketed(cell) or cell for cell in _split(head[1][1], separator)]
        if len(found) != 2 or not all(quantity_of(unit) for unit in found):
            raise reader.not_two(*head[1], separator)
    elif all(quantity_of(cell) for cell in cells):
        found = cells
    return tuple(cells), (found[0], found[1])


def _split(line: str, separator: str) -> list[str]:
    words = line.split(separator) if '"' not in line else next(csv.reader([line], delimiter=separator))
    cells = [cell.strip() for cell in words]
    # A separator at the end of every line, as some loggers leave it, is no column.
    return cells[:-1] if len(cells) == 3 and not cells[2] else cells


def _bracketed(cell: str) -> str:
    found: list[str] = BRACKETED.findall(cell)
    return next((unit for unit in found if quantity_of(unit)), found[0] if found else "")


def _unit_in(cell: str, quantity: str) -> str:
    """The unit a cell of a header names: in brackets, behind a slash or `in`, or as its last word; empty: none."""
    if BRACKETED.search(cell):
        return _bracketed(cell) or "-"
    words = re.split(r"\s*/\s*|\s+in\s+", cell.strip(), maxsplit=1)
    if len(words) == 2 and words[1].strip():
        return words[1].strip()
    parts = re.split(r"[\s_:]+", cell.strip())
    for count in (2, 1):
        # As last word only what can be nothing else: `force_z` and `F_min` are names.
        word = "".join(parts[-count:])
        if len(parts) > count and (factor_of(word, quantity) is not None or word in PLAIN):
            return " ".join(parts[-count:])
    return ""


class _Reader:
    """Cells of a line, and sentences about it."""

    def __init__(self, noun: str, place: Place, error: type[DrillrigError]) -> None:
        self.noun, self.place, self.error = noun, place, error

    def at(self, number: int, what: str, todo: str = "") -> DrillrigError:
        return self.error(what, where=self.place(number), todo=todo)

    def not_two(self, number: int, line: str, separator: str) -> DrillrigError:
        shown = line[:60]
        what = f"line {number} of the {self.noun} is not `time,value`, two numbers: {shown!r}"
        cells = _split(line, separator)
        if (
            len(cells) != 2
            and separator == ","
            and len(cells) == 4
            and all(re.fullmatch(r"[-+]?\d+", c) for c in cells)
        ):
            return self.at(
                number, what, "Write decimal points, or separate the columns by semicolons and write points."
            )
        if len(cells) > 2:
            return self.at(
                number, what, f"It has {len(cells)} columns; leave the time and one value, two numbers a line."
            )
        if len(line.split()) == 2 and len(cells) == 1:
            return self.at(number, what, "Separate the columns by a comma, a semicolon or a tab.")
        if ":" in line or re.search(r"\d{4}-\d\d-\d\d", line):
            return self.at(number, what, "Write times as seconds or in a unit that the header names.")
        return self.at(number, what, "Fill or remove the line.")

    def cells(self, number: int, line: str, separator: str) -> tuple[str, str]:
        """The two numbers of a line, as written."""
        cells = _split(line, separator)
        if separator != "," and any(DECIMAL_COMMA.fullmatch(cell) for cell in cells):
            what = f"line {number} of the {self.noun} has a decimal comma: {line[:60]!r}"
            raise self.at(number, what, "Write decimal points, as in 0.5.")
        if len(cells) != 2:
            raise self.not_two(number, line, separator)
        for cell in cells:
            if NOT_FINITE.fullmatch(cell):
                raise self.at(number, f"line {number} of the {self.noun} is not finite", "Fill or remove it.")
            if not NUMBER.fullmatch(cell):
                raise self.not_two(number, line, separator)
            if not math.isfinite(float(cell)):
                raise self.at(number, f"line {number} of the {self.noun} is not finite", "Fill or remove it.")
        return cells[0], cells[1]

    def wrong_unit(self, number: int, unit: str, measures: str, whose: str) -> DrillrigError:
        other = quantity_of(unit)
        what = f"{unit!r} is no unit of {measures}" + (f", but of {other}" if other else " known here")
        return self.at(number, f"{what}: {whose} of the {self.noun}", legal_units(unit, measures))
