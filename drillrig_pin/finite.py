"""Refuse what is no finite number before linear algebra sees it: there it ends in an error of LAPACK, or not at all."""

from __future__ import annotations

import numpy as np

from drillrig_pin.errors import AssemblyError
from drillrig_pin.kinematics import Array


def require_finite(*arrays: Array) -> None:
    """Raise AssemblyError if positions or forces of the machine at its start are no finite numbers."""
    if not all(np.isfinite(array).all() for array in arrays):
        raise AssemblyError(
            "positions or forces of the machine at its start are no finite numbers",
            todo="Two points that an element joins may coincide, or a size, mass or target be far too large.",
        )
