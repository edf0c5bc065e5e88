"""Rainflow ranges of cylinder forces (ASTM E1049-85): what pins, eyes and welds of a cylinder live through."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

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
        equivalent: range that, repeated once a second, does the same damage [N]; see :func:`rainflow_ranges`.
        exponent: m of the damage law.
        bins: equal bins from 0 to the largest range.
    """

    cylinder: str
    duration: float
    largest: float
    equivalent: float
    exponent: float
    bins: tuple[RangeBin, ...]

    def per_hour(self, count: float) -> float:
        """A count of this run as a rate [1/h]."""
        return count * 3600.0 / self.duration if self.duration > 0 else 0.0


def cylinder_rainflow(trajectory: Trajectory, steady: slice, exponent: float = EXPONENT) -> tuple[Rainflow, ...]:
    """Rainflow count of every cylinder's force over the samples ``steady``."""
    time = trajectory.time[steady]
    duration = float(time[-1] - time[0])
    return tuple(
        rainflow_ranges(name, trajectory.of("cylinder_force", name)[steady], duration, exponent)
        for name in trajectory.labels["cylinder"]
    )


def rainflow_ranges(name: str, force: Array, duration: float, exponent: float = EXPONENT) -> Rainflow:
    """Count one force (n) [N] sampled over ``duration`` [s].

        equivalent range = (sum n_i R_i^m / N)^(1/m),   N = duration x 1 Hz,

    n_i cycles of range R_i, m the exponent. Not the life of a part: that needs its section and its S-N line; but of two
    designs the one with the smaller equivalent range lasts longer, by the ratio to the power m.
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
    return Rainflow(name, duration, largest, equivalent, exponent, bins)
