"""What a report says about a run, gathered once; the template only arranges it."""

from __future__ import annotations

import datetime
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from drillrig_pin.analysis.fatigue import Rainflow, cylinder_rainflow
from drillrig_pin.analysis.hole_quality import HoleQuality, hole_quality
from drillrig_pin.analysis.limits import Limit, limited_depths
from drillrig_pin.analysis.metrics import Metrics, measure
from drillrig_pin.analysis.verdict import Finding, Level, findings, headline
from drillrig_pin.figures.sheet import Sheet
from drillrig_pin.figures.subject import Subject
from drillrig_pin.kinematics import Array
from drillrig_pin.model.modelfile import Parameter, read_model_text
from drillrig_pin.report.provenance import asks_the_same, command, scenario_rows
from drillrig_pin.trajectory import Trajectory, versions
from drillrig_pin.words import TENSION, measure_name, number, percent, quantity, reading


@dataclass(frozen=True, slots=True)
class Card:
    """One key number: a label, the value with its unit, and a few words below it."""

    label: str
    value: str
    note: str


@dataclass(frozen=True, slots=True)
class Content:
    """Everything on the page but the figures and the animation."""

    trajectory: Trajectory
    machine: str
    metrics: Metrics
    quality: HoleQuality | None
    aimed: bool
    limits: Mapping[str, Limit]
    verdict: tuple[Level, str]
    findings: tuple[Finding, ...]
    cards: tuple[Card, ...]
    counts: tuple[Rainflow, ...]
    parameters: tuple[Parameter, ...]
    scenario: list[tuple[str, str, bool, str]]
    command: str
    reproducible: bool | None
    versions: Mapping[str, str]
    made: str

    @property
    def assumed(self) -> int:
        """How many numbers of the model no source prints."""
        return sum(row.assumed for row in self.parameters)

    @property
    def newer(self) -> Mapping[str, str]:
        """Versions installed now, if they are not those that computed the run."""
        now = versions()
        return now if now != dict(self.versions) else {}

    @property
    def changed(self) -> tuple[Parameter, ...]:
        """Numbers that were given for this run."""
        return tuple(row for row in self.parameters if row.changed)

    @property
    def assumed_limits(self) -> int:
        """How many limits are shipped examples."""
        return sum(limit.assumed for limit in self.limits.values())


def gather(subject: Subject) -> Content:
    """Measure the run and judge it by its limits."""
    # The last samples of a run that diverged may be too large to be squared.
    with np.errstate(all="ignore"):
        return _gather(subject)


def _gather(subject: Subject) -> Content:
    run, design, limits = subject.trajectory, subject.design, subject.limits
    metrics = measure(run)
    quality = hole_quality(subject.window.record, design, subject.window.rows, limited_depths(limits), subject.hole)
    found = findings(metrics, design, quality, limits, run.outcome)
    file = read_model_text(run.model)
    return Content(
        run,
        file.name,
        metrics,
        quality,
        subject.hole is not None,
        limits,
        headline(found),
        found,
        tuple(cards(metrics, quality, limits)),
        cylinder_rainflow(subject.window.record, subject.window.rows),
        tuple(file.parameters().values()),
        scenario_rows(run.scenario),
        command(run),
        asks_the_same(run),
        run.made_with,
        datetime.datetime.now(datetime.UTC).strftime("%Y-%m-%d %H:%M UTC"),
    )


def cards(metrics: Metrics, quality: HoleQuality | None, limits: Mapping[str, Limit]) -> list[Card]:
    """The few numbers that a reader looks for first."""
    found = []
    if metrics.valid_until is not None:
        found.append(Card("Valid until", f"{number(metrics.valid_until, 4)} s", "do not use what comes after"))
    if quality is not None:
        for error in quality.errors:
            if error.name in ("angle", "toe_6m"):
                limit = limits.get(error.name)
                bound = f"limit {quantity(limit.value, error.unit)}" if limit else "no limit set"
                found.append(Card(measure_name(error.name), quantity(error.worst, error.unit), f"at worst; {bound}"))
    if metrics.survey is not None:
        widest = max(metrics.survey.axes, key=lambda axis: axis.peak_to_peak)
        label = f"Motion of {metrics.survey.point} along {widest.axis}"
        note = f"peak to peak; RMS {quantity(widest.rms, 'm')}"
        found.append(Card(label, quantity(widest.peak_to_peak, "m"), note))
    if metrics.frequencies is not None and metrics.frequencies.lines:
        line = metrics.frequencies.lines[0]
        found.append(Card("Strongest frequency", f"{number(line.frequency, 3)} Hz", f"{line.share:.0%} of the motion"))
    if metrics.cylinders:
        tight = max(metrics.cylinders, key=lambda c: max(c.a_max, c.b_max) / (c.relief or float("inf")))
        relief = f"; relief at {quantity(tight.relief, 'Pa')}" if tight.relief else ""
        found.append(Card("Highest pressure", quantity(max(tight.a_max, tight.b_max), "Pa"), tight.cylinder + relief))
    for contact in metrics.reactions:
        lifted = contact.lift_off
        if lifted is not None:
            note = f"least force; {percent(lifted.share)} of time off the face, {lifted.impacts} impacts"
            found.append(Card(f"Tip on the rock, {contact.name}", quantity(lifted.least, "N"), note))
    return found


def curve_table(sheet: Sheet) -> list[tuple[str, str, str, str, str]]:
    """Least, mean and greatest value of every curve, as the figure's alternative in words."""
    rows = []
    for panel in sheet.panels:
        unit = panel.y_label.partition("[")[2].rstrip("]") or panel.y_label
        for curve in panel.curves:
            name = panel.title if len(panel.curves) == 1 else f"{panel.title}: {curve.name}"
            least, mean, greatest = (number(value) for value in _range(curve.y))
            rows.append((name, least, mean, greatest, unit))
    return rows


def _range(values: Array) -> tuple[float, float, float]:
    finite = values[np.isfinite(values)]
    if not len(finite):
        return float("nan"), float("nan"), float("nan")
    return float(finite.min()), float(finite.mean()), float(finite.max())


def span(low: float, high: float, unit: str) -> str:
    """Two values in one unit: ``13.7 … 40.3 bar``."""
    name, factor = reading(unit, max(abs(low), abs(high)))
    mark = TENSION if unit == "Pa" and low < 0 else ""
    return f"{number(low * factor, 3)}{mark} … {number(high * factor, 3)} {name}"


def filters() -> dict[str, Any]:
    """What the template may call on a value."""
    return {"number": number, "quantity": quantity, "measure_name": measure_name}
