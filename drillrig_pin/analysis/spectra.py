"""Amplitude spectra of a vibration, its strongest frequencies and how much of it lies in a band.

The spectrum is that of one Hann window over the whole signal, so that its lines are as narrow as the run allows, padded
with zeros to eight times its length, so that a line between two bins loses at most 0.3 % of its height:

    A(f) = 2 |sum w (x - mean x) exp(-2 pi i f t)| / sum w,

which is A at the frequency of a pure sine of amplitude A. Shares are shares of the mean square of (x - mean x) w.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drillrig_pin.kinematics import Array

#: Bands of a drilling boom [Hz]: its own slow motion, and what the hammer drives.
BOOM_BAND = (0.0, 15.0)
HAMMER_BAND = (15.0, 80.0)

PADDING = 8
#: Length of the segments of an averaged spectrum [s], bins of a quarter of a hertz.
SEGMENT = 4.0
#: Shorter signals have no spectrum worth the name.
FEWEST_SAMPLES = 32
#: A line below this fraction of the tallest one is not told from the side lobes of the window (-31 dB).
SIDE_LOBE = 0.03
#: Lines below this amplitude [m] are rounding, not motion.
ROUNDING = 1e-12


@dataclass(frozen=True, slots=True)
class Spectrum:
    """Spectrum of signals taken together.

    Attributes:
        frequency: (n) [Hz], from 0 to half the sampling rate.
        amplitude: (n, signals), unit of the signals.
        power: (n, signals), fraction of the mean square of all signals together; sums to 1, or is all 0 at rest.
        bin: 1 / T with T the length of the window [Hz]; lines closer than three bins are reported as one.
    """

    frequency: Array
    amplitude: Array
    power: Array
    bin: float

    @property
    def total(self) -> Array:
        """Length of the amplitude vector over the signals, (n)."""
        length: Array = np.sqrt((self.amplitude**2).sum(axis=1))
        return length


@dataclass(frozen=True, slots=True)
class Line:
    """One line of a spectrum: frequency [Hz], amplitude [unit of the signal], its main axis, its share of the power."""

    frequency: float
    amplitude: float
    axis: str
    share: float


def amplitude_spectrum(time: Array, signals: Array) -> Spectrum | None:
    """Spectrum of equally spaced samples.

    Args:
        time: sample times (n) [s]; a last sample off the grid is left out.
        signals: (n, signals).

    Returns:
        The spectrum, or None where there are too few samples.
    """
    time, signals = _on_grid(time, signals)
    n = len(time)
    if n < FEWEST_SAMPLES:
        return None
    step = (time[-1] - time[0]) / (n - 1)
    # Periodic, so that a line at a multiple of 1 / T has no more than the window's three bins.
    window = np.hanning(n + 1)[:-1]
    length = PADDING * n
    transform = np.abs(np.fft.rfft((signals - signals.mean(axis=0)) * window[:, None], length, axis=0))
    # A one-sided spectrum holds every line twice except the first one and, at even length, the last.
    twice = np.full(len(transform), 2.0)
    twice[0] = 1.0
    if length % 2 == 0:
        twice[-1] = 1.0
    power = twice[:, None] * transform**2
    whole = power.sum()
    return Spectrum(
        np.fft.rfftfreq(length, step),
        2.0 * transform / window.sum(),
        power / whole if whole > 0 else power,
        float(1.0 / (n * step)),
    )


def strongest_lines(spectrum: Spectrum, names: Sequence[str], count: int = 5) -> tuple[Line, ...]:
    """The tallest lines, tallest first; frequencies below two bins are drift and left out."""
    total = spectrum.total
    height = max(float(total.max(initial=0.0)) * SIDE_LOBE, ROUNDING)
    per_bin = spectrum.bin / spectrum.frequency[1]
    inner = total[1:-1]
    tops = 1 + np.flatnonzero((inner > total[:-2]) & (inner >= total[2:]) & (inner >= height))
    peaks: list[int] = []
    for top in sorted(tops[spectrum.frequency[tops] >= 2 * spectrum.bin].tolist(), key=lambda top: -total[top]):
        if all(abs(top - peak) >= 3 * per_bin for peak in peaks):
            peaks.append(top)
    lines = []
    for peak in peaks[:count]:
        frequency = float(spectrum.frequency[peak])
        reach = 1.5 * spectrum.bin
        axis = names[int(np.argmax(spectrum.amplitude[peak]))]
        share = band_share(spectrum, frequency - reach, frequency + reach)
        lines.append(Line(frequency, float(total[peak]), axis, share))
    return tuple(lines)


def band_share(spectrum: Spectrum, low: float, high: float) -> float:
    """Share of the mean square at low <= f < high [Hz], from 0 to 1."""
    inside = (spectrum.frequency >= low) & (spectrum.frequency < high)
    return float(spectrum.power[inside].sum())


@dataclass(frozen=True, slots=True)
class AveragedSpectrum:
    """Amplitude spectrum by Welch's method.

    Attributes:
        frequency: (n) [Hz].
        amplitude: (n, signals), unit of the signals: A at the frequency of a lasting sine of amplitude A.
        bin: 1 / T with T the length of a segment [Hz].
        segments: how many were averaged.
    """

    frequency: Array
    amplitude: Array
    bin: float
    segments: int


def averaged_spectrum(time: Array, signals: Array) -> AveragedSpectrum | None:
    """Average the spectra of half-overlapping segments of ``SEGMENT`` (Welch), or of the whole of a shorter signal.

        A(f) = sqrt(2 P(f)),   P the power spectrum (scaling "spectrum") of the signal less the mean of each segment.

    Averaging keeps what lasts and lowers what comes and goes. The window is a flat top: a line between two bins loses
    no more than 0.1 % of its height, for lines that are some five bins wide to each side.

    Args:
        time: equally spaced sample times (n) [s]; a last sample off the grid is left out.
        signals: (n, signals).

    Returns:
        The spectrum, or None where there are too few samples.
    """
    from scipy.signal import welch

    time, signals = _on_grid(time, signals)
    n = len(time)
    if n < FEWEST_SAMPLES:
        return None
    step = (time[-1] - time[0]) / (n - 1)
    length = min(n, max(FEWEST_SAMPLES, round(SEGMENT / step)))
    frequency, power = welch(signals, 1.0 / step, "flattop", length, length // 2, scaling="spectrum", axis=0)
    segments = 1 + (n - length) // (length - length // 2)
    return AveragedSpectrum(frequency, np.sqrt(2.0 * power), float(1.0 / (length * step)), segments)


def _on_grid(time: Array, signals: Array) -> tuple[Array, Array]:
    if len(time) > 2 and not np.isclose(time[-1] - time[-2], time[1] - time[0], rtol=1e-6):
        return time[:-1], signals[:-1]
    return time, signals
