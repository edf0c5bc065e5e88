"""Linear algebra that every run needs. SciPy's takes a third of a second to import, which a run need not wait for."""

from __future__ import annotations

import numpy as np

from drillrig_pin.kinematics import Array


def null_space(A: Array) -> Array:
    """Orthonormal columns Z (n, k) that span A Z = 0, for A (m, n); all of space where A has no rows.

    Singular values up to the rounding of the largest one count as zero, as in ``scipy.linalg.null_space``.

    Raises:
        LinAlgError: an entry is no finite number.
    """
    _, values, V = np.linalg.svd(A)
    rank = int((values > np.finfo(float).eps * max(A.shape) * values.max(initial=0.0)).sum())
    basis: Array = V[rank:].T
    return basis
