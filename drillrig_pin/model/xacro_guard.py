"""xacro without its ways out: expressions are evaluated here, elements counted, messages kept off the terminal.

xacro hands expressions to Python's ``eval`` after a look at the names of the outermost code; anything nested in them is
not seen. For the duration of one expansion what evaluates, and what may take for ever, is replaced.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any
from xml.dom import minidom

from drillrig_pin.model.budget import ELEMENT, Budget
from drillrig_pin.model.expression import Scope, evaluate
from drillrig_pin.model.expression_functions import Functions, tokenize

#: xacro's pattern of a parameter, with quantifiers that give nothing back: its own takes 2^n steps for n letters.
_WORD = r"""\$\{.*?\}|\$\(.*?\)|(?:'.*?'|\".*?\"|[^\s'\"]++)++|"""
_PARAMETER = re.compile(rf"^\s*([^\s:=]+?)\s*:?=\s*(\^\|?)?({_WORD})(?:\s+|$)(.*)")
#: Python's functions that $(eval ...) knows.
_IN_EVAL = (list, dict, map, str, float, int, bool, len, min, max, round, abs, sum, sorted, range, any, all, tuple)


@contextmanager
def guarding(xacro: Any) -> Iterator[Budget]:
    """Put the safe functions in place for one expansion; the caller sees to it that it is the only one.

    It must be entered after whatever else replaces functions of xacro.
    """
    from xacro import substitution_args

    budget = Budget()
    functions = _functions(xacro, budget)
    read, extend, all_of = xacro.eval_text, xacro.eval_extension, xacro.eval_all

    def safe_eval(text: str, names: Mapping[str, Any], _: Any = None) -> Any:
        return evaluate(text, Scope(names, functions))

    def in_eval(text: str, context: Mapping[str, Any]) -> str:
        return str(evaluate(text, Scope(_Arguments(substitution_args, functions, context), functions)))

    def eval_text(text: str, symbols: Any) -> Any:
        if "$" not in text:
            return text
        # xacro cuts what it has read off the text, piece by piece.
        budget.spend(len(text) // 10 + text.count("$") * (len(text) // 2000))
        found = read(text, symbols)
        return budget.text(found) if isinstance(found, str) else found

    def eval_all(node: minidom.Element, macros: Any, symbols: Any) -> None:
        # What has no parent is the fresh copy of a macro or a block.
        budget.spend(ELEMENT * (count(node) if node.parentNode is None else 1))
        all_of(node, macros, symbols)

    places: dict[str, Any] = {
        "safe_eval": safe_eval,
        "eval_text": eval_text,
        "eval_extension": lambda text: budget.text(extend(text)),
        "eval_all": eval_all,
        "re_macro_arg": _PARAMETER,
    }
    before = {name: getattr(xacro, name) for name in places}
    original, substitution_args._eval = substitution_args._eval, in_eval
    try:
        for name, function in places.items():
            setattr(xacro, name, function)
        yield budget
    finally:
        substitution_args._eval = original
        for name, function in before.items():
            setattr(xacro, name, function)


def count(element: minidom.Element) -> int:
    """Elements of a tree, the first one included."""
    return 1 + len(element.getElementsByTagName("*"))


def _functions(xacro: Any, budget: Budget) -> Functions:
    """What may be called in this expansion: that of every model, and xacro's own functions as they stand now."""
    visible = xacro._global_symbols
    own = visible["xacro"]
    functions = Functions(budget)

    def said(*words: Any, **_: Any) -> str:
        xacro.warning(*words)
        return ""

    def deprecated(name: str, function: Any) -> Callable[..., Any]:
        def call(*given: Any, **named: Any) -> Any:
            xacro.warning(f"Using {name}() directly is deprecated. Use python.{name}() instead.")
            return functions.call(function, given, named)

        return call

    for name in ("load_yaml", "abs_filename", "dotify", "arg", "fatal"):
        functions.allow(own[name])
        if name in visible:
            functions.allow(visible[name])
    for name in ("message", "warning", "error"):
        functions.allow(own[name], said)
    functions.allow(own["print_location"], lambda: "")
    functions.allow(own["tokenize"], tokenize)
    for name, function in (("sorted", sorted), ("range", range)):
        functions.allow(visible[name], deprecated(name, function))
    return functions


class _Arguments(Mapping[str, Any]):
    """Names within $(eval ...): its functions, numbers of ``math``, and the arguments as numbers where they are."""

    def __init__(self, module: Any, functions: Functions, context: Mapping[str, Any]) -> None:
        self._module, self._given = module, context.get("arg", {})
        known = {name: module._eval_dict[name] for name in ("env", "optenv", "find")}
        known |= {"arg": lambda name: module.convert_value(module._eval_arg(name, self._given), "auto")}
        known |= {"dirname": lambda: module._eval_dirname(context.get("filename"))}
        for function in known.values():
            functions.allow(function)
        constants = {"true": True, "false": False, "True": True, "False": False}
        numbers = {name: value for name, value in vars(math).items() if not name.startswith("_")}
        self._known = {function.__name__: function for function in _IN_EVAL} | constants | numbers | known

    def __getitem__(self, name: str) -> Any:
        return self._known[name] if name in self._known else self._module.convert_value(self._given[name], "auto")

    def __iter__(self) -> Iterator[str]:
        return iter({**self._known, **self._given})

    def __len__(self) -> int:
        return len({**self._known, **self._given})
