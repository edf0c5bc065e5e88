"""A model that comes from outside: read as plain text, held to bounds, and refused if it names any file."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from drillrig_pin.errors import ModelError, Source, shown
from drillrig_pin.model.modelfile import read_model_text
from drillrig_pin.model.nodes import Node, XmlBounds, parse_bytes, root_element, take_nodes
from drillrig_pin.service.settings import Limits

#: Attributes that name a file in URDF, SDF or this package's own elements.
FILES = frozenset({"file", "filename", "uri", "url", "href", "src"})
LONGEST_NAME = 100
#: Degrees of freedom of a joint by its type.
FREEDOM = {"fixed": 0, "planar": 3, "floating": 6}


def upload_facts(content: bytes, limits: Limits) -> dict[str, Any]:
    """Name and counts of an uploaded model.

    Raises:
        ModelError: not well-formed, not plain URDF, names a file, or is too large.
    """
    try:
        text = content.decode("utf-8")
    except UnicodeDecodeError:
        raise ModelError("the model is not text in UTF-8", where="upload") from None
    bounds = XmlBounds(size=limits.upload, attributes=limits.attributes, comments=limits.comments)
    # Nothing is read along with it: tables in files are refused before anybody would look for them.
    root = take_nodes(root_element(parse_bytes(content, "upload", bounds)))
    count = 0
    for node in _all(root):
        count += 1
        _require_plain(node)
    _require_few("XML elements", count, limits.nodes)
    links = sum(1 for _ in root.named("link"))
    joints = sum(1 for _ in root.named("joint"))
    elements = sum(len(block.children) for block in root.named("drillrig"))
    _require_few("links", links, limits.links)
    _require_few("joints", joints, limits.links)
    _require_few("elements", elements, limits.elements)
    freedom = sum(FREEDOM.get(joint.attributes.get("type", ""), 1) for joint in root.named("joint"))
    _require_few("degrees of freedom", freedom, limits.dofs)
    file = read_model_text(text, "upload")
    if not links:
        raise ModelError("the model has no link", where="upload", todo="Send a URDF file.")
    return {"name": file.name[:LONGEST_NAME], "links": links, "joints": joints, "elements": elements}


def _all(node: Node) -> Iterator[Node]:
    todo = [node]
    while todo:
        node = todo.pop()
        yield node
        todo += node.children


def _require_plain(node: Node) -> None:
    names = [node.tag, *node.attributes]
    if any(name.startswith("xacro:") for name in names):
        raise _refused(node, "uses xacro, which runs expressions", "Send what `drillrig expand MODEL` writes.")
    for name, value in node.attributes.items():
        if name.rpartition(":")[2].lower() in FILES:
            todo = "Draw it with box, cylinder and sphere, and write tables into the model."
            raise _refused(node, f"names a file ({name}={shown(value)}), and an upload stands alone", todo)
        if "://" in value and not name.startswith("xmlns"):
            raise _refused(node, f"names a place ({name}={shown(value)}), and an upload stands alone", "Remove it.")


def _refused(node: Node, why: str, todo: str) -> ModelError:
    return ModelError(f"the element <{node.tag[:60]}> {why}", where=Source("upload", node.source.line), todo=todo)


def _require_few(what: str, count: int, limit: int) -> None:
    if count > limit:
        raise ModelError(f"the model has {count} {what}, this server takes {limit}", where="upload")
