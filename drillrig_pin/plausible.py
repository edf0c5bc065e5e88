"""Numbers that are possible but hardly meant: a bore of 80 m, oil of 1.6 Pa, a percussion of 2880 Hz.

Two tables are consulted, and both only advise: ``urdf/plausible.yaml`` holds wide ranges for every machine, a
``NAME.ranges.yaml`` beside the model narrow ones for its own arguments; the latter are held against what the user gave.
Where a customary unit would bring the number into its range, that unit is named.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from drillrig_pin.elements.cylinder import Cylinder
from drillrig_pin.errors import ModelError, Source
from drillrig_pin.files import shipped_folder
from drillrig_pin.model.inertias import extent
from drillrig_pin.model.problem import Problem
from drillrig_pin.model.ranges import read_ranges
from drillrig_pin.model.tree_text import child, inertial_numbers
from drillrig_pin.rig import Rig
from drillrig_pin.yamlfile import read_fields

#: Other units in which a quantity is customary: name and size in the unit of this package.
SLIPS: dict[str, tuple[tuple[str, float], ...]] = {
    "m": (("mm", 1e-3), ("cm", 1e-2), ("in", 0.0254), ("um", 1e-6)),
    "Pa": (("bar", 1e5), ("MPa", 1e6), ("GPa", 1e9), ("kPa", 1e3)),
    "N": (("kN", 1e3), ("MN", 1e6)),
    "N*m": (("kN*m", 1e3), ("N*mm", 1e-3)),
    "N/m": (("N/mm", 1e3), ("MN/m", 1e6), ("GN/m", 1e9)),
    "N*s/m": (("N*s/mm", 1e3), ("kN*s/mm", 1e6)),
    "Hz": (("per minute", 1 / 60), ("rad/s", 1 / (2 * math.pi))),
    "s": (("ms", 1e-3), ("us", 1e-6)),
    "kg": (("g", 1e-3), ("t", 1e3)),
    "m/s^2": (("mm/s^2", 1e-3),),
}


@dataclass(frozen=True, slots=True)
class Plausible:
    """A range in SI units; ``zero``: 0 stands for none and is fine."""

    low: float
    high: float
    unit: str
    source: str
    zero: bool = False

    def holds(self, value: float) -> bool:
        """Whether a value, by its size, lies in it."""
        size = abs(value)
        return (self.zero and size == 0) or self.low <= size <= self.high


@lru_cache(maxsize=1)
def plausible_ranges() -> dict[str, Plausible]:
    """The shipped ranges by ``ELEMENT.FIELD``."""
    rows = read_fields(shipped_folder() / "plausible.yaml", "a file of ranges")[0]
    return {
        name: Plausible(**{**row, "low": float(row["low"]), "high": float(row["high"])}) for name, row in rows.items()
    }


def meant(value: float, unit: str, low: float, high: float) -> str:
    """``did you mean 80 mm?`` if a customary unit brings ``value`` between ``low`` and ``high``, else nothing."""
    for name, size in SLIPS.get(unit, ()):
        if low <= abs(value) * size <= high:
            return f"did you mean {value:g} {name}?"
    return ""


def implausible(rig: Rig) -> list[Problem]:
    """Warnings about numbers of a rig, those the user gave first."""
    found = list(_given(rig))
    elements: tuple[Any, ...] = (*rig.forces, *rig.constraints)
    for element in elements:
        where = rig.sources.get(element.name, Source(rig.file.path))
        found += _fields(element, element.tag, f"<{element.tag} {element.name!r}>", where)
        if isinstance(element, Cylinder):
            found += _bore(element, where)
    found += _tree(rig)
    return list(dict.fromkeys(found))


def implausible_words(rig: Rig) -> list[str]:
    """The same in a sentence each, as notes of a run; at most ten."""
    words = [problem.message for problem in implausible(rig)]
    return words if len(words) <= 10 else [*words[:10], f"{len(words) - 10} more numbers are hardly meant: see check"]


def _given(rig: Rig) -> Iterator[Problem]:
    """Arguments of the user that lie outside the ranges of the model's own file."""
    given = rig.file.arguments
    if not given or not rig.file.files:
        return
    try:
        ranges = read_ranges(Path(rig.file.files[0]))
    except ModelError as error:
        where = error.where if isinstance(error.where, Source) else Source(str(error.where))
        yield Problem("warning", error.what, where, error.todo)
        return
    rows = rig.file.parameters()
    for name in given:
        row, known = rows.get(name), ranges.get(name)
        if row is None or known is None:
            continue
        try:
            value = float(row.value)
        except ValueError:
            continue
        if known.low <= value <= known.high:
            continue
        slip = meant(value, row.unit, known.low, known.high)
        yield Problem(
            "warning",
            f"{name} = {value:g} {row.unit}, sensible {known.low:g} to {known.high:g} {row.unit}"
            + (f": {slip}" if slip else ""),
            Source(rig.file.path),
            "" if slip else f"The range is {known.source}.",
        )


