"""Placements and Jacobians of a tree at one state, as arrays that Pinocchio fills in place.

Notation: ``X_j`` placement of joint j in the world, ``J`` the 6 x nv matrix whose column k is the unit twist of dof k
at the world origin in world axes (linear part first), ``S_j`` the 0/1 support of joint j: which dofs move it. The
spatial velocity of the body on joint j is ``V_j = J (S_j * v)``, its spatial acceleration at zero ``a`` is
``dJ (S_j * v)``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from drillrig_pin.tree_data import make_data

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Anchor:
    """Something rigidly attached to a joint's body: a point (``w`` = 1) or a direction (``w`` = 0).

    Attributes:
        joint: index of the carrying joint in the model; 0 is the world.
        vector: coordinates in the joint's frame [m] or [-].
        w: 1 for a point, 0 for a direction.
    """

    joint: int
    vector: tuple[float, float, float]
    w: int = 1


def world_point(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Anchor:
    """A point that stands still in the world."""
    return Anchor(0, (x, y, z))


def world_direction(axis: tuple[float, float, float]) -> Anchor:
    """A direction that stands still in the world."""
    return Anchor(0, axis, 0)


def anchor_matrix(model: Any, anchors: list[Anchor]) -> Array:
    """C such that ``C @ kinematics.frames`` holds each anchor's world coordinates, shape (len(anchors), 4 njoints)."""
    matrix = np.zeros((len(anchors), 4 * model.njoints))
    for row, anchor in enumerate(anchors):
        matrix[row, 4 * anchor.joint : 4 * anchor.joint + 4] = (*anchor.vector, anchor.w)
    return matrix


def support_matrix(model: Any) -> Array:
    """S[j, k] = 1 where dof k moves joint j, shape (njoints, nv)."""
    support = np.zeros((model.njoints, model.nv))
    for joint in range(1, model.njoints):
        for ancestor in list(model.supports[joint])[1:]:
            start = model.joints[ancestor].idx_v
            support[joint, start : start + model.joints[ancestor].nv] = 1.0
    return support


class Kinematics:
    """One workspace: ``update(q, v)`` makes every array below true for that state.

    Attributes:
        J: joint Jacobian columns in the world, (6, nv).
        dJ: their time derivative, (6, nv).
        frames: world axes e_x, e_y, e_z and origin of every joint stacked, (4 njoints, 3).
    """

    def __init__(self, model: Any) -> None:
        self.model = model
        self.data = make_data(model)
        # A tree with one dof has its only column handed over as a vector.
        self.J: Array = self.data.J.reshape(6, model.nv)
        self.dJ: Array = self.data.dJ.reshape(6, model.nv)
        self.frames = _frames_view(self.data, model.njoints)

    def update(self, q: Array, v: Array) -> None:
        """Compute placements, J and dJ at q (nq) and v (nv)."""
        pin.computeJointJacobiansTimeVariation(self.model, self.data, q, v)


def _frames_view(data: Any, njoints: int) -> Array:
    """All joint placements as one (4 njoints, 3) array over Pinocchio's own memory.

    Pinocchio keeps them in one block, each as three columns of the rotation followed by the translation; reading them
    one by one through Python would cost more than the whole dynamics.
    """
    first = data.oMi[0].rotation
    view = np.lib.stride_tricks.as_strided(first.T, shape=(4 * njoints, 3), strides=(24, 8), writeable=False)
    # All lie at the same distance: where the first and the last are as expected, so are the others.
    for joint in (0, njoints - 1):
        placement = data.oMi[joint]
        rows = view[4 * joint : 4 * joint + 4]
        origin, axes = placement.translation, placement.rotation
        if _address(rows) != _address(axes) or _address(rows[3:]) != _address(origin) or axes.strides != (8, 24):
            raise RuntimeError("this version of Pinocchio lays out joint placements differently")
    return view


def _address(array: Array) -> int:
    return int(array.__array_interface__["data"][0])


def velocity_map_is_identity(model: Any) -> bool:
    """True when dq/dt = v for every joint: none is floating."""
    return bool(model.nq == model.nv)


def configuration_rate(model: Any, q: Array, v: Array) -> Array:
    """dq/dt for any joints, (nq).

    One dof: v. Floating: R v_lin for the position and half the quaternion product with (omega, 0) for the orientation,
    both rates given in the body frame.
    """
    rate = np.empty(model.nq)
    for joint in list(model.joints)[1:]:
        iq, iv = joint.idx_q, joint.idx_v
        if joint.nq == joint.nv:
            rate[iq : iq + joint.nq] = v[iv : iv + joint.nv]
        else:
            x, y, z, w = q[iq + 3 : iq + 7]
            rotation = pin.Quaternion(w, x, y, z).normalized().matrix()
            rate[iq : iq + 3] = rotation @ v[iv : iv + 3]
            wx, wy, wz = v[iv + 3 : iv + 6]
            rate[iq + 3 : iq + 7] = 0.5 * np.array(
                [
                    w * wx + y * wz - z * wy,
                    w * wy + z * wx - x * wz,
                    w * wz + x * wy - y * wx,
                    -x * wx - y * wy - z * wz,
                ]
            )
    return rate
