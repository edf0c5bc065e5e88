"""Attribute types of the grammar: numbers with a unit, names, vectors and axis lists written as text."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, StringConstraints

#: Name of an element: a letter of any script or `_`, then letters, digits and `_ . - / :`.
Name = Annotated[str, StringConstraints(pattern=r"^[^\W\d][\w.\-/:]*$", max_length=100)]
#: Name of a link or joint: whatever the URDF part calls it.
TreeName = Annotated[str, StringConstraints(min_length=1, max_length=200)]


def split(value: Any) -> Any:
    """Words of a text attribute; anything else unchanged."""
    return tuple(value.split()) if isinstance(value, str) else value


def _axes(value: Any) -> Any:
    axes = split(value)
    if isinstance(axes, tuple) and len(set(axes)) != len(axes):
        raise ValueError("an axis is given twice")
    return axes


Vector = Annotated[tuple[float, float, float], BeforeValidator(split)]


def _direction(value: tuple[float, float, float]) -> tuple[float, float, float]:
    length = sum(c * c for c in value) ** 0.5
    if length == 0.0:
        raise ValueError("the direction has no length")
    return (value[0] / length, value[1] / length, value[2] / length)


Axes = Annotated[tuple[Literal["x", "y", "z"], ...], BeforeValidator(_axes)]
AXIS = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


def _direction_text(value: Any) -> Any:
    vector = split(value)
    if isinstance(vector, tuple) and len(vector) == 3:
        return _direction(tuple(float(c) for c in vector))  # type: ignore[arg-type]
    return vector


Direction = Annotated[tuple[float, float, float], BeforeValidator(_direction_text)]


def quantity(unit: str, text: str, default: Any = ..., **bounds: Any) -> Any:
    """A field with its unit and meaning, from which GRAMMAR.md is written; bounds as pydantic's ge, gt, le, lt."""
    return Field(default, description=text, json_schema_extra={"unit": unit}, **bounds)


def reference(text: str, default: Any = ..., **options: Any) -> Any:
    """A field that names something or chooses a word; no unit."""
    return Field(default, description=text, json_schema_extra={"unit": ""}, **options)


Initial = Literal["initial"]


def initial_or(value: Any) -> Any:
    """Leave the word 'initial' alone, turn anything else into a number."""
    return value if value == "initial" else float(value)


InitialOrNumber = Annotated[Initial | float, BeforeValidator(initial_or)]
