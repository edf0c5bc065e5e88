"""A load table between its rows: straight lines, held values, or a curve, and what decided which."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from drillrig_pin.elements.base import Law
from drillrig_pin.kinematics import Array

Reading = Literal["auto", "linear", "hold", "spline", "cubic"]

#: `auto` takes the cubic only where it nowhere leaves the range of two neighbouring rows by more than this part of the
#: range of all rows: the top of a sine between its samples does so from seven samples a period on.
BEYOND = 0.05
#: ... and where a cubic through the two rows on either side of a row misses it by no more than this part: a sine of
#: nine samples a period. The curve itself, which has that row too, is then about sixteen times nearer to the truth.
MISSED = 0.02
#: With fewer rows than this there is little to judge by: they must be those of one cubic, to rounding.
FEW_ROWS = 8
ROUNDING = 1e-9
#: A curve that leaves the range of its rows by more than this part is warned of.
OUTSIDE = 0.03


@dataclass(frozen=True, slots=True)
class Choice:
    """How a table is read between its rows, and why; ``why`` is empty where the model file says so itself."""

    reading: Reading
    why: str = ""


class TableLaw(Law):
    """F(t) = r(t) c_i(t) between rows i and i + 1, c_i of degree three at most; r as in :class:`HarmonicLaw`.

    - ``linear``: straight lines;
    - ``hold``: the value of the last row (zero order);
    - ``spline``: monotone between neighbours, never beyond them (F. N. Fritsch and J. Butland, SIAM J. Sci. Stat.
      Comput. 5 (1984) 300-304; SciPy's PCHIP);
    - ``cubic``: twice continuously differentiable, not-a-knot; exact for cubics, beyond its rows at corners;
    - ``auto``: ``cubic`` where the rows are smooth and dense enough for it (:data:`BEYOND`, :data:`MISSED`), else
      ``linear``.

    Two rows at one time are a jump; the second counts from that time on. A curve has its ends there.

    Args:
        time: of the rows (n) [s]; increasing, at most two alike.
        value: of the rows (n) [N or N m].
        reading: how to read between them.
        ramp: time of a smooth start from zero [s].
    """

    def __init__(self, time: Array, value: Array, reading: Reading = "auto", ramp: float = 0.0) -> None:
        self.time, self.value, self.ramp = time, value, ramp
        self._twice = np.flatnonzero(np.diff(time) == 0.0)
        self.choice = _choose(time, value, self._twice) if reading == "auto" else Choice(reading)
        self._spline = _curve(time, value, self.choice.reading, self._twice)
        self._breaks, self._jumps = _breaks(self._spline, self.choice.reading, time)

    def force(self, x: Array, xdot: Array, t: float) -> Array:
        """F(t) [N or N m]; outside the table its end values are kept (a run that long is refused beforehand)."""
        value = np.atleast_1d(self._spline(min(max(t, self.time[0]), self.time[-1])))
        if self.ramp <= 0 or t >= self.ramp:
            return value
        s = t / self.ramp
        return np.asarray((s * s * s * (10.0 + s * (6.0 * s - 15.0))) * value)

    def knots(self) -> Array:
        """Times and coefficients of the cubic behind each, highest power first, (n, 5); none behind the last."""
        curve = self._spline
        rows = np.zeros((len(curve.x), 5))
        rows[:, 0] = curve.x
        rows[:-1, 5 - len(curve.c) :] = curve.c.T
        return rows

    def breakpoints(self) -> Array:
        """Where a curve goes on as another: every row of a spline, corners of lines, changes of held values."""
        return np.append(self._breaks, self.ramp) if self.ramp else self._breaks

    def jumps(self) -> Array:
        """Where the force itself jumps."""
        return self._jumps

    def extremes(self) -> tuple[float, float]:
        """Least and largest value of the curve over the whole table, its ramp left out [N or N m]."""
        low, high = _extremes(self._spline)
        return float(low.min()), float(high.max())


def _curve(time: Array, value: Array, reading: Reading, twice: Any) -> Any:
    """The curve as piecewise polynomials over distinct times, those of a jump being the ones behind it."""
    from scipy.interpolate import PPoly

    starts, ends = [0, *(twice + 1).tolist()], [*(twice + 1).tolist(), len(time)]
    pieces = []
    for start, end in zip(starts, ends, strict=True):
        if end - start > 1:
            pieces.append(_piece(time[start:end], value[start:end], reading))
    degree = max(len(piece.c) for piece in pieces)
    c = [np.pad(piece.c, ((degree - len(piece.c), 0), (0, 0))) for piece in pieces]
    curve = PPoly(np.hstack(c), np.concatenate([*(piece.x[:-1] for piece in pieces), pieces[-1].x[-1:]]))
    if reading == "hold" or (len(twice) and twice[-1] == len(time) - 2):
        # The last row counts from its time on.
        curve.extend(np.append(np.zeros(degree - 1), value[-1])[:, None], np.array([time[-1] + 1.0]))
    return curve


def _piece(time: Array, value: Array, reading: Reading) -> Any:
    from scipy.interpolate import CubicSpline, PchipInterpolator, PPoly

    if reading == "hold":
        return PPoly(value[None, :-1], time)
    if reading == "linear" or len(time) == 2:
        return PPoly(np.vstack([np.diff(value) / np.diff(time), value[:-1]]), time)
    with np.errstate(all="ignore"):
        return PchipInterpolator(time, value) if reading == "spline" else CubicSpline(time, value)


def _breaks(curve: Any, reading: Reading, time: Array) -> tuple[Array, Array]:
    """Times at which the curve is not smooth, and those of them at which it jumps."""
    c, x = curve.c, curve.x
    reached, size = _at_ends(x, c)[:-1], _at_ends(x, np.abs(c))[:-1]
    jumps = np.abs(c[-1, 1:] - reached) > 1e-12 * (size + np.abs(c[-1, 1:]))
    if reading in ("linear", "hold"):
        bends = jumps if len(c) < 2 else jumps | (np.diff(c[-2]) != 0.0)
        inner = x[1:-1][bends]
    else:
        inner = x[1:-1]
    return np.unique([x[0], *inner, time[-1]]), x[1:-1][jumps]


def _at_ends(x: Array, c: Array) -> Array:
    """Value of every polynomial at the end of its interval."""
    h, value = np.diff(x), np.zeros(len(x) - 1)
    for row in c:
        value = value * h + row
    return value


def _extremes(curve: Any) -> tuple[Array, Array]:
    """Least and largest value within every interval."""
    c = np.pad(curve.c, ((4 - len(curve.c), 0), (0, 0)))
    h = np.diff(curve.x)
    found = [c[3], _at_ends(curve.x, c)]
    with np.errstate(all="ignore"):
        # Roots of 3 c0 d^2 + 2 c1 d + c2, without cancellation.
        b = c[1] + np.copysign(np.sqrt(np.maximum(c[1] ** 2 - 3 * c[0] * c[2], 0.0)), c[1])
        for d in (-b / (3 * c[0]), -c[2] / b):
            inside = np.where(np.isfinite(d), np.clip(d, 0.0, h), 0.0)
            found.append(((c[0] * inside + c[1]) * inside + c[2]) * inside + c[3])
    return np.minimum.reduce(found), np.maximum.reduce(found)


def _choose(time: Array, value: Array, twice: Any) -> Choice:
    """Cubic where it adds nothing of its own, else linear."""
    if len(twice):
        return Choice("linear", f"two rows at t = {time[twice[0]]:g} s are a jump")
    if len(time) < 5:
        return Choice("linear", f"{len(time)} rows do not show that a curve would be right")
    whole = float(np.ptp(value))
    if whole == 0.0:
        return Choice("linear", "all rows are alike")
    low, high = _extremes(_curve(time, value, "cubic", twice))
    beyond = np.maximum(high - np.maximum(value[1:], value[:-1]), np.minimum(value[1:], value[:-1]) - low)
    worst = int(np.argmax(np.where(np.isfinite(beyond), beyond, np.inf)))
    if not beyond[worst] <= BEYOND * whole:
        return Choice(
            "linear",
            f"a cubic would leave its neighbours behind t = {time[worst]:g} s by {beyond[worst] / whole:.2g} times "
            "the range of all rows",
        )
    few = len(time) < FEW_ROWS
    missed = _missed(time, value) / whole
    worst = int(np.argmax(np.where(np.isfinite(missed), missed, np.inf)))
    if not missed[worst] <= (ROUNDING if few else MISSED):
        return Choice(
            "linear",
            f"a cubic through its neighbours misses the row at t = {time[worst + 2]:g} s by {missed[worst]:.2g} of the "
            "range of all rows",
        )
    return Choice("cubic", f"a cubic through its neighbours misses no row by more than {missed.max():.1g} of the range")


def _missed(time: Array, value: Array) -> Array:
    """How far the cubic through the two rows on either side passes every inner row (n - 4)."""
    at = time[2:-2]
    nodes = [time[:-4], time[1:-3], time[3:-1], time[4:]]
    values = [value[:-4], value[1:-3], value[3:-1], value[4:]]
    predicted = np.zeros(len(at))
    with np.errstate(all="ignore"):
        for i in range(4):
            weight = np.ones(len(at))
            for j in range(4):
                if i != j:
                    weight = weight * ((at - nodes[j]) / (nodes[i] - nodes[j]))
            predicted += weight * values[i]
    return np.asarray(np.abs(predicted - value[2:-2]))
