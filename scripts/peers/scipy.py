"""Plain Pinocchio and SciPy, as a user who knows both would write it without this package.

Every point of the machine becomes a frame of the model; lengths, rates and generalised forces of all elements follow
from the frames' placements and Jacobians, row-wise in NumPy. The hold is solved with M in one saddle-point system, with
Baumgarte terms.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import pinocchio as pin
from scipy.integrate import solve_ivp

from drillrig_pin.kinematics import Anchor, Array
from peers.laws import Laws
from peers.problem import Problem, Setting, Stopwatch

WORLD = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
#: Negative powers of ten: relative tolerances of the integrators.
SWEEP = {"LSODA": range(2, 13), "DOP853": range(2, 12)}


class Scipy:
    """A right-hand side in Python, and SciPy's integrators."""

    name = "Pinocchio + SciPy"
    package = "scipy"
    orders: ClassVar[dict[str, int]] = {}

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.laws = Laws(problem)
        self.model = model = pin.buildModelFromXML(problem.urdf)
        model.gravity.linear = problem.rig.model.gravity.linear
        self.frames = [self._frame(anchor) for anchor in self.laws.points]
        self.still = np.zeros(model.nv)
        self.data = model.createData()

    def _frame(self, anchor: Anchor) -> int:
        """A point as a frame."""
        placement = pin.SE3(np.eye(3), np.array(anchor.vector))
        name = f"point {len(self.model.frames)}"
        return int(self.model.addFrame(pin.Frame(name, anchor.joint, 0, placement, pin.FrameType.OP_FRAME)))

    def acceleration(self, t: float, q: Array, v: Array) -> Array:
        """Joint accelerations at a state with all loads and the hold."""
        model, data, frames, laws = self.model, self.data, self.frames, self.laws
        pin.forwardKinematics(model, data, q, v, self.still)
        pin.computeJointJacobians(model, data)
        pin.updateFramePlacements(model, data)
        P = np.array([data.oMf[frame].translation for frame in frames])
        J = np.array([pin.getFrameJacobian(model, data, frame, WORLD)[:3] for frame in frames])
        drift = pin.getFrameClassicalAcceleration(model, data, frames[-1], WORLD).linear
        axes = [data.oMi[joint].rotation @ axis for joint, axis in laws.pushed]
        spins = [
            (data.oMi[joint].rotation @ axis) @ pin.getJointJacobian(model, data, joint, WORLD)[3:]
            for joint, axis in laws.turned
        ]
        right = laws.forces(t, q, v, P, J, axes, spins) - pin.nonLinearEffects(model, data, q, v)
        return laws.solve(pin.crba(model, data, q), right, v, P[-1], J[-1], drift)

    def _rate(self, t: float, y: Array) -> Array:
        n = self.laws.size
        return np.concatenate([y[n:], self.acceleration(t, y[:n], y[n:])])

    def sweep(self) -> list[list[Setting]]:
        """Tolerances of two integrators."""
        return [[Setting(method, rtol=10.0**-k) for k in powers] for method, powers in SWEEP.items()]

    def run(self, setting: Setting) -> tuple[Stopwatch, Array]:
        """One call of solve_ivp."""
        n = self.laws.size
        y = np.concatenate([self.problem.q, self.problem.v])
        # Velocities of a vibration at 100 1/s are that much larger than its displacements of millimetres.
        atol = setting.rtol * np.repeat([1e-3, 1e-1], n)
        samples, method, rtol = self.problem.samples, setting.method, setting.rtol
        with Stopwatch() as watch:
            answer = solve_ivp(self._rate, (0.0, samples[-1]), y, method, samples, rtol=rtol, atol=atol)
        return watch, answer.y[:n].T
