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
from drillrig_pin.analysis.hole_quality import HoleQuality, feed_line, hole_axis, hole_quality, no_hole
from drillrig_pin.analysis.joint_limits import LimitPassed, limits_passed
from drillrig_pin.analysis.lift_off import LiftOff
from drillrig_pin.analysis.motion import JointRange, PointMotion, joint_ranges, point_motion, survey_point
from drillrig_pin.analysis.sampling import Sampling, record_sampling, stored_sampling
from drillrig_pin.analysis.sources import Source, driven_frequencies, source_of
from drillrig_pin.analysis.spectra import (
    BOOM_BAND,
    HAMMER_BAND,
    Line,
    amplitude_spectrum,
    band_share,
    strongest_lines,
)
from drillrig_pin.analysis.trust import Trust, trust
from drillrig_pin.analysis.validity import invalid
from drillrig_pin.analysis.window import Steadiness, Window, window_of
from drillrig_pin.trajectory import AXES, Trajectory
from drillrig_pin.words import absolute


@dataclass(frozen=True, slots=True)
class Frequencies:
    """Frequencies of the survey point.

    Attributes:
        lines: the strongest [Hz, m].
        boom_share, hammer_share: shares of the two bands, below 15 Hz and 15 to 80 Hz.
        bin: width of one bin [Hz].
        sources: where every line comes from.
    """

    lines: tuple[Line, ...]
    boom_share: float
    hammer_share: float
    bin: float
    sources: tuple[Source, ...] = ()


@dataclass(frozen=True, slots=True)
class Metrics:
    """Summary of one run.

    Attributes:
        start_up: length of the start-up transient left out of everything but pressures and the joints' whole range [s].
        survey: motion of the survey point, or None if the run tracks no point.
        joints: range of every joint.
        frequencies: of the survey point; None if the run is too short, or its rows cannot show the loads.
        hole: errors of the hole, or None for a machine without a feed line.
        cylinders: extremes of every cylinder.
        reactions: constraint rows and contacts.
        trust: constraint errors, energy balance, cost.
        warnings: what a designer must not overlook, in words.
        steadiness: whether the motion has settled by the end of the start-up.
        sampling: of the rows the statistics are made of.
        stored: of the samples that curves are made of.
        no_hole: why there are no errors of the hole, in words; empty for a machine that touches no rock.
        across_what: what motion "across the hole" is across: the feed line at the start, or the contact's axis.
        valid_until: time of the first number that cannot be used [s]; None: there is none, see ``invalid``.
        invalid: why none of this may be used, in words; empty for a run that nothing speaks against.
        passed: joints that went beyond their limits.
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
    steadiness: Steadiness
    sampling: Sampling
    stored: Sampling
    invalid: tuple[str, ...] = ()
    passed: tuple[LimitPassed, ...] = ()
    no_hole: str = ""
    across_what: str = "the contact's axis"
    valid_until: float | None = None


def measure(trajectory: Trajectory, design: Design | None = None) -> Metrics:
    """Read a run. It needs at least one sample; sections without content come out empty or None.

    Args:
        trajectory: the run.
        design: what its model says, if that is known already; None: read from the model text it carries.
    """
    design = design or design_of(trajectory)
    window = window_of(trajectory, design)
    record, steady = window.record, window.rows
    point = survey_point(trajectory)
    hole = hole_axis(record, design)
    cylinders = cylinder_ranges(record, design, steady)
    reactions = reaction_ranges(record, design, steady)
    trusted = trust(trajectory)
    passed = limits_passed(record, design)
    sampling, stored = record_sampling(trajectory, design), stored_sampling(trajectory, design)
    doubts = invalid(trajectory, trusted)
    return Metrics(
        window.start_up,
        point_motion(record, point, steady, hole) if point else None,
        joint_ranges(record, design, steady),
        point_frequencies(window, design, point) if point else None,
        hole_quality(record, design, steady),
        cylinders,
        reactions,
        trusted,
        (
            *doubts,
            *window_warnings(window, sampling, stored),
            *(limit.words for limit in passed),
            *_pressure_warnings(cylinders),
            *_lift_off(reactions),
        ),
        window.steadiness,
        sampling,
        stored,
        doubts,
        passed,
        no_hole(record, design),
        "the feed line" if feed_line(record, design) is not None else "the contact's axis",
        trajectory.outcome.valid_until,
    )


def point_frequencies(window: Window, design: Design, point: str, count: int = 5) -> Frequencies | None:
    """Strongest frequencies of a point's displacement, the three axes taken together.

    None where there are too few rows, or where they cannot show the loads: there a line would be at a wrong frequency.
    """
    record, rows = window.record, window.rows
    sampling = record_sampling(record, design)
    spectrum = amplitude_spectrum(record.time[rows], record.of("point_displacement", point)[rows])
    if spectrum is None or not sampling.enough:
        return None
    lines = strongest_lines(spectrum, AXES, count)
    loads = driven_frequencies(record, design, rows)
    return Frequencies(
        lines,
        band_share(spectrum, *BOOM_BAND),
        band_share(spectrum, *HAMMER_BAND),
        spectrum.bin,
        tuple(source_of(line.frequency, spectrum.bin, loads, record.modes, sampling.rate) for line in lines),
    )


def window_warnings(window: Window, sampling: Sampling, stored: Sampling) -> list[str]:
    """What keeps statistics from being what they are called."""
    found = []
    if window.steadiness.words:
        found.append(f"the statistics are {window.steadiness.words}")
    if not sampling.enough:
        found.append(f"statistics and frequencies cannot be used, {sampling.words}")
    elif not stored.enough:
        found.append(f"curves and exported samples mislead, the statistics do not: {stored.words}")
    return found


def _pressure_warnings(cylinders: tuple[CylinderRange, ...]) -> list[str]:
    found = []
    for c in cylinders:
        for x in c.chambers:
            if x.least < GAS_RELEASE:
                law = "tears and does not pull as computed" if x.least < c.vapour else "is softer than computed"
                found.append(
                    f"{c.cylinder}: chamber {x.name} falls to {absolute(x.least)}; below "
                    f"{GAS_RELEASE / 1e5:g} bar oil releases air ({x.below:.1%} of time) and {law}"
                )
            if c.relief is not None and x.greatest > c.relief:
                found.append(
                    f"{c.cylinder}: chamber {x.name} rises to {absolute(x.greatest, 4)}; above "
                    f"{c.relief / 1e5:.4g} bar its relief valve opens ({x.above:.1%} of time)"
                )
    return found


def _lift_off(reactions: tuple[ReactionRange, ...]) -> list[str]:
    return [
        f"{r.name}: {lifted_words(r.lift_off)} for {r.lift_off.share:.1%} of time ({r.lift_off.impacts} impacts)"
        + (f"; meanwhile {', '.join(r.lift_off.ties)} goes on holding it" if r.lift_off.ties else "")
        for r in reactions
        if r.lift_off is not None and r.lift_off.share > 0
    ]


def lifted_words(found: LiftOff) -> str:
    """What a tip does that is not pressed on."""
    return "the tip is off the face" if found.unilateral else "the rock pulls at the tip, where a real tip lifts off,"
