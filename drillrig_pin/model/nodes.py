"""XML that remembers where it came from.

A model is written in several files and expanded by xacro, after which line numbers are gone. Every element is
therefore stamped with its file and line while it is parsed; xacro copies the stamp along with the element, and
:func:`take_nodes` removes it again and keeps it beside the element.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.dom import minidom
from xml.parsers.expat import ExpatError

from defusedxml.common import DefusedXmlException
from defusedxml.expatbuilder import DefusedExpatBuilderNS

from drillrig_pin.errors import ModelError, Source

STAMP = "drillrig-source"
MAX_BYTES = 20_000_000


@dataclass(frozen=True, slots=True)
class XmlBounds:
    """How much XML is read. What is beyond is refused where it begins, before it costs memory and time.

    Attributes:
        size: of the file [bytes].
        depth: elements within elements.
        elements: in all.
        attributes: of one element, declarations of namespaces counted. Readers of URDF look through all of them for
            each of them.
        comments: in all, processing instructions counted.
    """

    size: int = MAX_BYTES
    depth: int = 200
    elements: int = 50_000
    attributes: int = 1_000
    comments: int = 200_000


USUAL = XmlBounds()


@dataclass(frozen=True, slots=True)
class Node:
    """One element of the expanded file: tag, attributes as written, children, text and origin."""

    tag: str
    attributes: dict[str, str]
    children: tuple[Node, ...] = ()
    text: str = ""
    source: Source = field(default=Source("<model>"))

    def named(self, tag: str) -> Iterator[Node]:
        """Children with this tag, in file order."""
        return (child for child in self.children if child.tag == tag)


class _StampingBuilder(DefusedExpatBuilderNS):  # type: ignore[misc]
    """Builds a DOM whose plain elements carry ``file:line``; refuses DTDs, entities and what is beyond the bounds.

    Comments and processing instructions say nothing about a machine: they are counted, and not kept. Text is gathered
    between two elements and put together once: Python's own builder copies all of it for every piece that arrives.
    """

    def __init__(self, file: str, bounds: XmlBounds) -> None:
        super().__init__(forbid_dtd=True, forbid_entities=True, forbid_external=True)
        self._file, self._bounds = file, bounds
        self._depth = self._count = self._comments = 0
        self._text: list[str] = []
        self._size = f"nests deeper than {bounds.depth} elements or holds more than {bounds.elements}"

    def install(self, parser: Any) -> None:
        super().install(parser)
        # A CDATA section is text as well.
        parser.StartCdataSectionHandler = parser.EndCdataSectionHandler = None
        parser.CharacterDataHandler = self._text.append

    def start_element_handler(self, name: str, attributes: Any) -> None:
        self._depth += 1
        self._count += 1
        self._require(self._size, self._depth, self._bounds.depth)
        self._require(self._size, self._count, self._bounds.elements)
        count = len(attributes) // 2 + len(self._ns_ordered_prefixes)
        short = name.split(" ")[min(1, name.count(" "))][:60]
        self._require(f"holds an element <{short}> with more than {{}} attributes", count, self._bounds.attributes)
        self._put_text()
        super().start_element_handler(name, attributes)
        self.curNode.setAttribute(STAMP, f"{self._file}:{self.getParser().CurrentLineNumber}")

    def end_element_handler(self, name: str) -> None:
        self._depth -= 1
        self._put_text()
        super().end_element_handler(name)

    def comment_handler(self, data: str) -> None:
        self._comments += 1
        self._require("holds more than {} comments", self._comments, self._bounds.comments)

    def pi_handler(self, target: str, data: str) -> None:
        self.comment_handler(data)

    def _put_text(self) -> None:
        if self._text:
            self.curNode.appendChild(self.document.createTextNode("".join(self._text)))
            self._text.clear()

    def _require(self, sentence: str, count: int, bound: int) -> None:
        if count > bound:
            raise ModelError(
                f"the file {sentence.format(bound)}",
                where=Source(self._file, self.getParser().CurrentLineNumber),
                todo="Such a file is refused because it would take all memory or time.",
            )


def root_element(document: minidom.Document) -> minidom.Element:
    """The element that holds all others."""
    element = document.documentElement
    assert element is not None  # parse_bytes refuses a document without one
    return element


def parse_bytes(text: bytes, file: str, bounds: XmlBounds = USUAL) -> minidom.Document:
    """Parse XML bytes into a stamped DOM, without comments and processing instructions.

    Raises:
        ModelError: the bytes are not well-formed XML, are beyond the bounds, or hold a DTD or entity.
    """
    if len(text) > bounds.size:
        raise ModelError(f"the file is larger than {bounds.size / 1e6:g} MB", where=file)
    try:
        document = _StampingBuilder(file, bounds).parseString(text)
    except ExpatError as error:
        _refuse_other_encoding(text, file)
        raise ModelError(f"not well-formed XML ({error})", where=Source(file, error.lineno)) from None
    except DefusedXmlException:
        raise ModelError(
            "the file declares a DTD or an entity", where=file, todo="Remove it: a model needs neither."
        ) from None
    except (ValueError, UnicodeError, LookupError) as error:
        raise ModelError(f"not readable as XML ({error})", where=file) from None
    if document.documentElement is None:
        raise ModelError("the file holds no XML element", where=file)
    return document  # type: ignore[no-any-return]


def _refuse_other_encoding(text: bytes, file: str) -> None:
    """Say it in words if a file that cannot be read is not in the encoding it declares, or in none it declares."""
    if text.startswith((b"\xff\xfe", b"\xfe\xff")):
        return
    declared = re.match(rb"\s*<\?xml[^>]*encoding\s*=\s*[\"']([\w.\-]+)", text)
    encoding = declared[1].decode("ascii", "replace") if declared else "utf-8"
    try:
        text.decode(encoding)
    except UnicodeDecodeError as error:
        line = text.count(b"\n", 0, error.start) + 1
        said = f"declares {encoding}" if declared else "declares no encoding, which means UTF-8"
        raise ModelError(
            f"not readable as XML: the file {said}, but byte {text[error.start]:#04x} is none of it",
            where=Source(file, line),
            todo='Save the file as UTF-8, or let it begin with <?xml version="1.0" encoding="ISO-8859-1"?>.',
        ) from None
    except LookupError:
        return


def parse_file(path: str | os.PathLike[str]) -> minidom.Document:
    """Parse an XML file into a stamped DOM; errors as :func:`parse_bytes`."""
    try:
        with Path(path).open("rb") as stream:
            text = stream.read(MAX_BYTES + 1)
    except OSError as error:
        raise ModelError(
            f"cannot be read ({error.strerror})", where=str(path), todo="Check the path and its permissions."
        ) from None
    return parse_bytes(text, short_path(path))


def short_path(path: str | os.PathLike[str]) -> str:
    """The path as a person would type it: relative to the working directory if it lies below."""
    absolute = os.path.abspath(path)
    if os.pardir in Path(path).parts and os.path.realpath(path) != os.path.realpath(absolute):
        # After a link, `..` leads elsewhere than the letters of the path say.
        absolute = os.path.realpath(path)
    relative = os.path.relpath(absolute)
    return absolute if relative.startswith(os.pardir) else relative


def read_stamp(stamp: str) -> Source:
    """The place a stamp tells."""
    file, _, line = stamp.rpartition(":")
    return Source(file, int(line))


def take_nodes(element: minidom.Element) -> Node:
    """Turn a stamped DOM element into a :class:`Node`, removing the stamps from the DOM on the way."""
    stamp = element.getAttribute(STAMP)
    source = Source("<model>")
    if stamp:
        element.removeAttribute(STAMP)
        source = read_stamp(stamp)
    children = tuple(take_nodes(child) for child in element.childNodes if child.nodeType == child.ELEMENT_NODE)
    # A CDATA section is text as well.
    text = "".join(child.data for child in element.childNodes if isinstance(child, minidom.Text)).strip()
    return Node(element.tagName, dict(element.attributes.items()), children, text, source)
