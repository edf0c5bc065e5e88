"""Fewer points, same picture: no peak is lost and none is made up."""

from __future__ import annotations

import numpy as np

from drillrig_pin.kinematics import Array

#: Cells along each side of the grid a path is drawn on.
CELLS = 1000


def thin(x: Array, y: Array, buckets: int) -> tuple[Array, Array]:
    """Keep the least and the greatest sample of every bucket of equal length in samples, and both ends of the curve.

    Args:
        x: increasing (n).
        y: (n).
        buckets: about as many as the drawing has pixels; a curve of at most twice as many samples stays as it is.

    Returns:
        Samples of the curve in their order, at most 2 x buckets + 2.
    """
    n = len(x)
    if n <= 2 * buckets:
        return x, y
    edges = np.linspace(0, n, buckets + 1).astype(int)
    starts, ends = edges[:-1], edges[1:]
    finite = np.where(np.isfinite(y), y, np.nan)
    width = int((ends - starts).max())
    # Rows of one bucket each; the shorter ones repeat their last sample.
    index = np.minimum(starts[:, None] + np.arange(width), ends[:, None] - 1)
    rows = finite[index]
    least = np.argmin(np.where(np.isnan(rows), np.inf, rows), axis=1)
    greatest = np.argmax(np.where(np.isnan(rows), -np.inf, rows), axis=1)
    row = np.arange(buckets)
    keep = np.unique(np.concatenate([[0, n - 1], index[row, least], index[row, greatest]]))
    return x[keep], y[keep]


def thin_path(x: Array, y: Array) -> tuple[Array, Array]:
    """Draw every stretch of a path once on a grid of ``CELLS`` x ``CELLS``; NaN separates what does not join.

    A vibration goes over the same ground again and again: what is drawn already need not be drawn again.
    """
    good = np.isfinite(x) & np.isfinite(y)
    x, y = x[good], y[good]
    if len(x) < 2:
        return x, y
    span = max(float(np.ptp(x)), float(np.ptp(y)), 1e-300)
    cells = np.stack([np.rint((x - x.min()) / span * CELLS), np.rint((y - y.min()) / span * CELLS)], axis=1)
    moved = np.concatenate([[True], (np.diff(cells, axis=0) != 0).any(axis=1)])
    x, y, cells = x[moved], y[moved], cells[moved]
    place = (cells[:, 0] * (CELLS + 1) + cells[:, 1]).astype(np.int64)
    low, high = np.minimum(place[:-1], place[1:]), np.maximum(place[:-1], place[1:])
    _, first = np.unique(low * (CELLS + 1) ** 2 + high, return_index=True)
    keep = np.zeros(len(low), dtype=bool)
    keep[first] = True
    # A point is drawn if the stretch before or behind it is; a gap is marked on the last point of what was drawn.
    used = np.concatenate([keep, [False]]) | np.concatenate([[False], keep])
    gap = np.concatenate([~keep, [False]]) & used
    parts_x, parts_y = np.repeat(x[used], 1 + gap[used]), np.repeat(y[used], 1 + gap[used])
    last_of_pair = np.cumsum(1 + gap[used])[gap[used]] - 1
    parts_x[last_of_pair] = np.nan
    parts_y[last_of_pair] = np.nan
    return parts_x, parts_y
