"""How straight the hole becomes: where the feed line meets the face and where it would come out at the toe.

With E the tip, T the drill, d = (E - T) / |E - T| the feed axis and h the direction the hole is meant to have (that of
the feed axis at the start, as it was aimed):

    c = (E - E_0) - d (h . (E - E_0)) / (h . d)     collar: where the feed line crosses the plane across h through E_0
    s = d / (h . d) - h                             slope of the feed line against h, |s| = tan(angle)
    toe offset at depth L = |c + L s|               what a surveyor finds there: offset and slope may cancel

Motion along the hole counts in none of them. The static part is that of the mean over time of the vector; the vibration
is the greatest departure from that mean; the worst is the greatest value at any time, which the limits apply to.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drillrig_pin.analysis.design import Axis, Design
from drillrig_pin.analysis.series import greatest, weights
from drillrig_pin.kinematics import Array
from drillrig_pin.trajectory import Trajectory

#: Depths at which the toe is projected [m].
DEPTHS = (3.0, 6.0, 12.0)


@dataclass(frozen=True, slots=True)
class FeedLine:
    """The feed line over time.

    Attributes:
        drill, tip: names of the points that span it.
        direction: unit world direction h the hole is meant to have.
        collar: offset c at the collar, (n, 3) [m].
        slope: slope s, (n, 3) [-].
    """

    drill: str
    tip: str
    direction: Axis
    collar: Array
    slope: Array

    @property
    def collar_offset(self) -> Array:
        """|c|, (n) [m]."""
        return _length(self.collar)

    @property
    def angle(self) -> Array:
        """atan |s|, (n) [rad]."""
        angle: Array = np.arctan(_length(self.slope))
        return angle

    def toe_offset(self, depth: float) -> Array:
        """|c + L s| at depth L [m], (n) [m]."""
        return _length(self.collar + depth * self.slope)


@dataclass(frozen=True, slots=True)
class HoleError:
    """One measure of the hole: its static part, the vibration about it, and the worst at any time.

    ``name`` is that of its limit: ``angle`` [rad], ``collar`` [m], ``toe_6m`` [m].
    """

    name: str
    unit: str
    static: float
    vibration: float
    worst: float


@dataclass(frozen=True, slots=True)
class HoleQuality:
    """Errors of the hole after the start-up transient.

    Attributes:
        drill, tip: points that span the feed line.
        direction: unit world direction the hole is meant to have.
        to_face: angle between that direction and the contact's axis into the rock [rad].
        errors: angle, collar, then the toe at every depth.
    """

    drill: str
    tip: str
    direction: Axis
    to_face: float
    errors: tuple[HoleError, ...]


def feed_line(trajectory: Trajectory, design: Design, direction: Axis | None = None) -> FeedLine | None:
    """The feed line of a run, or None if the machine has none or its points are not tracked.

    Args:
        direction: world direction the hole is meant to have; None: the feed axis at the first sample.
    """
    if design.feed is None or not set(design.feed) <= set(trajectory.labels["point"]):
        return None
    drill, tip = design.feed
    T, E = trajectory.of("point_position", drill), trajectory.of("point_position", tip)
    d = E - T
    length = _length(d)[:, None]
    if not len(d) or not (length > 0).all():
        return None
    d = d / length
    h = d[0] if direction is None else np.array(direction) / np.linalg.norm(direction)
    advance = d @ h
    if not (advance > 0).all():
        return None
    moved = E - E[0]
    collar = moved - d * ((moved @ h) / advance)[:, None]
    return FeedLine(drill, tip, tuple(h.tolist()), collar, d / advance[:, None] - h)


def no_hole(trajectory: Trajectory, design: Design, direction: Axis | None = None) -> str:
    """Why :func:`feed_line` is None, in words; empty where it is not, or for a machine that touches no rock."""
    if design.feed is None:
        return design.no_feed
    missing = [name for name in design.feed if name not in trajectory.labels["point"]]
    if missing:
        return f"the ends of the feed line are not tracked: {', '.join(missing)}; give those points track='true'"
    if feed_line(trajectory, design, direction) is None:
        return "the feed line has no length, or turns by more than 90 degrees from the direction of the hole"
    return ""


def hole_axis(trajectory: Trajectory, design: Design) -> Axis | None:
    """Unit world direction across which a point's motion counts: the feed line's at the start, else the contact's axis.

    None for a machine with neither.
    """
    line = feed_line(trajectory, design)
    return line.direction if line is not None else next(iter(design.contacts.values()), None)


def hole_quality(
    trajectory: Trajectory,
    design: Design,
    steady: slice,
    depths: Sequence[float] = DEPTHS,
    direction: Axis | None = None,
) -> HoleQuality | None:
    """Errors of the hole over the rows ``steady``; None where :func:`feed_line` is."""
    line = feed_line(trajectory, design, direction)
    if line is None:
        return None
    c, s = line.collar[steady], line.slope[steady]
    time = trajectory.time[steady]
    angle = (float(np.arctan(value)) for value in _parts(time, s))
    errors = [HoleError("angle", "rad", *angle), HoleError("collar", "m", *_parts(time, c))]
    errors += [HoleError(toe_name(depth), "m", *_parts(time, c + depth * s)) for depth in depths]
    axis = next(iter(design.contacts.values()), line.direction)
    cosine = float(np.clip(np.dot(axis, line.direction) / np.linalg.norm(axis), -1.0, 1.0))
    return HoleQuality(line.drill, line.tip, line.direction, float(np.arccos(cosine)), tuple(errors))


def toe_name(depth: float) -> str:
    """Name of the toe offset at a depth [m], e.g. ``toe_6m``."""
    return f"toe_{depth:g}m"


def _parts(time: Array, offset: Array) -> tuple[float, float, float]:
    """Length of the mean over time of vectors (n, 3), greatest departure from that mean, greatest length."""
    mean = weights(time) @ offset
    return float(_length(mean)), greatest(time, _length(offset - mean)), greatest(time, _length(offset))


def _length(vectors: Array) -> Array:
    length: Array = np.linalg.norm(vectors, axis=-1)
    return length
