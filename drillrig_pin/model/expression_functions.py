"""What an expression may call: Python's harmless functions, those of ``math``, and xacro's own, each within bounds."""

from __future__ import annotations

import math
import operator
import re
from collections.abc import Callable, Iterable
from functools import reduce
from typing import Any

from drillrig_pin.model.budget import MAX_ITEMS, Budget, ExpressionError, is_namespace, length
from drillrig_pin.model.expression_methods import Method

#: The largest whole number whose factorial, and whose ways of being chosen from, are computed.
MAX_FACTORIAL, MAX_CHOICE = 500, 4000
#: Digits that rounding may be asked for.
MAX_DIGITS = 400

Named = dict[str, Any]


class Functions:
    """Which functions may be called, by the very function that a name gives, and what is called in its stead."""

    def __init__(self, budget: Budget) -> None:
        self.budget = budget
        self._known: dict[int, tuple[Any, Callable[..., Any]]] = {}
        for function in _PLAIN:
            self.allow(function)
        for name, function in vars(math).items():
            if not name.startswith("_") and callable(function):
                self.allow(function)
        for function, safe in {**_FIXED, **self._bounded()}.items():
            self.allow(function, safe)

    def allow(self, function: Any, safe: Callable[..., Any] | None = None) -> None:
        """Let a function be called; ``safe``: what is called instead."""
        self._known[id(function)] = (function, safe or function)

    def call(self, function: Any, arguments: Iterable[Any], named: Named | None = None) -> Any:
        """Call a function that may be called; ExpressionError for any other, or where the result is too large."""
        self.budget.spend()
        if isinstance(function, Method):
            return self.budget.weigh(function.call(self.budget, *arguments, **(named or {})))
        if isinstance(function, Written):
            self.budget.spend(10)
            return self.budget.weigh(function.value(*arguments, **(named or {})))
        known = self._known.get(id(function))
        if known is None or known[0] is not function:
            raise ExpressionError(f"{type(function).__name__} is nothing that an expression may call")
        return self.budget.weigh(known[1](*arguments, **(named or {})))

    def _bounded(self) -> dict[Any, Callable[..., Any]]:
        each, call, weigh = self.budget.few, self.call, self.budget.weigh

        def keyed(function: Callable[..., Any]) -> Callable[..., Any]:
            def with_key(*given: Any, key: Any = None, **named: Any) -> Any:
                if key is not None:
                    named["key"] = lambda value: call(key, (value,))
                return function(*given, **named)

            return with_key

        def added(values: Iterable[Any], start: Any = 0) -> Any:
            return reduce(lambda left, right: weigh(left + right), each(values), start)

        def multiplied(values: Iterable[Any], *, start: Any = 1) -> Any:
            return reduce(lambda left, right: weigh(operator.mul(left, right)), numbers(each(values)), start)

        def numbers(values: Iterable[Any]) -> Iterable[Any]:
            for value in values:
                if not isinstance(value, int | float | complex):
                    raise TypeError(f"{type(value).__name__} is no number")
                yield value

        return {
            map: lambda function, *values: [call(function, given) for given in zip(*map(each, values), strict=False)],
            filter: lambda function, values: [
                value for value in each(values) if (call(function, (value,)) if function is not None else value)
            ],
            sorted: keyed(sorted),
            min: keyed(min),
            max: keyed(max),
            sum: added,
            math.prod: multiplied,
            math.lcm: lambda *given: reduce(lambda left, right: weigh(math.lcm(left, right)), given, 1),
            **{kind: _listing(kind, each) for kind in (enumerate, zip, reversed)},
        }


class Written:
    """A function written in an expression: a lambda."""

    def __init__(self, value: Callable[..., Any]) -> None:
        self.value = value


def _listing(kind: Any, each: Callable[[Iterable[Any]], Iterable[Any]]) -> Callable[..., Any]:
    return lambda *given, **named: list(each(kind(*given, **named)))


def _range(*given: Any) -> range:
    found = range(*given)
    if length(found) > MAX_ITEMS:
        raise ExpressionError(f"a range of more than {MAX_ITEMS} numbers")
    return found


def _kind(value: Any, *more: Any) -> Any:
    if more:
        raise ExpressionError("no expression makes a class")
    return type(value)


def _round(value: Any, ndigits: int | None = None) -> Any:
    if ndigits is not None and abs(ndigits) > MAX_DIGITS:
        raise ExpressionError(f"rounding to more than {MAX_DIGITS} digits")
    return round(value, ndigits)


def _small(function: Callable[..., Any], most: int) -> Callable[..., Any]:
    def bounded(*given: Any) -> Any:
        if any(value is not None and value > most for value in given):
            raise ExpressionError(f"{function.__name__} of more than {most}")
        return function(*given)

    return bounded


def _words(kind: Callable[[Any], str]) -> Callable[..., str]:
    def text(*given: Any) -> str:
        if given and (callable(given[0]) or (isinstance(given[0], dict) and is_namespace(given[0]))):
            raise ExpressionError("a function or a namespace is no text")
        return kind(*given)

    return text


def tokenize(text: str, sep: str = ",; ", skip_empty: bool = True) -> list[str]:
    """xacro.tokenize, whose separators are taken as they are, not as a regular expression."""
    found = re.split(f"[{re.escape(sep)}]", text)
    return [word for word in found if word] if skip_empty else found


#: Functions that cannot give more than they are given.
_PLAIN = (
    *(bool, int, float, complex, list, dict, tuple, set, frozenset, slice),
    *(abs, all, any, divmod, isinstance, issubclass, len, ord),
)
_FIXED: dict[Any, Callable[..., Any]] = {
    range: _range,
    round: _round,
    type: _kind,
    str: _words(str),
    repr: _words(repr),
    math.factorial: _small(math.factorial, MAX_FACTORIAL),
    math.comb: _small(math.comb, MAX_CHOICE),
    math.perm: _small(math.perm, MAX_CHOICE),
}
