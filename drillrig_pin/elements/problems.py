"""Turn pydantic's findings about one file element into one sentence with file, line and the legal names."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, ValidationError

from drillrig_pin.errors import ModelError, legal_names, shown
from drillrig_pin.model.nodes import Node


def attribute_names(cls: type[BaseModel]) -> dict[str, Any]:
    """Attributes of an element as written in the file, without those that come from children."""
    children = {"terms", "samples", "header_units"}
    return {
        (field.alias or name): field
        for name, field in cls.model_fields.items()
        if name not in children and (field.json_schema_extra is not None or name == "name")
    }


def model_error(error: ValidationError, cls: type[BaseModel], node: Node) -> ModelError:
    """The first finding as a ModelError; further ones are counted."""
    findings = error.errors(include_url=False)
    # A misspelt attribute is found twice, as one too many and one too few; the word as written says more.
    first = next((finding for finding in findings if finding["type"] == "extra_forbidden"), findings[0])
    name = str(first["loc"][0]) if first["loc"] else ""
    label = f"<{node.tag}{' ' + repr(node.attributes['name']) if 'name' in node.attributes else ''}>"
    legal = attribute_names(cls)
    if first["type"] == "extra_forbidden":
        what, todo = f"{label} has no attribute {name!r}", legal_names(name, legal, "attributes")
    elif first["type"] == "missing" and len(first["loc"]) == 1:
        what, todo = f"{label} lacks the attribute {name!r}", legal_names(name, legal, "attributes")
    else:
        unit = (getattr(legal.get(name), "json_schema_extra", None) or {}).get("unit", "")
        given = shown(node.attributes.get(name, ""))
        message = first["msg"].removeprefix("Value error, ").removeprefix("Input ").rstrip(".")
        if first["type"] == "missing":
            message = "has too few values"
        what = f"{label} {name} = {given} {message}" + (f" [{unit}]" if unit else "")
        todo = ""
    if len(findings) > 1:
        todo = f"{todo} ({len(findings) - 1} more in this element.)".strip()
    return ModelError(what, where=node.source, todo=todo)
