"""Run xacro on a model file, keeping file and line of every element and the list of legal arguments."""

from __future__ import annotations

import os
import threading
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from xml.dom import minidom

from drillrig_pin.errors import ModelError, legal_names
from drillrig_pin.model.nodes import parse_file, root_element, short_path

# xacro keeps its arguments and its stack of open files in module globals: one expansion at a time.
_XACRO = threading.Lock()


def expand(path: Path, arguments: Mapping[str, Any]) -> tuple[minidom.Document, frozenset[str]]:
    """Expand a ``.xacro`` file into a stamped DOM; a plain ``.urdf`` is only parsed.

    Args:
        path: the model file.
        arguments: xacro arguments by name; values are written as text, as on xacro's own command line.

    Returns:
        The expanded document and the names of all arguments the model declares.

    Raises:
        ModelError: unreadable or malformed file, unknown argument, or an error inside an expression.
    """
    if path.suffix != ".xacro":
        document = parse_file(path)
        if root_element(document).hasAttribute("xmlns:xacro"):
            raise ModelError(
                "a file that uses xacro must be named *.xacro", where=short_path(path), todo="Rename the file."
            )
        _refuse_unknown(arguments, frozenset(), path)
        return document, frozenset()
    return _run_xacro(path, arguments)


def _run_xacro(path: Path, arguments: Mapping[str, Any]) -> tuple[minidom.Document, frozenset[str]]:
    import xacro

    declared: set[str] = set()

    def stamped_parse(text: Any, filename: str | None = None) -> Any:
        if text is not None or filename is None:
            return text
        document = parse_file(os.path.join(xacro.root_dir, filename))
        declared.update(element.getAttribute("name") for element in document.getElementsByTagName("xacro:arg"))
        return document

    mappings = {name: _as_text(value) for name, value in arguments.items()}
    with _XACRO:
        # xacro offers no hook for line numbers: its parser is replaced for the duration of one expansion.
        original, xacro.parse = xacro.parse, stamped_parse
        try:
            document = xacro.process_file(str(path), mappings=mappings, verbosity=0)
        except ModelError:
            raise
        except RecursionError:
            raise ModelError("the xacro macros call each other without end", where=short_path(path)) from None
        except Exception as error:
            # An expression in the file may raise anything; all of it means that the file is at fault.
            place = " in ".join(short_path(file) for file in xacro.filestack or [] if file) or short_path(path)
            reason = " ".join(str(error).split()) or type(error).__name__
            # A model that stops with xacro.fatal has said what is wrong; the expression that says so adds nothing.
            reason = reason.split(" when evaluating expression 'xacro.fatal(")[0]
            raise ModelError(f"xacro cannot expand the model: {reason}", where=place) from None
        finally:
            xacro.parse = original
            xacro.filestack = None
    _refuse_unknown(arguments, frozenset(declared), path)
    return document, frozenset(declared)


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
