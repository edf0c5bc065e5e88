"""What is no finite number, or no number of a machine: refused before linear algebra sees it, and found in a run."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from drillrig_pin.errors import AssemblyError
from drillrig_pin.kinematics import Array

#: Beyond this a number of a run is none of a machine, in whatever unit: its square must still be a number.
LARGEST = 1e100
#: No part of a machine lies farther from the world's origin [m]: map coordinates have up to 1e7 m, and beyond this a
#: position is rounded by more than 1e-8 m, ...
FARTHEST = 1e8
#: ... nor moves away farther than this [m], nor does a joint turn farther [rad]: a drill string at 300 turns a minute
#: for a year.
STRAYED, TURNED = 1e6, 1e9

TODO = "Two points that an element joins may coincide, or a size, mass, stiffness or target be far too large or small."


def require_finite(*arrays: Array) -> None:
    """Raise AssemblyError if positions or forces of the machine at its start are no finite numbers."""
    if not all(np.isfinite(array).all() for array in arrays):
        raise AssemblyError("positions or forces of the machine at its start are no finite numbers", todo=TODO)


def require_named(values: dict[str, float], what: str) -> None:
    """Raise AssemblyError that names the first of some values at the start that is no number of a machine.

    Args:
        values: by name.
        what: they are, e.g. ``force``.
    """
    for name, value in values.items():
        if not abs(value) <= LARGEST:
            raise AssemblyError(f"the {what} of {name!r} at the start is {_told(value)}", todo=TODO)


def require_near(places: dict[str, Array]) -> None:
    """Raise AssemblyError that names the first of some points at the start that is absurdly far from the world.

    Args:
        places: positions in the world [m], by name.
    """
    for name, place in places.items():
        distance = float(np.abs(place).max())
        if not distance <= FARTHEST:
            raise AssemblyError(
                f"{name} lies {_told(distance)} m from the origin of the world: more than {FARTHEST:g} m",
                todo="Look at the origins of its joints and at the initial positions.",
            )


#: Arrays of all rows (n, ...) by what they are, each with the names of its columns.
Columns = dict[str, tuple[Array, tuple[str, ...]]]


def first_unsound(columns: Columns, bounds: dict[str, Array]) -> tuple[int, str] | None:
    """The first row of a run with a value that no machine has, and which value that is; None: all are sound.

    Args:
        columns: of the run.
        bounds: for some of them how far each column may lie from its first row [rad or m].
    """
    found = min(_first_of_each(columns, bounds), default=None)
    return None if found is None else (found[0], found[1])


def _first_of_each(columns: Columns, bounds: dict[str, Array]) -> Iterator[tuple[int, str]]:
    for what, (values, names) in columns.items():
        if not values.size:
            continue
        rows, bound = values.reshape(len(values), -1), bounds.get(what)
        if _sound(rows, bound):
            continue
        wrong = ~(np.abs(rows) <= LARGEST)
        if bound is not None:
            wrong |= ~(np.abs(rows - rows[:1]) <= bound)
        row = int(np.argmax(wrong.any(axis=1)))
        column = int(np.argmax(wrong[row]))
        value = float(rows[row, column])
        name = f" of {names[column]}" if names and names[column] else ""
        yield row, f"the {what}{name} is {_told(value)}"


def _sound(rows: Array, bound: Array | None) -> bool:
    """True if all values are numbers of a machine: a look at the extremes alone, NaN among them."""
    low, high = rows.min(axis=0), rows.max(axis=0)
    reach = np.maximum(np.abs(low), np.abs(high)) <= LARGEST
    if bound is not None:
        reach &= np.maximum(high - rows[0], rows[0] - low) <= bound
    return bool(reach.all())


def _told(value: float) -> str:
    return f"{value:.3g}" if np.isfinite(value) else "no finite number"
