"""The rock face of a study with holes: where each hole is, how it fares, and which element its vibration comes from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from drillrig_pin.analysis.design import first_contact, relief_pressures
from drillrig_pin.analysis.forces import GAS_RELEASE
from drillrig_pin.analysis.quantities import meaning_of
from drillrig_pin.batch.again import Vector, base_model, hole_places
from drillrig_pin.batch.holes import across
from drillrig_pin.batch.table import StudyTable
from drillrig_pin.batch.worker import COMPLETED, INVALID, UNREACHABLE
from drillrig_pin.elements.cylinder import ATMOSPHERE
from drillrig_pin.model.modelfile import ModelFile

SHARE, HIGHEST, LOWEST = ".share", ".p_max", ".p_min"


@dataclass(frozen=True, slots=True)
class Pressure:
    """A chamber pressure beyond its limit, both absolute [Pa]."""

    cylinder: str
    value: float
    limit: float


@dataclass(frozen=True, slots=True)
class FaceHole:
    """One hole of the face and its worst case.

    Attributes:
        name: of the hole.
        place: in the world [m].
        right, up: on the face, seen from the machine [m].
        assumed: no source prints the position.
        case: number of its worst case, or of its first one if none completed.
        value: the metric there [SI]; None if no case completed.
        spread: least and greatest value over its cases.
        reason: why there is no value.
        reachable: the machine can aim at it.
        shares: of the elements in the vibration, the greatest first; empty where the study did not measure them.
        too_high, too_low: cylinder farthest above its relief pressure, or below gas release; None if none is.
    """

    name: str
    place: Vector
    right: float
    up: float
    assumed: bool
    case: int
    value: float | None
    spread: tuple[float, float] | None
    reason: str
    reachable: bool
    shares: dict[str, float]
    too_high: Pressure | None
    too_low: Pressure | None

    def leading(self, cylinders: frozenset[str]) -> tuple[str, float] | None:
        """The cylinder with the greatest share."""
        return next(((name, share) for name, share in self.shares.items() if name in cylinders), None)


@dataclass(frozen=True, slots=True)
class Face:
    """All holes of a study.

    Attributes:
        metric, unit: what is looked at.
        holes: in the order of the study.
        cylinders: names of the cylinders.
        several: a hole has more than one case; values are those of its worst.
    """

    metric: str
    unit: str
    holes: tuple[FaceHole, ...]
    cylinders: frozenset[str]
    several: bool

    @property
    def drilled(self) -> tuple[FaceHole, ...]:
        """Holes with a value, the worst first."""
        sign = -1.0 if worse_is_lower(self.metric) else 1.0
        return tuple(sorted((h for h in self.holes if h.value is not None), key=lambda h: -sign * (h.value or 0.0)))

    @property
    def elements(self) -> tuple[str, ...]:
        """Elements that have a share in a vibration, by their mean share, the greatest first."""
        names = dict.fromkeys(name for hole in self.holes for name in hole.shares)
        total = {name: sum(hole.shares.get(name, 0.0) for hole in self.holes) for name in names}
        return tuple(sorted(total, key=lambda name: -total[name]))


def worse_is_lower(metric: str) -> bool:
    """Whether little of a metric is bad."""
    meaning = meaning_of(metric)
    return meaning is not None and meaning.better == "higher"


def face_of(
    table: StudyTable, metric: str, file: ModelFile | None = None, places: Mapping[str, Vector] | None = None
) -> Face | None:
    """The face as one metric shows it; None for a study without holes or with none that can be placed.

    Args:
        table: the study.
        metric: by which the holes are judged; empty: none is.
        file: model of the base scenario, if it has been read already.
        places: of the holes, if they are known already.
    """
    if table.study.holes is None or "hole" not in table.inputs:
        return None
    file = file or base_model(table)
    places = hole_places(table, file) if places is None else places
    if not places:
        return None
    relief = {name: gauge + ATMOSPHERE for name, gauge in relief_pressures(file).items()} if file else {}
    right, up = face_axes(table, file)
    rows: dict[str, list[dict[str, Any]]] = {}
    for case in table.cases:
        row = table.row(case)
        rows.setdefault(row["hole"], []).append(row)
    holes = [
        _hole(name, places[name], (right, up), rows[name], metric, relief)
        for name in table.study.holes.places
        if name in places and name in rows
    ]
    cylinders = frozenset(n.removesuffix(HIGHEST) for n in table.metrics if n.endswith(HIGHEST)) | frozenset(relief)
    several = any(len(found) > 1 for found in rows.values())
    return Face(metric, table.units.get(metric, ""), tuple(holes), cylinders, several)


def face_axes(table: StudyTable, file: ModelFile | None) -> tuple[Any, Any]:
    """Unit vectors to the right and up on the face, seen along the drilling direction."""
    holes = table.study.holes
    direction = (holes.direction if holes else None) or (first_contact(file) if file else None) or (1.0, 0.0, 0.0)
    left, up = across(np.array(direction, dtype=float))
    return -left, up


def _hole(
    name: str,
    place: Vector,
    axes: tuple[Any, Any],
    rows: list[dict[str, Any]],
    metric: str,
    relief: Mapping[str, float],
) -> FaceHole:
    right, up = (float(axis @ np.array(place)) for axis in axes)
    sign = -1.0 if worse_is_lower(metric) else 1.0
    measured = [row for row in rows if row["status"] == COMPLETED and row.get(metric) is not None]
    assumed = bool(rows[0].get("hole.assumed"))
    void = [row for row in rows if row["status"] == INVALID]
    if void or not measured:
        # What a case that is not valid would have shown is not known: it may be the worst of its hole.
        first = (void or rows)[0]
        reachable = any(row["status"] != UNREACHABLE for row in rows)
        reason = first["reason"] or first["status"]
        return FaceHole(name, place, right, up, assumed, first["case"], None, None, reason, reachable, {}, None, None)
    worst = max(measured, key=lambda row: sign * row[metric])
    values = [row[metric] for row in measured]
    shares = {key.removesuffix(SHARE): v for key, v in worst.items() if key.endswith(SHARE) and v is not None}
    return FaceHole(
        name,
        place,
        right,
        up,
        assumed,
        worst["case"],
        worst[metric],
        (min(values), max(values)),
        "",
        True,
        dict(sorted(shares.items(), key=lambda item: -item[1])),
        _too_high(worst, relief),
        _too_low(worst),
    )


def _too_high(row: dict[str, Any], relief: Mapping[str, float]) -> Pressure | None:
    found = [
        Pressure(name, row[name + HIGHEST], limit)
        for name, limit in relief.items()
        if (row.get(name + HIGHEST) or 0.0) > limit
    ]
    return max(found, key=lambda p: p.value / p.limit, default=None)


def _too_low(row: dict[str, Any]) -> Pressure | None:
    found = [
        Pressure(key.removesuffix(LOWEST), value, GAS_RELEASE)
        for key, value in row.items()
        if key.endswith(LOWEST) and value is not None and value < GAS_RELEASE
    ]
    return min(found, key=lambda p: p.value, default=None)
