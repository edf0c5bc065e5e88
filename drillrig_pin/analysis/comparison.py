"""Runs beside each other: which number changed by how much, and in what the questions differ."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from drillrig_pin.analysis.design import design_of
from drillrig_pin.analysis.differences import Difference, differences
from drillrig_pin.analysis.fatigue import cylinder_rainflow
from drillrig_pin.analysis.hole_quality import hole_quality
from drillrig_pin.analysis.metrics import Metrics, measure
from drillrig_pin.analysis.quantities import GROUPS, Quantity, quantities
from drillrig_pin.analysis.window import window_of
from drillrig_pin.model.modelfile import read_model_text
from drillrig_pin.trajectory import Trajectory

#: Relative changes below this are no changes.
UNCHANGED = 1e-3


@dataclass(frozen=True, slots=True)
class Change:
    """One number of one run against the first run.

    Attributes:
        value: in this run [unit].
        absolute: value - reference [unit].
        relative: absolute / |reference|; None if that is zero.
        verdict: ``better``, ``worse``, ``other`` (changed, neither is better) or ``same``.
    """

    value: float
    absolute: float
    relative: float | None
    verdict: str


@dataclass(frozen=True, slots=True)
class Row:
    """One number in all runs: that of the first, and its changes in the others."""

    reference: Quantity
    changes: tuple[Change, ...]

    @property
    def changed(self) -> bool:
        """Whether any run differs from the first."""
        return any(change.verdict != "same" for change in self.changes)

    @property
    def size(self) -> float:
        """Greatest relative change, infinite from zero."""
        return max(_size(change) for change in self.changes)


@dataclass(frozen=True, slots=True)
class Comparison:
    """Runs against the first of them.

    Attributes:
        machines: name of the machine of every run.
        rows: numbers all runs have, the most important first: by group, then by the size of the change.
        missing: labels of the numbers that not all runs have.
        differences: in what the questions differ.
        cautions: what the reader must know before comparing.
    """

    machines: tuple[str, ...]
    rows: tuple[Row, ...]
    missing: tuple[str, ...]
    differences: tuple[Difference, ...]
    cautions: tuple[str, ...]


def compare_runs(runs: Sequence[Trajectory]) -> Comparison:
    """Compare two or more runs of at least two samples each with the first of them."""
    measured = [_measured(run) for run in runs]
    tables = [table for _, table in measured]
    first, others = tables[0], tables[1:]
    # Rows that cannot show the loads miss peaks, and a run that is not valid shows another machine: nothing that they
    # make smaller is better.
    shown = [metrics.sampling.enough and not metrics.invalid for metrics, _ in measured]
    rows = [
        Row(
            quantity,
            tuple(
                _change(quantity, table[key], judged=shown[0] and enough)
                for table, enough in zip(others, shown[1:], strict=True)
            ),
        )
        for key, quantity in first.items()
        if all(key in table and table[key].unit == quantity.unit for table in others)
    ]
    changed = any(row.changed for row in rows)
    rows.sort(key=lambda row: (not row.changed, GROUPS.index(row.reference.group), -row.size))
    shared = {row.reference.key for row in rows}
    missing = {q.key: q.label for table in tables for q in table.values() if q.key not in shared}
    machines = tuple(read_model_text(run.model).name for run in runs)
    return Comparison(
        machines,
        tuple(rows),
        tuple(missing.values()),
        differences(runs),
        (*_cautions(runs, machines, missing), *_doubts([m for m, _ in measured], changed=changed)),
    )


def _measured(run: Trajectory) -> tuple[Metrics, dict[str, Quantity]]:
    # The last samples of a run that diverged may be too large to be squared.
    with np.errstate(all="ignore"):
        metrics, window = measure(run), window_of(run)
        record, rows = window.record, window.rows
        quality = hole_quality(record, design_of(run), rows)
        return metrics, quantities(metrics, quality, cylinder_rainflow(record, rows))


def _change(reference: Quantity, other: Quantity, *, judged: bool = True) -> Change:
    absolute = other.value - reference.value
    relative = absolute / abs(reference.value) if reference.value else None
    noise = max(UNCHANGED * abs(reference.value), reference.noise, other.noise)
    if math.isfinite(absolute) and abs(absolute) <= noise:
        verdict = "same"
    elif not reference.better or not judged or not math.isfinite(absolute):
        verdict = "other"
    else:
        verdict = "better" if (absolute < 0) == (reference.better == "lower") else "worse"
    return Change(other.value, absolute, relative, verdict)


def _size(change: Change) -> float:
    if change.verdict == "same":
        return 0.0
    return abs(change.relative) if change.relative is not None else math.inf


def _cautions(runs: Sequence[Trajectory], machines: Sequence[str], missing: dict[str, str]) -> list[str]:
    found = []
    if len(set(machines)) > 1:
        names = ", ".join(dict.fromkeys(machines))
        found.append(f"different machines ({names}): only numbers of the same name are compared")
    ends = {round(run.outcome.time, 9) for run in runs}
    if len(ends) > 1:
        found.append(
            f"runs of different length ({', '.join(f'{end:g} s' for end in sorted(ends))}): extremes grow with time"
        )
    for i, run in enumerate(runs):
        if not run.outcome.completed:
            found.append(f"run {i + 1} did not complete: {run.outcome}")
        elif run.outcome.invalid:
            found.append(f"run {i + 1} is {run.outcome.invalid}; no number is called better or worse")
    if missing:
        found.append(f"{len(missing)} numbers are not in all runs and cannot be compared")
    return found


def _doubts(measured: Sequence[Metrics], *, changed: bool) -> Iterator[str]:
    """What keeps the numbers of single runs from being what they are called, and their changes from being changes."""
    for i, metrics in enumerate(measured, 1):
        if changed and metrics.steadiness.words:
            yield f"run {i} is {metrics.steadiness.words}"
        if not metrics.sampling.enough:
            yield f"run {i}: {metrics.sampling.words}; its numbers are neither better nor worse"
        elif not metrics.stored.enough:
            yield f"run {i}: {metrics.stored.words}; its numbers do not depend on that, exported samples do"


def comparison_document(found: Comparison, names: Sequence[str]) -> dict[str, Any]:
    """A comparison as programs read it: SI units, pressures absolute; ``names`` are those of the runs."""
    return {
        "runs": list(names),
        "machines": found.machines,
        "units": "SI; pressures absolute",
        "cautions": found.cautions,
        "differences": found.differences,
        "changes": [
            {
                "key": row.reference.key,
                "label": row.reference.label,
                "group": row.reference.group,
                "unit": row.reference.unit,
                "better": row.reference.better,
                "reference": row.reference.value,
                "runs": row.changes,
            }
            for row in found.rows
        ],
        "not_in_all_runs": found.missing,
    }
