"""Sheets of several runs laid over each other: one panel per curve, one colour per run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from drillrig_pin.figures.sheet import CYCLE, Curve, Panel, Sheet
from drillrig_pin.kinematics import Array

#: Sizes of the units that figures choose among, by the unit they are compared in.
UNITS = {
    "m": 1.0, "mm": 1e-3, "µm": 1e-6, "N": 1.0, "kN": 1e3, "N m": 1.0, "kN m": 1e3, "°": 1.0, "m°": 1e-3,
    "J": 1.0, "kJ": 1e3, "mJ": 1e-3,
}  # fmt: skip


def overlay(runs: Sequence[tuple[str, Sequence[Sheet]]]) -> list[Sheet]:
    """Lay the sheets of runs over each other.

    Args:
        runs: name and sheets of every run.

    Returns:
        The sheets that at least two runs have in common, with the panels at least two have in common, in the units of
        the first run.
    """
    names = list(dict.fromkeys(sheet.name for _, sheets in runs for sheet in sheets))
    found = []
    for name in names:
        having = [(i, run, sheet) for i, (run, sheets) in enumerate(runs) for sheet in sheets if sheet.name == name]
        if len(having) < 2:
            continue
        panels = _common(
            [(i, run, part) for i, run, sheet in having for panel in sheet.panels for part in _parts(panel)]
        )
        if panels:
            title = having[0][2].title
            found.append(replace(having[0][2], title=f"{title}, compared", panels=tuple(panels)))
    return found


def _parts(panel: Panel) -> list[Panel]:
    """A panel for each of its curves; the parts of one path stay together."""
    if panel.square:
        last = panel.curves[-1]
        return [replace(panel, curves=(last,), note="")]
    if len(panel.curves) == 1:
        return [replace(panel, note="")]
    return [
        replace(panel, key=f"{panel.key} {curve.name}", title=f"{panel.title}, {curve.name}", curves=(curve,), note="")
        for curve in panel.curves
    ]


def _common(parts: Sequence[tuple[int, str, Panel]]) -> list[Panel]:
    by_key: dict[str, list[tuple[int, str, Panel]]] = {}
    for part in parts:
        by_key.setdefault(part[2].key, []).append(part)
    return [_merged(group) for group in by_key.values() if len(group) > 1 and _comparable(group)]


def _comparable(group: Sequence[tuple[int, str, Panel]]) -> bool:
    first = group[0][2]
    return all(
        _ratio(panel.x_label, first.x_label) is not None and _ratio(panel.y_label, first.y_label) is not None
        for _, _, panel in group
    )


def _merged(group: Sequence[tuple[int, str, Panel]]) -> Panel:
    first = group[0][2]
    curves = []
    for i, run, panel in group:
        curve = panel.curves[0]
        x, y = (curve.x, curve.y) if not panel.bars else _outline(curve.x, curve.y, first.floor or 0.0)
        x = x * (_ratio(panel.x_label, first.x_label) or 1.0)
        y = y * (_ratio(panel.y_label, first.y_label) or 1.0)
        curves.append(Curve(run, x, y, CYCLE[i % len(CYCLE)], path=curve.path))
    floors = [panel.floor for _, _, panel in group if panel.floor is not None]
    ranges = [panel.x_range for _, _, panel in group if panel.x_range is not None]
    return replace(
        first,
        curves=tuple(curves),
        levels=tuple({(v.name, v.value): v for _, _, p in group for v in p.levels}.values()),
        marks=tuple({(v.name, v.x): v for _, _, p in group for v in p.marks}.values()),
        floor=min(floors) if floors else None,
        x_range=(min(low for low, _ in ranges), max(high for _, high in ranges)) if ranges else None,
        bars=False,
    )


def _outline(middles: Array, heights: Array, base: float) -> tuple[Array, Array]:
    """The outline of touching bars."""
    half = (middles[1] - middles[0]) / 2 if len(middles) > 1 else 0.5
    x = np.repeat(np.append(middles - half, middles[-1] + half), 2)
    y = np.concatenate([[base], np.repeat(np.maximum(heights, base), 2), [base]])
    return x, y


def _ratio(label: str, wanted: str) -> float | None:
    """Factor from the unit of one axis label to that of another; None if they measure different things."""
    if label == wanted:
        return 1.0
    words, _, unit = label.partition("[")
    wanted_words, _, wanted_unit = wanted.partition("[")
    own, other = unit.rstrip("]"), wanted_unit.rstrip("]")
    alike = own.lstrip("kmµ") == other.lstrip("kmµ") or {own, other} <= {"m", "mm", "µm"}
    if words != wanted_words or own not in UNITS or other not in UNITS or not alike:
        return None
    return UNITS[own] / UNITS[other]
