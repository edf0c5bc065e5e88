"""Files that a model names by a relative path: looked for beside the file that names them, wherever the program runs.

xacro looks beside the file it is expanding just then. That is another one where a macro or a property that waits for
its first use is written in an include. So every call that takes a path is told, when its file is parsed, which file it
is written in. The order of the search: beside that file; beside the files that led to it, the nearest first. A file
that is a link counts as standing at its link first, then where it really is.
"""

from __future__ import annotations

import glob
import os
import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from xml.dom import minidom

#: Attribute that tells, from parsing to reading, which file names a load table.
NAMED_IN = "drillrig-named-in"
#: Functions of xacro that take the path of a file.
_CALLS = re.compile(r"\b(load_yaml|abs_filename)\s*\((?=\s*[^\s)])")
_TOLD = re.compile(r"\b(load_yaml|abs_filename)\(\d+, ")
#: One of these stands in every file that names another.
_NAMING = (b"load_yaml", b"abs_filename", b"table", b"include")
_PLACES = ("load_yaml", "abs_filename")


def beside(name: str, files: Iterable[str]) -> str:
    """The path that ``name`` stands for, written in the first of ``files``; the place looked at first if none exists.

    Args:
        name: a path, or a pattern of paths (``*``, ``?``, ``[``).
        files: files beside which to look, the nearest first.
    """
    if os.path.isabs(name):
        return name
    tried = [os.path.join(folder, name) for folder in dict.fromkeys(way for file in files for way in folders(file))]
    there = (path for path in tried if os.path.exists(path) or (glob.has_magic(path) and glob.glob(path)))
    return next(there, tried[0] if tried else name)


def folders(file: str) -> tuple[str, ...]:
    """The folder a file stands in as it was named and, if the file is a link, the one it really stands in."""
    real = os.path.realpath(file)
    return tuple(dict.fromkeys((os.path.dirname(file), os.path.dirname(real))))


class Names:
    """Which file every path of one expansion is written in."""

    def __init__(self) -> None:
        self._files: list[str] = []

    def note(self, document: minidom.Document, file: str) -> None:
        """Write into a freshly parsed file where it stands, at all places that name a file."""
        here = len(self._files)
        self._files.append(file)
        raw = Path(file).read_bytes()
        if not any(word in raw for word in _NAMING):
            return
        told = rf"\g<1>({here}, "
        for element in document.getElementsByTagName("*"):
            if element.tagName == "xacro:include":
                _settle(element, file)
            elif element.tagName == "table" and element.hasAttribute("file"):
                element.setAttribute(NAMED_IN, file)
            for attribute in (element.attributes or {}).values():
                if _mentions(attribute.value):
                    attribute.value = _CALLS.sub(told, attribute.value)
            for child in element.childNodes:
                if child.nodeType == child.TEXT_NODE and _mentions(child.data):
                    child.data = _CALLS.sub(told, child.data)

    def files(self, here: int | None, stack: Iterable[str | None]) -> list[str]:
        """Files beside which a name is looked for: where it is written, then those being read, the last one first."""
        nearest = [] if here is None else [self._files[here]]
        return [*nearest, *(file for file in reversed(list(stack)) if file)]


def as_written(text: str) -> str:
    """A message of xacro without what :meth:`Names.note` put into the file's expressions."""
    return _TOLD.sub(r"\1(", text)


@contextmanager
def naming(xacro: Any) -> Iterator[Names]:
    """Let xacro look for files as this module says; the caller sees to it that one expansion at a time does."""
    names = Names()
    original = xacro.abs_filename_spec
    visible = xacro._global_symbols
    found = [(symbols, key) for symbols in (visible, visible["xacro"]) for key in _PLACES if key in symbols]
    before = [symbols[key] for symbols, key in found]

    def resolve(name: str, here: int | None = None) -> str:
        return beside(name, names.files(here, xacro.filestack or ()))

    def told(key: str, function: Any) -> Any:
        # Called under another name, a function is not told where.
        def abs_filename(here: Any, filename_spec: str | None = None) -> str:
            return resolve(here) if filename_spec is None else resolve(filename_spec, here)

        def load_yaml(here: Any, filename: str | None = None) -> Any:
            return function(abs_filename(here, filename))

        return load_yaml if key == "load_yaml" else abs_filename

    xacro.abs_filename_spec = resolve
    for (symbols, key), function in zip(found, before, strict=True):
        symbols[key] = told(key, function)
    try:
        yield names
    finally:
        xacro.abs_filename_spec = original
        for (symbols, key), function in zip(found, before, strict=True):
            symbols[key] = function


def _mentions(text: str) -> bool:
    return "$" in text and any(function in text for function in _PLACES)


def _settle(include: minidom.Element, file: str) -> None:
    """An include of a plain name is settled at once: in a macro it would be looked for beside the macro's caller."""
    name = include.getAttribute("filename")
    if name and "$" not in name and not os.path.isabs(name):
        path = beside(name, [file])
        if os.path.exists(path):
            include.setAttribute("filename", path)
