"""How a statically indeterminate machine shares its weight: by the stiffness of what carries it.

Of all forces in balance a machine that was locked while it was loaded takes those of least elastic energy,

    minimise  sum F_i^2 / (2 k_i)   subject to   rows^T F + J^T lambda = needed,

with the stiffness k_i of every element; rows of constraints are rigid and store nothing. How a real machine was set
down may differ, which is why what is shared is named.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drillrig_pin.assembly import least_norm
from drillrig_pin.dependence import RANK
from drillrig_pin.finite import require_finite
from drillrig_pin.kinematics import Array

#: Part of a state of self-stress below which an element or row takes no part in it.
NO_PART = 1e-9


@dataclass(frozen=True)
class Shares:
    """Forces that balance ``needed``.

    Attributes:
        elastic: force of every element [N or N m].
        rigid: multiplier of every constraint row [N or N m].
        shared: which elements take part in a state of self-stress: their forces follow from stiffness.
        spread: for every row that takes part in one without elements, its least and greatest value over the solutions
            in which one of these rows carries nothing; zero width for the others, (rows, 2).
    """

    elastic: Array
    rigid: Array
    shared: Array
    spread: Array


def share(rows: Array, stiffness: Array, J: Array, needed: Array) -> Shares:
    """Forces with rows^T F + J^T lambda nearest to ``needed``.

    Args:
        rows: gradient rows of the elements, (n, nv).
        stiffness: of each [N/m or N m/rad], positive.
        J: rigid rows, (m, nv).
        needed: generalised forces to be carried, (nv).
    """
    n, m = len(rows), len(J)
    together = np.vstack([rows, J])
    require_finite(together, needed)
    stress = _null_space(together.T)
    rigid_stress = _null_space(J.T)
    if not stress.shape[1]:
        solution = least_norm(together.T, needed) if n + m else np.zeros(0)
        return Shares(solution[:n], solution[n:], np.zeros(n, dtype=bool), np.repeat(solution[n:, None], 2, axis=1))
    elastic = _least_energy(rows, stiffness, J, needed)
    rigid = least_norm(J.T, needed - rows.T @ elastic) if m else np.zeros(0)
    # Columns of very different size lose what only the softest can carry: it is made up for without weights.
    left = least_norm(together.T, needed - rows.T @ elastic - J.T @ rigid)
    elastic, rigid = elastic + left[:n], rigid + left[n:]
    # An element between points of one body moves nothing and carries nothing: it shares with nobody.
    shared = (np.abs(stress[:n]).max(axis=1, initial=0.0) > NO_PART) & rows.any(axis=1)
    return Shares(elastic, rigid, shared, _spread(rigid, rigid_stress))


def _least_energy(rows: Array, stiffness: Array, J: Array, needed: Array) -> Array:
    """Elastic forces of least energy; the rigid rows take whatever they can."""
    root = np.sqrt(stiffness)
    weighted, wanted = rows.T * root, needed
    if len(J):
        U, values, _ = np.linalg.svd(J.T, full_matrices=False)
        U = U[:, values > RANK * values.max(initial=0.0)]
        left = weighted - U @ (U.T @ weighted)
        # What the rigid rows span they carry alone. The rounding left of such a column is no direction to carry in.
        left[:, np.linalg.norm(left, axis=0) <= RANK * np.linalg.norm(weighted, axis=0)] = 0.0
        weighted, wanted = left, wanted - U @ (U.T @ wanted)
    return np.asarray(root * least_norm(weighted, wanted)) if len(rows) else np.zeros(0)


def _null_space(A: Array) -> Array:
    """Orthonormal vectors F with A F = 0, as columns; columns of A count as of one size."""
    if not A.shape[1]:
        return np.zeros((0, 0))
    length = np.linalg.norm(A, axis=0)
    size = np.where(length > 0, length, 1.0)
    _, values, V = np.linalg.svd(A / size)
    rank = int((values > RANK * values.max(initial=0.0)).sum())
    null = V[rank:].T / size[:, None]
    norm = np.linalg.norm(null, axis=0)
    return np.asarray(null / np.where(norm > 0, norm, 1.0))


def _spread(rigid: Array, stress: Array) -> Array:
    low, high = rigid.copy(), rigid.copy()
    for vector in stress.T:
        for j in np.flatnonzero(np.abs(vector) > NO_PART):
            other = rigid - vector * (rigid[j] / vector[j])
            low, high = np.minimum(low, other), np.maximum(high, other)
    return np.stack([low, high], axis=1) if len(rigid) else np.zeros((0, 2))
