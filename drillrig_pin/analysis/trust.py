"""May this run be believed: how well it kept its constraints and its energy, and what it cost."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from drillrig_pin.balance import NOTHING, WORST_ENERGY, balance_of
from drillrig_pin.trajectory import Trajectory

#: Beyond this a run should not be used: constraint error [m or 1].
WORST_ERROR = 1e-6
#: So is one whose estimated error is more than this share of the greatest joint motion.
WORST_SHARE = 0.01


@dataclass(frozen=True, slots=True)
class Trust:
    """The trust line of a run.

    Attributes:
        error, rate: greatest |f| [m, or 1 for rotations] and |f_dot| [m/s or 1/s]; None without constraints.
        residual: greatest |E - E_0 - W_in + W_out| [J].
        reference: energy the residual is compared with [J]; see :func:`drillrig_pin.balance.balance_of`.
        against: what that energy is: ``work in``, ``energy exchanged`` or ``nothing moved``.
        relative: residual / reference; None where nothing moved.
        estimated: greatest error of the joint positions, estimated [rad or m]; None if it was not.
        moved: greatest range of a joint [rad or m], which that error is to be compared with.
        steps, evaluations: accepted steps and evaluations of the equations.
        engine: which engine and integrator ran, in words.
        wall_time: of the computation [s].
        real_time_factor: simulated time / wall time.
    """

    error: float | None
    rate: float | None
    residual: float
    reference: float
    against: str
    relative: float | None
    estimated: float | None
    moved: float
    steps: int
    evaluations: int
    engine: str
    wall_time: float
    real_time_factor: float | None

    @property
    def doubts(self) -> tuple[str, ...]:
        """Reasons not to use the run, in words; empty for a sound one."""
        reasons = []
        if self.error is not None and not self.error <= WORST_ERROR:
            reasons.append(f"the constraints drift by {self.error:.2g}")
        if not math.isfinite(self.residual):
            reasons.append("the energy of the run is no finite number")
        elif self.relative is not None and not self.relative <= WORST_ENERGY:
            reasons.append(f"the energy balance misses {self.relative:.2g} of the {self.against}")
        if self.estimated is not None and not self.estimated <= max(WORST_SHARE * self.moved, NOTHING):
            reasons.append(f"the joint positions are wrong by about {self.estimated:.2g} of {self.moved:.2g} rad or m")
        return tuple(reasons)


def trust(trajectory: Trajectory) -> Trust:
    """Measure constraint errors and the energy balance over the whole run."""
    trajectory = trajectory.record
    balance = balance_of(trajectory)
    wall = trajectory.cost.get("wall_time", 0.0)
    held = trajectory.constraint_error.size > 0
    return Trust(
        float(np.abs(trajectory.constraint_error).max()) if held else None,
        float(np.abs(trajectory.constraint_rate).max()) if held else None,
        *balance,
        balance.relative,
        trajectory.estimated_error,
        float(np.ptp(trajectory.q, axis=0).max(initial=0.0)) if len(trajectory.time) else 0.0,
        int(trajectory.cost.get("steps", trajectory.outcome.steps)),
        int(trajectory.cost.get("evaluations", 0)),
        f"{trajectory.method} in {'the compiled core' if trajectory.engine == 'core' else 'Python'}",
        wall,
        trajectory.outcome.time / wall if wall > 0 else None,
    )
