"""The rig in MuJoCo as its expert would set it up: the same expanded URDF, the laws in a compiled passive callback.

The hold is two equalities on the length of tendons that run from the tip to anchors so far away that their lengths are
the tip's coordinates. MuJoCo's equalities are springs: their time constant is tied to the step, their impedance is the
largest it takes. The time loop is compiled too, so Python costs nothing per step.
"""

from __future__ import annotations

import ctypes
import subprocess
import tempfile
from pathlib import Path
from typing import ClassVar

import mujoco
import numpy as np

from drillrig_pin.coordinates import JointCoordinate, Line, Slide, Turn
from drillrig_pin.elements.contact import BilateralContact
from drillrig_pin.elements.cylinder import LockedOil
from drillrig_pin.elements.loads import HarmonicLaw
from drillrig_pin.elements.springs import SpringDamper
from drillrig_pin.kinematics import Anchor, Array, world_point
from peers.problem import RATE, Problem, Setting, Stopwatch, divided

#: Distance of the tendons' far anchors [m]: a tip that moves 1 mm across changes a length by 1e-6 / (2 FAR).
FAR = 1e4
#: Largest impedance MuJoCo takes.
IMPEDANCE = 0.9999
#: What this problem does not need; without "reference safety" the hold may be stiffer than 2 steps of the integrator,
#: which RK4 bears, and without "auto reset" a run that blows up says nothing.
UNUSED = ["CONTACT", "LIMIT", "FRICTIONLOSS", "ACTUATION", "CLAMPCTRL", "SENSOR", "ISLAND", "REFSAFE", "AUTORESET"]
#: Time constant of the hold in steps: the stiffest that is stable and accurate, found by trying.
STIFFNESS = {"RK4": 0.6, "implicitfast": 2.0}
SWEEP = {"RK4": (2, 3, 4, 5, 6, 8, 10, 12, 14, 16, 20, 28, 40, 80), "implicitfast": (2, 5, 10, 20, 40, 80, 160)}

LAWS = {
    LockedOil: (0, ("x0", "E0", "S_A", "S_B", "l_A", "l_B", "p_A0", "p_B0", "k")),
    SpringDamper: (1, ("x0", "F0", "c", "k")),
    BilateralContact: (2, ("x0", "N0", "c", "k")),
    HarmonicLaw: (3, ("mean", "ramp")),
}
WIDTH, PARAMETERS, TERMS, SERIES = 64, 15, 24, 25


def compile_helper(folder: str) -> ctypes.CDLL:
    """Build mujoco.c against the installed MuJoCo, as fast as its makers build theirs."""
    package = Path(mujoco.__file__).parent
    library = next(package.glob("libmujoco.so.*"))
    target, source = Path(folder, "laws.so"), Path(__file__).with_suffix(".c")
    flags = ["-O3", "-march=native", "-shared", "-fPIC", f"-I{package / 'include'}"]
    subprocess.run(["gcc", *flags, str(source), str(library), "-lm", "-o", str(target)], check=True)
    return ctypes.CDLL(str(target))


