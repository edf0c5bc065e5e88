"""Rainflow ranges of cylinder forces (ASTM E1049-85): what pins, eyes and welds of a cylinder live through."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drillrig_pin.analysis.series import turning_points
from drillrig_pin.kinematics import Array
from drillrig_pin.trajectory import Trajectory

#: Slope of the S-N line of welded steel details, N ~ range^-m.
EXPONENT = 3.0
BINS = 10


@dataclass(frozen=True, slots=True)
class RangeBin:
    """Cycles whose range lies above ``low`` and up to ``high`` [N]; half cycles count one half."""

    low: float
    high: float
    count: float


@dataclass(frozen=True, slots=True)
class Rainflow:
    """Rainflow count of one force.

    Attributes:
        cylinder: its name.
        duration: time counted [s].
        largest: largest range [N].
        equivalent: damage-equivalent range at 1 Hz [N]; see :func:`rainflow_ranges`.
        cycles: cycles counted; half cycles count one half.
        typical: range that, in as many cycles as were counted, does the same damage [N].
        exponent: m of the damage law.
        bins: equal bins from 0 to the largest range.
    """

    cylinder: str
    duration: float
    largest: float
    equivalent: float
    cycles: float
    typical: float
    exponent: float
    bins: tuple[RangeBin, ...]

    def per_hour(self, count: float) -> float:
        """A count of this run as a rate [1/h]."""
        return count * 3600.0 / self.duration if self.duration > 0 else 0.0


def cylinder_rainflow(trajectory: Trajectory, steady: slice, exponent: float = EXPONENT) -> tuple[Rainflow, ...]:
    """Rainflow count of every cylinder's force over the rows ``steady``, smooth peaks between them included."""
    time = trajectory.time[steady]
    duration = float(time[-1] - time[0])
    forces = ((name, trajectory.of("cylinder_force", name)[steady]) for name in trajectory.labels["cylinder"])
    return tuple(rainflow_ranges(name, turning_points(time, force), duration, exponent) for name, force in forces)


def rainflow_ranges(name: str, force: Array, duration: float, exponent: float = EXPONENT) -> Rainflow:
    """Count one force (n) [N] sampled over ``duration`` [s].

        (sum n_i R_i^m / N)^(1/m),   n_i cycles of range R_i, m the exponent:

    the typical range with N = sum n_i, never above the largest one, and the damage-equivalent range at 1 Hz with
    N = duration x 1 Hz. The latter holds how often the force swings as well as how far: one cycle of it a second does
    the damage of all that were counted, so at 48 cycles a second it lies above the largest range, by up to 48^(1/3).
    Not the life of a part: that needs its section and its S-N line; but of two designs the one with the smaller range
    at 1 Hz lasts longer, by the ratio to the power m.
    """
    from rainflow import extract_cycles

    found = ((span, count) for span, _, count, _, _ in extract_cycles(force) if span > 0)
    cycles = np.array(list(found)).reshape(-1, 2)
    spans, counts = cycles[:, 0], cycles[:, 1]
    largest = float(spans.max(initial=0.0))
    edges = np.linspace(0.0, largest, BINS + 1)
    # A cycle on an edge belongs to the bin below it, the largest one to the last bin.
    place = np.clip(np.searchsorted(edges, spans, side="left") - 1, 0, BINS - 1)
    totals = np.bincount(place, counts, BINS)
    bins = tuple(RangeBin(float(edges[i]), float(edges[i + 1]), float(totals[i])) for i in range(BINS))
    damage = float((counts * spans**exponent).sum())
    equivalent = (damage / duration) ** (1.0 / exponent) if duration > 0 else 0.0
    total = float(counts.sum())
    typical = float((damage / total) ** (1.0 / exponent)) if total > 0 else 0.0
    return Rainflow(name, duration, largest, equivalent, total, typical, exponent, bins)
