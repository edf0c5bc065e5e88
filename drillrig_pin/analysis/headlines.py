"""The handful of numbers by which two versions of a design are compared."""

from __future__ import annotations

from dataclasses import dataclass

from drillrig_pin.analysis.metrics import Metrics


@dataclass(frozen=True, slots=True)
class Headline:
    """One number.

    Attributes:
        name: what it is.
        value: in SI.
        unit: in which people read it.
        factor: from SI to that unit.
        less_is_better: True for a number a designer wants small; None where neither is better by itself.
    """

    name: str
    value: float
    unit: str
    factor: float
    less_is_better: bool | None = None

    @property
    def shown(self) -> float:
        """The value in the unit people read."""
        return self.value * self.factor


def headlines(metrics: Metrics) -> tuple[Headline, ...]:
    """What a designer looks at first after a change: vibration, its frequency, pressures, forces, the rock."""
    found: list[Headline] = []
    if metrics.valid_until is not None:
        found.append(Headline("NOT VALID from", metrics.valid_until, "s", 1.0))
    survey = metrics.survey
    if survey is not None:
        if survey.across is not None:
            found.append(Headline(f"{survey.point} across hole, RMS", survey.across.rms, "mm", 1e3, True))
            found.append(Headline(f"{survey.point} across hole, farthest", survey.across.farthest, "mm", 1e3, True))
        for axis in survey.axes:
            found.append(Headline(f"{survey.point} {axis.axis}, peak to peak", axis.peak_to_peak, "mm", 1e3, True))
    if metrics.frequencies is not None:
        for line in metrics.frequencies.lines[:1]:
            found.append(Headline("strongest frequency", line.frequency, "Hz", 1.0))
    if metrics.cylinders:
        forces = [max(abs(c.force_min), abs(c.force_max)) for c in metrics.cylinders]
        highest = max(max(c.a_max, c.b_max) for c in metrics.cylinders)
        lowest = min(min(c.a_min, c.b_min) for c in metrics.cylinders)
        found.append(Headline("largest cylinder force", max(forces), "kN", 1e-3, True))
        found.append(Headline("highest pressure (abs.)", highest, "bar", 1e-5, True))
        found.append(Headline("lowest pressure (abs.)", lowest, "bar", 1e-5, False))
    for reaction in metrics.reactions:
        if reaction.lift_off is not None:
            name, found_off = reaction.name, reaction.lift_off
            found.append(Headline(f"{name} off the face, of time", found_off.share, "%", 100.0, True))
            found.append(Headline(f"{name} impacts", float(found_off.impacts), "", 1.0, True))
    return tuple(found)