def _fields(part: BaseModel, tag: str, label: str, where: Source) -> Iterator[Problem]:
    """Fields of an element and of what stands inside it."""
    ranges = plausible_ranges()
    for field in type(part).model_fields:
        value: Any = getattr(part, field)
        known = ranges.get(f"{tag}.{field}")
        if known is not None and isinstance(value, int | float) and not known.holds(float(value)):
            yield _told(f"{label}: {field}", float(value), known, where)
        for inner in value if isinstance(value, tuple) else (value,):
            if isinstance(inner, BaseModel):
                yield from _fields(inner, getattr(inner, "tag", tag), label, where)


def _told(what: str, value: float, known: Plausible, where: Source) -> Problem:
    slip = meant(value, known.unit, max(known.low, 1e-300), known.high)
    return Problem(
        "warning",
        f"{what} = {value:g} {known.unit}, plausible {known.low:g} to {known.high:g} {known.unit}"
        + (f": {slip}" if slip else ""),
        where,
        "" if slip else f"The range is {known.source}.",
    )


def _bore(cylinder: Cylinder, where: Source) -> Iterator[Problem]:
    if cylinder.bore >= cylinder.length_retracted:
        yield Problem(
            "warning",
            f"<cylinder {cylinder.name!r}>: its bore of {cylinder.bore:g} m is not below its retracted length of "
            f"{cylinder.length_retracted:g} m",
            where,
            "Check their units.",
        )


def _tree(rig: Rig) -> Iterator[Problem]:
    """Masses and densities of links, places of joints and points, gravity."""
    ranges = plausible_ranges()
    lengths = {"point": ranges["point.xyz"], "gravity": ranges["gravity.xyz"]}
    for node in rig.file.elements():
        if node.tag in lengths:
            size = _longest(node.attributes)
            if not lengths[node.tag].holds(size):
                label = f"<{node.tag} {node.attributes['name']!r}>" if "name" in node.attributes else f"<{node.tag}>"
                yield _told(f"{label}: xyz", size, lengths[node.tag], node.source)
    for joint in rig.file.root.named("joint"):
        origin = child(joint, "origin")
        size = _longest(origin.attributes) if origin is not None else 0.0
        if not ranges["joint.xyz"].holds(size):
            label = f"joint {joint.attributes.get('name', '')!r}: its distance from the joint before"
            yield _told(label, size, ranges["joint.xyz"], joint.source)
    for link in rig.file.root.named("link"):
        inertial = child(link, "inertial")
        if inertial is None:
            continue
        mass = inertial_numbers(inertial)[0]
        label = f"link {link.attributes.get('name', '')!r}"
        if not ranges["link.mass"].holds(mass):
            yield _told(f"{label}: mass", mass, ranges["link.mass"], inertial.source)
            continue
        edges = extent(link)
        volume = math.prod(edges)
        if volume > 0 and mass > 0 and not ranges["link.density"].holds(mass / volume):
            box = " x ".join(f"{edge:.3g}" for edge in edges)
            yield _told(
                f"{label}: {mass:g} kg in a box of {box} m", mass / volume, ranges["link.density"], inertial.source
            )


def _longest(attributes: Mapping[str, str]) -> float:
    try:
        return max(abs(float(word)) for word in attributes.get("xyz", "0").split())
    except ValueError:
        return 0.0
