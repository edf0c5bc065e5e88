"""Figures of forces: loads, chamber pressures, cylinder forces and their cycles, reactions."""

from __future__ import annotations

import numpy as np

from drillrig_pin.analysis.fatigue import cylinder_rainflow
from drillrig_pin.analysis.forces import GAS_RELEASE, is_rotation
from drillrig_pin.elements.cylinder import ATMOSPHERE
from drillrig_pin.figures.sheet import TIME, Curve, Ink, Level, Mark, Panel, Sheet
from drillrig_pin.figures.subject import Subject, force_unit


def loads(subject: Subject) -> Sheet | None:
    """Value of every load along its axis (paper: figure 9)."""
    run = subject.curves
    panels = []
    for name in run.labels["load"]:
        values = run.of("load_value", name)
        unit, factor = force_unit(values, moment=name in subject.design.torques)
        panels.append(Panel(name, name, TIME, f"{_symbol(unit)} [{unit}]", (Curve(name, run.time, values * factor),)))
    caption = "Loads of drilling along their axes, as the model gives them."
    return Sheet("loads", "Drilling loads", caption, tuple(panels)) if panels else None


def pressures(subject: Subject) -> Sheet | None:
    """Absolute pressure in both chambers of every cylinder, between gas release and relief."""
    run = subject.curves
    panels = []
    for name in run.labels["cylinder"]:
        curves = tuple(
            Curve(f"chamber {c.upper()}", run.time, (run.of(f"pressure_{c}", name) + ATMOSPHERE) / 1e5, ink)
            for c, ink in (("a", Ink.BLUE), ("b", Ink.VERMILION))
        )
        levels = [Level("gas release", GAS_RELEASE / 1e5)]
        if name in subject.design.relief:
            levels.append(Level("relief", (subject.design.relief[name] + ATMOSPHERE) / 1e5))
        if min(float(curve.y.min()) for curve in curves) < 0:
            levels.append(Level("zero: oil tears", 0.0))
        until = run.outcome.valid_until
        marks = () if until is None else (Mark("not valid from here", until),)
        panels.append(Panel(name, name, TIME, "p [bar abs.]", curves, tuple(levels), marks=marks))
    caption = (
        "Absolute pressure in the piston chamber A and the annulus chamber B. Dashed: relief pressure, and the "
        "pressure at which oil releases its air (1 bar)."
    )
    return Sheet("pressures", "Chamber pressures", caption, tuple(panels)) if panels else None


def cylinder_forces(subject: Subject) -> Sheet | None:
    """Force of every cylinder."""
    run = subject.curves
    panels = []
    for name in run.labels["cylinder"]:
        values = run.of("cylinder_force", name)
        unit, factor = force_unit(values)
        panels.append(Panel(name, name, TIME, f"F [{unit}]", (Curve(name, run.time, values * factor),)))
    caption = "Force of every cylinder; positive pushes the pins apart."
    return Sheet("cylinder_forces", "Cylinder forces", caption, tuple(panels)) if panels else None


def rainflow(subject: Subject) -> Sheet | None:
    """Rainflow cycles of every cylinder's force by range, per hour of drilling."""
    panels = []
    for count in cylinder_rainflow(subject.window.record, subject.window.rows):
        if count.largest <= 0 or count.duration <= 0:
            continue
        middles = np.array([(b.low + b.high) / 2 for b in count.bins])
        rates = np.array([count.per_hour(b.count) for b in count.bins])
        unit, factor = force_unit(middles)
        note = (
            f"largest {count.largest * factor:.3g} {unit}, typical {count.typical * factor:.3g} {unit}\n"
            f"damage of {count.equivalent * factor:.3g} {unit} once a second"
        )
        bars = (Curve(count.cylinder, middles * factor, rates),)
        panels.append(
            Panel(
                count.cylinder,
                count.cylinder,
                f"range [{unit}]",
                "cycles / h",
                bars,
                log=True,
                floor=100.0,
                bars=True,
                note=note,
            )
        )
    caption = (
        "Rainflow cycles (ASTM E1049) of the cylinder forces after the start-up, per hour of drilling. Typical: the "
        "range that does the same damage in as many cycles; once a second it takes a larger one. Damage ~ range³."
    )
    return Sheet("rainflow", "Load cycles of the cylinders", caption, tuple(panels), shared=False) if panels else None


def reaction(subject: Subject) -> Sheet | None:
    """Reactions of all constraint rows, and the forces of contacts along their axes into the rock."""
    run = subject.curves
    kinds = {name: subject.design.placed.get(name.rpartition(".")[0], "hold") for name in run.labels["constraint"]}
    titles = {name: f"{name} (within the loop)" if kind == "loop" else name for name, kind in kinds.items()}
    rows = [(name, title, run.of("reaction", name)) for name, title in titles.items()]
    contacts = [name for name in run.labels["element"] if name in subject.design.contacts]
    rows += [(name, f"{name} (above zero it pulls)", run.of("element_force", name)) for name in contacts]
    panels = []
    for name, title, values in rows:
        unit, factor = force_unit(values, moment=is_rotation(name))
        curve = Curve(name, run.time, values * factor)
        levels = (Level("lift-off", 0.0),) if name in contacts else ()
        panels.append(Panel(name, title, TIME, f"{_symbol(unit)} [{unit}]", (curve,), levels))
    caption = (
        "Force on the machine: of holds along the world axes, of contacts along their axis into the rock, where one "
        "above zero would have to pull; and within loops, force and moment on their second link."
    )
    return Sheet("reaction", "Reactions", caption, tuple(panels)) if panels else None


def _symbol(unit: str) -> str:
    return "M" if unit.endswith("N m") else "F"
