"""The rig in Drake: its plant in continuous time, laws and multipliers by hand, its Runge-Kutta method of order 5.

Drake has neither locked oil nor a hold on two axes in continuous time, so a leaf system asks the plant for mass matrix,
bias, places and Jacobians, adds what is missing and hands the accelerations to the simulator.
"""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import JacobianWrtVariable
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import LeafSystem

from drillrig_pin.kinematics import Array
from peers.laws import Laws
from peers.problem import Problem, Setting, Stopwatch


class Drake:
    """A plant without discrete state, and a system that makes it one of twelve equations of first order."""

    name = "Drake"
    package = "drake"
    orders: ClassVar[dict[str, int]] = {}

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.system = Drilling(problem)
        self.simulator = Simulator(self.system)

    def sweep(self) -> list[list[Setting]]:
        """Accuracies of its integrator with error control."""
        return [[Setting("runge_kutta5", rtol=10.0**-k) for k in range(3, 12)]]

    def run(self, setting: Setting) -> tuple[Stopwatch, Array]:
        """Advance from sample to sample."""
        simulator, problem = self.simulator, self.problem
        ResetIntegratorFromFlags(simulator, setting.method, 0.01)
        integrator = simulator.get_mutable_integrator()
        integrator.set_target_accuracy(setting.rtol)
        context = simulator.get_mutable_context()
        context.SetTime(0.0)
        context.SetContinuousState(np.concatenate([problem.q, problem.v]))
        simulator.Initialize()
        n = len(problem.q)
        out = np.empty((len(problem.samples), n))
        with Stopwatch() as watch:
            for i, t in enumerate(problem.samples):
                simulator.AdvanceTo(t)
                out[i] = context.get_continuous_state_vector().CopyToVector()[:n]
        return watch, out

    def acceleration(self, t: float, q: Array, v: Array) -> Array:
        """From the leaf system."""
        return self.system.acceleration(t, q, v)


class Drilling(LeafSystem):
    """q and v as continuous state."""

    def __init__(self, problem: Problem) -> None:
        super().__init__()
        self.problem = problem
        self.plant = plant = MultibodyPlant(time_step=0.0)
        (index,) = Parser(plant).AddModelsFromString(problem.urdf, "urdf")
        names = list(problem.rig.model.names)
        joints = [plant.GetJointByName(name, index) for name in names[1:]]
        self.bodies = [plant.world_body(), *(joint.child_body() for joint in joints)]
        base = joints[0].parent_body()
        if base.index() != plant.world_body().index():
            plant.WeldFrames(plant.world_frame(), base.body_frame())
        plant.mutable_gravity_field().set_gravity_vector(problem.rig.model.gravity.linear)
        plant.Finalize()
        # Drake numbers joints as the tree does; what it calls q is then what Pinocchio calls q.
        assert [joint.position_start() for joint in joints] == list(range(len(joints)))
        self.context = plant.CreateDefaultContext()
        self.laws = Laws(problem)
        self.n = self.laws.size
        # One call per body that carries points: which they are in the laws' order, and where on it, (3, k).
        carriers = {anchor.joint for anchor in self.laws.points} - {0}
        self.carried = [(i, self._of(i), self._local(self._of(i))) for i in sorted(carriers)]
        self.P, self.J = np.zeros((len(self.laws.points), 3)), np.zeros((len(self.laws.points), 3, self.n))
        fixed = self._of(0)
        self.P[fixed] = self._local(fixed).T
        self.DeclareContinuousState(self.n, self.n, 0)

    def _of(self, body: int) -> list[int]:
        return [i for i, anchor in enumerate(self.laws.points) if anchor.joint == body]

    def _local(self, points: list[int]) -> Array:
        return np.array([self.laws.points[i].vector for i in points], order="F").reshape(-1, 3).T

    def DoCalcTimeDerivatives(self, context: Any, derivatives: Any) -> None:
        """Drake's hook: v and a."""
        y = context.get_continuous_state_vector().CopyToVector()
        v = y[self.n :]
        rate = np.concatenate([v, self.acceleration(context.get_time(), y[: self.n], v)])
        derivatives.get_mutable_vector().SetFromVector(rate)

    def acceleration(self, t: float, q: Array, v: Array) -> Array:
        """Joint accelerations at a state with all loads and the hold."""
        plant, context, laws, P, J = self.plant, self.context, self.laws, self.P, self.J
        wrt, world = JacobianWrtVariable.kV, plant.world_frame()
        plant.SetPositionsAndVelocities(context, np.concatenate([q, v]))
        poses = [plant.EvalBodyPoseInWorld(context, body) for body in self.bodies]
        for i, where, local in self.carried:
            P[where] = poses[i].multiply(local).T
            frame = self.bodies[i].body_frame()
            jacobian = plant.CalcJacobianTranslationalVelocity(context, wrt, frame, local, world, world)
            J[where] = jacobian.reshape(-1, 3, self.n)
        axes = [poses[i].rotation().matrix() @ axis for i, axis in laws.pushed]
        spins = [
            (poses[i].rotation().matrix() @ axis)
            @ plant.CalcJacobianAngularVelocity(context, wrt, self.bodies[i].body_frame(), world, world)
            for i, axis in laws.turned
        ]
        tip = laws.points[-1]
        frame, held = self.bodies[tip.joint].body_frame(), np.array(tip.vector)
        drift = plant.CalcBiasTranslationalAcceleration(context, wrt, frame, held, world, world)[:, 0]
        right = laws.forces(t, q, v, P, J, axes, spins) - plant.CalcBiasTerm(context)
        right += plant.CalcGravityGeneralizedForces(context)
        return laws.solve(plant.CalcMassMatrix(context), right, v, P[-1], J[-1], drift)
