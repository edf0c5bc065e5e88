"""Kinematics at one state: views on Pinocchio's own memory, and the rate of configurations that are no vectors."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pinocchio as pin
import pytest
from rigs import double_pendulum, floating_body, four_bar, pendulum, tree

from drillrig_pin import Rig, Scenario, load_rig_text, simulate
from drillrig_pin.kinematics import Kinematics, configuration_rate, support_matrix

TEXTS = {"one joint": pendulum(), "two joints": double_pendulum(), "free body": floating_body(), "tree": tree()}


@pytest.fixture(params=TEXTS, ids=str)
def rig(request: pytest.FixtureRequest) -> Rig:
    return load_rig_text(TEXTS[request.param])


def test_frames_and_jacobians_are_those_of_pinocchio_after_every_update(rig: Rig, rng: np.random.Generator) -> None:
    model, data = rig.model, rig.model.createData()
    kinematics = Kinematics(model)
    for _ in range(3):
        q = pin.integrate(model, pin.neutral(model), rng.uniform(-1, 1, model.nv))
        v = rng.uniform(-1, 1, model.nv)
        kinematics.update(q, v)
        pin.computeJointJacobiansTimeVariation(model, data, q, v)
        for joint in range(model.njoints):
            rows = kinematics.frames[4 * joint : 4 * joint + 4]
            np.testing.assert_array_equal(rows[:3].T, data.oMi[joint].rotation)
            np.testing.assert_array_equal(rows[3], data.oMi[joint].translation)
        np.testing.assert_array_equal(kinematics.J, np.reshape(data.J, (6, model.nv)))
        np.testing.assert_array_equal(kinematics.dJ, np.reshape(data.dJ, (6, model.nv)))


def test_spatial_velocity_of_each_joint_is_its_supported_part_of_the_jacobian(
    rig: Rig, rng: np.random.Generator
) -> None:
    model, data = rig.model, rig.model.createData()
    q = pin.integrate(model, pin.neutral(model), rng.uniform(-1, 1, model.nv))
    v = rng.uniform(-1, 1, model.nv)
    kinematics, support = Kinematics(model), support_matrix(model)
    kinematics.update(q, v)
    pin.forwardKinematics(model, data, q, v)
    for joint in range(1, model.njoints):
        expected = data.oMi[joint].act(data.v[joint]).vector
        # Two ways of summing the same twists.
        np.testing.assert_allclose(kinematics.J @ (support[joint] * v), expected, atol=1e-14)


def test_the_rate_of_a_configuration_is_the_derivative_of_its_flow(rig: Rig, rng: np.random.Generator) -> None:
    model, h = rig.model, 1e-6
    for _ in range(5):
        q = pin.integrate(model, pin.neutral(model), rng.uniform(-1.5, 1.5, model.nv))
        v = rng.uniform(-2, 2, model.nv)
        slope = (pin.integrate(model, q, v * h) - pin.integrate(model, q, -v * h)) / (2 * h)
        # Central difference over 1e-6: 1e-10 of rounding.
        np.testing.assert_allclose(configuration_rate(model, q, v), slope, atol=1e-9)


def test_a_rig_can_be_simulated_in_several_threads_at_once() -> None:
    rig = load_rig_text(four_bar())
    start = {"crank_joint": 0.4, "coupler_joint": 0.3, "rocker_joint": 1.2}
    cases = [Scenario(duration=0.05, positions=start, velocities={"crank_joint": float(v)}) for v in range(4)]
    alone = [simulate(rig, case).q for case in cases]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(lambda case: simulate(rig, case).q, cases))
    for a, b in zip(alone, together, strict=True):
        np.testing.assert_array_equal(a, b)


def test_a_run_changes_nothing_of_the_rig(mkz49: Rig) -> None:
    before = mkz49.model.saveToString()
    simulate(mkz49, Scenario(duration=0.01))
    assert mkz49.model.saveToString() == before
    with pytest.raises(AttributeError):
        mkz49.name = "other"
