"""The numbers of a run by name, each with unit and which way is better, so that runs can be compared one by one."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

from drillrig_pin.analysis.fatigue import Rainflow
from drillrig_pin.analysis.hole_quality import HoleQuality
from drillrig_pin.analysis.metrics import Metrics
from drillrig_pin.words import measure_name

Better = Literal["lower", "higher", ""]

#: Groups in the order of their importance to a designer.
GROUPS = ("hole", "motion", "pressures", "contact", "load cycles", "forces", "joints", "frequencies", "trust", "cost")


@dataclass(frozen=True, slots=True)
class Quantity:
    """One number of a run.

    Attributes:
        key: the same in every run that has it.
        label: in words.
        group: one of ``GROUPS``.
        value, unit: SI.
        better: which way is better; empty where neither is.
        noise: changes below this mean nothing [unit].
    """

    key: str
    label: str
    group: str
    value: float
    unit: str
    better: Better = ""
    noise: float = 0.0


def quantities(metrics: Metrics, quality: HoleQuality | None, counts: Sequence[Rainflow]) -> dict[str, Quantity]:
    """All numbers of a run by key."""
    found = [*_hole(quality), *_motion(metrics), *_cylinders(metrics), *_reactions(metrics), *_cycles(counts)]
    found += [*_joints(metrics), *_frequencies(metrics), *_trust(metrics)]
    return {quantity.key: quantity for quantity in found}


def _hole(quality: HoleQuality | None) -> Iterator[Quantity]:
    for error in quality.errors if quality else ():
        name = measure_name(error.name)
        yield Quantity(f"hole.{error.name}.worst", f"{name}, at worst", "hole", error.worst, error.unit, "lower")
        yield Quantity(f"hole.{error.name}.static", f"{name}, static", "hole", error.static, error.unit, "lower")


def _motion(metrics: Metrics) -> Iterator[Quantity]:
    motion = metrics.survey
    if motion is None:
        return
    for axis in motion.axes:
        key, label = f"{motion.point}.{axis.axis}", f"{motion.point} along {axis.axis}"
        yield Quantity(f"{key}.peak_to_peak", f"{label}, peak to peak", "motion", axis.peak_to_peak, "m", "lower")
        yield Quantity(f"{key}.rms", f"{label}, RMS", "motion", axis.rms, "m", "lower")
    if motion.across is not None:
        across = f"{motion.point} across the hole"
        yield Quantity(f"{motion.point}.across.rms", f"{across}, RMS", "motion", motion.across.rms, "m", "lower")


def _cylinders(metrics: Metrics) -> Iterator[Quantity]:
    for c in metrics.cylinders:
        greatest, least = max(c.a_max, c.b_max), min(c.a_min, c.b_min)
        yield Quantity(
            f"{c.cylinder}.p_max", f"{c.cylinder}, highest pressure", "pressures", greatest, "Pa", "lower", 1e3
        )
        yield Quantity(f"{c.cylinder}.p_min", f"{c.cylinder}, lowest pressure", "pressures", least, "Pa", "higher", 1e3)
        span = c.force_max - c.force_min
        yield Quantity(f"{c.cylinder}.force_range", f"{c.cylinder}, range of force", "forces", span, "N", "lower", 1.0)


def _reactions(metrics: Metrics) -> Iterator[Quantity]:
    for r in metrics.reactions:
        if r.tension is not None:
            label = f"{r.name}, share of time lifted off"
            yield Quantity(f"{r.name}.tension", label, "contact", r.tension, "1", "lower", 1e-4)
        greatest = max(abs(r.least), abs(r.greatest))
        label = f"{r.name}, greatest {'moment' if r.unit == 'N m' else 'force'}"
        yield Quantity(f"{r.name}.greatest", label, "forces", greatest, r.unit, "lower", 1e-3)


def _cycles(counts: Sequence[Rainflow]) -> Iterator[Quantity]:
    for count in counts:
        key, label = f"{count.cylinder}.equivalent", f"{count.cylinder}, equivalent range (1 Hz)"
        yield Quantity(key, label, "load cycles", count.equivalent, "N", "lower", 1.0)


def _joints(metrics: Metrics) -> Iterator[Quantity]:
    for joint in metrics.joints:
        yield Quantity(f"{joint.joint}.range", f"{joint.joint}, range", "joints", joint.steady, joint.unit, "lower")


def _frequencies(metrics: Metrics) -> Iterator[Quantity]:
    found = metrics.frequencies
    if found is None or not found.lines:
        return
    strongest = found.lines[0].frequency
    yield Quantity("frequency.strongest", "strongest frequency", "frequencies", strongest, "Hz", "", found.bin)
    yield Quantity("frequency.slow", "share of 0–15 Hz", "frequencies", found.boom_share, "1", "", 1e-3)
    yield Quantity("frequency.fast", "share of 15–80 Hz", "frequencies", found.hammer_share, "1", "", 1e-3)


def _trust(metrics: Metrics) -> Iterator[Quantity]:
    trust = metrics.trust
    if trust.error is not None:
        yield Quantity("trust.error", "constraint error", "trust", trust.error, "", "lower", 1e-12)
    if trust.relative is not None:
        yield Quantity("trust.energy", "energy residual, relative", "trust", trust.relative, "", "lower", 1e-8)
    if trust.estimated is not None:
        yield Quantity(
            "trust.estimated", "estimated error of joint positions", "trust", trust.estimated, "", "lower", 1e-8
        )
    yield Quantity("cost.steps", "steps", "cost", float(trust.steps), "")
    yield Quantity("cost.wall_time", "wall time", "cost", trust.wall_time, "s")
