"""Amplitude spectra of a vibration, its strongest frequencies and how much of it lies between two frequencies.

The spectrum is that of one Hann window over the whole signal, so that its lines are as narrow as the run allows, padded
with zeros to eight times its length, so that a line between two bins loses at most 0.3 % of its height:

    A(f) = 2 |sum w (x - mean x) exp(-2 pi i f t)| / sum w,

which is A at the frequency of a pure sine of amplitude A. Shares are shares of the mean square of (x - mean x) w.

Signals along several axes move together on an ellipse at each frequency. With c the vector of their complex amplitudes,

    a^2 = (|c|^2 + |c . c|) / 2,   b^2 = (|c|^2 - |c . c|) / 2

are its semi-axes, and the real part of c exp(-i arg(c . c) / 2) points along the major one. The amplitude of a line is
a: how far the point goes at most to either side. On a circle a = b is its radius.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drillrig_pin.kinematics import Array

#: Bands that shares are given of [Hz]. What moves in them, the machine by itself or a load, the lines say.
BOOM_BAND = (0.0, 15.0)
HAMMER_BAND = (15.0, 80.0)

PADDING = 8
#: Length of the segments of an averaged spectrum [s], bins of a quarter of a hertz.
SEGMENT = 4.0
#: Shorter signals have no spectrum worth the name.
FEWEST_SAMPLES = 32
#: A line below this fraction of the tallest one is not told from the side lobes of the window (-31 dB).
SIDE_LOBE = 0.03
#: Rows within this part of a step of their place are at it.
GRID = 1e-4
#: Of a load table counts what this share of its mean square lies below.
MOST = 0.999
#: Lines below this amplitude [m] are rounding, not motion.
ROUNDING = 1e-12
#: An ellipse whose minor semi-axis is at least this part of the major one is an orbit, not a motion to and fro.
ORBIT = 0.5
#: Components of a direction below this part of the largest one are not named.
NAMED = 0.5


@dataclass(frozen=True, slots=True)
class Spectrum:
    """Spectrum of signals taken together.

    Attributes:
        frequency: (n) [Hz], from 0 to half the sampling rate.
        amplitude: (n, signals), unit of the signals.
        power: (n, signals), fraction of the mean square of all signals together; sums to 1, or is all 0 at rest.
        bin: 1 / T with T the length of the window [Hz]; lines closer than three bins are reported as one.
        phasor: complex amplitudes, (n, signals).
    """

    frequency: Array
    amplitude: Array
    power: Array
    bin: float
    phasor: Array

    @property
    def major(self) -> Array:
        """Major semi-axis of the ellipse at every frequency, (n)."""
        square, turned = self._squares()
        length: Array = np.sqrt(0.5 * (square + turned))
        return length

    @property
    def minor(self) -> Array:
        """Minor semi-axis, (n)."""
        square, turned = self._squares()
        length: Array = np.sqrt(np.maximum(0.5 * (square - turned), 0.0))
        return length

    def direction(self, row: int) -> Array:
        """Unit vector along the major semi-axis at one frequency, its largest component positive, (signals)."""
        c = self.phasor[row]
        way = (c * np.exp(-0.5j * np.angle(np.sum(c * c)))).real
        length = float(np.linalg.norm(way)) or 1.0
        found: Array = way / length * (np.sign(way[np.argmax(np.abs(way))]) or 1.0)
        return found

    def _squares(self) -> tuple[Array, Array]:
        return (self.amplitude**2).sum(axis=1), np.abs((self.phasor**2).sum(axis=1))


@dataclass(frozen=True, slots=True)
class Line:
    """One line of a spectrum.

    Attributes:
        frequency: [Hz].
        amplitude: major semi-axis of the ellipse the signals move on [unit of the signal].
        axis: along what, by the names of the signals: ``z``, ``x+y`` for a slanting motion, ``x–y`` for an orbit in
            that plane.
        share: of the power.
        minor: minor semi-axis [unit of the signal].
        direction: unit vector along the major one; of a circle any that lies in it.
    """

    frequency: float
    amplitude: float
    axis: str
    share: float
    minor: float = 0.0
    direction: tuple[float, ...] = ()

    @property
    def orbit(self) -> bool:
        """Whether the motion goes around rather than to and fro."""
        return self.minor >= ORBIT * self.amplitude > 0

    @property
    def way(self) -> str:
        """In words: ``along z``, ``on an orbit in x–y``."""
        return f"on an orbit in {self.axis}" if self.orbit else f"along {self.axis}"


def amplitude_spectrum(time: Array, signals: Array) -> Spectrum | None:
    """Spectrum of the equally spaced rows among those given.

    Args:
        time: increasing times (n) [s].
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
    transform = np.fft.rfft((signals - signals.mean(axis=0)) * window[:, None], length, axis=0)
    phasor = 2.0 * transform / window.sum()
    # A one-sided spectrum holds every line twice except the first one and, at even length, the last.
    twice = np.full(len(transform), 2.0)
    twice[0] = 1.0
    if length % 2 == 0:
        twice[-1] = 1.0
    power = twice[:, None] * np.abs(transform) ** 2
    whole = power.sum()
    return Spectrum(
        np.fft.rfftfreq(length, step),
        np.abs(phasor),
        power / whole if whole > 0 else power,
        float(1.0 / (n * step)),
        phasor,
    )