class Mujoco:
    """A bound rig in MuJoCo; one case, many runs."""

    name = "MuJoCo"
    package = "mujoco"
    #: Of RK4: as long as the error of the hold, which falls with its time constant squared, is the smaller one.
    orders: ClassVar = {"RK4": 4, "implicitfast": 1}

    def __init__(self, problem: Problem, far: float = FAR) -> None:
        self.problem, self.dynamics = problem, problem.dynamics
        with tempfile.TemporaryDirectory() as folder:
            self.helper = compile_helper(folder)
        self.model = _spec(problem, far).compile()
        # An equality holds the length found at MuJoCo's own zero position, plus this.
        self.model.eq_data[:, 0] = self.dynamics.targets + far - self.model.tendon_length0
        self.data = mujoco.MjData(self.model)
        names = list(problem.rig.model.names)
        self.bodies = [0] + [int(self.model.joint(name).bodyid[0]) for name in names[1:]]
        self.table = np.array([self._row(i) for i in range(len(self.dynamics.forces))])

    def _row(self, i: int) -> np.ndarray:
        """One force element as a row of the helper's table."""
        coordinate, law = self.dynamics.forces[i].coordinate(self.dynamics.rig), self.dynamics.laws[i]
        row = np.zeros(WIDTH)
        row[1], fields = LAWS[type(law)]
        row[PARAMETERS : PARAMETERS + len(fields)] = [float(getattr(law, name)) for name in fields]
        if isinstance(law, HarmonicLaw):
            series = np.column_stack([law.amplitude, law.frequency, law.phase]).ravel()
            row[TERMS], row[SERIES : SERIES + len(series)] = len(law.amplitude), series
        if isinstance(coordinate, JointCoordinate):
            row[0], row[5] = 0, coordinate.index_v
            return row
        here = world_point()
        if isinstance(coordinate, Turn):
            kind, a, b, n = (
                1,
                Anchor(coordinate.base, (0, 0, 0)),
                Anchor(coordinate.body, (0, 0, 0)),
                coordinate.direction,
            )
        elif isinstance(coordinate, Line):
            kind, a, b, n = 2, coordinate.start, coordinate.end, here
        elif isinstance(coordinate, Slide):
            kind, a, b, n = 3, coordinate.origin, coordinate.point, coordinate.direction
        row[0], row[2:5] = kind, [self.bodies[anchor.joint] for anchor in (a, b, n)]
        row[6:15] = [*a.vector, *b.vector, *n.vector]
        return row

    def start(self, integrator: str, step: float, stiffness: float | None = None) -> None:
        """Back to the start of the case; the hold's time constant in steps is given or the integrator's own."""
        options, model = self.model.opt, self.model
        options.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator.upper()}")
        options.timestep = step
        model.eq_solref[:] = ((stiffness or STIFFNESS[integrator]) * step, 1.0)
        mujoco.mj_resetData(model, self.data)
        self.data.qpos[:], self.data.qvel[:] = self.problem.q, self.problem.v
        rows = np.ascontiguousarray(self.table)
        self.helper.install(rows.ctypes.data_as(ctypes.c_void_p), len(rows))

    def sweep(self) -> list[list[Setting]]:
        """Fixed steps of two integrators."""
        return [[Setting(method, step=step) for step in divided(*counts)] for method, counts in SWEEP.items()]

    def run(self, setting: Setting, stiffness: float | None = None) -> tuple[Stopwatch, Array]:
        """Time of the compiled loop alone, and positions at the samples."""
        self.start(setting.method, setting.step, stiffness)
        every = round(1.0 / RATE / setting.step)
        out = np.zeros((len(self.problem.samples), self.model.nq))
        model, data = ctypes.c_void_p(self.model._address), ctypes.c_void_p(self.data._address)
        with Stopwatch() as watch:
            self.helper.drive(model, data, every * len(out), every, out.ctypes.data_as(ctypes.c_void_p))
        self.helper.uninstall()
        return watch, out

    def acceleration(self, t: float, q: Array, v: Array) -> Array:
        """Joint accelerations at a state with all loads and its soft hold."""
        return self._evaluated(t, q, v).qacc.copy()

    def free_acceleration(self, t: float, q: Array, v: Array) -> Array:
        """The same without the hold: what can agree to rounding."""
        return self._evaluated(t, q, v).qacc_smooth.copy()

    def _evaluated(self, t: float, q: Array, v: Array) -> mujoco.MjData:
        self.start("RK4", 1e-4)
        self.data.time, self.data.qpos[:], self.data.qvel[:] = t, q, v
        mujoco.mj_forward(self.model, self.data)
        self.helper.uninstall()
        return self.data


def _spec(problem: Problem, far: float) -> mujoco.MjSpec:
    """The expanded URDF with the hold added and everything switched off that this problem does not need."""
    dynamics, rig = problem.dynamics, problem.rig
    spec = mujoco.MjSpec.from_string(problem.urdf)
    spec.option.gravity = rig.model.gravity.linear
    names = list(rig.model.names)
    targets = dynamics.targets
    for i, (row, target) in enumerate(zip(rig.rows, targets, strict=True)):
        slide = row.coordinate
        tip, axis = slide.point, np.array(slide.direction.vector)
        position = _world(problem, tip)
        spec.joint(names[tip.joint]).parent.add_site(name=f"tip{i}", pos=tip.vector)
        # Level with the tip across the axis, so that the length is the coordinate plus a constant.
        spec.worldbody.add_site(name=f"far{i}", pos=position - (axis @ position + far) * axis)
        tendon = spec.add_tendon(name=row.name)
        tendon.wrap_site(f"far{i}")
        tendon.wrap_site(f"tip{i}")
        hold = spec.add_equality(type=mujoco.mjtEq.mjEQ_TENDON, name1=row.name)
        hold.solimp = [IMPEDANCE, IMPEDANCE, 0.001, 0.5, 2.0]
        assert abs(axis @ position - target) < 1e-12
    for name in UNUSED:
        spec.option.disableflags |= getattr(mujoco.mjtDisableBit, f"mjDSBL_{name}")
    # For two rows a few dual sweeps are exact, and cheaper than the Newton solver.
    spec.option.solver = mujoco.mjtSolver.mjSOL_PGS
    spec.option.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    spec.option.iterations, spec.option.tolerance = 3, 0.0
    return spec


def _world(problem: Problem, anchor: Anchor) -> Array:
    """World position of a point at the start."""
    problem.dynamics.space.update(problem.q, problem.v)
    frame = problem.dynamics.space.kinematics.data.oMi[anchor.joint]
    return np.asarray(frame.act(np.array(anchor.vector)))
