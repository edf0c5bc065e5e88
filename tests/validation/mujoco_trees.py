"""Bare trees in MuJoCo: mass matrix and bias at random states, and free motion."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import mujoco
import numpy as np
import pinocchio as pin
from peers.problem import plain_urdf
from robots import floating, robot_text

from drillrig_pin import Rig, Scenario, load_rig, load_rig_text, simulate
from drillrig_pin.dynamics import Dynamics
from drillrig_pin.kinematics import Array
from drillrig_pin.simulation import prepare
from validation.record import Row
from validation.settings import ENGINES, TIGHT

MATRICES = """\
The same expanded URDF, without force elements and holds, is read by MuJoCo. At random states, every joint anywhere and
moving at about 1 rad/s or 1 m/s, its mass matrix and its bias (Coriolis, centrifugal and gravity forces) are compared
with this package's; the difference is divided by the largest entry of the matrix or vector. MuJoCo counts the velocity
of a floating base in the world, Pinocchio in the base: M and bias are carried over by that rotation and its rate.
"""
MOTION = """\
The same bare trees move freely for 2 s from a random state at rates of about 1 rad/s (3 rad/s where the base floats and
nothing weighs), nothing holding them. This package runs DOP853 at a tolerance of 1e-13, MuJoCo its RK4 with a step that
leaves nothing of its error; what twice that step does to it is shown beside. Compared are all joints at 200 samples a
second, of a floating base its place [m] and the components of its quaternion.
"""
STATES = 1000
#: Mass matrix and bias at q and v.
Terms = Callable[[Array, Array], tuple[Array, Array]]
#: Samples per second of the motion.
RATE = 200
#: What a bare tree has no use for.
FLAGS = ("CONTACT", "LIMIT", "FRICTIONLOSS", "SPRING", "DAMPER", "ACTUATION", "SENSOR", "REFSAFE", "AUTORESET")


class Twin:
    """A tree in both engines."""

    def __init__(self, name: str, text: str) -> None:
        self.name = name
        self.rig: Rig = load_rig_text(plain_urdf(load_rig_text(text)))
        spec = mujoco.MjSpec.from_string(self.rig.file.text)
        spec.option.gravity = self.rig.model.gravity.linear
        for flag in FLAGS:
            spec.option.disableflags |= getattr(mujoco.mjtDisableBit, f"mjDSBL_{flag}")
        spec.option.integrator = mujoco.mjtIntegrator.mjINT_RK4
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        self.free = self.rig.model.nq != self.rig.model.nv

    def random_state(self, rng: np.random.Generator) -> tuple[Array, Array]:
        """q and v as Pinocchio counts them."""
        model = self.rig.model
        q = pin.neutral(model)
        first = 7 if self.free else 0
        q[first:] = rng.uniform(-np.pi, np.pi, model.nq - first)
        if self.free:
            q[:3] = rng.standard_normal(3)
            q[3:7] = (turn := rng.standard_normal(4)) / np.linalg.norm(turn)
        return q, rng.standard_normal(model.nv)

    def place(self, q: Array, v: Array) -> Array:
        """Put MuJoCo into a state; the matrix T with v = T v_mujoco."""
        T = np.eye(len(v))
        if self.free:
            T[:3, :3] = pin.Quaternion(q[3:7]).toRotationMatrix().T
            q = np.concatenate([q[:3], q[6:7], q[3:6], q[7:]])
        self.data.qpos[:], self.data.qvel[:] = q, np.linalg.solve(T, v)
        return T

    def terms(self, q: Array, v: Array) -> tuple[Array, Array]:
        """MuJoCo's mass matrix and bias as Pinocchio counts them."""
        T = self.place(q, v)
        mujoco.mj_forward(self.model, self.data)
        M = np.zeros((len(v), len(v)))
        mujoco.mj_fullM(self.model, self.data, M)
        back = np.linalg.inv(T)
        M, bias = back.T @ M @ back, back.T @ self.data.qfrc_bias
        if self.free:
            # v = T v_mujoco, and T turns with the base: T_dot v_mujoco = -omega x v of the base's linear part.
            turning = np.zeros(len(v))
            turning[:3] = -np.cross(v[3:6], v[:3])
            bias = bias - M @ turning
        return M, bias

    def motion(self, q: Array, v: Array, step: float, every: int, samples: int) -> Array:
        """Positions by MuJoCo's RK4, as Pinocchio counts them."""
        mujoco.mj_resetData(self.model, self.data)
        self.model.opt.timestep = step
        self.place(q, v)
        out = np.empty((samples, len(q)))
        for i in range(samples):
            mujoco.mj_step(self.model, self.data, nstep=every)
            out[i] = self.data.qpos
        if self.free:
            out[:, 3:7] = np.roll(out[:, 3:7], -1, axis=1)
        return out


