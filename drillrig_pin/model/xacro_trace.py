"""Where in the files xacro is while it expands a model, and what it grumbles about: xacro itself forgets both.

xacro offers no hook for this. For the duration of one expansion a few of its functions are wrapped; what they compute
stays the same.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.dom import minidom

from drillrig_pin.errors import ModelError, Source
from drillrig_pin.model.nodes import STAMP, read_stamp
from drillrig_pin.model.packages import find_package
from drillrig_pin.model.problem import Problem

#: Where a table of xacro keeps the places of its properties.
_PLACES = "_drillrig_places"


@dataclass
class Trace:
    """The state of one expansion.

    Attributes:
        place: the element being expanded.
        calls: macro calls that are under way, outermost first: name of the macro and where it is called.
        properties: properties whose value could not be computed, innermost first: name and where it is defined.
        macros: xacro's table of the macros that the last call could name.
        warnings: what xacro warned of.
    """

    place: Source | None = None
    calls: list[tuple[str, Source | None]] = field(default_factory=list)
    properties: list[tuple[str, Source | None]] = field(default_factory=list)
    macros: Any = None
    warnings: list[Problem] = field(default_factory=list)

    def known_macros(self) -> Iterator[str]:
        """Names of the macros that the last call could name."""
        macros = self.macros
        while isinstance(macros, dict):
            yield from macros
            macros = getattr(macros, "parent", None)

    def enter(self, element: minidom.Element, take: bool = False) -> None:
        """Go to an element; ``take``: xacro must not see the stamp, it takes it for a parameter."""
        stamp = element.getAttribute(STAMP)
        if stamp:
            self.place = read_stamp(stamp)
            if take:
                element.removeAttribute(STAMP)


@contextmanager
def tracing(xacro: Any, model: Path, packages: Mapping[str, str | Path]) -> Iterator[Trace]:
    """Follow one expansion; the caller sees to it that it is the only one."""
    from xacro import substitution_args

    trace = Trace()
    wrapped = {name: wrap(getattr(xacro, name), trace) for name, wrap in _WRAPPERS.items()}
    before = {name: getattr(xacro, name) for name in wrapped}
    methods = xacro.Table._setitem, xacro.Table._resolve_
    find, find_in_eval = substitution_args._eval_find, substitution_args._eval_dict["find"]

    def find_folder(name: str) -> str:
        # From the file that names it, which may be in another package than the model; then from the model.
        try:
            return str(find_package(name, (xacro.filestack or [model])[-1] or model, packages))
        except ModelError:
            return str(find_package(name, model, packages))

    try:
        for name, function in wrapped.items():
            setattr(xacro, name, function)
        xacro.Table._setitem, xacro.Table._resolve_ = _setitem(methods[0], trace), _resolve(methods[1], trace)
        substitution_args._eval_find = substitution_args._eval_dict["find"] = find_folder
        yield trace
    finally:
        for name, function in before.items():
            setattr(xacro, name, function)
        xacro.Table._setitem, xacro.Table._resolve_ = methods
        substitution_args._eval_find, substitution_args._eval_dict["find"] = find, find_in_eval


def _eval_all(original: Callable[..., Any], trace: Trace) -> Callable[..., Any]:
    def eval_all(node: minidom.Element, macros: Any, symbols: Any) -> None:
        before = trace.place
        trace.enter(node)
        original(node, macros, symbols)
        trace.place = before

    return eval_all


def _handle_macro_call(original: Callable[..., Any], trace: Trace) -> Callable[..., Any]:
    def handle_macro_call(node: minidom.Element, macros: Any, symbols: Any) -> bool:
        if not node.tagName.startswith("xacro:"):
            return False
        before, depth = trace.place, len(trace.calls)
        trace.enter(node, take=True)
        trace.macros = macros
        trace.calls.append((node.tagName.removeprefix("xacro:"), trace.place))
        original(node, macros, symbols)
        del trace.calls[depth:]
        trace.place = before
        return True

    return handle_macro_call


def _check_attrs(original: Callable[..., Any], trace: Trace) -> Callable[..., Any]:
    def check_attrs(tag: minidom.Element, required: Any, optional: Any) -> Any:
        trace.enter(tag, take=True)
        return original(tag, required, optional)

    return check_attrs


def _reqd_attrs(original: Callable[..., Any], trace: Trace) -> Callable[..., Any]:
    def reqd_attrs(tag: minidom.Element, attributes: Any) -> Any:
        trace.enter(tag)
        return original(tag, attributes)

    return reqd_attrs


def _warning(_original: Callable[..., Any], trace: Trace) -> Callable[..., Any]:
    def warning(*words: Any, **_: Any) -> None:
        sentence = " ".join(" ".join(map(str, words)).split()).rstrip(".")
        trace.warnings.append(Problem("warning", f"xacro says: {sentence}", trace.place or Source("<model>")))

    return warning


def _print_location(_original: Callable[..., Any], _trace: Trace) -> Callable[..., Any]:
    return lambda: None


def _setitem(original: Callable[..., Any], trace: Trace) -> Callable[..., Any]:
    def setitem(table: Any, key: str, value: Any, unevaluated: bool) -> None:
        table.__dict__.setdefault(_PLACES, {})[key] = trace.place
        original(table, key, value, unevaluated)

    return setitem


def _resolve(original: Callable[..., Any], trace: Trace) -> Callable[..., Any]:
    def resolve(table: Any, key: str) -> Any:
        if key not in table.unevaluated:
            return original(table, key)
        try:
            return original(table, key)
        except Exception:
            trace.properties.append((key, table.__dict__.get(_PLACES, {}).get(key)))
            raise

    return resolve


_WRAPPERS = {
    "eval_all": _eval_all,
    "handle_macro_call": _handle_macro_call,
    "check_attrs": _check_attrs,
    "reqd_attrs": _reqd_attrs,
    "warning": _warning,
    "print_location": _print_location,
}
