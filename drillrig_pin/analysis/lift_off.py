"""How long a tip is off the face, how often it comes back, and how near it is to that: for every kind of contact.

    bilateral    off where the law pulls, F > 0: a real tip would have let go
    unilateral   off where nothing presses: no penetration, or a damper that would have to pull

The share is one of time, by straight lines between the rows: of the gap while it is off, of the force while it is on.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drillrig_pin.analysis.series import extremes, share_above
from drillrig_pin.elements.contact import Contact
from drillrig_pin.trajectory import Trajectory

#: Forces below this part of the greatest one are rounding.
ROUNDING = 1e-9


@dataclass(frozen=True, slots=True)
class LiftOff:
    """A contact after the start-up.

    Attributes:
        unilateral: the computation lets the tip go; otherwise the rock pulls at it instead.
        share: of time the tip is off the face, or pulled at, from 0 to 1.
        whole: the same share of the whole run, start-up included.
        impacts: how often it comes back onto the face.
        least: least force with which it is pressed on [N]; negative: pulled at.
        gap: farthest it gets from the face [m]; 0 if it never leaves it, None for a bilateral contact.
        ties: constraints that go on holding its body meanwhile, in words.
    """

    unilateral: bool
    share: float
    whole: float
    impacts: int
    least: float
    gap: float | None
    ties: tuple[str, ...]


def lift_off(trajectory: Trajectory, contact: Contact, steady: slice, ties: tuple[str, ...] = ()) -> LiftOff:
    """Look at a contact over the rows ``steady`` of a run that begins at its rest position x0."""
    time = trajectory.time
    force = trajectory.of("element_force", contact.name)
    tiny = ROUNDING * float(np.abs(force).max(initial=0.0))
    if contact.mode == "unilateral":
        x = trajectory.of("element_coordinate", contact.name)
        gap = x[0] - x - contact.preload / contact.stiffness
        least_free, free = max(tiny, float(np.finfo(float).tiny)), contact.stiffness * gap
        # On the face the tip lands by its gap, before the damper's force jumps, and lets go by its force.
        signal = np.where(force < -tiny, np.minimum(np.maximum(force, free), -tiny), np.maximum(free, least_free))
        farthest: float | None = max(0.0, extremes(time[steady], gap[steady])[1])
        least = max(0.0, -float(force[steady].max()))
    else:
        signal, farthest = force - tiny, None
        least = -extremes(time[steady], force[steady])[1]
    off = signal[steady] > 0
    return LiftOff(
        contact.mode == "unilateral",
        share_above(time[steady], signal[steady], 0.0),
        share_above(time, signal, 0.0),
        int((off[:-1] & ~off[1:]).sum()),
        least,
        farthest,
        ties,
    )
