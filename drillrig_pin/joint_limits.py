"""Which joints stand outside the limits of the model, and a pose within them."""

from __future__ import annotations

import math
from dataclasses import dataclass

from drillrig_pin.kinematics import Array
from drillrig_pin.rig import Rig


@dataclass(frozen=True, slots=True)
class Outside:
    """A joint outside its limits [rad or m]."""

    joint: str
    position: float
    low: float
    high: float

    @property
    def within(self) -> float:
        """A position within the limits, written short: their middle, or the limit itself if there is only one."""
        ends = [end for end in (self.low, self.high) if math.isfinite(end)]
        middle = sum(ends) / len(ends)
        short = float(f"{middle:.3g}")
        return short if self.low <= short <= self.high else middle

    def __str__(self) -> str:
        return (
            f"joint {self.joint!r} stands at {self.position:.4g}, outside its limits {self.low:.4g} to {self.high:.4g}"
        )


def outside_limits(rig: Rig, q: Array) -> list[Outside]:
    """Joints of one coordinate that stand outside their limits in a configuration, in the order of the tree."""
    found = []
    for name, joint in zip(rig.joints, list(rig.model.joints)[1:], strict=True):
        if joint.nq == 1:
            value = float(q[joint.idx_q])
            low, high = rig.limits(joint)
            if not low <= value <= high:
                found.append(Outside(name, value, low, high))
    return found
