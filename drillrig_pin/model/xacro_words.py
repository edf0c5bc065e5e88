"""What went wrong while xacro expanded a model, in one sentence with file and line."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from drillrig_pin.errors import ModelError, Source, legal_names
from drillrig_pin.model.beside import as_written
from drillrig_pin.model.nodes import short_path
from drillrig_pin.model.xacro_trace import Trace

#: Elements of xacro that old files write without its prefix, which xacro takes for plain elements.
XACRO_TAGS = frozenset(
    ("arg", "attribute", "call", "element", "if", "include", "insert_block", "macro", "property", "unless")
)


def explain(
    error: Exception, trace: Trace, path: Path, declared: set[str], bare: Mapping[tuple[str, str], Source]
) -> ModelError:
    """The failure of an expansion as the error of the model.

    Args:
        error: what xacro raised.
        trace: where it was.
        path: the model file.
        declared: arguments declared so far.
        bare: where elements of xacro stand without their prefix, by tag and name.
    """
    root, expression = _root(error)
    where: Any = next((place for _, place in trace.properties if place is not None), None) or trace.place
    where = where or short_path(path)
    if isinstance(root, ModelError):
        return ModelError(root.what, where=root.where if root.where is not None else where, todo=root.todo)
    if isinstance(root, RecursionError):
        what = "the xacro macros call each other without end" if trace.calls else "the model nests without end"
        return ModelError(what + _called_from(trace, inner=True), where=where)
    call = _about_a_call(error, root, trace)
    if call is not None:
        return ModelError(call[0] + _called_from(trace), where=where, todo=call[1])
    reason, todo = _reason(root, declared)
    if isinstance(root, NameError) and (name := re.search(r"name '(\w+)'", str(root))):
        stands = bare.get(("property", name[1])) or bare.get(("arg", name[1]))
        if stands is not None:
            reason = f"{reason}: at {stands} it lacks the prefix xacro:"
            todo = "Write xacro:property."
    if told := re.search(r'in "(.+?)", line (\d+), column', reason):
        where = Source(short_path(told[1]), int(told[2]))
    # A model that stops with xacro.fatal has said what is wrong; the expression that says so adds nothing.
    if expression and expression not in reason and "xacro.fatal(" not in expression:
        reason += f", in ${{{expression}}}"
    if trace.properties:
        reason += f" (value of the property {trace.properties[0][0]!r}, used at {trace.place})"
    reason += _called_from(trace, inner=True)
    return ModelError(f"xacro cannot expand the model: {reason}", where=where, todo=todo)


def _root(error: BaseException) -> tuple[BaseException, str]:
    """What was raised first, and the innermost expression it was raised in."""
    expression = ""
    while (inner := getattr(error, "exc", None)) is not None:
        if found := re.search(r"when evaluating expression '(.*)'", str(getattr(error, "suffix", "")), re.DOTALL):
            expression = as_written(" ".join(found[1].split()))
        error = inner
    return error, expression


def _reason(root: BaseException, declared: set[str]) -> tuple[str, str]:
    words = as_written(" ".join(str(root).split()).rstrip("."))
    kind = type(root).__name__
    if kind == "ArgException":
        return (
            f"the argument {words!r} is not declared",
            f'Write <xacro:arg name="{words}" default="..."/> above it. ' + legal_names(words, declared, "arguments"),
        )
    if variable := re.fullmatch(r"environment variable '(.*)' is not set", words):
        todo = f"Set it, or write $(optenv {variable[1]} VALUE)."
        return f"the environment variable {variable[1]!r} is not set", todo
    if isinstance(root, OSError) and root.filename is not None:
        return f"{short_path(str(root.filename))} cannot be read ({root.strerror})", "Check the path."
    if isinstance(root, KeyError):
        return f"there is no {words}", ""
    return words or kind, ""


def _about_a_call(error: Exception, root: BaseException, trace: Trace) -> tuple[str, str] | None:
    """A macro that is called wrongly: with its name and its parameters, which xacro's own words leave out."""
    words = str(root)
    if unknown := re.match(r"unknown macro name: xacro:(.*)", words):
        return f"no macro {unknown[1]!r}", legal_names(unknown[1], trace.known_macros(), "macros")
    macros = getattr(root, "macros", None) or getattr(error, "macros", None)
    if not macros:
        return None
    name, parameters = macros[0].body.getAttribute("name").removeprefix("xacro:"), list(macros[0].params)
    listed = f"It takes: {', '.join(parameters) or 'no parameter'}."
    if invalid := re.search(r'Invalid parameter "(.*?)"', words):
        return f"the macro {name!r} has no parameter {invalid[1]!r}", legal_names(invalid[1], parameters, "parameters")
    if missing := re.search(r"Undefined parameters \[(.*?)\]", words):
        given = ", ".join(map(repr, missing[1].split(",")))
        return f"the call of the macro {name!r} does not give {given}", listed
    if "Not enough blocks" in words:
        return f"the call of the macro {name!r} gives too few blocks", listed
    if unused := re.search(r'Unused block "(.*?)"', words):
        return f"the macro {name!r} takes no block <{unused[1]}>", listed
    return f"the macro {name!r} cannot be called: {' '.join(words.split())}", listed


def _called_from(trace: Trace, inner: bool = False) -> str:
    """The macros that were being expanded, innermost first; the last few of many."""
    calls = list(reversed(trace.calls if inner else trace.calls[:-1]))
    shown = "; ".join(f"in the macro {name!r} called at {place}" for name, place in calls[:3])
    return f" ({shown}{'; ...' if len(calls) > 3 else ''})" if shown else ""
