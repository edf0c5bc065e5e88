"""How far things moved: the survey point along the world axes and across the hole, and every joint."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from drillrig_pin.analysis.design import Axis, Design
from drillrig_pin.analysis.series import extremes, rms, span, weights
from drillrig_pin.kinematics import Array
from drillrig_pin.trajectory import AXES, Mode, Trajectory

#: The point a surveyor's prism sits on; a run without it reports its last tracked point.
SURVEY_POINT = "S"
#: Periods of the loads' slowest sine that are left out behind their ramp, at least.
PERIODS = 3.0
#: Share of the run that the start-up may take.
LARGEST_START_UP = 0.2
#: What the start stirred up has rung down to this part of the deflection under the loads.
REST = 1e-3
#: Modes of less than this part of critical damping never ring down, as far as a run goes.
DAMPED = 1e-6


def start_up(trajectory: Trajectory, design: Design) -> float:
    """Length of the start-up transient that statistics leave out [s], at most a fifth of the run.

    It ends when the loads have their full value, and either three periods of their slowest sine later or when what
    their start stirred up has rung down, whichever is later. Zero for a run without loads: there the start is what one
    wants to see.
    """
    end = float(trajectory.time[-1]) if len(trajectory.time) else 0.0
    return min(wanted_start_up(trajectory, design), LARGEST_START_UP * end)


def wanted_start_up(trajectory: Trajectory, design: Design) -> float:
    """The same for a run that is long enough [s]."""
    if not trajectory.labels["load"]:
        return 0.0
    periods = PERIODS / design.slowest if design.slowest > 0 else 0.0
    return design.ramp + max(periods, ring_down(trajectory.modes, design.shortest_ramp))


def ring_down(modes: Sequence[Mode], ramp: float) -> float:
    """Time after the start of the loads until all modes that are damped have rung down [s].

    What a start stirs up in a mode of angular frequency w and decay d is, as part of the deflection under the load, 1
    for a load that acts in full at once, and at most 120 / (w T)^3 for the smooth ramp over T, whose third derivative
    jumps by 60 / T^3 at both ends. It falls by exp(-d t), here to ``REST``.

    Args:
        modes: of the machine.
        ramp: the shortest ramp T of the loads [s]; 0 for one that acts in full at once, as a table does.
    """
    longest = 0.0
    for mode in modes:
        omega = math.hypot(2 * math.pi * mode.frequency, mode.decay)
        stirred = min(1.0, 120.0 / (omega * ramp) ** 3) if ramp > 0 else 1.0
        if mode.decay > DAMPED * omega and stirred > REST:
            longest = max(longest, math.log(stirred / REST) / mode.decay)
    return longest


def after(trajectory: Trajectory, start: float) -> slice:
    """The rows from ``start`` [s] on; all of them if that leaves fewer than two."""
    first = int(np.searchsorted(trajectory.time, start))
    return slice(first if len(trajectory.time) - first >= 2 else 0, None)


@dataclass(frozen=True, slots=True)
class AxisMotion:
    """Motion along one world axis [m]: highest less lowest, RMS about the mean, mean displacement from the start."""

    axis: str
    peak_to_peak: float
    rms: float
    mean: float


@dataclass(frozen=True, slots=True)
class AcrossHole:
    """Motion perpendicular to the hole [m]: RMS about its mean position, and the farthest it went from there."""

    direction: Axis
    rms: float
    farthest: float


@dataclass(frozen=True, slots=True)
class PointMotion:
    """Motion of one point after the start-up transient; ``across`` only where a contact tells the hole's direction."""

    point: str
    axes: tuple[AxisMotion, ...]
    across: AcrossHole | None


def survey_point(trajectory: Trajectory) -> str | None:
    """Name of the survey point: ``S``, else the last tracked point, else None."""
    points = trajectory.labels["point"]
    if SURVEY_POINT in points:
        return SURVEY_POINT
    return points[-1] if points else None


def point_motion(trajectory: Trajectory, point: str, steady: slice, hole: Axis | None = None) -> PointMotion:
    """Statistics of a point's displacement u over the rows ``steady``, means taken over time.

    peak-to-peak = max u - min u, RMS = sqrt(mean (u - mean u)^2) per axis; across the hole of unit direction n the same
    for w = u - (u . n) n.
    """
    time, u = trajectory.time[steady], trajectory.of("point_displacement", point)[steady]
    weight = weights(time)
    mean, effective = weight @ u, rms(weight, u)
    axes = tuple(
        AxisMotion(axis, span(time, u[:, i]), float(effective[i]), float(mean[i])) for i, axis in enumerate(AXES)
    )
    if hole is None:
        return PointMotion(point, axes, None)
    n = np.array(hole)
    w = u - mean
    distance = np.linalg.norm(w - np.outer(w @ n, n), axis=1)
    across = AcrossHole(hole, float(np.sqrt(weight @ distance**2)), extremes(time, distance)[1])
    return PointMotion(point, axes, across)


@dataclass(frozen=True, slots=True)
class JointRange:
    """How far one joint moved [unit]: highest less lowest position, in the whole run and after the start-up."""

    joint: str
    unit: str
    whole: float
    steady: float


def joint_ranges(trajectory: Trajectory, design: Design, steady: slice) -> tuple[JointRange, ...]:
    """Range of every joint."""
    return tuple(
        JointRange(name, unit, span(trajectory.time, values), span(trajectory.time[steady], values[steady]))
        for name, unit, values in joint_motions(trajectory, design)
    )


def joint_motions(trajectory: Trajectory, design: Design) -> Iterator[tuple[str, str, Array]]:
    """Name, unit (rad or m) and position less initial position (n) of everything that a joint lets move.

    A floating joint gives its three translations and the angle it has turned.
    """
    columns = {name: trajectory.q[:, i] for i, name in enumerate(trajectory.labels["joint"])}
    for joint, kind in design.kinds.items():
        if kind == "floating" and f"{joint}.qw" in columns:
            for axis in AXES:
                values = columns[f"{joint}.{axis}"]
                yield f"{joint}.{axis}", "m", values - values[0]
            quaternion = np.stack([columns[f"{joint}.q{c}"] for c in "xyzw"], axis=1)
            cosine = np.clip(np.abs(quaternion @ quaternion[0]), 0.0, 1.0)
            yield f"{joint}.turn", "rad", 2.0 * np.arccos(cosine)
        elif joint in columns:
            yield joint, "m" if kind == "prismatic" else "rad", columns[joint] - columns[joint][0]
