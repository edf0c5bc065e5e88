"""What makes a machine stiff: its fastest motion, and the element whose stiffness or damping carries it."""

from __future__ import annotations

import math

import numpy as np
import pinocchio as pin

from drillrig_pin.dynamics import Dynamics
from drillrig_pin.errors import DrillrigError
from drillrig_pin.kinematics import Array
from drillrig_pin.linear import null_space
from drillrig_pin.stabilization import Baumgarte, SlidingMode
from drillrig_pin.words import number

#: Difference of a coordinate [m or rad] and of its rate [m/s or rad/s] for the slope of a law.
ASIDE = 1e-7


@np.errstate(all="ignore")
def stiff_words(dynamics: Dynamics, y: Array) -> str:
    """The fastest motion of a machine in a state and what carries it, in words; empty if nothing can be said.

    Of the small motions about the state that the constraints allow, with the slopes k and c of all force laws, the
    frequency is the root of the largest eigenvalue of (Z' R' k R Z, Z' M Z), the rate of decay that of (Z' R' c R Z,
    Z' M Z).
    """
    rig, nv = dynamics.rig, dynamics.rig.model.nv
    q, v = y[: rig.model.nq], y[rig.model.nq : rig.model.nq + nv]
    try:
        dynamics.evaluate_forces(0.0, q, v)
        rows, J = dynamics.space.rows[dynamics.space.index], dynamics.space.J.copy()
        M = pin.crba(rig.model, dynamics.space.kinematics.data, q).copy()
        M = np.triu(M) + np.triu(M, 1).T
        k, c = _slopes(dynamics)
        if not all(np.isfinite(a).all() for a in (rows, J, M, k, c)):
            return ""
        Z = null_space(J) if len(J) else np.eye(nv)
        if not Z.shape[1]:
            return ""
        fast, shape = _largest(rows, k, M, Z)
        lost, way = _largest(rows, c, M, Z)
    except (DrillrigError, np.linalg.LinAlgError, ValueError):
        return ""
    rate = _correcting(dynamics)
    omega = math.sqrt(max(fast, 0.0))
    if rate > max(omega, lost):
        return f"the fastest motion is that of the correction of the constraints, {number(rate, 3)} 1/s"
    if max(omega, lost) <= 0.0:
        return ""
    damping = lost > omega
    slopes, shape = (c, way) if damping else (k, shape)
    carried = slopes * (rows @ shape) ** 2
    element = dynamics.forces[int(np.argmax(carried))].name
    dof = rig.dof_names[int(np.argmax(np.abs(shape)))]
    if damping:
        return f"the fastest motion dies away at {number(lost, 3)} 1/s, in {dof}, by the damping of {element!r}"
    hertz = number(omega / (2 * math.pi), 3)
    return f"the fastest vibration, {hertz} Hz in {dof}, comes from the stiffness of {element!r} against what it moves"


def _slopes(dynamics: Dynamics) -> tuple[Array, Array]:
    """-dF/dx and -dF/dx_dot of every element that is no load, at the state last evaluated."""
    k, c = np.zeros((2, len(dynamics.forces)))
    for i, (element, law) in enumerate(zip(dynamics.forces, dynamics.laws, strict=True)):
        if element.load:
            continue
        j = dynamics.space.index[i]
        x, rate = dynamics.x[j : j + 1].copy(), dynamics.x_dot[j : j + 1].copy()
        step = ASIDE * max(1.0, abs(float(x[0])))

        for slopes, a, b in ((k, step, 0.0), (c, 0.0, ASIDE)):
            low, high = (float(np.ravel(law.force(x + s * a, rate + s * b, 0.0))[0]) for s in (-1.0, 1.0))
            slopes[i] = (low - high) / (2.0 * (a + b))
    return np.maximum(k, 0.0), np.maximum(c, 0.0)


def _largest(rows: Array, slopes: Array, M: Array, Z: Array) -> tuple[float, Array]:
    """Largest eigenvalue of slopes against masses, and its motion by dof."""
    # It takes a third of a second to import, which no run need wait for.
    from scipy.linalg import eigh

    K = Z.T @ (rows.T * slopes) @ rows @ Z
    last = Z.shape[1] - 1
    values, vectors = eigh(K, Z.T @ M @ Z, subset_by_index=[last, last])
    return float(values[0]), np.asarray(Z @ vectors[:, 0])


def _correcting(dynamics: Dynamics) -> float:
    """Rate at which the constraints are corrected [1/s]; zero without any."""
    if not dynamics.space.m:
        return 0.0
    term = dynamics.correction
    if isinstance(term, Baumgarte):
        return max(term.alpha, term.beta)
    return max(term.rate, term.gain / term.width) if isinstance(term, SlidingMode) else 0.0
