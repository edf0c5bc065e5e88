"""Whether joints passed the limits that their model states: nothing in the equations stops them there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drillrig_pin.analysis.design import Design
from drillrig_pin.trajectory import Trajectory
from drillrig_pin.words import quantity

#: What counts as standing at a limit [rad, m]: rounding of a pose written with nine decimals.
AT = 1e-9


@dataclass(frozen=True, slots=True)
class LimitPassed:
    """One joint beyond one of its limits.

    Attributes:
        joint: its name.
        unit: rad or m.
        bound: ``lower`` or ``upper``.
        limit: the limit [unit].
        beyond: how far beyond it the joint went [unit].
        since: time of the first row beyond it [s].
        at: time of the row farthest beyond it [s].
    """

    joint: str
    unit: str
    bound: str
    limit: float
    beyond: float
    since: float
    at: float

    @property
    def words(self) -> str:
        """As a sentence without its full stop."""
        return (
            f"joint {self.joint} passes its {self.bound} limit of {quantity(self.limit, self.unit)} from "
            f"{self.since:.4g} s on, by up to {quantity(self.beyond, self.unit)} (at {self.at:.4g} s)"
        )


def limits_passed(record: Trajectory, design: Design) -> tuple[LimitPassed, ...]:
    """Joints that passed a limit in the rows of a run, each bound once, in the order of the model."""
    found = []
    for joint, (low, high) in design.limits.items():
        if joint not in record.labels["joint"] or not len(record.time):
            continue
        q = record.q[:, record.labels["joint"].index(joint)]
        unit = "m" if design.kinds.get(joint) == "prismatic" else "rad"
        for bound, limit, beyond in (("lower", low, low - q), ("upper", high, q - high)):
            farthest = int(np.argmax(beyond))
            if beyond[farthest] > AT * max(1.0, abs(limit)):
                since = float(record.time[int(np.argmax(beyond > AT * max(1.0, abs(limit))))])
                found.append(
                    LimitPassed(joint, unit, bound, limit, float(beyond[farthest]), since, float(record.time[farthest]))
                )
    return tuple(found)
