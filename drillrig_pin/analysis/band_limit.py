"""A run as an instrument of a given rate would show it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from drillrig_pin.kinematics import Array
from drillrig_pin.words import percent

#: Part of the run's RMS above half the rate of the measurement from which it matters whether the instrument took it out
#: before it sampled. Below, it is no more than the errors judged here.
ABOVE = 0.01
LONGEST = 4_000_000


def curve_of(time: Array, values: Array) -> Callable[[Array], Array]:
    """Cubic spline through the rows of a run (n)."""
    from scipy.interpolate import CubicSpline

    spline: Callable[[Array], Array] = CubicSpline(time, values)
    return spline


def as_sampled(
    time: Array, computed: Array, at: Array, measured: Array, usual: float, notes: list[str]
) -> tuple[Array, Callable[[Array], Array]]:
    """The run as it is or without what the measurement cannot hold, whichever is nearer to the measurement."""
    run = curve_of(time, computed)
    limited = _band_limited(time, computed, usual)
    if limited is None:
        return computed, run
    kept, share = limited
    other = curve_of(time, kept)

    def missed(curve: Callable[[Array], Array]) -> float:
        difference = curve(at) - measured
        return float(np.std(difference))

    without = missed(other) < missed(run)
    notes.append(
        f"{percent(share)} of the run lies above half the rate of the measurement ({0.5 / usual:.4g} Hz), which shows "
        f"it folded or not at all; it is compared {'without' if without else 'with'} it, which fits better"
    )
    return (kept, other) if without else (computed, run)


def _band_limited(time: Array, values: Array, usual: float) -> tuple[Array, float] | None:
    """The run without what a measurement of that rate cannot hold, and that part of its RMS; None: too little."""
    half = 0.5 / usual
    count = int(min((time[-1] - time[0]) / float(np.median(np.diff(time))) + 1, LONGEST))
    if count < 3 or half >= 0.5 * (count - 1) / float(time[-1] - time[0]):
        return None
    even = np.linspace(time[0], time[-1], count)
    frequency = np.fft.rfftfreq(count, float(even[1] - even[0]))
    signal = np.asarray(curve_of(time, values)(even))
    power = np.abs(np.fft.rfft((signal - signal.mean()) * np.hanning(count))) ** 2
    share = float(np.sqrt(power[frequency > half].sum() / power.sum())) if power.sum() else 0.0
    if share <= ABOVE:
        return None
    # Turned over at both ends, so that the ends of the run are no steps.
    longer = np.concatenate([2 * signal[0] - signal[:0:-1], signal, 2 * signal[-1] - signal[-2::-1]])
    spectrum = np.fft.rfft(longer)
    spectrum[np.fft.rfftfreq(len(longer), float(even[1] - even[0])) > half] = 0.0
    kept = np.fft.irfft(spectrum, len(longer))[count - 1 : 2 * count - 1]
    return np.asarray(curve_of(even, kept)(time)), share
