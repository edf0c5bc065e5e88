"""YAML as every file of this package is written in: plain values, small, and with the line of every entry.

Aliases unfold into gigabytes, tags call constructors, nesting exhausts the stack: all three are refused before anything
is built. So is what YAML reads otherwise than its author meant: a field given twice (the first is lost), 012 (ten) and
1:30 (ninety). `on`, `off`, `yes` and `no` are words, as in YAML 1.2, not truth values.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any, ClassVar

from drillrig_pin.errors import ScenarioError, Source
from drillrig_pin.model.nodes import short_path

MAX_BYTES = 1_000_000
MAX_DEPTH = 20

#: Numbers that mean another one to YAML 1.1: with a leading zero to base 8, with colons to base 60.
_OCTAL = re.compile(r"[-+]?0[0-9_]+")
_BASE_60 = re.compile(r"[-+]?[0-9][0-9_]*(:[0-5]?[0-9])+(\.[0-9_]*)?")
_BOOL = "tag:yaml.org,2002:bool"
#: Words that YAML 1.1 takes for truth values.
_SWITCH = re.compile(r"on|off|yes|no", re.IGNORECASE)

#: Keys and positions that lead to an entry, e.g. ``("axes", 0, "name")``.
Way = tuple[str | int, ...]


class Lines:
    """Lines of a YAML file by the way to an entry."""

    def __init__(self, file: str, lines: dict[Way, int]) -> None:
        self.file = file
        self._lines = lines

    def at(self, way: tuple[Any, ...]) -> Source:
        """The line of an entry, or of the nearest one that holds it; names that no entry has are skipped."""
        known: Way = ()
        for part in way:
            if (*known, part) in self._lines:
                known = (*known, part)
        return Source(self.file, self._lines.get(known, 0))

    def exactly(self, way: tuple[Any, ...]) -> Source | None:
        """The line of an entry; None if the file does not have it."""
        return Source(self.file, self._lines[way]) if way in self._lines else None


def read_fields(path: Path, kind: str) -> tuple[dict[str, Any], Lines]:
    """The entries of a file of ``field: value`` lines, and where each of them stands; an empty file has none.

    Args:
        path: the file.
        kind: what it is, in words, e.g. ``a scenario``.

    Raises:
        ScenarioError: unreadable, too large, not plain YAML (with the line), or something else than fields.
    """
    where = short_path(path)
    text = _text(path, where, kind)
    content, root = parse(text, where)
    content = {} if content is None else content
    if not isinstance(content, dict) or not all(isinstance(key, str) for key in content):
        raise ScenarioError(f"{kind} is a list of `field: value` lines", where=where)
    return content, Lines(where, dict(_lines(root, ())) if root is not None else {})


def require_fields(fields: dict[str, Any], where: Path, kind: str) -> None:
    """ScenarioError if a file holds nothing: a save that failed, or the wrong file, must not stand for all defaults."""
    if not fields:
        todo = "Write at least one field; name: NAME is one."
        raise ScenarioError(f"{kind} that holds nothing is refused", where=short_path(where), todo=todo)


def require_plain(path: Path, kind: str) -> None:
    """Make sure that a file which another library reads is small, free of aliases and nests no deeper than others.

    Raises:
        ScenarioError: as :func:`read_fields`; tags are left to that library.
    """
    where = short_path(path)
    text = _text(path, where, kind)
    with _yaml_errors_told(where):
        _look_through(text, where, tags=True)


def parse(text: str, where: str) -> tuple[Any, Any]:
    """The value a text of YAML stands for, and its root node (None for an empty text).

    Raises:
        ScenarioError: not plain YAML, with the line.
    """
    with _yaml_errors_told(where):
        _look_through(text, where, tags=False)
        loader = _plain_reader()(text)
        try:
            root = loader.get_single_node()
            return (None if root is None else loader.construct_document(root)), root
        finally:
            loader.dispose()


def _text(path: Path, where: str, kind: str) -> str:
    try:
        with path.open("rb") as stream:
            raw = stream.read(MAX_BYTES + 1)
    except (OSError, ValueError) as error:
        # A path with a null character is a ValueError.
        reason = getattr(error, "strerror", None) or error
        raise ScenarioError(f"cannot be read ({reason})", where=where, todo="Check the path.") from None
    if len(raw) > MAX_BYTES:
        raise ScenarioError(f"{kind} larger than {MAX_BYTES // 1_000_000} MB is refused", where=where)
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise _unreadable(error, Source(where)) from None


def _reader() -> Any:
    """libyaml reads a megabyte in a second where the reader in Python takes half a minute."""
    import yaml

    return getattr(yaml, "CSafeLoader", yaml.SafeLoader)


@cache
def _plain_reader() -> Any:
    """The same, to which words are words: only `true` and `false` are truth values."""

    class Reader(_reader()):  # type: ignore[misc]
        yaml_implicit_resolvers: ClassVar[dict[Any, Any]] = {
            first: [(tag, pattern) for tag, pattern in found if tag != _BOOL]
            for first, found in _reader().yaml_implicit_resolvers.items()
        }

    Reader.add_implicit_resolver(_BOOL, re.compile(r"^(?:true|True|TRUE|false|False|FALSE)$"), list("tTfF"))
    return Reader


@contextmanager
def _yaml_errors_told(where: str) -> Iterator[None]:
    import yaml

    try:
        yield
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        raise _unreadable(error.problem or error.context, Source(where, mark.line + 1 if mark else 0)) from None
    except (yaml.YAMLError, ValueError, OverflowError, RecursionError) as error:
        raise _unreadable(error, Source(where)) from None


def _unreadable(reason: object, where: Source) -> ScenarioError:
    return ScenarioError(f"not readable as YAML ({' '.join(str(reason).split())[:200]})", where=where)


def _look_through(text: str, where: str, tags: bool) -> None:
    """Refuse aliases, absurd nesting and, unless ``tags``, tags; nothing is built of the text."""
    import yaml

    depth = 0
    keys = _Keys(where)
    for event in yaml.parse(text, Loader=_reader()):
        place = Source(where, event.start_mark.line + 1 if event.start_mark else 0)
        if isinstance(event, yaml.AliasEvent):
            raise _unreadable("aliases are not allowed", place)
        tag = getattr(event, "tag", None)
        if not tags and tag is not None:
            raise _unreadable(f"tags such as {tag} are not allowed", place)
        if isinstance(event, yaml.ScalarEvent) and event.implicit[0]:
            _require_meant(event.value, place, switches=tags)
        keys.see(event)
        depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
        if depth > MAX_DEPTH:
            raise _unreadable(f"nested deeper than {MAX_DEPTH} levels", place)


def _require_meant(word: str, place: Source, *, switches: bool) -> None:
    """Refuse a bare word that YAML 1.1 reads as another number; ``switches``: also one it reads as a truth value."""
    if _OCTAL.fullmatch(word):
        plain = word.replace("_", "").lstrip("+-0") or "0"
        raise _unreadable(f"{word} with a leading zero is another number to YAML: write {plain}, or quote it", place)
    if _BASE_60.fullmatch(word):
        raise _unreadable(f"{word} is a number to base 60 to YAML: write the number that is meant, or quote it", place)
    if switches and _SWITCH.fullmatch(word):
        raise _unreadable(f"{word} is a truth value to YAML: write true or false, or quote it", place)


class _Keys:
    """Fields of every mapping that is open while the events of a file pass by; one given twice is refused."""

    def __init__(self, where: str) -> None:
        self._where = where
        #: Of every open collection: the lines of its keys (None for a list), and whether a key comes next.
        self._open: list[tuple[dict[str, int] | None, bool]] = []

    def see(self, event: Any) -> None:
        """Take the next event; ScenarioError with both lines if it is a key that was there."""
        import yaml

        if isinstance(event, yaml.CollectionEndEvent):
            self._open.pop()
            return
        if not isinstance(event, yaml.NodeEvent):
            return
        if self._open:
            keys, is_key = self._open[-1]
            if keys is not None:
                self._open[-1] = (keys, not is_key)
            if keys is not None and is_key and isinstance(event, yaml.ScalarEvent):
                line = event.start_mark.line + 1 if event.start_mark else 0
                if event.value in keys:
                    first = f"first in line {keys[event.value]}"
                    raise _unreadable(f"{event.value!r} is given twice, {first}", Source(self._where, line))
                keys[event.value] = line
        if isinstance(event, yaml.CollectionStartEvent):
            self._open.append(({} if isinstance(event, yaml.MappingStartEvent) else None, True))


def _lines(node: Any, way: Way) -> Iterator[tuple[Way, int]]:
    """Way and line of a node and of all in it; the line of a field is that of its key."""
    if not way:
        yield way, node.start_mark.line + 1
    if node.id == "mapping":
        for key, value in node.value:
            inner = (*way, str(key.value))
            yield inner, key.start_mark.line + 1
            yield from _lines(value, inner)
    elif node.id == "sequence":
        for i, value in enumerate(node.value):
            yield (*way, i), value.start_mark.line + 1
            yield from _lines(value, (*way, i))
