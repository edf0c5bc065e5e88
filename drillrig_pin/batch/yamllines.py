"""YAML that remembers on which line every entry stands."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

from drillrig_pin.errors import ScenarioError, Source
from drillrig_pin.model.nodes import short_path

MAX_BYTES = 10_000_000
MAX_DEPTH = 20

Path_ = tuple[str | int, ...]


class Lines:
    """Lines of a YAML file by the way to an entry, e.g. ``("axes", 0, "name")``."""

    def __init__(self, file: str, lines: dict[Path_, int]) -> None:
        self.file = file
        self._lines = lines

    def at(self, way: tuple[Any, ...]) -> Source:
        """The line of an entry, or of the nearest one that holds it; names that no entry has are skipped."""
        known: Path_ = ()
        for part in way:
            if (*known, part) in self._lines:
                known = (*known, part)
        return Source(self.file, self._lines.get(known, 0))

    def exactly(self, way: tuple[Any, ...]) -> Source | None:
        """The line of an entry; None if the file does not have it."""
        return Source(self.file, self._lines[way]) if way in self._lines else None


def read_yaml_lines(path: Path) -> tuple[dict[str, Any], Lines]:
    """The content of a YAML file that is a mapping, and its lines.

    Raises:
        ScenarioError: unreadable, not YAML (with its line), aliases, absurd nesting, or no mapping.
    """
    where = short_path(path)
    try:
        with path.open("rb") as stream:
            raw = stream.read(MAX_BYTES + 1)
        if len(raw) > MAX_BYTES:
            raise ScenarioError(f"the file is larger than {MAX_BYTES // 1_000_000} MB", where=where)
        text = raw.decode()
        _require_plain(text, where)
        root = yaml.compose(text, Loader=yaml.SafeLoader)
        content = yaml.safe_load(text)
    except OSError as error:
        raise ScenarioError(f"cannot be read ({error.strerror})", where=where, todo="Check the path.") from None
    except yaml.MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else 0
        raise ScenarioError(f"not readable as YAML ({error.problem})", where=Source(where, line)) from None
    except (yaml.YAMLError, UnicodeDecodeError, RecursionError, ValueError) as error:
        raise ScenarioError(f"not readable as YAML ({' '.join(str(error).split())})", where=where) from None
    if not isinstance(content, dict) or not all(isinstance(key, str) for key in content):
        raise ScenarioError("a study is a list of `field: value` lines", where=where)
    lines: dict[Path_, int] = {}
    _note(root, (), lines)
    return content, Lines(where, lines)


def _require_plain(text: str, where: str) -> None:
    depth = 0
    for event in yaml.parse(text, Loader=yaml.SafeLoader):
        line = event.start_mark.line + 1 if event.start_mark else 0
        if isinstance(event, yaml.AliasEvent):
            raise ScenarioError("aliases are not allowed", where=Source(where, line))
        depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
        if depth > MAX_DEPTH:
            raise ScenarioError(f"nested deeper than {MAX_DEPTH} levels", where=Source(where, line))


def _note(node: Any, way: Path_, lines: dict[Path_, int]) -> None:
    lines.setdefault(way, node.start_mark.line + 1)
    if isinstance(node, yaml.MappingNode):
        for key, value in node.value:
            inner = (*way, str(key.value))
            lines[inner] = key.start_mark.line + 1
            _note(value, inner, lines)
    elif isinstance(node, yaml.SequenceNode):
        for i, value in enumerate(node.value):
            _note(value, (*way, i), lines)
