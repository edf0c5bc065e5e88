"""Statistics of signals over time whose rows need not lie at equal distances.

    mean x  = sum w_i x_i,   w_i half the steps to both sides of a row, of the first and last row a whole one, sum w = 1
    RMS x   = sqrt(sum w_i (x_i - mean x)^2)
    share   = time during which the straight lines between the rows lie above a level, as part of the whole

An extreme between two rows is that of the parabola through three rows, where the signal is smooth: the row in the
middle is an extreme, its neighbours are about equally far, and the curvature there is of the same sign and size. Of a
sine of 20 rows a period it is right to 0.03 %, where the highest row may miss 1.2 %. An edge or a blow stays as it was
computed.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drillrig_pin.kinematics import Array

#: Steps beside an extreme may differ by this factor.
EVEN = 2.0
#: Curvature beside an extreme is at least this part of that at it; of a sine, five rows a period have it.
SMOOTH = 0.25


def weights(time: Array) -> Array:
    """Weights of rows at increasing times (n), of sum 1; rows at equal distances weigh alike."""
    n = len(time)
    if n < 2 or not time[-1] > time[0]:
        return np.full(n, 1.0 / max(n, 1))
    steps = np.diff(time)
    # To the left of every row, and to the right of it.
    w = np.concatenate([steps[:1], steps]) + np.concatenate([steps, steps[-1:]])
    whole: Array = w / w.sum()
    return whole


def rms(w: Array, x: Array) -> Array:
    """RMS about the mean with weights w (n), of every column of x (n, ...)."""
    off = x - np.tensordot(w, x, 1)
    found: Array = np.sqrt(np.tensordot(w, off**2, 1))
    return found


def extremes(time: Array, x: Array) -> tuple[float, float]:
    """Least and greatest value of one signal x (n), also between its rows."""
    _, heights = _refined(time, x)
    # The height of a smooth extreme is never on the other side of the row it was found at.
    return min(float(x.min()), float(heights.min(initial=np.inf))), max(
        float(x.max()), float(heights.max(initial=-np.inf))
    )


def greatest(time: Array, x: Array) -> float:
    """Greatest value of one signal x (n), also between its rows."""
    return extremes(time, x)[1]


def span(time: Array, x: Array) -> float:
    """Greatest less least value."""
    low, high = extremes(time, x)
    return high - low


def turning_points(time: Array, x: Array) -> Array:
    """The signal with its smooth extremes at their heights between the rows; everything else as it is."""
    rows, heights = _refined(time, x)
    if not len(rows):
        return x
    refined = x.copy()
    refined[rows] = heights
    return refined


def share_above(time: Array, x: Array, level: float) -> float:
    """Share of time, from 0 to 1, during which the signal x (n) lies above a level."""
    if len(time) < 2 or not time[-1] > time[0]:
        return float((x > level).mean()) if len(x) else 0.0
    a, b = x[:-1] - level, x[1:] - level
    rise = np.abs(b - a)
    above = np.maximum(a, 0.0) + np.maximum(b, 0.0)
    with np.errstate(all="ignore"):
        part = np.where((a > 0) == (b > 0), (a > 0).astype(float), np.abs(above) / np.where(rise > 0, rise, 1.0))
    return float((part * np.diff(time)).sum() / (time[-1] - time[0]))


def _refined(time: Array, x: Array) -> tuple[NDArray[np.intp], Array]:
    """Rows of smooth extremes, and the heights of the parabolas there."""
    if len(x) < 5 or not np.isfinite(x).all():
        return np.zeros(0, dtype=np.intp), np.zeros(0)
    with np.errstate(all="ignore"):
        rows, heights = _parabolas(np.diff(time), x)
    # Where a run lasts 1e-300 s, slopes are no numbers: there is nothing to refine.
    sound = np.isfinite(heights)
    return rows[sound], heights[sound]


def _parabolas(h: Array, x: Array) -> tuple[NDArray[np.intp], Array]:
    slope = np.diff(x) / h
    # Entry j of these belongs to row j + 1, which has a neighbour at each side.
    curve = 2.0 * np.diff(slope) / (h[:-1] + h[1:])
    inner = x[1:-1]
    top = (inner >= x[:-2]) & (inner >= x[2:]) & (curve < 0)
    low = (inner <= x[:-2]) & (inner <= x[2:]) & (curve > 0)
    even = (h[:-1] <= EVEN * h[1:]) & (h[1:] <= EVEN * h[:-1])
    least, sign = SMOOTH * np.abs(curve[1:-1]), np.sign(curve[1:-1])
    alike = np.zeros(len(curve), dtype=bool)
    alike[1:-1] = (curve[:-2] * sign >= least) & (curve[2:] * sign >= least)
    j = np.flatnonzero((top | low) & even & alike)
    # The parabola about the middle row: x + s u + c / 2 u^2 with s its slope there, u the time from it.
    c = curve[j]
    s = slope[j] + 0.5 * c * h[j]
    heights: Array = inner[j] - s**2 / (2.0 * c)
    return j + 1, heights
