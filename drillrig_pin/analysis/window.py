"""The time that statistics are taken over, and whether the motion has settled by then.

The window begins after the start-up, see :func:`drillrig_pin.analysis.motion.start_up`. Whether the motion is steady in
it is looked at in the motion itself: the first and the last part of the window, each of whole periods of the slowest
sine and as long as half the window allows, must agree in peak to peak, RMS and mean to ``TOLERANCE``.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from drillrig_pin.analysis.design import Design, design_of
from drillrig_pin.analysis.motion import (
    LARGEST_START_UP,
    after,
    joint_motions,
    start_up,
    survey_point,
    wanted_start_up,
)
from drillrig_pin.analysis.series import rms, weights
from drillrig_pin.kinematics import Array
from drillrig_pin.trajectory import AXES, Trajectory
from drillrig_pin.words import number, percent

#: By so much may the parts of a steady window differ.
TOLERANCE = 0.05
#: The same under a load table, which as measured is hardly ever the same twice.
TOLERANCE_TABLE = 0.15
#: Signals that move less than this part of the greatest of their kind do not decide, ...
SMALL = 0.05
#: ... nor do those that move less within the window than this part of what they moved in the whole run.
SETTLED = 3e-3


@dataclass(frozen=True, slots=True)
class Steadiness:
    """Whether the statistics are those of a steady motion.

    Attributes:
        steady: None for a run without loads, which is looked at from its start.
        drift: greatest difference between the first and the last part of the window, as part of peak to peak, RMS or
            peak to peak again (for the mean); None if the window is too short for two parts.
        needed: how long a run must at least be [s]; None if nothing is known of it.
        reason: why it is not steady, in words.
    """

    steady: bool | None
    drift: float | None
    needed: float | None
    reason: str = ""

    @property
    def words(self) -> str:
        """One sentence without its full stop; empty where there is nothing to say."""
        if self.steady is not False:
            return ""
        todo = f": run at least {_upwards(self.needed)} s" if self.needed is not None else ""
        return f"not steady yet, {self.reason}{todo}"


@dataclass(frozen=True, slots=True)
class Window:
    """What statistics are made of.

    Attributes:
        record: rows of the run that do not depend on what is stored.
        rows: those of them after the start-up.
        start_up: time left out [s].
        steadiness: whether the motion has settled.
    """

    record: Trajectory
    rows: slice
    start_up: float
    steadiness: Steadiness


def window_of(trajectory: Trajectory, design: Design | None = None) -> Window:
    """The window of a run of at least one sample."""
    design = design or design_of(trajectory)
    record = trajectory.record
    begin = start_up(record, design)
    rows = after(record, begin)
    return Window(record, rows, begin, steadiness(record, design, begin))


def steadiness(trajectory: Trajectory, design: Design, begin: float) -> Steadiness:
    """Compare the first and the last part of what lies behind ``begin`` [s]."""
    if not trajectory.labels["load"] or len(trajectory.time) < 2:
        return Steadiness(None, None, None)
    end = float(trajectory.time[-1])
    wanted = wanted_start_up(trajectory, design)
    needed = wanted / LARGEST_START_UP
    if begin < design.ramp * (1 - 1e-9):
        reason = f"the statistics begin at {number(begin, 3)} s, within the loads' ramp of {number(design.ramp, 3)} s"
        return Steadiness(False, None, needed, reason)
    period = 1.0 / design.slowest if design.slowest > 0 else 0.0
    length = 0.5 * (end - begin)
    if period > 0:
        needed = max(needed, wanted + 2 * period)
        if length < period * (1 - 1e-9):
            words = f"less than two periods of the slowest load ({number(design.slowest, 3)} Hz)"
            return Steadiness(False, None, needed, f"the statistics are taken over {number(2 * length, 3)} s, {words}")
        length = period * math.floor(length / period * (1 + 1e-9))
    drift, what = max(_drifts(trajectory, design, begin, length), default=(0.0, ""))
    if drift <= (TOLERANCE_TABLE if design.tables else TOLERANCE):
        return Steadiness(True, drift, needed)
    reason = f"{what} by {percent(drift)} between the first and the last {number(length, 3)} s after the start-up"
    # The window begins where it should and yet the motion changes: nothing but a longer run can tell.
    return Steadiness(False, drift, needed if needed > end else 2 * end, reason)


def _drifts(trajectory: Trajectory, design: Design, begin: float, length: float) -> Iterator[tuple[float, str]]:
    time = trajectory.time
    first = slice(int(np.searchsorted(time, begin)), int(np.searchsorted(time, begin + length, side="right")))
    last = slice(int(np.searchsorted(time, time[-1] - length)), None)
    parts = (first, last)
    if any(len(time[part]) < 2 for part in parts):
        return
    w = [weights(time[part]) for part in parts]
    for kind in _signals(trajectory, design):
        reach = [max(float(np.ptp(x[part])) for part in parts) for _, x in kind]
        for (name, x), moved in zip(kind, reach, strict=True):
            still = moved <= max(SMALL * max(reach), SETTLED * float(np.ptp(x)))
            if still or not math.isfinite(moved):
                continue
            spans = [float(np.ptp(x[part])) for part in parts]
            effective = [float(rms(v, x[part])) for v, part in zip(w, parts, strict=True)]
            means = [float(v @ x[part]) for v, part in zip(w, parts, strict=True)]
            yield abs(spans[1] - spans[0]) / moved, f"the peak to peak of {name} changes"
            yield abs(effective[1] - effective[0]) / max(effective), f"the RMS of {name} changes"
            yield abs(means[1] - means[0]) / moved, f"the mean of {name} moves"


def _signals(trajectory: Trajectory, design: Design) -> Iterator[list[tuple[str, Array]]]:
    """Signals by kind: the survey point, or the joints where none is tracked; the cylinder forces."""
    point = survey_point(trajectory)
    if point is not None:
        u = trajectory.of("point_displacement", point)
        yield [(f"{point} along {axis}", u[:, i]) for i, axis in enumerate(AXES)]
    else:
        motions = list(joint_motions(trajectory, design))
        for unit in ("m", "rad"):
            yield [(name, values) for name, of, values in motions if of == unit]
    yield [(f"the force of {name}", trajectory.of("cylinder_force", name)) for name in trajectory.labels["cylinder"]]


def _upwards(seconds: float) -> str:
    """A time rounded up to two digits."""
    size = 10.0 ** (math.floor(math.log10(seconds)) - 1) if seconds > 0 else 1.0
    return number(math.ceil(seconds / size * (1 - 1e-9)) * size, 2 if seconds < 100 else 3)