def strongest_lines(spectrum: Spectrum, names: Sequence[str], count: int = 5) -> tuple[Line, ...]:
    """The tallest lines, tallest first; frequencies below two bins are drift and left out."""
    total = spectrum.major
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
        share = band_share(spectrum, frequency - reach, frequency + reach)
        minor, direction = float(spectrum.minor[peak]), spectrum.direction(peak)
        around = minor >= ORBIT * total[peak]
        axis = _plane(spectrum.amplitude[peak], names) if around else _way(direction, names)
        lines.append(Line(frequency, float(total[peak]), axis, share, minor, tuple(direction.tolist())))
    return tuple(lines)


def _way(direction: Array, names: Sequence[str]) -> str:
    """The axes a direction lies along, the largest component first, with the signs of the others: ``x+y``."""
    order = np.argsort(-np.abs(direction), kind="stable")
    words = names[int(order[0])]
    for i in order[1:].tolist():
        if abs(direction[i]) >= NAMED * abs(direction[order[0]]):
            words += f"{'+' if direction[i] > 0 else '−'}{names[i]}"
    return words


def _plane(amplitude: Array, names: Sequence[str]) -> str:
    """The two axes with the largest amplitudes, in their order: ``x–y``."""
    return "–".join(names[i] for i in sorted(np.argsort(-amplitude, kind="stable")[:2].tolist()))


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
        time: increasing times (n) [s], of which the equally spaced ones count.
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


def table_frequency(time: Array, value: Array) -> float:
    """Frequency below which ``MOST`` of the mean square of a load table lies [Hz]; 0 for one that does not change.

    At most the one that the table's own rows can show, 2.5 of them in a period.
    """
    step = float(np.median(np.diff(time)))
    even = np.arange(time[0], time[-1] + 0.5 * step, step)
    if len(even) < 4:
        return 0.0
    signal = np.interp(even, time, value)
    power = np.abs(np.fft.rfft((signal - signal.mean()) * np.hanning(len(even)))) ** 2
    whole = power.sum()
    if not whole > 0:
        return 0.0
    row = int(np.searchsorted(np.cumsum(power), MOST * whole))
    return min(float(np.fft.rfftfreq(len(even), step)[min(row, len(power) - 1)]), 0.4 / step)


def _on_grid(time: Array, signals: Array) -> tuple[Array, Array]:
    """The rows at equal distances; those between them are left out. A curve through the rows where there are none."""
    if len(time) < 3:
        return time, signals
    steps = np.diff(time)
    # Rows in between only shorten steps: the usual step is the longest that occurs more than a few times.
    step = float(np.quantile(steps, 0.99)) if len(steps) > 100 else float(steps.max())
    # Rows stand at multiples of their step; a signal cut out of others counts from its own first row.
    for origin in (0.0, float(time[0])):
        place = (time - origin) / step
        rows = np.flatnonzero(np.abs(place - np.rint(place)) < GRID)
        rows = rows[np.concatenate([[True], np.diff(np.rint(place[rows])) > 0])] if len(rows) else rows
        if len(rows) > 1 and len(rows) == 1 + np.rint(place[rows[-1]]) - np.rint(place[rows[0]]):
            most = (time[-1] - time[0]) / step - 2
            if len(rows) >= most:
                return time[rows], signals[rows]
    from scipy.interpolate import CubicSpline

    distinct = np.concatenate([[True], steps > 0])
    even = time[0] + step * np.arange(int((time[-1] - time[0]) / step + GRID) + 1)
    return even, np.asarray(CubicSpline(time[distinct], signals[distinct])(even))
