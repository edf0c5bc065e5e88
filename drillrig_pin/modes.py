"""The machine's own vibrations: modes of the equations linearised about the equilibrium, along the constraints.

With Z a basis of the motions the constraints allow at the initial state (J Z = 0, (dofs, k)) and q (+) eps Z z the
placement reached along it, the accelerations by central differences give

    z'' = K z + D z',   K = Z^T da/dq Z,   D = Z^T da/dv Z,   A = [[0, 1], [K, D]].

Every pair of eigenvalues -d +- i w of A is a mode of frequency w / 2 pi [Hz] that decays as exp(-d t). What
stabilises the constraints does not appear: no motion along Z disturbs them.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from drillrig_pin.dynamics import Dynamics
from drillrig_pin.errors import SingularConfigurationError
from drillrig_pin.linear import null_space
from drillrig_pin.marching import Rates
from drillrig_pin.trajectory import Mode

#: Step of the differences [rad or m, rad/s or m/s].
STEP = 1e-6
#: A machine of more degrees of freedom is not linearised: dense matrices of that size would take longer than the run.
LARGEST = 300
#: Eigenvalues below this part of the largest one are motions that nothing holds, not vibrations.
FREE = 1e-6


@np.errstate(all="ignore")
def modes_of(dynamics: Dynamics, rates: Rates) -> tuple[Mode, ...]:
    """Modes about the initial state, the slowest to decay first; none where the machine does not rest there.

    Args:
        dynamics: a bound rig.
        rates: its rates, as the engine that runs it computes them.
    """
    model, space = dynamics.rig.model, dynamics.space
    nq, nv = model.nq, model.nv
    if nv == 0 or nv > LARGEST or not dynamics.equilibrium.at_rest:
        return ()
    y = dynamics.initial()
    q = y[:nq].copy()
    y[nq : nq + nv] = 0.0
    try:
        J = dynamics.assemble(0.0, q, np.zeros(nv)).J
        if not np.isfinite(J).all():
            return ()
        Z = null_space(J) if space.m else np.eye(nv)
        k = Z.shape[1]
        if k == 0:
            return ()  # held in every direction
        states = np.tile(y, (4 * k, 1))
        for i, way in enumerate(Z.T):
            states[i, :nq] = pin.integrate(model, q, STEP * way)
            states[k + i, :nq] = pin.integrate(model, q, -STEP * way)
            states[2 * k + i, nq : nq + nv] = STEP * way
            states[3 * k + i, nq : nq + nv] = -STEP * way
        a = rates(np.zeros(4 * k), states)[:, nq : nq + nv]
    except (SingularConfigurationError, np.linalg.LinAlgError):
        return ()  # the run itself will say what is wrong
    if not np.isfinite(a).all():
        return ()
    K, D = ((Z.T @ (a[i : i + k] - a[i + k : i + 2 * k]).T) / (2 * STEP) for i in (0, 2 * k))
    A = np.block([[np.zeros((k, k)), np.eye(k)], [K, D]])
    if not np.isfinite(A).all():
        return ()
    values = np.linalg.eigvals(A)
    values = values[(np.abs(values) > FREE * np.abs(values).max()) & (values.imag >= 0)]
    found = [Mode(float(abs(value.imag)) / (2 * np.pi), float(-value.real)) for value in values]
    return tuple(sorted(found, key=lambda mode: (mode.decay, mode.frequency)))
