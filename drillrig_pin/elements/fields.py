"""Attribute types of the grammar: numbers with a unit, names, vectors and axis lists written as text."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, StringConstraints

from drillrig_pin.series import LARGEST

#: Name of an element: a letter of any script or `_`, then letters, digits and `_ . - / :`.
Name = Annotated[str, StringConstraints(pattern=r"^[^\W\d][\w.\-/:]*$", max_length=100)]
#: Name of a link or joint: whatever the URDF part calls it.
TreeName = Annotated[str, StringConstraints(min_length=1, max_length=200)]


def sized(value: Any) -> Any:
    """A value whose numbers, within lists and tables too, are no larger than any machine has; ValueError otherwise."""
    if isinstance(value, dict | list | tuple):
        for item in value.values() if isinstance(value, dict) else value:
            sized(item)
    elif isinstance(value, int | float) and not abs(value) <= LARGEST:
        raise ValueError(f"is beyond {LARGEST:g}, larger than any number of a machine")
    return value


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
    largest = max(abs(c) for c in sized(value))
    if largest == 0.0:
        raise ValueError("the direction has no length")
    # Squares of very small numbers would vanish. A power of two rounds nothing.
    scale = math.ldexp(1.0, math.frexp(largest)[1])
    x, y, z = (c / scale for c in value)
    length = (x * x + y * y + z * z) ** 0.5
    return (x / length, y / length, z / length)


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
