"""What the machine had to carry: chamber pressures against their limits, reactions of the surroundings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from drillrig_pin.analysis.design import Design
from drillrig_pin.analysis.lift_off import LiftOff, lift_off
from drillrig_pin.analysis.series import extremes, share_above, weights
from drillrig_pin.elements.cylinder import ATMOSPHERE, VAPOUR_PRESSURE
from drillrig_pin.kinematics import Array
from drillrig_pin.trajectory import Trajectory

#: Below this absolute pressure [Pa] oil releases its air, and the law of the trapped column no longer holds.
GAS_RELEASE = 1e5


class Chamber(NamedTuple):
    """One chamber of a cylinder: its name, least and greatest absolute pressure [Pa], shares of time beyond limits."""

    name: str
    least: float
    greatest: float
    below: float
    above: float


@dataclass(frozen=True, slots=True)
class CylinderRange:
    """Extremes of one cylinder: of its pressures over the whole run, of its force after the start-up.

    Oil releases air and valves open whenever it is, so their limits hold from the first moment on.

    Attributes:
        cylinder: its name.
        a_min, a_max, b_min, b_max: absolute pressures of the piston and the annulus chamber, whole run [Pa].
        relief: absolute pressure at which the relief valve would open [Pa]; None if the model no longer tells.
        below, above: share of the whole time any chamber is below gas release, or above relief, from 0 to 1.
        force_min, force_max: force of the cylinder after the start-up, positive pushes the pins apart [N].
        a_below, a_above, b_below, b_above: the same shares, of one chamber each.
        vapour: absolute pressure below which its oil tears [Pa].
        vapour_assumed: the model leaves that to the assumed default.
    """

    cylinder: str
    a_min: float
    a_max: float
    b_min: float
    b_max: float
    relief: float | None
    below: float
    above: float
    force_min: float
    force_max: float
    a_below: float
    a_above: float
    b_below: float
    b_above: float
    vapour: float
    vapour_assumed: bool

    @property
    def chambers(self) -> tuple[Chamber, Chamber]:
        """The piston chamber A and the annulus chamber B."""
        return (
            Chamber("A", self.a_min, self.a_max, self.a_below, self.a_above),
            Chamber("B", self.b_min, self.b_max, self.b_below, self.b_above),
        )


def cylinder_ranges(trajectory: Trajectory, design: Design, steady: slice) -> tuple[CylinderRange, ...]:
    """Extremes of every cylinder; pressures are absolute, p = p_gauge + 101 325 Pa."""
    found = []
    time = trajectory.time
    for name in trajectory.labels["cylinder"]:
        a = trajectory.of("pressure_a", name) + ATMOSPHERE
        b = trajectory.of("pressure_b", name) + ATMOSPHERE
        force = trajectory.of("cylinder_force", name)[steady]
        relief = design.relief[name] + ATMOSPHERE if name in design.relief else None
        vapour = design.vapour.get(name)
        shares = [
            (share_above(time, -p, -GAS_RELEASE), share_above(time, p, relief) if relief is not None else 0.0)
            for p in (np.minimum(a, b), np.maximum(a, b), a, b)
        ]
        found.append(
            CylinderRange(
                name,
                *extremes(time, a),
                *extremes(time, b),
                relief,
                shares[0][0],
                shares[1][1],
                *extremes(time[steady], force),
                *shares[2],
                *shares[3],
                VAPOUR_PRESSURE if vapour is None else vapour,
                vapour is None,
            )
        )
    return tuple(found)


@dataclass(frozen=True, slots=True)
class ReactionRange:
    """One reaction after the start-up transient: least, mean, greatest [unit].

    Attributes:
        kind: ``tip`` (a hold on the body of the tip), ``hold``, ``loop`` or ``contact``.
        tension: of a contact, share of time the tip is off the face or pulled at.
        lift_off: of a contact, more about that.
    """

    name: str
    unit: str
    least: float
    mean: float
    greatest: float
    tension: float | None = None
    kind: str = "hold"
    lift_off: LiftOff | None = None


def reaction_ranges(trajectory: Trajectory, design: Design, steady: slice) -> tuple[ReactionRange, ...]:
    """Multipliers of all constraint rows, then the contact forces.

    A multiplier of a hold is the force of the surroundings on the machine along a world axis. The force of a contact is
    counted along its axis into the rock: negative where the rock pushes the tip back, positive (tension) where a
    bilateral contact pulls at it, which no rock does.
    """
    found = []
    time = trajectory.time[steady]
    for name in trajectory.labels["constraint"]:
        values = trajectory.of("reaction", name)[steady]
        unit = "N m" if is_rotation(name) else "N"
        kind = design.placed.get(name.rpartition(".")[0], "hold")
        found.append(ReactionRange(name, unit, *_range(time, values), kind=kind))
    for contact in design.touching:
        if contact.name in trajectory.labels["element"]:
            least, mean, greatest = _range(time, trajectory.of("element_force", contact.name)[steady])
            lifted = lift_off(trajectory, contact, steady, design.ties[contact.name])
            greatest = min(greatest, 0.0) if lifted.unilateral else greatest
            found.append(ReactionRange(contact.name, "N", least, mean, greatest, lifted.share, "contact", lifted))
    return tuple(found)


def _range(time: Array, values: Array) -> tuple[float, float, float]:
    """Least, mean, greatest."""
    least, greatest = extremes(time, values)
    return least, float(weights(time) @ values), greatest


#: Headings of reactions by what they are, in the order they are shown.
REACTIONS = {
    "Force of the face on the tip": ("tip", "contact"),
    "Force of what holds the machine": ("hold",),
    "Force and moment within loops": ("loop",),
}


def reaction_groups(reactions: Sequence[ReactionRange]) -> dict[str, list[ReactionRange]]:
    """Reactions under headings that say what they are; headings without any are left out."""
    groups = {title: [r for r in reactions if r.kind in kinds] for title, kinds in REACTIONS.items()}
    return {title: rows for title, rows in groups.items() if rows}


def is_rotation(row: str) -> bool:
    """Whether a constraint row, by its name, closes a rotation: its residual is a cosine, its multiplier a moment."""
    return row.rpartition(".")[2] in ("rx", "ry", "rz", "angle")
