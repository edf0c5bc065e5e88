"""What every axis does to a metric, averaged over all others."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from drillrig_pin.batch.worker import COMPLETED
from drillrig_pin.studyreport.subject import StudyAxis, StudySubject, finite

#: Up to so many different values an axis shows each; more are put together in so many groups of equal size.
SINGLE, GROUPS = 24, 8
#: The studentised range of that many means, exceeded once in 20 times.
RANGE = 4.29
#: A grid of two axes is drawn as one up to so many cells, where at least this part of them is there.
CELLS, FILLED = 10_000, 0.6


@dataclass(frozen=True, slots=True)
class Stage:
    """One value of an axis, or a range of them, and the metric over all cases that have it.

    Attributes:
        at: value, mean of a range, or position of a word.
        label: in words.
        count: completed cases.
        mean, deviation, least, greatest: of the metric [SI]; deviation is the standard deviation.
    """

    at: float
    label: str
    count: int
    mean: float
    deviation: float
    least: float
    greatest: float


@dataclass(frozen=True, slots=True)
class Effect:
    """What one axis does to a metric: its stages in order."""

    axis: StudyAxis
    stages: tuple[Stage, ...]
    grouped: bool

    @property
    def swing(self) -> float:
        """How far the mean of the metric moves along the axis: greatest less least mean [SI]."""
        means = [stage.mean for stage in self.stages]
        return max(means) - min(means) if means else 0.0

    @property
    def chance(self) -> float:
        """Swing that means of random samples reach without any effect, exceeded once in 20 times [SI]; 0 for a grid.

        The studentised range of GROUPS means times their standard error.
        """
        if not self.grouped:
            return 0.0
        return RANGE * float(np.mean([stage.deviation / math.sqrt(stage.count) for stage in self.stages]))

    @property
    def lowest(self) -> Stage:
        """Stage with the least mean."""
        return min(self.stages, key=lambda stage: stage.mean)

    @property
    def highest(self) -> Stage:
        """Stage with the greatest mean."""
        return max(self.stages, key=lambda stage: stage.mean)


def effects_of(subject: StudySubject, metric: str) -> tuple[Effect, ...]:
    """Effect of every axis on a metric, in the order of the study; axes without two stages are left out."""
    table = subject.table
    chosen = [
        (i, value)
        for i, (raw, status) in enumerate(zip(table.columns.get(metric, ()), table.columns["status"], strict=False))
        if status == COMPLETED and (value := finite(raw)) is not None
    ]
    found = []
    for axis in subject.axes:
        inputs = [table.columns[axis.name][i] for i, _ in chosen]
        effect = _effect(axis, inputs, np.array([value for _, value in chosen]))
        if len(effect.stages) > 1:
            found.append(effect)
    return tuple(found)


def _effect(axis: StudyAxis, inputs: Sequence[Any], values: Any) -> Effect:
    distinct = list(dict.fromkeys(inputs))
    if axis.words:
        groups = [
            (float(i), str(word), [k for k, v in enumerate(inputs) if v == word]) for i, word in enumerate(distinct)
        ]
        return Effect(axis, tuple(_stage(at, label, values[rows]) for at, label, rows in groups), False)
    x = np.array(inputs, dtype=float)
    if len(distinct) <= SINGLE:
        stages = [_stage(at, axis.shown(at), values[x == at]) for at in sorted(distinct)]
        return Effect(axis, tuple(stages), False)
    order = np.argsort(x, kind="stable")
    stages = []
    for rows in np.array_split(order, GROUPS):
        middle = float(np.exp(np.log(x[rows]).mean())) if axis.log else float(x[rows].mean())
        label = f"{axis.shown(float(x[rows].min()))} to {axis.shown(float(x[rows].max()))}"
        stages.append(_stage(middle, label, values[rows]))
    return Effect(axis, tuple(stages), True)


def _stage(at: float, label: str, values: Any) -> Stage:
    return Stage(
        at, label, len(values), float(values.mean()), float(values.std()), float(values.min()), float(values.max())
    )


def is_grid(subject: StudySubject) -> bool:
    """Whether two axes span the study as a grid that can be drawn cell by cell."""
    if len(subject.axes) != 2:
        return False
    cells = math.prod(axis.count for axis in subject.axes)
    return 4 <= cells <= CELLS and len(subject.table) >= FILLED * cells and len(subject.table) <= cells
