"""Pinocchio's workspace of a tree, without what grows with the cube of the degrees of freedom.

``Model.createData`` also lays out four nv x nv x nv tensors of second derivatives that nothing here asks for: 4 GB for
400 degrees of freedom. Small trees take it as it is. For a large one only those parts are made which these functions
use: ``computeJointJacobiansTimeVariation``, ``forwardKinematics``, ``nonLinearEffects``, ``computeGeneralizedGravity``,
``computePotentialEnergy`` and ``crba``. The largest of them, the columns of forces of ``crba``, grow with nv^2.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import pinocchio as pin

#: From here on the tensors, 32 nv^3 bytes twice over while they are made, are more than all else in memory.
LARGE = 100


def make_data(model: Any) -> Any:
    """A workspace of a tree for the functions named above, of at most some 100 nv^2 bytes for a large one."""
    # A tree with mimicking joints has more columns than dofs; its maps are Pinocchio's own business.
    if model.nv < LARGE or getattr(model, "nvExtended", model.nv) != model.nv:
        return model.createData()
    return lean_data(model)


def lean_data(model: Any) -> Any:
    """What :func:`make_data` makes of a large tree."""
    data, n, nv = pin.Data(), model.njoints, model.nv
    for joint in list(model.joints):
        data.joints.append(joint.createData())
    for kind, value, names in (
        (pin.StdVec_Motion, pin.Motion.Zero(), ("a", "oa", "v", "ov", "a_gf", "oa_gf")),
        (pin.StdVec_Force, pin.Force.Zero(), ("f", "of", "h", "oh")),
        (pin.StdVec_SE3, pin.SE3.Identity(), ("oMi", "liMi")),
        (pin.StdVec_Inertia, pin.Inertia.Zero(), ("Ycrb", "oYcrb")),
    ):
        for name in names:
            setattr(data, name, _filled(kind(), [value] * n))
    for name in ("J", "dJ", "Ag"):
        setattr(data, name, np.zeros((6, nv)))
    for name in ("nle", "g", "tau"):
        setattr(data, name, np.zeros(nv))
    data.M = np.zeros((nv, nv))
    for _ in range(n):
        data.Fcrb.append(np.zeros((6, nv)))
        data.mass.append(0.0)
        data.com.append(np.zeros(3))
    data.nvSubtree = _filled(pin.StdVec_int(), _dofs_beyond(model))
    parents = _parent_rows(model)
    data.parents_fromRow = _filled(pin.StdVec_int(), parents)
    data.non_mimic_parents_fromRow = _filled(pin.StdVec_int(), parents)
    data.idx_vExtended_to_idx_v_fromRow = _filled(pin.StdVec_int(), range(nv))
    return data


def _dofs_beyond(model: Any) -> list[int]:
    """Dofs of every joint and of all that hangs on it; of the world, those of the whole tree."""
    found = [0, *(model.joints[i].nv for i in range(1, model.njoints))]
    for i in range(model.njoints - 1, 0, -1):
        found[model.parents[i]] += found[i]
    return found


def _parent_rows(model: Any) -> list[int]:
    """For every dof the one before it on the way to the world, -1 at the end."""
    last = [-1] * model.njoints
    rows = [-1] * model.nv
    for i in range(1, model.njoints):
        joint, before = model.joints[i], last[model.parents[i]]
        for dof in range(joint.idx_v, joint.idx_v + joint.nv):
            rows[dof] = before
            before = dof
        last[i] = before
    return rows


def _filled(vector: Any, values: Iterable[Any]) -> Any:
    for value in values:
        vector.append(value)
    return vector
