"""Run xacro on a model file, keeping file and line of every element and the list of legal arguments."""

from __future__ import annotations

import re
import threading
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from xml.dom import minidom

from drillrig_pin.errors import ModelError, legal_names
from drillrig_pin.model.beside import Names, as_written, naming
from drillrig_pin.model.nodes import parse_file, root_element, short_path
from drillrig_pin.model.xacro_memory import remembering

# xacro keeps its arguments and its stack of open files in module globals: one expansion at a time.
_XACRO = threading.Lock()


def expand(path: Path, arguments: Mapping[str, Any]) -> tuple[minidom.Document, frozenset[str], tuple[Path, ...]]:
    """Expand a ``.xacro`` file into a stamped DOM; a plain ``.urdf`` is only parsed.

    Args:
        path: the model file.
        arguments: xacro arguments by name; values are written as text, as on xacro's own command line.

    Returns:
        The expanded document, the names of all arguments the model declares, and all files it was read from.

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
        Names().note(document, str(path.absolute()))
        return document, frozenset(), (path,)
    return _run_xacro(path, arguments)


def _run_xacro(path: Path, arguments: Mapping[str, Any]) -> tuple[minidom.Document, frozenset[str], tuple[Path, ...]]:
    import xacro

    declared: set[str] = set()

    def stamped_parse(text: Any, filename: str | None = None) -> Any:
        if text is not None or filename is None:
            return text
        document = parse_file(filename)
        names.note(document, filename)
        declared.update(element.getAttribute("name") for element in document.getElementsByTagName("xacro:arg"))
        return document

    mappings = {name: _as_text(value) for name, value in arguments.items()}
    # The path a person gave is kept as it is: `..` after a link leads elsewhere once it is worked out in letters.
    path = path.absolute()
    with _XACRO, remembering(xacro), naming(xacro) as names:
        # xacro offers no hook for line numbers: its parser is replaced for the duration of one expansion.
        original, xacro.parse = xacro.parse, stamped_parse
        xacro.all_includes.clear()
        try:
            document = xacro.process_file(str(path), mappings=mappings, verbosity=0)
            files = tuple(dict.fromkeys(map(Path, (path, *xacro.all_includes))))
        except ModelError:
            raise
        except RecursionError:
            raise ModelError("the xacro macros call each other without end", where=short_path(path)) from None
        except Exception as error:
            # An expression in the file may raise anything; all of it means that the file is at fault.
            place = _place(
                [file for file in xacro.filestack or [] if file] or [str(path)],
                tuple(dict.fromkeys(map(Path, (path, *xacro.all_includes)))),
                words := as_written(str(error)),
            )
            reason = " ".join(words.split()) or type(error).__name__
            # A model that stops with xacro.fatal has said what is wrong; the expression that says so adds nothing.
            reason = re.split(r" when evaluating expression '(?=.*xacro\.fatal\()", reason)[0]
            raise ModelError(f"xacro cannot expand the model: {reason}", where=place) from None
        finally:
            xacro.parse = original
            xacro.filestack = None
    _refuse_unknown(arguments, frozenset(declared), path)
    return document, frozenset(declared), files


def _place(stack: list[str], files: tuple[Path, ...], reason: str) -> str:
    """Where an expansion failed, with the line if it can be told.

    xacro says which expression or macro failed, not where; its words are looked for in all files read so far, and where
    they stand exactly once, that is the place. A YAML reader says its file and line.
    """
    if told := re.search(r'in "(.+?)", line (\d+), column', reason):
        return f"{short_path(told[1])}:{told[2]}"
    words = re.search(r"expression '(.+)'", reason) or re.search(r"(xacro:[\w.]+)", reason)
    if words:
        found = [place for file in files for place in _lines_with(words[1], file)]
        if len(found) == 1:
            return found[0]
    return " in ".join(short_path(file) for file in stack)


def _lines_with(words: str, file: Path) -> list[str]:
    try:
        lines = file.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError):
        return []
    return [f"{short_path(file)}:{number}" for number, line in enumerate(lines, start=1) if words in line]


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
