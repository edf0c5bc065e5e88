"""What may stand behind a dot in an expression: names of a namespace, keys of a table, methods of words and lists."""

from __future__ import annotations

import string
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from drillrig_pin.model.budget import (
    MAX_TEXT,
    Budget,
    ExpressionError,
    formatted,
    is_namespace,
    require_printable,
    size,
)

_OF_WORDS = """
capitalize casefold center count endswith find format index isalnum isalpha isdecimal isdigit isidentifier islower
isnumeric isspace istitle isupper join ljust lower lstrip partition removeprefix removesuffix replace rfind rindex
rjust rpartition rsplit rstrip split splitlines startswith strip swapcase title upper zfill
"""
_METHODS: dict[type, frozenset[str]] = {
    str: frozenset(_OF_WORDS.split()),
    dict: frozenset(("copy", "get", "items", "keys", "pop", "setdefault", "update", "values")),
    list: frozenset(("append", "copy", "count", "extend", "index", "insert", "pop", "remove", "reverse")),
    tuple: frozenset(("count", "index")),
    float: frozenset(("is_integer",)),
}


@dataclass(frozen=True, slots=True)
class Method:
    """A method of a word, number, list or table."""

    given: Any
    kind: type
    name: str

    def call(self, budget: Budget, *arguments: Any, **named: Any) -> Any:
        """Call it; ExpressionError if what comes out would be too large."""
        special = _SPECIAL.get((self.kind, self.name))
        if special is not None:
            special(self.given, *arguments, **named)
        if self.name == "format":
            return _Formatter().vformat(self.given, arguments, named)
        found = getattr(self.kind, self.name)(self.given, *arguments, **named)
        if self.kind in (dict, list):
            # It may have been changed.
            budget.weigh(self.given)
        return list(found) if self.name in ("items", "keys", "values") else found


def attribute(given: Any, name: str) -> Any:
    """given.name; ExpressionError for all that is not listed here."""
    if isinstance(given, dict) and is_namespace(given):
        try:
            return given[name]
        except KeyError:
            raise NameError(f"name {name!r} is not defined") from None
    for kind, names in _METHODS.items():
        if isinstance(given, kind):
            if name in names:
                return Method(given, kind, name)
            if isinstance(given, dict) and type(given) is not dict:
                # A table of xacro gives its entries behind a dot.
                return given[name]
    raise ExpressionError(f"{type(given).__name__} has no {name!r} that an expression may use")


def _require_replaceable(given: str, old: str, new: str, *_: Any) -> None:
    if len(given) + (given.count(old) if old else len(given) + 1) * len(new) > MAX_TEXT:
        raise ExpressionError(f"a text of more than {MAX_TEXT} characters")


def _require_joinable(given: str, words: Any) -> None:
    if isinstance(words, list | tuple | set | dict) and len(given) * len(words) + size(words) > 40 * MAX_TEXT:
        raise ExpressionError(f"a text of more than {MAX_TEXT} characters")


def _require_narrow(_: str, width: int, *__: Any) -> None:
    if width > MAX_TEXT:
        raise ExpressionError(f"a text of more than {MAX_TEXT} characters")


_SPECIAL: Mapping[tuple[type, str], Callable[..., None]] = {
    (str, "replace"): _require_replaceable,
    (str, "join"): _require_joinable,
    **{(str, name): _require_narrow for name in ("center", "ljust", "rjust", "zfill")},
}


class _Formatter(string.Formatter):
    """str.format without a way from a value to what it is made of."""

    def vformat(self, format_string: str, args: Sequence[Any], kwargs: Mapping[str, Any]) -> str:
        require_printable(format_string, format_string.count("{"), [*args, *kwargs.values()])
        return super().vformat(format_string, args, kwargs)

    def get_field(self, field_name: str, args: Sequence[Any], kwargs: Mapping[str, Any]) -> Any:
        if "." in field_name or "[" in field_name:
            raise ExpressionError(f"the field {{{field_name}}} is more than a name or a number")
        return super().get_field(field_name, args, kwargs)

    def format_field(self, value: Any, format_spec: str) -> str:
        return formatted(value, format_spec)
