"""Run xacro on a model file, keeping file and line of every element and the list of legal arguments."""

from __future__ import annotations

import errno
import os
import threading
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.dom import minidom

from drillrig_pin.errors import ModelError, Source, legal_names
from drillrig_pin.model.beside import Names, naming
from drillrig_pin.model.budget import ELEMENT
from drillrig_pin.model.nodes import STAMP, parse_file, read_stamp, root_element, short_path
from drillrig_pin.model.problem import Problem
from drillrig_pin.model.xacro_memory import remembering
from drillrig_pin.model.xacro_trace import tracing
from drillrig_pin.model.xacro_words import XACRO_TAGS, explain

# xacro keeps its arguments and its stack of open files in module globals: one expansion at a time.
_XACRO = threading.Lock()
#: Files that include one another, the one in the other.
MAX_INCLUDES = 30


@dataclass(frozen=True, slots=True)
class Expanded:
    """A model file without xacro.

    Attributes:
        document: the stamped DOM.
        declared: names of all arguments the model takes.
        files: everything it was read from.
        warnings: what xacro warned of.
    """

    document: minidom.Document
    declared: frozenset[str]
    files: tuple[Path, ...]
    warnings: tuple[Problem, ...] = ()


def expand(path: Path, arguments: Mapping[str, Any], packages: Mapping[str, str | Path] | None = None) -> Expanded:
    """Expand a ``.xacro`` file into a stamped DOM; a plain ``.urdf`` is only parsed.

    Args:
        path: the model file.
        arguments: xacro arguments by name; values are written as text, as on xacro's own command line.
        packages: folders of packages that ``$(find NAME)`` stands for, by name; others are searched for.

    Raises:
        ModelError: unreadable or malformed file, unknown argument, or an error inside an expression.
    """
    if path.suffix != ".xacro":
        document = parse_file(path)
        refuse_xacro(document, "A file that uses xacro must be named *.xacro: rename it.")
        _refuse_unknown(arguments, frozenset(), path)
        Names().note(document, str(path.absolute()))
        return Expanded(document, frozenset(), (path,))
    return _run_xacro(path, arguments, packages or {})


def refuse_xacro(document: minidom.Document, todo: str) -> None:
    """Refuse a document in which an element, attribute or expression of xacro is really used; its namespace is none.

    Raises:
        ModelError: with the line of the first one.
    """
    for element in (root_element(document), *root_element(document).getElementsByTagName("*")):
        used = [name for name in (element.tagName, *element.attributes.keys()) if name.startswith("xacro:")]
        if used:
            what = f"<{used[0]}>" if used[0] == element.tagName else f"the attribute {used[0]!r}"
            where = read_stamp(element.getAttribute(STAMP))
            raise ModelError(f"{what} needs xacro, and this file is read without", where=where, todo=todo)
        held = [name for name, text in element.attributes.items() if "${" in text or "$(" in text]
        if held:
            raise ModelError(
                f"<{element.tagName}> {held[0]} holds an expression of xacro, and this file is read without",
                where=read_stamp(element.getAttribute(STAMP)),
                todo=todo,
            )


def _run_xacro(path: Path, arguments: Mapping[str, Any], packages: Mapping[str, str | Path]) -> Expanded:
    import xacro

    from drillrig_pin.model.xacro_guard import count, guarding

    declared: set[str] = set()
    bare: dict[tuple[str, str], Source] = {}

    def stamped_parse(text: Any, filename: str | None = None) -> Any:
        if text is not None or filename is None:
            return text
        if not os.path.isfile(filename) and len(xacro.filestack) > 1:
            # As xacro's own parser does, so that an optional include may be missing.
            xacro.filestack.pop()
            raise xacro.XacroException(exc=FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), filename))
        if len(xacro.filestack) > MAX_INCLUDES:
            raise ModelError(f"{short_path(filename)} includes itself without end", where=trace.place)
        document = parse_file(filename)
        budget.spend(ELEMENT // 4 * count(root_element(document)))
        names.note(document, filename)
        for element in document.getElementsByTagName("*"):
            if element.tagName == "xacro:arg":
                declared.add(element.getAttribute("name"))
            elif element.tagName in XACRO_TAGS:
                bare[element.tagName, element.getAttribute("name")] = read_stamp(element.getAttribute(STAMP))
        return document

    mappings = {name: _as_text(value) for name, value in arguments.items()}
    # The path a person gave is kept as it is: `..` after a link leads elsewhere once it is worked out in letters.
    path = path.absolute()
    with (
        _XACRO,
        remembering(xacro),
        naming(xacro) as names,
        tracing(xacro, path, packages) as trace,
        guarding(xacro) as budget,
    ):
        # xacro offers no hook for line numbers: its parser is replaced for the duration of one expansion.
        original, xacro.parse = xacro.parse, stamped_parse
        xacro.all_includes.clear()
        try:
            document = xacro.process_file(str(path), mappings=mappings, verbosity=0)
            files = tuple(dict.fromkeys(map(Path, (path, *xacro.all_includes))))
        except ModelError as error:
            if error.where is None:
                error = ModelError(error.what, where=trace.place or short_path(path), todo=error.todo)
            raise error from None
        except Exception as error:
            # An expression in the file may raise anything; all of it means that the file is at fault.
            raise explain(error, trace, path, declared, bare) from None
        finally:
            xacro.parse = original
            xacro.filestack = None
    _refuse_unknown(arguments, frozenset(declared), path)
    return Expanded(document, frozenset(declared), files, tuple(trace.warnings))


def _as_text(value: Any) -> str:
    return repr(float(value)) if isinstance(value, float) else str(value)


def _refuse_unknown(arguments: Mapping[str, Any], declared: frozenset[str], path: Path) -> None:
    for name in arguments:
        if name not in declared:
            raise ModelError(
                f"the model has no argument {name!r}",
                where=short_path(path),
                todo=legal_names(name, declared, "arguments"),
            )
