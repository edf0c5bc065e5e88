"""What an expansion may cost: a model comes from anybody, and a few lines of it can ask for years and terabytes.

Steps are counted over one expansion. No value is larger than a bound: whatever an expression makes is weighed, and what
multiplies (powers, repeated words, wide formats) is refused before it is made.
"""

from __future__ import annotations

import math
import operator
import re
from collections.abc import Iterable, Iterator
from typing import Any

#: Steps of one expansion; the shipped machine takes 90,000.
MAX_STEPS = 2_000_000
#: What an element costs that is looked at, next to a step of an expression.
ELEMENT = 20
#: Entries of one value, all that it holds included; characters of one text; bits of a whole number.
MAX_ITEMS, MAX_TEXT, MAX_BITS = 20_000, 1_000_000, 4096
#: Characters a number may take when it is printed.
PRINTED = 1300


class ExpressionError(Exception):
    """An expression does what none may do, or an expansion costs more than any model needs."""


class Budget:
    """Counts the steps of one expansion."""

    def __init__(self) -> None:
        self.spent = 0

    def spend(self, steps: int = 1) -> None:
        """Take steps; ExpressionError if there were too many."""
        self.spent += steps
        if self.spent > MAX_STEPS:
            raise ExpressionError(
                f"the model takes more than {MAX_STEPS} steps to expand: its macros, includes or expressions unfold "
                "without measure"
            )

    def text(self, text: str) -> str:
        """A text that was made; what it costs grows with its length."""
        if len(text) > MAX_TEXT:
            raise ExpressionError(f"a text of more than {MAX_TEXT} characters")
        self.spend(1 + len(text) // 10)
        return text

    def weigh(self, value: Any) -> Any:
        """The value, if it is of a size that a model may have; ExpressionError otherwise."""
        if isinstance(value, float | bool) or value is None:
            return value
        if isinstance(value, str):
            return self.text(value)
        if isinstance(value, int):
            if value.bit_length() > MAX_BITS:
                raise ExpressionError(f"a whole number of more than {MAX_BITS} bits")
            return value
        self.spend(1 + size(value) // PRINTED)
        return value

    def few(self, values: Iterable[Any]) -> Iterator[Any]:
        """Values one by one, each counted; ExpressionError for too many."""
        for i, value in enumerate(values):
            if i >= MAX_ITEMS:
                raise ExpressionError(f"more than {MAX_ITEMS} values")
            self.spend()
            yield value


def size(value: Any) -> int:
    """Characters a value may take when it is printed, at most; ExpressionError if it holds too much."""
    items, text, left = 0, 0, [value]
    while left:
        found = left.pop()
        items += 1
        if isinstance(found, str):
            text += len(found)
        elif isinstance(found, range):
            items += length(found)
        elif isinstance(found, dict) and not is_namespace(found):
            left.extend(dict.keys(found))
            left.extend(dict.values(found))
        elif isinstance(found, list | tuple | set | frozenset):
            left.extend(list.__iter__(found) if isinstance(found, list) else found)
        if items + len(left) > MAX_ITEMS or text > MAX_TEXT:
            raise ExpressionError(f"a value of more than {MAX_ITEMS} entries or {MAX_TEXT} characters")
    return text + PRINTED * items


def is_namespace(value: Any) -> bool:
    """Whether a dictionary is one of xacro's tables of names, which no expression may change."""
    return hasattr(type(value), "_resolve_")


def length(values: range) -> int:
    """How many numbers a range has, of which there may be more than Python counts."""
    return max(0, math.ceil((values.stop - values.start) / values.step)) if abs(values.stop) < 1e15 else MAX_ITEMS + 1


def multiplied(left: Any, right: Any) -> Any:
    """left * right; words and lists are not repeated without measure."""
    for several, times in ((left, right), (right, left)):
        if isinstance(several, str | list | tuple) and isinstance(times, int):
            bound = MAX_TEXT if isinstance(several, str) else MAX_ITEMS
            if len(several) * times > bound:
                raise ExpressionError(f"something of {len(several)} entries is repeated more than {bound} entries long")
    return left * right


def power(left: Any, right: Any) -> Any:
    """left ** right, of whole numbers only where the result has few bits."""
    if isinstance(left, int) and isinstance(right, int) and left.bit_length() * right > MAX_BITS and abs(left) > 1:
        raise ExpressionError(f"a power of more than {MAX_BITS} bits")
    return left**right


def shifted(left: Any, right: Any) -> Any:
    """left << right with few bits."""
    if isinstance(right, int) and right > MAX_BITS:
        raise ExpressionError(f"a whole number of more than {MAX_BITS} bits")
    return operator.lshift(left, right)


def printed(form: str, values: Any) -> str:
    """form % values; a width must stand in the form and be small."""
    if re.search(r"%[#0\- +]*(\d*\.)?\*", form):
        raise ExpressionError("a format whose width is an argument")
    require_printable(form, form.count("%"), values)
    return str(form % values)


def formatted(value: Any, form: str) -> str:
    """format(value, form) of a number or a word."""
    require_printable(form, 1, value)
    return format(value if isinstance(value, str | int | float | complex) else str(value), form)


def require_printable(form: str, places: int, values: Any) -> None:
    """ExpressionError if a form with so many places for values could become too long a text."""
    widths = re.findall(r"\d+", form)
    if any(len(width) > 6 for width in widths) or sum(map(int, widths)) + places * size(values) > 2 * MAX_TEXT:
        raise ExpressionError(f"a format that may give more than {MAX_TEXT} characters")
