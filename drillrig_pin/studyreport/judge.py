"""Every case against the limits: is it good enough, and if not, why."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from drillrig_pin.analysis.quantities import label_of
from drillrig_pin.analysis.verdict import NEAR, Level
from drillrig_pin.batch.worker import COMPLETED
from drillrig_pin.studyreport.subject import Bound, StudySubject, finite
from drillrig_pin.words import quantity


@dataclass(frozen=True, slots=True)
class Judgement:
    """How one case stands: the level of its worst metric, and the metrics that make it so."""

    level: Level
    metrics: tuple[str, ...]


def against(value: float, bound: Bound) -> Level:
    """How a value stands to a limit; near is within the last fifth before a greatest value. No number keeps none."""
    if not (value >= bound.value if bound.least else value <= bound.value):
        return Level.BAD
    if not bound.least and bound.value > 0 and value > NEAR * bound.value:
        return Level.NEAR
    return Level.GOOD


def judge(row: Mapping[str, Any], bounds: Mapping[str, Bound]) -> Judgement:
    """A completed case against all limits that apply to it; one that did not complete is bad."""
    if row["status"] != COMPLETED:
        return Judgement(Level.BAD, ())
    levels = {
        metric: against(value, bound)
        for metric, bound in bounds.items()
        if (value := finite(row.get(metric))) is not None
    }
    for level in (Level.BAD, Level.NEAR, Level.GOOD):
        found = tuple(metric for metric, reached in levels.items() if reached is level)
        if found:
            return Judgement(level, () if level is Level.GOOD else found)
    return Judgement(Level.NOTE, ())


def judge_all(subject: StudySubject) -> dict[int, Judgement]:
    """Judgement of every case by its number."""
    table = subject.table
    return {case: judge(table.row(case), subject.bounds) for case in table.cases}


def broken(subject: StudySubject, judgements: Mapping[int, Judgement]) -> list[tuple[str, int, int, float]]:
    """Limits that cases break: metric, how many, the worst of them and its value; most often broken first."""
    found = []
    for metric, bound in subject.bounds.items():
        cases = [c for c, j in judgements.items() if j.level is Level.BAD and metric in j.metrics]
        if cases:
            choose = min if bound.least else max
            worst = choose(cases, key=lambda case: subject.table.row(case)[metric])
            found.append((metric, len(cases), worst, subject.table.row(worst)[metric]))
    return sorted(found, key=lambda item: -item[1])


def bound_words(metric: str, bound: Bound, unit: str) -> str:
    """A limit in words."""
    side = "at least" if bound.least else "at most"
    return f"{label_of(metric, unit)}: {side} {quantity(bound.value, unit)}{' (assumed)' if bound.assumed else ''}"
