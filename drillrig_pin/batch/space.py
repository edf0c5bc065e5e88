"""Designs of a study: which of its names are searched between bounds, and under which conditions every design is run.

Axes that give bounds are searched: ``range``, ``latin_hypercube``, ``sobol``, and the ranges of a ``grid``. Whatever
else is varied (``holes``, ``list``, ``zip``, lists of a ``grid``) is a condition: every design is run at all of them.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from drillrig_pin.batch.axes import (
    Bounds,
    GridAxis,
    LatinHypercubeAxis,
    ListAxis,
    Point,
    RangeAxis,
    SobolAxis,
    Span,
    size_of,
)
from drillrig_pin.batch.cases import Asker, Case
from drillrig_pin.batch.importance import Parameter
from drillrig_pin.batch.study import MAX_CASES, Study
from drillrig_pin.errors import ScenarioError

#: Significant digits of a design: what is printed is the number that was computed with.
DIGITS = 8

#: Values of everything that is searched, by name.
Design = dict[str, float]


@dataclass(frozen=True)
class Space:
    """A box of designs and the conditions each is run under.

    Attributes:
        bounds: of everything searched, by name.
        conditions: what a design is combined with; one empty point if it is a single case.
        others: the axes that make up the conditions.
    """

    bounds: dict[str, Bounds]
    conditions: list[Point]
    others: list[Any]

    def design(self, shares: Iterable[float]) -> Design:
        """The design at these shares, 0 to 1, of the way from each lower to each upper bound."""
        found = {}
        for (name, bound), share in zip(self.bounds.items(), shares, strict=True):
            value = float(f"{bound.at(float(share)):.{DIGITS}g}")
            found[name] = min(max(value, bound.low), bound.high)
        return found

    def shares(self, design: Mapping[str, float]) -> list[float]:
        """Where a design lies, 0 to 1 between the bounds of each name."""
        return [_share(bound, design[name]) for name, bound in self.bounds.items()]

    def inside(self, design: Mapping[str, float]) -> bool:
        """Whether a design lies between all bounds."""
        return all(bound.low <= design[name] <= bound.high for name, bound in self.bounds.items())

    def cases(self, asker: Asker, design: Design, first: int, tags: dict[str, int]) -> list[Case]:
        """Cases of one design, one for every condition, numbered from ``first`` on."""
        return [asker.case(first + i, {**design, **point}, tags) for i, point in enumerate(self.conditions)]


def space_of(study: Study) -> Space:
    """What a study searches, and under which conditions.

    Raises:
        ScenarioError: nothing in it has bounds, or there are too many conditions; with the line of its axes.
    """
    bounds: dict[str, Bounds] = {}
    others: list[Any] = []
    for axis in study.axes:
        if isinstance(axis, RangeAxis):
            _split({axis.name: axis.range}, bounds, others)
        elif isinstance(axis, GridAxis):
            _split(axis.grid, bounds, others)
        elif isinstance(axis, LatinHypercubeAxis | SobolAxis):
            bounds |= (axis.latin_hypercube if isinstance(axis, LatinHypercubeAxis) else axis.sobol).bounds
        else:
            others.append(axis)
    if not bounds:
        raise ScenarioError(
            "no axis gives bounds to search between",
            where=study.at("axes") or study.name,
            todo="Give one of kind range, latin_hypercube or sobol; holes, list and zip are run for every design.",
        )
    count = size_of(others)
    if count > MAX_CASES:
        raise ScenarioError(f"every design has {count} cases, more than {MAX_CASES}", where=study.at("axes"))
    points = [list(axis.points()) for axis in others]
    conditions = [{k: v for point in row for k, v in point.items()} for row in itertools.product(*points)]
    return Space(bounds, conditions, others)


def parameters(space: Space, asker: Asker) -> tuple[Parameter, ...]:
    """What is searched, with the units the model file gives."""
    rows = asker.file.parameters()
    found = []
    for name, bound in space.bounds.items():
        row = rows.get(name.removeprefix("model.")) if name.startswith("model.") else None
        about = (row.unit, row.text, row.assumed) if row else ()
        found.append(Parameter(name, bound.low, bound.high, bound.scale, *about))
    return tuple(found)


def default_design(space: Space, asker: Asker) -> Design | None:
    """The design the study starts from: values of its scenario and its model; None if one of them is no number."""
    found: Design = {}
    rows, fields = asker.file.parameters(), asker.base.model_dump()
    for name in space.bounds:
        kind, _, rest = name.partition(".")
        value: Any
        if kind == "model":
            value = asker.base.arguments.get(rest, rows[rest].default if rest in rows else None)
        else:
            value = _field(fields, rest)
        try:
            found[name] = float(value)
        except (TypeError, ValueError):
            return None
    return found


def _split(columns: Mapping[str, Any], bounds: dict[str, Bounds], others: list[Any]) -> None:
    for name, values in columns.items():
        if isinstance(values, Span) and values.start != values.stop:
            low, high = sorted((values.start, values.stop))
            bounds[name] = Bounds(low=low, high=high, scale=values.scale)
        else:
            listed = list(values.values()) if isinstance(values, Span) else values
            others.append(ListAxis(name=name, list=listed))


def _share(bound: Bounds, value: float) -> float:
    if bound.scale == "log":
        return math.log(value / bound.low) / math.log(bound.high / bound.low) if value > 0 else -math.inf
    return (value - bound.low) / (bound.high - bound.low)


def _field(fields: Any, name: str) -> Any:
    for part in name.split("."):
        if not isinstance(fields, dict) or part not in fields:
            return None
        fields = fields[part]
    return fields
