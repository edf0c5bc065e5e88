"""A model file, read: the expanded URDF text, the extension elements beside it, the parameters with their sources."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from xml.dom import minidom

from drillrig_pin.errors import ModelError, Source, legal_names
from drillrig_pin.files import MODEL_SUFFIXES, shipped_models
from drillrig_pin.model.beside import NAMED_IN, folders
from drillrig_pin.model.document_text import document_text, escaped
from drillrig_pin.model.expand import expand, refuse_xacro
from drillrig_pin.model.meshes import settle_meshes
from drillrig_pin.model.nodes import (
    MAX_BYTES,
    STAMP,
    Node,
    parse_bytes,
    read_stamp,
    root_element,
    short_path,
    take_nodes,
)
from drillrig_pin.model.problem import Problem

BLOCK = "drillrig"


@dataclass(frozen=True, slots=True)
class Parameter:
    """One number of the model: the value in force, its default, unit, source and meaning."""

    name: str
    value: str
    default: str
    unit: str
    source: str
    text: str

    @property
    def changed(self) -> bool:
        """True when the value in force was given by the user."""
        return self.value != self.default

    @property
    def assumed(self) -> bool:
        """True when the number is printed in no source: everybody who meets it is told so."""
        return not self.changed and self.source.startswith("assumed")


@dataclass(frozen=True, slots=True)
class ModelFile:
    """The immutable content of one design.

    Attributes:
        name: the robot's name.
        path: the file it came from, as a person would type it.
        text: the expanded, self-contained XML (no xacro, no other file needed).
        root: the same as nodes that know their file and line.
        arguments: the arguments the user gave.
        declared: all arguments the file takes.
        files: everything it was read from: the file itself, its includes, its tables of numbers.
        warnings: what was noticed while it was expanded.
        folder: where relative names of meshes count from; None: not known.
    """

    name: str
    path: str
    text: str
    root: Node
    arguments: dict[str, Any]
    declared: frozenset[str]
    files: tuple[Path, ...] = ()
    warnings: tuple[Problem, ...] = ()
    folder: Path | None = None

    def elements(self) -> Iterator[Node]:
        """The extension elements of all ``<drillrig>`` blocks, in file order."""
        for block in self.root.named(BLOCK):
            yield from block.children

    def parameters(self) -> dict[str, Parameter]:
        """The parameter table the file carries, by name."""
        keys = ("name", "value", "default", "unit", "source", "text")
        table = {}
        for node in self.elements():
            if node.tag == "parameter":
                row = Parameter(*(node.attributes.get(key, "") for key in keys))
                table[row.name] = row
        return table


def read_model(
    path_or_name: str | Path,
    arguments: Mapping[str, Any] | None = None,
    packages: Mapping[str, str | Path] | None = None,
) -> ModelFile:
    """Read a model by path or by the name of a shipped one.

    Args:
        path_or_name: path of a ``.xacro`` or ``.urdf`` file, or name of a shipped model.
        arguments: xacro arguments by name.
        packages: folders of the packages that ``$(find NAME)`` names, by name; others are searched for, see
            :func:`drillrig_pin.model.packages.find_package`.

    Raises:
        ModelError: no such model, malformed file, unknown argument, unreadable load table, package not found.
    """
    arguments = dict(arguments or {})
    path = find_model(path_or_name)
    expanded = expand(path, arguments, packages)
    root, text, read = _content(expanded.document, short_path(path), path.parent)
    return ModelFile(
        _name(root),
        short_path(path),
        text,
        root,
        arguments,
        expanded.declared,
        (*expanded.files, *read),
        expanded.warnings,
        path.parent.absolute(),
    )


def with_elements(file: ModelFile, nodes: Sequence[Node]) -> ModelFile:
    """The model with further extension elements that have no children, in a block of their own."""
    rows = []
    for node in nodes:
        attributes = [f'{name}="{escaped(value)}"' for name, value in node.attributes.items()]
        rows.append(f"    <{node.tag} {' '.join(attributes)}/>")
    head, end, tail = file.text.rpartition("</robot>")
    text = "\n".join([head.rstrip("\n"), f"  <{BLOCK}>", *rows, f"  </{BLOCK}>", end + tail])
    block = Node(BLOCK, {}, tuple(nodes), source=Source(file.path))
    return replace(file, text=text, root=replace(file.root, children=(*file.root.children, block)))


def read_model_text(text: str, name: str = "<text>", folder: Path | None = None) -> ModelFile:
    """Read a model from URDF text that needs no xacro, e.g. the one stored in a result file.

    Without a ``folder`` no file is read: a load table must stand in the text.
    """
    document = parse_bytes(text.encode(), name)
    refuse_xacro(document, "Send what `drillrig expand MODEL` writes.")
    root, text, read = _content(document, name, folder)
    return ModelFile(_name(root), name, text, root, {}, frozenset(), tuple(read), folder=folder)


def _name(root: Node) -> str:
    return root.attributes.get("name", "") or "robot"


def find_model(path_or_name: str | Path) -> Path:
    """The file a model name or path stands for; ModelError with the legal names if there is none."""
    path = Path(path_or_name)
    if path.suffix in (".xacro", ".urdf") or path.parent != Path():
        # Path.is_file raises where a name is too long; this says no.
        if not os.path.isfile(path):
            raise ModelError("no such model file", where=str(path), todo="Check the path.")
        return path
    models = shipped_models()
    if path.name in models:
        return models[path.name]
    if os.path.isfile(path):
        raise ModelError(f"a model file ends in {' or '.join(MODEL_SUFFIXES)}", where=str(path), todo="Rename it.")
    raise ModelError(
        f"no model named {path.name!r}",
        todo=legal_names(path.name, models, "models") + " A file of your own is given by its path.",
    )


def _content(document: minidom.Document, path: str, folder: Path | None) -> tuple[Node, str, list[Path]]:
    """The expanded model as nodes and as text, and the load tables read along with it."""
    element = root_element(document)
    if element.tagName != "robot":
        raise ModelError(f"the root element is <{element.tagName}>, not <robot>", where=path)
    read = [file for table in element.getElementsByTagName("table") if (file := _inline(table, document, folder))]
    if folder is not None:
        settle_meshes(element, folder)
    root = take_nodes(element)
    return root, document_text(element), read


def _inline(table: minidom.Element, document: minidom.Document, folder: Path | None) -> Path | None:
    """Put the text of a CSV file into the element that names it, so that the expanded model stands alone.

    It is looked for beside the file that names it, then beside the model file.

    Returns:
        The file, whether it was read now or its text stands there already; None if none is named.
    """
    name = table.getAttribute("file")
    near = folders(table.getAttribute(NAMED_IN)) if table.hasAttribute(NAMED_IN) else ()
    if near:
        table.removeAttribute(NAMED_IN)
    if not name:
        return None
    if folder is None:
        if table.firstChild is not None:
            return None
        raise ModelError(
            f"the load table {name!r} is a file, and this model is read without files",
            where=read_stamp(table.getAttribute(STAMP)),
            todo="Write its rows into the <table> element.",
        )
    places = list(dict.fromkeys([*map(Path, near), folder.absolute()]))
    path = next((path for place in places if os.path.isfile(path := place / name)), places[0] / name)
    if table.firstChild is not None:
        return path
    if not any(path.resolve().is_relative_to(place.resolve()) for place in places):
        # A model may come from anywhere; it must not be able to name any file of this machine.
        raise ModelError(
            f"the load table {name!r} lies outside the model's folder",
            where=short_path(folder),
            todo="Put it beside the file that names it.",
        )
    try:
        with path.open("rb") as stream:
            raw = stream.read(MAX_BYTES + 1)
        if len(raw) > MAX_BYTES:
            raise ModelError(f"the load table is larger than {MAX_BYTES // 1_000_000} MB", where=short_path(path))
        text = raw.decode()
    except OSError as error:
        raise ModelError(f"the load table cannot be read ({error.strerror})", where=short_path(path)) from None
    except UnicodeDecodeError:
        raise ModelError("the load table is not text in UTF-8", where=short_path(path)) from None
    table.appendChild(document.createTextNode("\n" + text.strip() + "\n"))
    return path
