"""A computed signal against a measured one: the CSV, the shift in time between the two, and the errors."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from drillrig_pin.analysis.alignment import Alignment, align
from drillrig_pin.analysis.band_limit import as_sampled, curve_of
from drillrig_pin.errors import ResultFileError
from drillrig_pin.kinematics import Array
from drillrig_pin.series import read_series
from drillrig_pin.units import quantity_of
from drillrig_pin.words import number, percent

MAX_BYTES = 50_000_000
FEWEST = 8
#: A step of the measurement longer than this many times its usual step is a gap.
GAP = 2.5
#: Turning the sign must fit better by this much to be suspected, or leave less than this part of the variance; by less
#: than the last, correlations on a grid do not tell.
CLEARLY, PARTS, GRID = 0.02, 0.2, 2e-3


@dataclass(frozen=True, slots=True)
class Measurement:
    """A measured displacement: sample times (n) [s], values (n) [m], the name of its file, and what was read how."""

    time: Array
    value: Array
    name: str
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Comparison:
    """Computed and measured displacement at the times of the measurement, both less their means over the overlap.

    Attributes:
        time: times of the measured samples in the overlap, shifted (n) [s].
        computed, measured: (n) [m]; the run is evaluated at those times, the measurement stays as it is.
        shift: what was added to the measured times [s].
        correlation: correlation coefficient of the two after the shift.
        rms_error: RMS of (computed - measured) / RMS of measured.
        peak_error: (peak-to-peak computed - measured) / measured, at the measured samples; negative: computed too
            small.
        excluded: measured samples outside the run.
        gaps: gaps of the measurement within the overlap, from and to (k, 2) [s]; nothing is compared there.
        reversed: whether the measurement fits better with its sign turned.
        notes: all that a reader of the numbers must know, in words.
        run_time, run: the run over the overlap as it was compared, at its own times (m) [s], [m].
    """

    time: Array
    computed: Array
    measured: Array
    shift: float
    correlation: float
    rms_error: float
    peak_error: float
    excluded: int
    gaps: Array
    reversed: bool
    notes: tuple[str, ...]
    run_time: Array
    run: Array

    def numbers(self) -> dict[str, object]:
        """The errors as programs read them."""
        return {
            "rms_error": self.rms_error,
            "peak_error": self.peak_error,
            "correlation": self.correlation,
            "shift": self.shift,
            "compared": len(self.time),
            "excluded": self.excluded,
            "gaps": self.gaps.tolist(),
            "reversed": self.reversed,
            "from": float(self.time[0]),
            "to": float(self.time[-1]),
            "notes": list(self.notes),
        }


def read_measurement(path: Path, unit: str | None = None) -> Measurement:
    """Read a CSV of two columns, time and displacement, with a header such as ``time [s], S_z [mm]``.

    Args:
        path: the file; separators comma, semicolon or tab; lines that start with # are passed over.
        unit: unit of the displacement; None: that of the header.

    Raises:
        ResultFileError: not readable, no unit, a unit that is no length, a value that is no number, times that do not
            increase, too few samples.
    """
    where = str(path)
    try:
        # No more is read than is allowed: a device has no size, and no end either.
        with path.open("rb") as stream:
            raw = stream.read(MAX_BYTES + 1)
        if len(raw) > MAX_BYTES:
            raise ResultFileError(f"the measurement is larger than {MAX_BYTES // 1_000_000} MB", where=where)
        text = raw.decode("utf-8-sig")
    except OSError as error:
        raise ResultFileError(f"cannot be read ({error.strerror})", where=where, todo="Check the path.") from None
    except UnicodeDecodeError:
        raise ResultFileError("is not text in UTF-8", where=where) from None
    series = read_series(
        text,
        "measurement",
        lambda line: f"{where}:{line}",
        ResultFileError,
        quantity="length",
        what="the values",
        unit=unit or "",
        jumps=False,
    )
    if len(series.rows) < FEWEST:
        raise ResultFileError(f"holds {len(series.rows)} samples; a comparison needs {FEWEST}", where=where)
    if not (unit or series.units[1]):
        todo = "Write it in the header, as in 'time [s], S_z [mm]', or give --measured-unit."
        raise ResultFileError("does not say the unit of its values", where=where, todo=todo)
    notes = []
    if unit and quantity_of(series.units[1]) and unit != series.units[1]:
        notes.append(f"values are read in {unit}, as asked, although the header says {series.units[1]}")
    table = np.array(series.rows)
    return Measurement(table[:, 0], table[:, 1], path.name, tuple(notes))


def compare_with(
    time: Array, computed: Array, measurement: Measurement, shift: float | None = None
) -> Comparison | None:
    """Evaluate the run at the times of the measurement, and measure what is left.

    Between its rows the run is a cubic spline. What it holds above half the rate of the measurement, an instrument has
    taken out before it sampled or shows folded to other frequencies: if that is more than 1 % of the run's RMS, the run
    is compared with it and without it, and the nearer one counts. Straight lines between samples of a measurement would
    lose 1 - sinc^2(f / f_s) of a vibration; the measurement is never interpolated, and nothing is compared in its gaps.

    Args:
        time, computed: of the run (n), times increasing.
        measurement: what it is compared with.
        shift: what is added to the measured times [s]; None: where the correlation is greatest, see
            :func:`drillrig_pin.analysis.alignment.align`.

    Returns:
        The comparison, or None where one of the signals does not move or they have too little in common.
    """
    rows = np.concatenate([[True], np.diff(time) > 1e-3 * float(np.median(np.diff(time)))])
    time, computed = time[rows], computed[rows]
    t, value = measurement.time, measurement.value
    usual = float(np.median(np.diff(t)))
    if min(len(time), len(t)) < FEWEST or np.ptp(computed) == 0 or np.ptp(value) == 0:
        return None
    notes = list(measurement.notes)
    run = curve_of(time, computed)
    found: Alignment | None = None
    if shift is None:
        step = 0.5 * min(float(np.median(np.diff(time))), usual)
        found = align(float(time[0]), float(time[-1]), run, step, t, value)
        if found is None:
            return None
        shift = _refined(time, run, t, value, found.shift, step)
    # The shift is found to a small part of a step: the sample at the very end still belongs to the run.
    slack = 1e-3 * usual
    inside = (t + shift >= time[0] - slack) & (t + shift <= time[-1] + slack)
    if inside.sum() < FEWEST:
        return None
    at = np.clip(t[inside] + shift, time[0], time[-1])
    computed, run = as_sampled(time, computed, at, value[inside], usual, notes)
    ours, theirs = run(at), value[inside]
    ours, theirs = ours - ours.mean(), theirs - theirs.mean()
    rms, size = (float(np.sqrt((x**2).mean())) for x in (theirs, ours))
    if rms == 0 or size == 0:
        return None
    correlation = float(np.clip((ours * theirs).mean() / (rms * size), -1.0, 1.0))
    turned = _turned(found, correlation, notes)
    if turned and found is not None:
        there = compare_with(time, computed, Measurement(t, -value, ""), found.turned[0])
        if there is not None:
            notes[-1] += f"; the RMS error is then {percent(there.rms_error)}"
    if found is not None and not turned and found.others:
        nearest = ", ".join(f"{other:+.4g} s" for other in found.others[:3])
        notes.append(
            f"other shifts fit as well ({nearest}; {len(found.others)} in all): the signal repeats itself; fix one "
            "with --shift"
        )
    steps = np.flatnonzero(np.diff(at) > GAP * usual)
    gaps = np.column_stack([at[steps], at[steps + 1]])
    outside = int(len(t) - inside.sum())
    if len(gaps):
        whole = float((gaps[:, 1] - gaps[:, 0]).sum())
        longest = max(gaps.tolist(), key=lambda gap: gap[1] - gap[0])
        notes.append(
            f"gaps of the measurement are left out: {len(gaps)}, {number(whole, 3)} s in all, the longest from "
            f"{longest[0]:.4g} to {longest[1]:.4g} s"
        )
    if outside:
        notes.append(f"{outside} of {len(t)} measured samples lie outside the run and are left out")
    shown = (time >= at[0]) & (time <= at[-1])
    return Comparison(
        at,
        ours,
        theirs,
        float(shift),
        correlation,
        float(np.sqrt(((ours - theirs) ** 2).mean())) / rms,
        float(np.ptp(ours) / np.ptp(theirs) - 1.0),
        outside,
        gaps,
        turned,
        tuple(notes),
        time[shown],
        computed[shown] - float(run(at).mean()),
    )


def _refined(time: Array, run: Callable[[Array], Array], t: Array, value: Array, shift: float, step: float) -> float:
    """The shift of the greatest correlation within a step of the grid."""
    from scipy.optimize import minimize_scalar

    inside = (t + shift - step >= time[0]) & (t + shift + step <= time[-1])
    if inside.sum() < FEWEST:
        return shift
    at, theirs = t[inside], value[inside] - value[inside].mean()

    def against(offset: float) -> float:
        ours = run(at + offset)
        ours = ours - ours.mean()
        size = float(np.sqrt((ours**2).sum() * (theirs**2).sum()))
        return -float(ours @ theirs) / size if size else 0.0

    best = minimize_scalar(against, bounds=(shift - step, shift + step), method="bounded", options={"xatol": 1e-7})
    return float(best.x) if best.fun < against(shift) else shift


def _turned(found: Alignment | None, correlation: float, notes: list[str]) -> bool:
    """Whether the sign of the measurement seems reversed; what is to be said about it."""
    if found is None:
        if correlation < -0.5:
            notes.append(
                f"the sign (polarity) of the measurement seems reversed: correlation {correlation:.3f} at this shift"
            )
            return True
        return False
    shift, fit = found.turned
    left = (1 - fit**2) < PARTS * (1 - found.correlation**2)
    if fit > found.correlation + CLEARLY or (left and fit > found.correlation + GRID):
        notes.append(
            f"the sign (polarity) of the measurement seems reversed: turned, its correlation is {fit:.3f} at a shift "
            f"of {shift:+.4g} s, as it is {found.correlation:.3f}"
        )
        return True
    if fit > found.correlation - CLEARLY and fit > 0.5:
        notes.append(f"with its sign turned it fits as well, at a shift of {shift:+.4g} s: nothing here tells its sign")
    return False
