"""Looks at the constraints behind every accepted step: are they kept, and has their Jacobian J lost rank since?

Where rank is lost, the machine is stuck or may go on in more than one way: the equations do not say which, and an
integrator that steps over such a position takes one by chance. Behind it all looks well again, so what lies *between*
two looks has to be bounded. The r-th singular value s of J (r: its rank) changes by no more than J itself (Weyl):

    s(t) >= s_0 - |J(t) - J_0|_F,        s(t) >= (s_0 + s_1 - |J_1 - J_0|_F) / 2 - d

for a J(t) that stays within d of the chord from J_0 to J_1. The first says for most steps, at the price of a norm, that
there is nothing to see. Where neither does, the step is halved on the integrator's interpolant until one does, or until
s is as good as zero. No singular vector is followed: it does not matter how many values vanish at once, nor how a
decomposition orders and signs them. The twin is _core/constraint_watch.cpp.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin

from drillrig_pin.dependence import RANK
from drillrig_pin.dynamics import Dynamics
from drillrig_pin.errors import Status
from drillrig_pin.kinematics import Array
from drillrig_pin.stepping import NOT_FINITE, StoppedError
from drillrig_pin.tree import unresisted

#: A residual [m, or 1 for a cosine] from which a run has left its constraints; on a machine below a metre as much less.
DRIFT = 1e-3
#: Entries of a Jacobian up to which its rows are moved by nothing.
STILL = 1e-9
#: The r-th singular value is as good as zero below this fraction of its own largest value, or below ten times the
#: relative tolerance: so near to a singular position the path is not known any better. At most the last.
WEAK, WEAKEST = 1e-4, 1e-2
#: Change of J since the last decomposition, over the singular value then, up to which there is nothing to see.
CALM = 0.5
#: Turn of each dof [rad or m] to see at the start how fast J changes.
PROBE = 1e-6
#: A step is halved so often at most.
HALVINGS = 40


class ConstraintWatch:
    """Follows one run of a bound rig.

    Args:
        dynamics: its equations.
        rtol: relative tolerance of the integrator.
    """

    def __init__(self, dynamics: Dynamics, rtol: float) -> None:
        self._dynamics, self._rank = dynamics, dynamics.rank
        self._nq, self._end = dynamics.rig.model.nq, dynamics.rig.model.nq + dynamics.rig.model.nv
        self._ranked = dynamics.formulation != "damped" and dynamics.rank > 0
        self._weak = min(max(10.0 * rtol, WEAK), WEAKEST)
        self._largest = self._reference = self._slope = self._moved = self._drift = 0.0

    def begin(self, t: float, y: Array, rate: Array) -> None:
        """Take in the start, where the dynamics has just been evaluated; it still is behind it.

        Args:
            t: time [s].
            y: integrated vector.
            rate: dy/dt.

        Raises:
            StoppedError: rank is lost already.
        """
        J = self._dynamics.space.J
        size = float(np.abs(J).max(initial=0.0))
        # Rows that nothing can move are off by rounding alone: no scale for what they may be off.
        self._drift = DRIFT * (min(1.0, size) if size > STILL else 1.0)
        if not self._ranked:
            return
        if not np.isfinite(J).all():
            raise StoppedError(Status.DIVERGED, t, NOT_FINITE, y)
        self._keep(t, y, rate, J)
        self._looked, self._value, self._there = self._J, self._smallest(J), True
        if not self._value > RANK * self._largest:
            raise self._stop(t, y)
        q = y[: self._nq]
        for turn in PROBE * np.eye(self._end - self._nq):
            aside = pin.integrate(self._dynamics.rig.model, q, turn)
            change = np.linalg.norm(self._jacobian_at(aside) - self._J)
            self._slope = max(self._slope, float(change / np.linalg.norm(aside - q)))
        self._dynamics.rate(t, y)

    def step(self, solver: Any) -> None:
        """Look at an accepted step, at whose end the dynamics has just been evaluated; it still is behind it.

        Args:
            solver: SciPy's integrator behind the step.

        Raises:
            StoppedError: the constraints are not kept, or rank was lost within the step.
        """
        dynamics, t, y = self._dynamics, float(solver.t), solver.y
        if not dynamics.space.m:
            return
        f = dynamics.space.x_constraint - dynamics.targets
        if not (np.isfinite(f).all() and np.isfinite(dynamics.space.J).all()):
            raise StoppedError(Status.DIVERGED, t, NOT_FINITE, y)
        if not float(np.abs(f).max()) <= self._drift:
            raise StoppedError(Status.DRIFTED, t, left_words(dynamics, f), y)
        if not self._ranked or not t > self._t:
            return
        before_t, last, J = self._t, self._J, dynamics.space.J.copy()
        rate = dynamics.rate_of_configuration(y)
        if self._bends_little(t - before_t, y, rate, J):
            self._there = False
            self._keep(t, y, rate, J)
            return
        before = self._value if self._there else self._smallest(last)
        after = self._smallest(J)
        if not 0.5 * (before + after - float(np.linalg.norm(J - last))) - self._bend > self._limit:
            found = self._lost(solver.dense_output(), (before_t, last, before), (t, J, after), HALVINGS)
            if found is None and not after > self._limit:
                found = t
            dynamics.rate(t, y)
            if found is not None:
                raise self._stop(found, y)
        self._keep(t, y, rate, J)
        self._looked, self._value, self._there, self._moved = J, after, True, 0.0

    def _bends_little(self, h: float, y: Array, rate: Array, J: Array) -> bool:
        """How far J may have been from the chord within a step; true if that and the chord itself leave no doubt.

        The way of q between its ends is that of their cubic: it leaves its chord by 4/27 of what the end slopes do.
        """
        chord = y[: self._nq] - self._q
        way, change = float(np.linalg.norm(chord)), float(np.linalg.norm(J - self._J))
        if way > 1e-9:
            self._slope = max(self._slope, change / way)
        slack = float(np.linalg.norm(self._qdot - chord / h) + np.linalg.norm(rate - chord / h))
        self._bend = self._slope * (2.0 * (4.0 / 27.0) * h * slack + 0.5 * way * way)
        before, self._moved = self._moved, float(np.linalg.norm(J - self._looked))
        return max(before, self._moved) + self._bend < CALM * self._value

    def _lost(
        self, curve: Any, left: tuple[float, Array, float], right: tuple[float, Array, float], halvings: int
    ) -> float | None:
        """First time between two at which rank is as good as lost, or None; each is a time, J, and its value."""
        middle = 0.5 * (left[0] + right[0])
        if halvings == 0 or not left[0] < middle < right[0]:
            return None
        J = self._jacobian_at(curve(middle)[: self._nq])
        off = 2.0 * float(np.linalg.norm(J - 0.5 * (left[1] + right[1])))
        clear = 0.5 * (left[2] + right[2] - float(np.linalg.norm(right[1] - left[1]))) - off > self._limit
        if clear and halvings < HALVINGS:
            return None
        value = self._smallest(J)
        if not value > self._limit:
            return middle
        inner = (middle, J, value)
        found = self._lost(curve, left, inner, halvings - 1)
        return found if found is not None else self._lost(curve, inner, right, halvings - 1)

    @property
    def _limit(self) -> float:
        return max(RANK * self._largest, self._weak * self._reference)

    def _smallest(self, J: Array) -> float:
        if not np.isfinite(J).all():
            return np.nan
        values = np.linalg.svd(J, compute_uv=False)
        value = float(values[self._rank - 1])
        self._largest = max(self._largest, float(values[0]))
        self._reference = max(self._reference, value)
        return value

    def _jacobian_at(self, q: Array) -> Array:
        space = self._dynamics.space
        space.update(q, np.zeros(self._end - self._nq))
        return space.J.copy()

    def _keep(self, t: float, y: Array, rate: Array, J: Array) -> None:
        self._t, self._q, self._qdot, self._J = t, y[: self._nq].copy(), rate[: self._nq].copy(), J.copy()

    def _stop(self, t: float, y: Array) -> StoppedError:
        return StoppedError(Status.SINGULAR, t, lost_words(self._dynamics), y)


def lost_words(dynamics: Dynamics) -> str:
    """The cause of a run that stops at a singular position."""
    rig = dynamics.rig
    still = [repr(rig.dof_names[i]) for i in unresisted(rig.model, dynamics.equilibrium.assembly.q)]
    if still:
        return f"no mass or inertia resists a motion of {', '.join(still)}"
    rows = [row.name for row in rig.rows]
    return f"constraints {', '.join(rows)}" if rows else "a moving link without mass"


def left_words(dynamics: Dynamics, f: Array) -> str:
    """The cause of a run that left its constraints, with residuals f (m): the row that is off most."""
    worst = int(np.argmax(np.where(np.isfinite(f), np.abs(f), np.inf)))
    row = dynamics.rig.rows[worst]
    return f"constraint {row.name!r} is off by {abs(float(f[worst])):.3g} {'(cosine)' if row.unit == '1' else row.unit}"
