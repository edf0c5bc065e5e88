"""Which element a point owes its vibration to: the point's motion split over cylinders, springs and contacts.

With K = sum_e k_e r_e^T r_e the tangent stiffness of the machine at its mean pose (r_e = dx_e/dq the gradient row of
element e, k_e = -dF_e/dx_e), Z a basis of the motions the constraints allow (J Z = 0) and J_P the point's Jacobian,

    a_e = J_P Z (Z^T K Z)^-1 Z^T r_e^T k_e                  displacement of P per change of x_e [m/m or m/rad], (3)
    u_P(t) = sum_e a_e (x_e(t) - mean x_e) + rest(t)        principle of virtual work, to first order
    share_e = mean(w . w_e) / mean(w . w)                   w = u_P, w_e = a_e dx_e, both across the hole

-a_e is the force that a unit force at P calls up in element e of the machine at rest. Where every motion of the machine
strains some element, the rest is of second order and the shares add up to 1. A negative share belongs to an element
that moves P against what it does in all. The lengths are those of the run, so damping, inertia and resonance are in
them; the stiffnesses only decide between elements that carry the same load side by side.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from drillrig_pin.analysis.design import Axis
from drillrig_pin.analysis.series import rms, weights
from drillrig_pin.elements.base import Element
from drillrig_pin.kinematics import Array
from drillrig_pin.linear import null_space
from drillrig_pin.rig import Rig
from drillrig_pin.trajectory import Trajectory
from drillrig_pin.workspace import Workspace

#: Step of the numerical derivative of a force law, as part of the coordinate's range in the run.
STEP = 1e-3
#: Motions that strain the elements less than this part of the stiffest one are carried by nothing.
SLACK = 1e-12
#: Samples that decide the mean pose.
POSES = 200


@dataclass(frozen=True, slots=True)
class Share:
    """What one element contributes to the motion of a point.

    Attributes:
        element: its name.
        share: of the mean square of the motion; all shares and the rest add up to 1, single ones may be negative.
        rms: RMS of the motion it causes by itself [m].
    """

    element: str
    share: float
    rms: float


def motion_shares(
    trajectory: Trajectory, rig: Rig, point: str, steady: slice, hole: Axis | None = None
) -> tuple[Share, ...]:
    """Shares of all elements in the motion of a tracked point, in the order of the model.

    Args:
        trajectory: the run.
        rig: the rig it was made with.
        point: a tracked point.
        steady: rows after the start-up.
        hole: unit direction across which the motion counts; None: motion in all directions.
    """
    elements = [element for element in rig.forces if not element.load and _series(trajectory, element) is not None]
    u = trajectory.of("point_displacement", point)[steady]
    across = np.eye(3) if hole is None else np.eye(3) - np.outer(hole, hole)
    weight = weights(trajectory.time[steady])
    w = (u - weight @ u) @ across
    whole = float(weight @ (w**2).sum(axis=1))
    if not elements or not np.isfinite(whole) or whole <= 0:
        return ()
    x = np.array([_series(trajectory, element) for element in elements])[:, steady]
    influence = across @ _influence(trajectory, rig, point, steady, elements, x, weight)
    if not np.isfinite(influence).all():
        return ()
    moved = x - (x @ weight)[:, None]
    shares = (influence.T @ ((w * weight[:, None]).T @ moved.T)).diagonal() / whole
    alone = np.linalg.norm(influence, axis=0) * rms(weight, x.T)
    return tuple(Share(e.name, float(s), float(r)) for e, s, r in zip(elements, shares, alone, strict=True))


def _series(trajectory: Trajectory, element: Element) -> Array | None:
    """Coordinate of an element over time (n); None if the run does not hold it."""
    for labels, variable in (("cylinder", "cylinder_length"), ("element", "element_coordinate")):
        if element.name in trajectory.labels[labels]:
            return trajectory.of(variable, element.name)
    return None


def _influence(
    trajectory: Trajectory, rig: Rig, point: str, steady: slice, elements: list[Element], x: Array, weight: Array
) -> Array:
    """a_e of every element at the mean pose, (3, elements)."""
    space = Workspace(rig, elements)
    space.update(_mean_pose(trajectory, rig, steady), np.zeros(rig.model.nv))
    middles = x @ weight
    rows = space.rows[space.index]
    k = np.array([_stiffness(trajectory, *of) for of in zip(elements, x, middles.tolist(), strict=True)])
    Z = null_space(space.J) if space.m else np.eye(rig.model.nv)
    anchor = rig.point(point)
    frame = space.kinematics.frames[4 * anchor.joint : 4 * anchor.joint + 4]
    place = np.array([*anchor.vector, 1.0]) @ frame
    J = space.kinematics.J * space.support[anchor.joint]
    J_P = J[:3] + np.cross(J[3:].T, place).T
    # Weighted rows as a least-squares problem: (sqrt(k) r Z) has K as its normal matrix, at half its condition number.
    root = np.sqrt(k)
    strained = root[:, None] * rows @ Z
    if not np.isfinite(strained).all():
        return np.full((3, len(elements)), np.nan)
    influence: Array = J_P @ Z @ np.linalg.pinv(strained, rcond=np.sqrt(SLACK)) * root
    return influence


def _mean_pose(trajectory: Trajectory, rig: Rig, steady: slice) -> Array:
    q, time = trajectory.q[steady], trajectory.time[steady]
    # Equally far apart in time, not in rows.
    wanted = np.linspace(time[0], time[-1], min(len(q), POSES))
    some = q[np.unique(np.searchsorted(time, wanted))]
    steps = np.array([pin.difference(rig.model, q[0], other) for other in some])
    pose: Array = pin.integrate(rig.model, q[0], steps.mean(axis=0))
    return pose


def _stiffness(trajectory: Trajectory, element: Element, x: Array, middle: float) -> float:
    """-dF/dx at the mean coordinate [N/m or N m/rad], locked and relaxed at the first sample; at least 0."""
    series = _series(trajectory, element)
    assert series is not None
    law = element.bind(float(series[0]), 0.0)
    h = STEP * float(np.ptp(x)) or 1e-9
    low, high = (np.ravel(law.force(np.array([at]), np.zeros(1), 0.0))[0] for at in (middle - h, middle + h))
    return max(0.0, float(low - high) / (2 * h))
