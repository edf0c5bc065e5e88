"""Where a line of a spectrum comes from: a load, what loads make together, sampling, or a mode of the machine.

A load drives a frequency if it has a sine there, or, for tables and laws of one's own, if its own spectrum has a line
there. A machine that is not linear answers also at multiples of it and at sums and differences. What is sampled at the
rate r cannot be told from f at |f - n r|. A mode is named where the line lies within its width or a bin of it.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from drillrig_pin.analysis.design import Design
from drillrig_pin.analysis.spectra import amplitude_spectrum, strongest_lines
from drillrig_pin.trajectory import Mode, Trajectory
from drillrig_pin.words import number

#: Orders k of k f_1 +- l f_2 that are tried, |k| + |l|.
ORDER = 4
#: Lines of a load's own spectrum that are taken for what it drives.
LINES = 20


@dataclass(frozen=True, slots=True)
class Source:
    """Where one line comes from.

    Attributes:
        kind: ``load``, ``combination``, ``alias``, ``mode`` or ``unknown``.
        words: one sentence or two.
        short: for a table: ``hammer``, ``own mode``, ...
    """

    kind: str
    words: str
    short: str


def driven_frequencies(trajectory: Trajectory, design: Design, rows: slice) -> dict[str, tuple[float, ...]]:
    """Frequencies of every load that acted [Hz]: its sines, or the lines of its values where it is no series."""
    found = dict(design.sines)
    for load in trajectory.labels["load"]:
        if load not in found:
            values = trajectory.of("load_value", load)[rows]
            spectrum = amplitude_spectrum(trajectory.time[rows], values[:, None])
            lines = strongest_lines(spectrum, [load], LINES) if spectrum is not None else ()
            found[load] = tuple(line.frequency for line in lines)
    return found


def source_of(
    frequency: float, width: float, loads: Mapping[str, Sequence[float]], modes: Sequence[Mode], rate: float
) -> Source:
    """Where a line comes from.

    Args:
        frequency: of the line [Hz].
        width: of a bin of the spectrum [Hz].
        loads: frequencies by load [Hz].
        modes: of the machine; empty if they are not known.
        rate: rows a second the spectrum was made of [Hz].
    """
    near = _mode_words(frequency, width, modes)
    driving = [(load, f) for load, found in loads.items() for f in found if abs(f - frequency) <= width]
    if driving:
        names = " and ".join(f"{load} ({number(f, 4)} Hz)" for load, f in driving)
        also = f" The machine's own mode at {near} is close to it, so the motion is amplified." if near else ""
        first, *others = dict.fromkeys(load for load, _ in driving)
        return Source("load", f"It is driven by {names}.{also}", f"{first}{f' +{len(others)}' if others else ''}")
    sines = sorted({f for found in loads.values() for f in found})
    for words, f in _alike(sines):
        if f > rate / 2 and abs(abs(f - rate * round(f / rate)) - frequency) <= width:
            sentence = f"At {number(rate, 4)} samples a second it cannot be told from the load's {words}."
            return Source("alias", sentence, f"alias of {words}")
    if near:
        sentence = f"No load has this frequency; it is the machine's own mode at {near}."
        return Source("mode", sentence, "own mode")
    for words, f in _alike(sines):
        if abs(f - frequency) <= width:
            sentence = f"No load has this frequency, but {words} has: what is not linear answers there as well."
            return Source("combination", sentence, words)
    known = "no mode of the machine at its start is near" if modes else "the machine's own modes are not known"
    return Source("unknown", f"No load has this frequency, and {known}.", "")


def _mode_words(frequency: float, width: float, modes: Sequence[Mode]) -> str:
    near = [
        mode
        for mode in modes
        if mode.frequency > 0 and abs(mode.frequency - frequency) <= max(width, mode.decay / (2 * math.pi))
    ]
    if not near:
        return ""
    closest = min(near, key=lambda mode: abs(mode.frequency - frequency))
    return f"{number(closest.frequency, 3)} Hz"


def _alike(sines: Sequence[float]) -> Iterator[tuple[str, float]]:
    """Multiples, then sums and differences of frequencies, in words and in hertz, the simple ones first."""
    for order in range(1, ORDER + 1):
        for f in sines:
            yield (f"{order} × {number(f, 4)} Hz" if order > 1 else f"{number(f, 4)} Hz"), order * f
    few = sines[:6]
    pairs = itertools.combinations(few, 2)
    for low, high in pairs:
        for k, m in itertools.product(range(1, ORDER), repeat=2):
            if k + m <= ORDER:
                a = f"{k} × {number(low, 4)}" if k > 1 else number(low, 4)
                b = f"{m} × {number(high, 4)}" if m > 1 else number(high, 4)
                yield f"{b} + {a} Hz", m * high + k * low
                yield f"{b} − {a} Hz", abs(m * high - k * low)
