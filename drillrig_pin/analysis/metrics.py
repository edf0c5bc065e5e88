"""Everything the end of a run reports, in one object: SI units, pressures absolute."""

from __future__ import annotations

from dataclasses import dataclass

from drillrig_pin.analysis.design import Design, design_of
from drillrig_pin.analysis.forces import (
    GAS_RELEASE,
    CylinderRange,
    ReactionRange,
    cylinder_ranges,
    reaction_ranges,
)
from drillrig_pin.analysis.hole_quality import HoleQuality, hole_quality
from drillrig_pin.analysis.motion import (
    JointRange,
    PointMotion,
    after,
    joint_ranges,
    point_motion,
    start_up,
    survey_point,
)
from drillrig_pin.analysis.spectra import (
    BOOM_BAND,
    HAMMER_BAND,
    Line,
    amplitude_spectrum,
    band_share,
    strongest_lines,
)
from drillrig_pin.analysis.trust import Trust, trust
from drillrig_pin.trajectory import AXES, Trajectory


@dataclass(frozen=True, slots=True)
class Frequencies:
    """Frequencies of the survey point: the strongest lines [Hz, m], shares of the two bands, width of one bin [Hz]."""

    lines: tuple[Line, ...]
    boom_share: float
    hammer_share: float
    bin: float


@dataclass(frozen=True, slots=True)
class Metrics:
    """Summary of one run.

    Attributes:
        start_up: length of the start-up transient left out of survey, frequencies and reactions [s].
        survey: motion of the survey point, or None if the run tracks no point.
        joints: range of every joint.
        frequencies: of the survey point; None if the run is too short.
        hole: errors of the hole, or None for a machine without a feed line.
        cylinders: extremes of every cylinder, whole run.
        reactions: constraint rows and contacts.
        trust: constraint errors, energy balance, cost.
        warnings: what a designer must not overlook, in words.
    """

    start_up: float
    survey: PointMotion | None
    joints: tuple[JointRange, ...]
    frequencies: Frequencies | None
    hole: HoleQuality | None
    cylinders: tuple[CylinderRange, ...]
    reactions: tuple[ReactionRange, ...]
    trust: Trust
    warnings: tuple[str, ...]


def measure(trajectory: Trajectory) -> Metrics:
    """Read a run. It needs at least one sample; sections without content come out empty or None."""
    design = design_of(trajectory)
    begin = start_up(trajectory, design)
    steady = after(trajectory, begin)
    point = survey_point(trajectory)
    hole = next(iter(design.contacts.values()), None)
    cylinders = cylinder_ranges(trajectory, design)
    reactions = reaction_ranges(trajectory, design, steady)
    trusted = trust(trajectory)
    return Metrics(
        begin,
        point_motion(trajectory, point, steady, hole) if point else None,
        joint_ranges(trajectory, design, steady),
        point_frequencies(trajectory, point, steady) if point else None,
        hole_quality(trajectory, design, steady),
        cylinders,
        reactions,
        trusted,
        (*_pressure_warnings(cylinders), *_lift_off(reactions, design), *trusted.doubts),
    )


def point_frequencies(trajectory: Trajectory, point: str, steady: slice, count: int = 5) -> Frequencies | None:
    """Strongest frequencies of a point's displacement, the three axes taken together."""
    u = trajectory.of("point_displacement", point)[steady]
    spectrum = amplitude_spectrum(trajectory.time[steady], u)
    if spectrum is None:
        return None
    return Frequencies(
        strongest_lines(spectrum, AXES, count),
        band_share(spectrum, *BOOM_BAND),
        band_share(spectrum, *HAMMER_BAND),
        spectrum.bin,
    )


def _pressure_warnings(cylinders: tuple[CylinderRange, ...]) -> list[str]:
    found = []
    for c in cylinders:
        for chamber, least, greatest in (("A", c.a_min, c.a_max), ("B", c.b_min, c.b_max)):
            if least < GAS_RELEASE:
                found.append(
                    f"{c.cylinder}: chamber {chamber} falls to {least / 1e5:.3g} bar absolute; below "
                    f"{GAS_RELEASE / 1e5:g} bar oil releases air and is softer than computed ({c.below:.1%} of time)"
                )
            if c.relief is not None and greatest > c.relief:
                found.append(
                    f"{c.cylinder}: chamber {chamber} rises to {greatest / 1e5:.4g} bar absolute; above "
                    f"{c.relief / 1e5:.4g} bar its relief valve opens ({c.above:.1%} of time)"
                )
    return found


def _lift_off(reactions: tuple[ReactionRange, ...], design: Design) -> list[str]:
    return [
        f"{r.name}: the rock pulls at the tip for {r.tension:.1%} of time, where a real tip lifts off"
        for r in reactions
        if r.tension and r.name in design.contacts
    ]
