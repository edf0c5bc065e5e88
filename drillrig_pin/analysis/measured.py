"""A computed signal against a measured one: the CSV, the shift in time between the two, and the errors."""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from drillrig_pin.errors import ResultFileError, legal_names
from drillrig_pin.kinematics import Array

#: Units a measurement of a displacement may have, as factor to metres.
LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "µm": 1e-6}
TIMES = {"s": 1.0, "ms": 1e-3}
MAX_BYTES = 50_000_000
#: The two signals must overlap by at least this part of the shorter one.
OVERLAP = 0.5
FEWEST = 8
#: A measurement with a gap of days in it must not fill the memory.
MOST = 2_000_000


@dataclass(frozen=True, slots=True)
class Measurement:
    """A measured displacement: sample times (n) [s], values (n) [m], and the words of its header."""

    time: Array
    value: Array
    name: str


@dataclass(frozen=True, slots=True)
class Comparison:
    """Computed and measured displacement on one time axis, both less their means over the overlap.

    Attributes:
        time: times of the computed run in the overlap (n) [s].
        computed, measured: (n) [m].
        shift: what was added to the measured times [s].
        correlation: correlation coefficient of the two after the shift.
        rms_error: RMS of (computed - measured) / RMS of measured.
        peak_error: (peak-to-peak computed - measured) / measured; negative: computed too small.
    """

    time: Array
    computed: Array
    measured: Array
    shift: float
    correlation: float
    rms_error: float
    peak_error: float


def read_measurement(path: Path, unit: str | None = None) -> Measurement:
    """Read a CSV of two columns, time and displacement, with a header such as ``time [s], S_z [mm]``.

    Args:
        path: the file; separators comma, semicolon or tab; lines that start with # are passed over.
        unit: unit of the displacement; None: from the header's brackets.

    Raises:
        ResultFileError: not readable, no unit, a unit that is no length, a value that is no number, times that do not
            increase, too few samples.
    """
    where = str(path)
    try:
        if path.stat().st_size > MAX_BYTES:
            raise ResultFileError(f"the measurement is larger than {MAX_BYTES // 1_000_000} MB", where=where)
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise ResultFileError(f"cannot be read ({error.strerror})", where=where, todo="Check the path.") from None
    except UnicodeDecodeError:
        raise ResultFileError("is not text in UTF-8", where=where) from None
    lines = [(i, line) for i, line in enumerate(text.splitlines(), 1) if line.strip() and not line.startswith("#")]
    separator = next((mark for mark in (";", "\t") if lines and mark in lines[0][1]), ",")
    header: list[str] = []
    rows: list[tuple[float, float]] = []
    for number, line in lines:
        cells = [cell.strip() for cell in next(csv.reader([line], delimiter=separator))]
        try:
            t, value = float(cells[0]), float(cells[1])
        except (ValueError, IndexError):
            if not rows and not header:
                header = cells
                continue
            raise ResultFileError("needs two numbers, time and value", where=f"{where}:{number}") from None
        if not np.isfinite([t, value]).all() or (rows and t <= rows[-1][0]):
            raise ResultFileError("times must increase and values be finite", where=f"{where}:{number}")
        rows.append((t, value))
    if len(rows) < FEWEST:
        raise ResultFileError(f"holds {len(rows)} samples; a comparison needs {FEWEST}", where=where)
    table = np.array(rows)
    in_header = [_bracketed(cell) for cell in (*header, "", "")][:2]
    time_factor = TIMES.get(in_header[0] or "s")
    if time_factor is None:
        raise ResultFileError(f"the time is in {in_header[0]!r}", where=where, todo=legal_names("", TIMES, "units"))
    given = unit or in_header[1]
    if not given:
        todo = "Write it in the header, as in 'time [s], S_z [mm]', or give --measured-unit."
        raise ResultFileError("does not say the unit of its values", where=where, todo=todo)
    if given not in LENGTHS:
        raise ResultFileError(f"{given!r} is no unit of length", where=where, todo=legal_names(given, LENGTHS, "units"))
    return Measurement(table[:, 0] * time_factor, table[:, 1] * LENGTHS[given], path.name)


def _bracketed(cell: str) -> str:
    found = re.search(r"[\[(]\s*([^\])]*?)\s*[\])]", cell)
    return found.group(1) if found else ""


def compare_with(time: Array, computed: Array, measurement: Measurement) -> Comparison | None:
    """Shift the measurement to where it fits best and measure what is left.

    The shift is the lag of the greatest correlation coefficient of the two signals less their means, times the root of
    the share of the shorter one that overlaps (at least half), so that of the many fits of a periodic signal the
    longest one wins. Both are resampled to the finer of their steps; a parabola through its neighbours refines the
    maximum. Errors are those of the overlap.

    Returns:
        The comparison, or None where one of the signals does not move or they are too short.
    """
    span = max(time[-1] - time[0], measurement.time[-1] - measurement.time[0])
    step = min(float(np.median(np.diff(time))), float(np.median(np.diff(measurement.time))))
    step = max(step, float(span) / MOST)
    t_a = np.arange(time[0], time[-1] + 0.5 * step, step)
    t_b = np.arange(measurement.time[0], measurement.time[-1] + 0.5 * step, step)
    a, b = np.interp(t_a, time, computed), np.interp(t_b, measurement.time, measurement.value)
    if min(len(a), len(b)) < FEWEST or np.ptp(a) == 0 or np.ptp(b) == 0:
        return None
    lag, correlation = _best_lag(a - a.mean(), b - b.mean())
    shift = t_a[0] - t_b[0] + lag * step
    inside = (time >= measurement.time[0] + shift) & (time <= measurement.time[-1] + shift)
    if inside.sum() < FEWEST:
        return None
    ours = computed[inside] - computed[inside].mean()
    theirs = np.interp(time[inside] - shift, measurement.time, measurement.value)
    theirs = theirs - theirs.mean()
    rms = float(np.sqrt((theirs**2).mean()))
    if rms == 0:
        return None
    return Comparison(
        time[inside],
        ours,
        theirs,
        float(shift),
        correlation,
        float(np.sqrt(((ours - theirs) ** 2).mean())) / rms,
        float(np.ptp(ours) / np.ptp(theirs) - 1.0),
    )


def _best_lag(a: Array, b: Array) -> tuple[float, float]:
    """Samples by which b must be moved to the right to fit a, to a fraction of a sample, and the correlation there."""
    from scipy.signal import correlate, correlation_lags

    lags = correlation_lags(len(a), len(b))
    product = correlate(a, b)
    # Energy of each signal in the overlap at every lag, so that a short overlap is not taken for a good fit.
    energy = correlate(a**2, np.ones(len(b))) * correlate(np.ones(len(a)), b**2)
    overlap = np.minimum(len(a), lags + len(b)) - np.maximum(0, lags)
    share = overlap / min(len(a), len(b))
    fit = np.where((share >= OVERLAP) & (energy > 0), product / np.sqrt(np.maximum(energy, 1e-300)), -np.inf)
    best = int(np.argmax(np.where(np.isfinite(fit), fit * np.sqrt(np.maximum(share, 0.0)), -np.inf)))
    lag, height = float(lags[best]), float(fit[best])
    if 0 < best < len(fit) - 1 and np.isfinite(fit[best - 1 : best + 2]).all():
        left, middle, right = fit[best - 1 : best + 2]
        bend = left - 2.0 * middle + right
        if bend < 0:
            lag += 0.5 * float(left - right) / float(bend)
    return lag, min(height, 1.0)
