"""Figures that say whether a run may be believed: constraint residuals and energy balance."""

from __future__ import annotations

import numpy as np

from drillrig_pin.figures.sheet import CYCLE, TIME, Curve, Ink, Panel, Sheet
from drillrig_pin.figures.subject import Subject, energy_unit
from drillrig_pin.kinematics import Array

#: Parts of a run of which the greatest residual is drawn.
STRETCHES = 200


def constraints(subject: Subject) -> Sheet | None:
    """Residuals of all constraint rows and their rates (paper: figure 18)."""
    run = subject.curves
    rows = run.labels["constraint"]
    if not rows:
        return None
    panels = []
    for key, variable, title, label in (
        ("error", "constraint_error", "Residual f(q)", "|f| [m]"),
        ("rate", "constraint_rate", "Its rate", "|df/dt| [m/s]"),
    ):
        curves = tuple(
            Curve(name, *_greatest(run.time, _magnitude(run.of(variable, name))), ink)
            for name, ink in zip(rows, _inks(len(rows)), strict=True)
        )
        panels.append(Panel(key, title, TIME, label, curves, log=True))
    caption = (
        "How far the held rows are from where they should be, and how fast they drift: the greatest magnitude in each "
        f"1/{STRETCHES} of the run. Rows that hold a rotation: 1 and 1/s. Exact zeros are drawn at 2e-18."
    )
    return Sheet("constraints", "Constraint residuals", caption, tuple(panels))


def energy(subject: Subject) -> Sheet | None:
    """Work, stored energies, and the residual of their balance."""
    run = subject.curves
    work = (("work in", run.work_input, Ink.BLUE), ("dissipated", run.work_dissipated, Ink.VERMILION))
    stored = tuple(
        (name, run.arrays[f"energy_{name}"] - run.arrays[f"energy_{name}"][0], ink)
        for name, ink in zip(("kinetic", "potential", "elastic"), CYCLE, strict=False)
    )
    panels = []
    for key, title, entries in (("work", "Work", work), ("stored", "Stored energy", stored)):
        unit, factor = energy_unit(*(values for _, values, _ in entries))
        curves = tuple(
            Curve(name, run.time, values * factor, ink, dashed=name == "dissipated") for name, values, ink in entries
        )
        panels.append(Panel(key, title, TIME, f"E [{unit}]", curves))
    residual = Curve("residual", run.time, np.maximum.accumulate(_magnitude(run.energy_residual)), Ink.INK)
    floor = float(residual.y[-1]) * 1e-6
    panels.append(Panel("residual", "Greatest residual so far", TIME, "|ΔE| [J]", (residual,), log=True, floor=floor))
    caption = (
        "Energy balance: work of the loads and losses, energies stored since the start, and what is left over in the "
        "books, which would be zero in an exact solution."
    )
    return Sheet("energy", "Energy balance", caption, tuple(panels))


def _greatest(time: Array, values: Array) -> tuple[Array, Array]:
    """Greatest value in each of ``STRETCHES`` parts of the run, at the middle of the part."""
    if len(time) <= 2 * STRETCHES:
        return time, values
    starts = np.linspace(0, len(time), STRETCHES, endpoint=False).astype(int)
    return time[starts + (len(time) // STRETCHES) // 2], np.maximum.reduceat(values, starts)


def _inks(count: int) -> list[Ink]:
    return [CYCLE[i % len(CYCLE)] for i in range(count)]


def _magnitude(values: Array) -> Array:
    """|values| for a logarithmic axis: exact zeros are drawn at a hundredth of the rounding of 1."""
    magnitude: Array = np.maximum(np.abs(values), np.finfo(float).eps / 100)
    return magnitude
