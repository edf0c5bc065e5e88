"""Where in time a measurement belongs beside a run: correlation over the samples both have, at every shift."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from drillrig_pin.kinematics import Array

#: The two signals must overlap by at least this part of the shorter one.
OVERLAP = 0.5
#: Longest grid the correlations are computed on: a measurement with a gap of days in it must not fill the memory.
MOST = 2_000_000
#: Shifts whose correlation comes this near to the best fit as well.
AS_WELL = 0.02


@dataclass(frozen=True, slots=True)
class Alignment:
    """Shifts that fit.

    Attributes:
        shift: what is added to the measured times [s].
        others: further shifts that fit as well, the nearest first (n) [s].
        turned: the shift that fits best if the sign of the measurement is turned [s], with the correlation it gives.
        correlation: at ``shift``.
    """

    shift: float
    others: tuple[float, ...]
    turned: tuple[float, float]
    correlation: float


def align(
    start: float, end: float, run: Callable[[Array], Array], step: float, time: Array, value: Array
) -> Alignment | None:
    """The shift of the greatest correlation coefficient, times the root of the share of the shorter signal in common.

    Both signals are taken less their means over what they have in common. The run is laid on a grid of ``step``, each
    measured sample on the nearest point of it, so that gaps of the measurement count for nothing.

    Args:
        start, end: of the run [s].
        run: its value at given times.
        step: of the grid [s].
        time, value: of the measurement (n), times increasing.

    Returns:
        None where no shift leaves half of the shorter signal in common.
    """
    step = max(step, (end - start + time[-1] - time[0]) / MOST)
    a = run(np.minimum(np.arange(start, end + 0.5 * step, step), end))
    place = np.rint((time - time[0]) / step).astype(np.int64)
    size = int(place[-1]) + 1
    less = value - value.mean()
    count, y, y2 = (np.asarray(np.bincount(place, w, size), dtype=float) for w in (np.ones(len(time)), less, less**2))
    fit, share, lags = _correlations(a - a.mean(), count, y, y2)
    usable = share >= OVERLAP
    if not usable.any():
        return None
    score = np.where(usable, fit * np.sqrt(share), -np.inf)
    against = np.where(usable, -fit * np.sqrt(share), -np.inf)
    best, turned = int(np.argmax(score)), int(np.argmax(against))
    at = start - time[0]
    peaks = _peaks(np.where(usable, fit, -np.inf))
    others = [i for i in peaks if abs(i - best) > 1 and fit[i] >= fit[best] - AS_WELL and fit[best] > 0.5]
    others.sort(key=lambda i: abs(i - best))
    return Alignment(
        at + float(lags[best]) * step,
        tuple(at + float(lags[i]) * step for i in others),
        (at + float(lags[turned]) * step, float(-fit[turned])),
        float(fit[best]),
    )


def _correlations(a: Array, count: Array, y: Array, y2: Array) -> tuple[Array, Array, Array]:
    """Correlation coefficient, share of the shorter signal in common, and lag, at every lag of y behind a."""
    from scipy.signal import correlate, correlation_lags

    ones = np.ones(len(a))
    lags = correlation_lags(len(a), len(y))
    n, s_a, s_aa = correlate(ones, count), correlate(a, count), correlate(a * a, count)
    s_y, s_yy, s_ay = correlate(ones, y), correlate(ones, y2), correlate(a, y)
    n = np.maximum(np.rint(n), 0.0)
    energy = np.maximum(n * s_aa - s_a**2, 0.0) * np.maximum(n * s_yy - s_y**2, 0.0)
    # Below this much of the whole energy the overlap holds rounding.
    floor = 1e-20 * float((len(a) * (a @ a)) * (count.sum() * y2.sum()))
    with np.errstate(all="ignore"):
        fit = np.where(energy > floor, (n * s_ay - s_a * s_y) / np.sqrt(energy), 0.0)
    spans = np.minimum(len(a), lags + len(y)) - np.maximum(0, lags)
    return np.clip(fit, -1.0, 1.0), spans / min(len(a), len(y)), lags


def _peaks(fit: Array) -> list[int]:
    """Inner local maxima."""
    higher = (fit[1:-1] >= fit[:-2]) & (fit[1:-1] > fit[2:]) & np.isfinite(fit[1:-1])
    return [int(i) + 1 for i in np.flatnonzero(higher)]
