"""A robot nobody made for this package: the UR5 of example-robot-data, held, sprung and looped."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from robots import robot_text

from drillrig_pin import Rig, Scenario, load_rig_text, simulate
from drillrig_pin.simulation import prepare

POSE = {
    "shoulder_pan_joint": 0.3,
    "shoulder_lift_joint": -1.1,
    "elbow_joint": 1.4,
    "wrist_1_joint": -0.5,
    "wrist_2_joint": 0.7,
    "wrist_3_joint": 0.2,
}
EXTENSION = """<drillrig>
  <point name="tool" link="tool0"/>
  <point name="post" link="world" xyz="0.2 0.4 0.9"/>
  <point name="elbow" link="forearm_link"/>
  <hold name="face" point="tool" axes="y z"/>
  <spring name="cord" from="post" to="elbow" stiffness="2000" damping="5" rest_length="0.3"/>
</drillrig>"""


def ur5_text() -> str:
    return robot_text("ur5_robot.urdf")


@pytest.fixture(scope="module")
def urdf() -> str:
    return ur5_text()


@pytest.fixture(scope="module")
def rig(urdf: str) -> Rig:
    return load_rig_text(urdf.replace("</robot>", EXTENSION + "</robot>"))


def test_a_ur5_held_at_its_tool_swings_on_its_spring_and_stays_on_the_face(rig: Rig) -> None:
    case = Scenario(duration=1.0, positions=POSE).changed({"integrator.rtol": 1e-10, "integrator.atol": 1e-11})
    run = simulate(rig, case)
    assert run.outcome.completed, run.outcome
    assert run.labels["constraint"] == ["face.y", "face.z"]
    assert np.abs(run.constraint_error).max() <= 1e-12
    assert np.abs(run.constraint_rate).max() <= 1e-10
    for axis in "yz":
        assert np.abs(run.of("point_displacement", "tool", axis)).max() <= 1e-12
    assert np.ptp(run.of("point_position", "tool", "x")) > 0.01, "the tool must slide along the face"
    # Tolerance 1e-10 over a thousand steps, as part of the energy that goes to and fro.
    assert np.abs(run.energy_residual).max() < 1e-6 * np.ptp(run.energy_potential)


def test_without_elements_its_equations_are_those_of_pinocchio(urdf: str, rng: np.random.Generator) -> None:
    plain, ours = pin.buildModelFromXML(urdf), prepare(load_rig_text(urdf), Scenario())
    data = plain.createData()
    for _ in range(20):
        q, v = rng.uniform(-np.pi, np.pi, plain.nq), rng.uniform(-2, 2, plain.nv)
        equations = ours.assemble(0.0, q, v)
        np.testing.assert_allclose(np.array(equations.M), pin.crba(plain, data, q), rtol=1e-13, atol=1e-15)
        bias = pin.rnea(plain, data, q, v, np.zeros(plain.nv))
        np.testing.assert_allclose(-equations.p1, bias, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(ours.solve(equations)[0], pin.aba(plain, data, q, v, np.zeros(plain.nv)), rtol=1e-9)


def test_held_its_accelerations_are_those_of_pinocchios_constrained_dynamics(
    rig: Rig, rng: np.random.Generator
) -> None:
    dynamics = prepare(rig, Scenario(positions=POSE))
    q, v = dynamics.equilibrium.assembly.q, dynamics.equilibrium.assembly.v + rng.uniform(-1, 1, 6)
    equations = dynamics.assemble(0.0, q, v)
    a, reaction = dynamics.solve(equations)
    model, data = rig.model, rig.model.createData()
    frame = model.getFrameId("tool0")
    pin.computeAllTerms(model, data, q, v)
    pin.updateFramePlacements(model, data)
    J = pin.getFrameJacobian(model, data, frame, pin.LOCAL_WORLD_ALIGNED)[1:3]
    pin.forwardKinematics(model, data, q, v, np.zeros(6))
    drift = pin.getFrameClassicalAcceleration(model, data, frame, pin.LOCAL_WORLD_ALIGNED).linear[1:]
    torque = equations.p1 + data.nle
    correction = equations.p2 + drift
    expected = pin.forwardDynamics(model, data, q, v, torque, J, drift - correction)
    np.testing.assert_allclose(a, expected, rtol=1e-9)
    np.testing.assert_allclose(reaction, data.lambda_c, rtol=1e-9)
