"""Which constraint rows depend on the others: all along the motion (redundant), or in this very position (singular).

A row that depends on the others at one configuration says nothing yet. Where the rank r of J is the same all around on
f(q) = 0, every direction of its null space is the start of a finite motion, and the dependent rows can be left out.
Where it is not, two motions cross there or none goes on: leaving rows out would let the machine move off them. So small
steps are taken along null directions and put back onto the constraints using r directions of J alone: the rows left
out then close by themselves, or they do not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from drillrig_pin.finite import require_finite
from drillrig_pin.kinematics import Array
from drillrig_pin.rig import Rig
from drillrig_pin.words import listed
from drillrig_pin.workspace import Workspace

#: Singular values below this fraction of the largest count as zero.
RANK = 1e-9
#: A start whose rows depend on each other to within this is taken for the singular position beside it: where two
#: motions meet, assembly finds a configuration only to the square root of its residual of 1e-13.
NEAR = 1e-6
#: Lengths of the steps away from the start [rad or m]; the shorter ones are for machines that bend more.
STEPS = (1e-2, 1e-3, 1e-4)
#: Directions tried. A direction drawn at random lies in one of two crossing motions with probability zero.
DIRECTIONS = 4
#: The rows left out close by themselves when they do so to this many lengths of the largest row [m or -].
CLOSED = 1e-12
ITERATIONS = 12


@dataclass(frozen=True, slots=True)
class Dependence:
    """Names of rows that depend on rows before them.

    Attributes:
        redundant: rows that do so in every configuration nearby: the motion does not need them.
        singular: rows that do so here and not nearby: the motion is not determined.
    """

    redundant: tuple[str, ...] = ()
    singular: tuple[str, ...] = ()


def dependence(rig: Rig, space: Workspace, q: Array, targets: Array) -> Dependence:
    """Tell redundant rows from a singular position at a configuration q on f(q) = x(q) - targets = 0.

    The steps are drawn from a fixed seed: the same machine gets the same answer. Leaves ``space`` at q.
    """
    names = [row.name for row in rig.rows]
    zero = np.zeros(rig.model.nv)
    space.update(q, zero)
    J = space.J.copy()
    require_finite(J)
    loose = dependent_rows(J, NEAR)
    if not loose:
        return Dependence()
    around = _Neighbourhood(rig, space, q, targets)
    rank = len(J) - len(loose)
    if around.moves_with(J, rank):
        found = Dependence(tuple(names[i] for i in loose))
    else:
        everywhere = set(loose).intersection(*(dependent_rows(other, NEAR) for other in around.jacobians()))
        # A step that found no other rank than here cannot be blamed on single rows.
        singular = [i for i in loose if i not in everywhere] or loose
        found = Dependence(tuple(names[i] for i in loose if i not in singular), tuple(names[i] for i in singular))
    space.update(q, zero)
    return found


def singular_words(rows: Sequence[str]) -> str:
    """What is wrong with a position in which these rows depend on the others."""
    verb = "follows" if len(rows) == 1 else "follow"
    return f"{listed(rows)} {verb} from the other constraint rows there, and nowhere near"


def redundant_rows(J: Array, names: list[str]) -> tuple[str, ...]:
    """Names of rows of J (m, nv) that depend on the rows before them, to within ``RANK``."""
    return tuple(names[i] for i in dependent_rows(J))


def dependent_rows(J: Array, tolerance: float = RANK) -> list[int]:
    """Rows of J (m, nv) that depend on the rows before them, by Gram-Schmidt.

    What is left of a row counts as nothing below ``tolerance`` times the longest row: a row that is itself rounding
    is dependent however its direction falls out.
    """
    basis: list[Array] = []
    dependent = []
    longest = float(np.linalg.norm(J, axis=1).max(initial=0.0))
    for i, row in enumerate(J):
        rest = row.copy()
        for _ in range(2):
            for unit in basis:
                rest -= (unit @ rest) * unit
        length = float(np.linalg.norm(rest))
        if length <= tolerance * longest:
            dependent.append(i)
        else:
            basis.append(rest / length)
    return dependent


class _Neighbourhood:
    """Configurations near q, put back onto the constraints."""

    def __init__(self, rig: Rig, space: Workspace, q: Array, targets: Array) -> None:
        self._model, self._space, self._q, self._targets = rig.model, space, q, targets
        self._zero = np.zeros(rig.model.nv)
        self._rng = np.random.default_rng(0)

    def moves_with(self, J: Array, rank: int) -> bool:
        """True if every null direction of J (m, nv) of this rank is the start of a finite motion that closes f = 0."""
        null = np.linalg.svd(J)[2][rank:]
        if not len(null):
            # A truss: no direction is left to go, and the rows left out lead nowhere.
            return True
        directions = self._rng.standard_normal((DIRECTIONS, len(null))) @ null
        directions /= np.abs(directions).max(axis=1, keepdims=True)
        return any(all(self._closed(self._q_at(step * u), rank) is not None for u in directions) for step in STEPS)

    def jacobians(self) -> list[Array]:
        """J at configurations all around, on the constraints where such are found and off them otherwise."""
        on, off = [], []
        for direction in self._rng.uniform(-1.0, 1.0, (DIRECTIONS, len(self._zero))):
            q = self._q_at(STEPS[0] * direction)
            self._space.update(q, self._zero)
            off.append(self._space.J.copy())
            closed = self._closed(q, None)
            away = 0.0 if closed is None else float(np.abs(pin.difference(self._model, self._q, closed)).max())
            if away > 0.01 * STEPS[0]:
                on.append(self._space.J.copy())
        return on or off

    def _q_at(self, step: Array) -> Array:
        return np.asarray(pin.integrate(self._model, self._q, step))

    def _closed(self, q: Array, rank: int | None) -> Array | None:
        """q put onto f = 0 by Gauss-Newton steps that use ``rank`` directions of J; None: it does not close."""
        for _ in range(ITERATIONS):
            self._space.update(q, self._zero)
            f, J = self._space.x_constraint - self._targets, self._space.J
            if not (np.isfinite(f).all() and np.isfinite(J).all()):
                return None
            if float(np.abs(f).max()) <= CLOSED * max(1.0, float(np.abs(J).max())):
                return q
            U, values, V = np.linalg.svd(J, full_matrices=False)
            used = int((values > NEAR * values[0]).sum()) if rank is None else rank
            step = V[:used].T @ ((U[:, :used].T @ f) / values[:used])
            longest = float(np.abs(step).max())
            if not longest < 1.0:
                return None
            q = np.asarray(pin.integrate(self._model, q, -step))
        return None
