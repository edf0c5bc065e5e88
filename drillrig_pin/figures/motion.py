"""Figures of motion: joints, the survey point, its path, a measurement beside it, the hole."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from drillrig_pin.analysis.hole_quality import feed_line, toe_name
from drillrig_pin.analysis.limits import limited_depths
from drillrig_pin.analysis.measured import Comparison, compare_with
from drillrig_pin.analysis.motion import joint_motions, survey_point
from drillrig_pin.figures.sheet import AXIS_INKS, TIME, Curve, Ink, Level, Panel, Sheet
from drillrig_pin.figures.subject import Subject, angle_unit, length_unit
from drillrig_pin.trajectory import AXES

#: Colours of the toe offsets, the deepest first.
HOLE_INKS = (Ink.SKY, Ink.ORANGE, Ink.BLUE, Ink.GREEN, Ink.PURPLE)
#: A limit beyond this many times the greatest value is not drawn.
NEAR = 3.0


def joints(subject: Subject) -> Sheet | None:
    """Deviation of every joint from its initial position (paper: figures 11 to 16)."""
    run = subject.curves
    panels = []
    for name, unit, values in joint_motions(run, subject.design):
        label, factor = angle_unit(values) if unit == "rad" else length_unit(values)
        curve = Curve(name, run.time, values * factor)
        panels.append(Panel(name, name, TIME, f"Δq [{label}]", (curve,)))
    caption = "Deviation of every joint from its initial position."
    return Sheet("joints", "Joint motion", caption, tuple(panels)) if panels else None


def survey(subject: Subject) -> Sheet | None:
    """Displacement of the survey point along the world axes (paper: figure 17 shows z)."""
    run, point = subject.curves, survey_point(subject.trajectory)
    if point is None:
        return None
    u = run.of("point_displacement", point)
    label, factor = length_unit(u)
    panels = tuple(
        Panel(
            axis, f"{point}, along {axis}", TIME, f"{axis} [{label}]", (Curve(axis, run.time, u[:, i] * factor, ink),)
        )
        for i, (axis, ink) in enumerate(zip(AXES, AXIS_INKS, strict=True))
    )
    caption = f"Displacement of the survey point {point} from its initial position, along the world axes."
    return Sheet("survey", f"Displacement of {point}", caption, panels)


def path(subject: Subject) -> Sheet | None:
    """Path of the survey point in the Y-Z plane, across the hole (paper: figure 19).

    Without a contact to say where the hole is, in the plane of the two largest motions.
    """
    run, point = subject.curves, survey_point(subject.trajectory)
    if point is None:
        return None
    u = run.of("point_displacement", point)
    label, factor = length_unit(u)
    first = subject.steady.start or 0
    i, j = (1, 2) if subject.design.contacts else sorted(np.argsort(np.ptp(u, axis=0))[-2:])
    x, y = u[:, i] * factor, u[:, j] * factor
    curves = [Curve("after start-up", x[first:], y[first:], Ink.BLUE, path=True)]
    if first:
        curves.insert(0, Curve("start-up", x[: first + 1], y[: first + 1], Ink.GREY, path=True))
    plane = f"{AXES[i].upper()}–{AXES[j].upper()} plane"
    axes = [f"{AXES[k]} [{label}]" for k in (i, j)]
    panel = Panel("path", f"Path of {point}", axes[0], axes[1], tuple(curves), square=True)
    caption = f"Path of the survey point {point} in the {plane}; zero is where it stood at the start."
    return Sheet("path", f"Path of {point}, {plane}", caption, (panel,))


def compared(subject: Subject) -> Comparison | None:
    """The run against the measurement beside it; None without one, or where they cannot be compared."""
    record, point = subject.trajectory.record, survey_point(subject.trajectory)
    if point is None or subject.measurement is None:
        return None
    signal = record.of("point_displacement", point, subject.measured_axis)
    return compare_with(record.time, signal, subject.measurement, subject.measured_shift)


def measured(subject: Subject) -> Sheet | None:
    """Displacement of the survey point against a measurement (paper: figure 20); None without a measurement."""
    found, point, axis = compared(subject), survey_point(subject.trajectory), subject.measured_axis
    if found is None or point is None or subject.measurement is None:
        return None
    label, factor = length_unit(found.computed, found.measured)
    note = (
        f"RMS error {found.rms_error:.1%}, peak error {found.peak_error:+.1%}\n"
        f"shift {found.shift:+.4g} s, correlation {found.correlation:.3f}"
    ).replace("%", " %")
    if found.reversed:
        note += "\nsign reversed?"
    curves = (
        _with_gaps(Curve("measured", found.time, found.measured * factor, Ink.VERMILION), found),
        Curve("computed", found.run_time, found.run * factor, Ink.BLUE),
    )
    left = Curve("computed − measured", found.time, (found.computed - found.measured) * factor, Ink.INK)
    unit = f"{axis} [{label}]"
    panels = (
        Panel("signals", f"{point} along {axis}", TIME, unit, curves, note=note),
        Panel("close_up", "close-up", TIME, unit, tuple(curve.between(*_middle(found)) for curve in curves)),
        Panel("difference", "computed − measured", TIME, unit, (_with_gaps(left, found),)),
    )
    how = "greatest correlation" if subject.measured_shift is None else "shift given"
    caption = (
        f"Displacement of {point} along {axis} against {subject.measurement.name}, shifted in time to the {how}, means "
        "over the overlap removed; the run is evaluated at the times of the measurement. RMS error: RMS of the "
        "difference over RMS of the measurement. Peak error: peak-to-peak computed against measured."
        + "".join(f" Note: {words}." for words in found.notes)
    )
    return Sheet("measured", f"{point} against the measurement", caption, panels, shared=False)


def _with_gaps(curve: Curve, found: Comparison) -> Curve:
    """The curve broken where the measurement has a gap."""
    behind = np.searchsorted(curve.x, found.gaps[:, 1]) if len(found.gaps) else np.zeros(0, dtype=int)
    middle = found.gaps.mean(axis=1) if len(found.gaps) else np.zeros(0)
    return replace(curve, x=np.insert(curve.x, behind, middle), y=np.insert(curve.y, behind, np.nan))


def _middle(found: Comparison) -> tuple[float, float]:
    """About ten swings of the measurement in the middle of its longest stretch without a gap [s]."""
    crossings = int((np.diff(np.signbit(found.measured)) != 0).sum())
    edges = np.concatenate([found.time[:1], found.gaps.ravel(), found.time[-1:]]).reshape(-1, 2)
    low, high = edges[np.argmax(edges[:, 1] - edges[:, 0])].tolist()
    measured = float((edges[:, 1] - edges[:, 0]).sum())
    half = 0.5 * min(high - low, measured * 20 / max(crossings, 1))
    return 0.5 * (low + high) - half, 0.5 * (low + high) + half


def hole(subject: Subject) -> Sheet | None:
    """Angle error of the feed axis and where the feed line meets collar and toe, over time."""
    run = subject.curves
    line = feed_line(run, subject.design, subject.hole)
    if line is None:
        return None
    depths = limited_depths(subject.limits)
    label, factor = length_unit(line.toe_offset(depths[-1]))
    # The largest first, so that it does not cover the others.
    offsets = [(toe_name(depth), f"toe {depth:g} m", line.toe_offset(depth)) for depth in reversed(depths)]
    offsets.append(("collar", "collar", line.collar_offset))
    inks = [*(HOLE_INKS[i % len(HOLE_INKS)] for i in range(len(depths))), Ink.INK]
    degrees = 180 / math.pi
    angle = Curve("angle", run.time, line.angle * degrees)
    curves = tuple(
        Curve(words, run.time, values * factor, ink) for (_, words, values), ink in zip(offsets, inks, strict=True)
    )
    panels = (
        Panel(
            "angle",
            "Angle error of the feed axis",
            TIME,
            "angle [°]",
            (angle,),
            _bounds(subject, [("angle", "limit", angle)], degrees),
        ),
        Panel(
            "offset",
            "Offset",
            TIME,
            f"offset [{label}]",
            curves,
            _bounds(
                subject,
                [(key, f"limit, {words}", curve) for (key, words, _), curve in zip(offsets, curves, strict=True)],
                factor,
            ),
        ),
    )
    against = "the direction it is meant to have" if subject.hole else "its direction at the start"
    caption = (
        f"The feed line from {line.drill} through {line.tip} against {against}: its angle, where it "
        "meets the face (collar), and where it would come out at the toe: offset and slope added as vectors."
    )
    return Sheet("hole", "Hole quality", caption, panels)


def _bounds(subject: Subject, curves: list[tuple[str, str, Curve]], factor: float) -> tuple[Level, ...]:
    """Limits that lie near their curve; one far above it would only press the curves flat."""
    found = []
    for key, words, curve in curves:
        limit = subject.limits.get(key)
        if limit is not None and limit.value * factor < NEAR * float(np.nanmax(curve.y, initial=0.0)):
            found.append(Level(words, limit.value * factor))
    return tuple(found)
