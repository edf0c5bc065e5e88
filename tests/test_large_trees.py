"""Memory grows with the square of the degrees of freedom, and a large tree computes what a small one does."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from drillrig_pin import Scenario, load_rig_text, simulate
from drillrig_pin.tree_data import LARGE, lean_data, make_data

#: What the process needs before the first dof: interpreter, numpy, Pinocchio, twice over.
BASE = 160e6


def chain(dofs: int) -> str:
    """A hanging chain of hinges, across and along by turns; the last link carries a load."""
    parts = ['<robot name="chain"><link name="l0"/>']
    for i in range(1, dofs + 1):
        parts.append(
            f'<link name="l{i}"><inertial><origin xyz="0 0 -0.05"/><mass value="0.1"/><inertia ixx="1e-4" ixy="0" '
            f'ixz="0" iyy="1e-4" iyz="0" izz="1e-4"/></inertial></link><joint name="j{i}" type="revolute"><parent '
            f'link="l{i - 1}"/><child link="l{i}"/><origin xyz="0 0 -0.1"/><axis xyz="{i % 2} {1 - i % 2} 0"/>'
            '<limit lower="-3" upper="3" effort="1" velocity="1"/></joint>'
        )
    return "\n".join([*parts, "</robot>"])


def tree(kinds: list[object], seed: int) -> pin.Model:
    model, draw, joint = pin.Model(), np.random.default_rng(seed), 0
    for i, kind in enumerate(kinds):
        parent = max(0, joint - int(draw.integers(0, 3)))
        joint = model.addJoint(parent, kind, pin.SE3.Random(), f"j{i}")
        model.appendBodyToJoint(joint, pin.Inertia.Random(), pin.SE3.Random())
    return model


@pytest.mark.parametrize("seed", range(4))
def test_lean_workspace_gives_the_same_numbers(seed: int) -> None:
    kinds = [pin.JointModelRY(), pin.JointModelPX(), pin.JointModelRUBZ(), pin.JointModelFreeFlyer()] * 4
    pin.seed(seed)
    model = tree(kinds, seed)
    draw = np.random.default_rng(seed)
    q, v = pin.randomConfiguration(model, -np.ones(model.nq), np.ones(model.nq)), draw.normal(size=model.nv)

    def everything(data: object) -> list[np.ndarray]:
        found = [pin.nonLinearEffects(model, data, q, v), pin.computeGeneralizedGravity(model, data, q)]
        found += [np.triu(pin.crba(model, data, q)), np.array(pin.computePotentialEnergy(model, data, q))]
        pin.computeJointJacobiansTimeVariation(model, data, q, v)
        found += [data.J, data.dJ]
        pin.forwardKinematics(model, data, q)
        found.append(np.array([placement.homogeneous for placement in data.oMi]))
        return [np.array(array, copy=True) for array in found]

    for lean, full in zip(everything(lean_data(model)), everything(model.createData()), strict=True):
        # The same functions on the same numbers: not even rounding may differ.
        np.testing.assert_array_equal(lean, full)


def test_large_trees_take_the_lean_workspace() -> None:
    kinds = [pin.JointModelRX()] * LARGE
    assert make_data(tree(kinds, 0)).dtau_dq.size == 0
    assert make_data(tree(kinds[1:], 0)).dtau_dq.size > 0


@pytest.mark.parametrize("work", ["check", "load"])
@pytest.mark.parametrize("dofs", [400, 1000])
def test_memory_of_a_large_machine(tmp_path: Path, work: str, dofs: int) -> None:
    path = tmp_path / "chain.urdf"
    path.write_text(chain(dofs))
    words = {
        "check": "from drillrig_pin.check import check_model as use",
        "load": "from drillrig_pin import load_rig as use",
    }
    # The peak of this program alone; getrusage would count the process it was forked from.
    code = f"{words[work]}; use({str(path)!r}); "
    code += "print(next(row.split()[1] for row in open('/proc/self/status') if row.startswith('VmHWM')))"
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    needed = 1024.0 * float(answer.stdout)
    # Some forty arrays of nv x nv doubles at once; a cube would be 4 GB for 400 dofs and 64 GB for 1000.
    assert needed < BASE + 40 * 8 * dofs**2 + 3e5 * dofs
    assert needed < 1e9


@pytest.mark.parametrize("floating", [False, True])
def test_engines_agree_on_a_large_tree(floating: bool) -> None:
    text = chain(LARGE + 4)
    if floating:
        text = text.replace(
            '<link name="l0"/>',
            '<link name="world"/><link name="l0"><inertial><mass value="2"/>'
            '<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link><joint name="free" '
            'type="floating"><parent link="world"/><child link="l0"/></joint>',
        )
    rig = load_rig_text(text)
    case = {
        "duration": 0.004,
        "output_rate": 1000.0,
        "velocities": {"j3": 1.0},
        "integrator": {"method": "RK4", "step": 1e-3},
    }
    runs = [simulate(rig, Scenario(model="chain", engine=engine, **case)) for engine in ("core", "python")]
    # Velocities reach 1 rad/s; both solve the same equations of a chain of 100 links, rounding grows with its length.
    np.testing.assert_allclose(runs[0].v, runs[1].v, atol=1e-8)