def twins() -> list[Twin]:
    """The shipped rig, an arm, and a robot on a floating base."""
    return [
        Twin("rig", load_rig("mkz49").file.text),
        Twin("UR5", robot_text("ur5_robot.urdf")),
        Twin("Go2, floating base", floating(robot_text("go2.urdf"))),
    ]


def matrix_rows(short: bool) -> Iterator[Row]:
    """M and bias of all three."""
    states = 50 if short else STATES
    for twin in twins():
        rng = np.random.default_rng(6)
        dynamics = prepare(twin.rig, Scenario())
        evaluate = {"python": _python(dynamics)}
        if "core" in ENGINES:
            evaluate["core"] = _core(dynamics)
        worst = {(engine, what): 0.0 for engine in evaluate for what in ("mass matrix", "bias")}
        for _ in range(states):
            state = twin.random_state(rng)
            theirs = twin.terms(*state)
            for engine, ours in evaluate.items():
                for what, a, b in zip(("mass matrix", "bias"), ours(*state), theirs, strict=True):
                    difference = float(np.abs(a - b).max() / np.abs(b).max())
                    worst[engine, what] = max(worst[engine, what], difference)
        for (engine, what), difference in worst.items():
            yield Row(f"{twin.name}, {engine}: {what} at {states} states, relative", "MuJoCo", difference, high=1e-10)


def _python(dynamics: Dynamics) -> Terms:
    def terms(q: Array, v: Array) -> tuple[Array, Array]:
        equations = dynamics.assemble(0.0, q, v)
        return equations.M, -equations.p1

    return terms


def _core(dynamics: Dynamics) -> Terms:
    from drillrig_pin.core import CompiledDynamics

    compiled = CompiledDynamics(dynamics)

    def terms(q: Array, v: Array) -> tuple[Array, Array]:
        found = compiled.evaluate(0.0, np.concatenate([q, v, np.zeros(2)]))
        return found["M"], found["bias"]

    return terms


def motion_rows(short: bool) -> Iterator[Row]:
    """Both engines from the same state."""
    seconds = 0.5 if short else 2.0
    samples, engine = round(seconds * RATE), ENGINES[0]
    for twin in twins():
        q, v = twin.random_state(np.random.default_rng(7))
        v *= 3.0 if twin.free else 1.0
        case = Scenario(
            duration=seconds,
            output_rate=RATE,
            positions=_by_joint(twin.rig, q),
            velocities=dict(zip(twin.rig.dof_names, v.tolist(), strict=True)),
            engine=engine,
        )
        ours = simulate(twin.rig, case.changed({**TIGHT, "integrator.rtol": 1e-13, "integrator.atol": 1e-15})).q
        coarse, fine = (
            float(np.abs(twin.motion(q, v, 1 / RATE / every, every, samples) - ours[1:]).max()) for every in (20, 40)
        )
        reference = f"MuJoCo, RK4, step 0.125 ms; {coarse:.1e} with 0.25 ms"
        moved = float(np.ptp(ours, axis=0).max())
        yield Row(
            f"{twin.name}, {engine}: positions over {seconds:g} s, moved by {moved:.2g}", reference, fine, high=1e-8
        )


def _by_joint(rig: Rig, q: Array) -> dict[str, float | list[float]]:
    """Positions as a scenario names them."""
    parts = {}
    for name, joint in zip(rig.joints, list(rig.model.joints)[1:], strict=True):
        part = q[joint.idx_q : joint.idx_q + joint.nq].tolist()
        parts[name] = part if len(part) > 1 else part[0]
    return parts
