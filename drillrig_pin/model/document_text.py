"""A model's document as text: one form, whatever was imported before.

The text is compared, hashed and kept in results. xacro replaces the writer of Python's DOM by its own when it is
imported, so the DOM would write a plain URDF file in one way before and in another after the first xacro model.
"""

from __future__ import annotations

from collections.abc import Iterator
from html import escape
from xml.dom import minidom

HEAD = '<?xml version="1.0"?>'
INDENT = "  "


def document_text(root: minidom.Element) -> str:
    """The element and all below it: an element a line, attributes in the order of their names, no empty line."""
    written = "\n".join((HEAD, *_lines(root, "")))
    return "\n".join(line for line in written.splitlines() if line.strip()) + "\n"


def escaped(text: str) -> str:
    """Text as it stands in XML, in an attribute too. (Python's own ``saxutils`` would import its network clients.)"""
    return escape(text, quote=False).replace('"', "&quot;")


def _lines(element: minidom.Element, indent: str) -> Iterator[str]:
    attributes = "".join(f' {name}="{escaped(value)}"' for name, value in sorted(element.attributes.items()))
    head = f"{indent}<{element.tagName}{attributes}"
    inside = [node for node in element.childNodes if isinstance(node, minidom.Element) or _said(node)]
    if not inside:
        yield f"{head}/>"
    elif len(inside) == 1 and _said(inside[0]):
        yield f"{head}>{_said(inside[0])}</{element.tagName}>"
    else:
        yield f"{head}>"
        for node in inside:
            if isinstance(node, minidom.Element):
                yield from _lines(node, indent + INDENT)
            else:
                yield f"{indent}{INDENT}{_said(node)}"
        yield f"{indent}</{element.tagName}>"


def _said(node: minidom.Node) -> str:
    """Text of a node as XML; empty for blanks and whatever is no text."""
    return escaped(node.data) if isinstance(node, minidom.Text) and node.data.strip() else ""
