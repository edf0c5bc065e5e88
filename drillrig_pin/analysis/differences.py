"""In what two questions differ: parameters and elements of the model, fields of the scenario, software."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from drillrig_pin.model.modelfile import ModelFile, read_model_text
from drillrig_pin.model.nodes import Node
from drillrig_pin.trajectory import Trajectory

#: Fields of a scenario that say where a case came from and how it is called, not what it is.
_ORIGIN = {"model", "arguments", "name", "text"}


@dataclass(frozen=True, slots=True)
class Difference:
    """One thing that is not the same in all runs.

    Attributes:
        kind: ``parameter``, ``model``, ``scenario`` or ``software``.
        name: of the parameter, the place in the model, the field.
        values: one per run; None where a run does not have it.
        unit: of a parameter.
        source: of a parameter, in the first run that has it.
    """

    kind: str
    name: str
    values: tuple[str | None, ...]
    unit: str = ""
    source: str = ""


def differences(runs: Sequence[Trajectory]) -> tuple[Difference, ...]:
    """Everything that differs between the runs, parameters first.

    Places of the expanded model are listed as well; most of them follow from a parameter.
    """
    files = [read_model_text(run.model) for run in runs]
    cases = [_filled(flat(run.scenario.model_dump(mode="json", exclude=_ORIGIN))) for run in runs]
    software = [{**run.made_with, "engine": run.engine, "method": run.method} for run in runs]
    return (
        *_parameters(files),
        *_unequal("model", [dict(_places(file.root, "")) for file in files]),
        *_unequal("scenario", cases),
        *_unequal("software", software),
    )


def flat(fields: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Nested fields by dotted name; an empty dictionary counts as a value."""
    found: dict[str, Any] = {}
    for name, value in fields.items():
        if isinstance(value, dict) and value:
            found |= flat(value, f"{prefix}{name}.")
        else:
            found[prefix + name] = value
    return found


def _filled(fields: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in fields.items() if value != {}}


def _parameters(files: Sequence[ModelFile]) -> Iterator[Difference]:
    tables = [file.parameters() for file in files]
    for name in dict.fromkeys(name for table in tables for name in table):
        rows = [table.get(name) for table in tables]
        values = tuple(row.value if row else None for row in rows)
        if len(set(values)) > 1:
            first = next(row for row in rows if row is not None)
            yield Difference("parameter", name, values, first.unit, first.source)


def _unequal(kind: str, tables: Sequence[Mapping[str, Any]]) -> Iterator[Difference]:
    for name in dict.fromkeys(name for table in tables for name in table):
        values = [table.get(name) for table in tables]
        if any(value != values[0] for value in values):
            yield Difference(kind, name, tuple(None if value is None else str(value) for value in values))


def _places(node: Node, path: str) -> Iterator[tuple[str, str]]:
    """Every attribute and text of the model below a node, by a path of tags and names; the parameter table left out."""
    counts: dict[str, int] = {}
    for name, value in node.attributes.items():
        if name != "name":
            yield f"{path} {name}".strip(), value
    if node.text.strip():
        yield f"{path} text".strip(), node.text.strip()
    for child in node.children:
        if child.tag == "parameter":
            continue
        own = child.attributes.get("name", "")
        label = f"{child.tag} {own}".strip()
        counts[label] = counts.get(label, 0) + 1
        if counts[label] > 1:
            label = f"{label} {counts[label]}"
        place = label if child.tag in ("drillrig", "robot") or not path or path == "drillrig" else f"{path} / {label}"
        yield from _places(child, place)
