"""Stepping through time: order, agreement of the methods, samples at a fixed rate whatever the steps were."""

from __future__ import annotations

import numpy as np
import pytest
from rigs import NO_GRAVITY, double_pendulum, floating_body, four_bar, joint, link, point, point_mass, robot

from drillrig_pin import Scenario, Trajectory, load_rig_text, simulate

METHODS = ["RK4", "DOP853", "Radau", "LSODA"]
SWING = double_pendulum('<joint_spring name="s" joint="elbow" stiffness="20" damping="0.3" rest="0"/>')
BARS = {"crank_joint": 0.4, "coupler_joint": 0.3, "rocker_joint": 1.2}


def tight(method: str, step: float = 2e-4) -> dict[str, object]:
    """Settings under which each method is exact to about 1e-8; LSODA cannot be projected."""
    return {
        "integrator": {"method": method, "step": step, "rtol": 1e-10, "atol": 1e-11},
        "stabilization": {"method": "baumgarte", "alpha": 50.0, "beta": 50.0, "projection": False},
    }


def swing(method: str, step: float, rate: float = 50) -> Trajectory:
    return simulate(
        load_rig_text(SWING),
        Scenario(duration=0.4, output_rate=rate, positions={"shoulder": 0.3, "elbow": 1.0}, **tight(method, step)),
    )


def test_rk4_converges_with_the_fourth_order() -> None:
    exact = simulate(
        load_rig_text(SWING),
        Scenario(
            duration=0.4,
            output_rate=50,
            positions={"shoulder": 0.3, "elbow": 1.0},
            integrator={"rtol": 1e-13, "atol": 1e-14},
        ),
    ).q
    # The whole motion counts: at a single instant an error may pass through zero.
    errors = [np.linalg.norm(swing("RK4", step).q - exact) for step in (0.02, 0.01, 0.005, 0.0025)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    # The order is met in the limit; the finest pair of steps must be within a tenth of it.
    assert (orders > 3.8).all(), orders
    assert abs(orders[-1] - 4) < 0.1, orders


@pytest.mark.parametrize("method", METHODS)
def test_every_method_reproduces_a_harmonic_oscillation(method: str) -> None:
    rail = NO_GRAVITY + '<joint_spring name="s" joint="x" stiffness="200" rest="0"/>'
    run = simulate(load_rig_text(point_mass(2.0, rail)), Scenario(duration=1.0, positions={"x": 0.1}, **tight(method)))
    exact = 0.1 * np.cos(10 * run.time)
    # RK4 at 2e-4 s errs by (omega h)^4 / 120 a radian; the others by their tolerance times a few hundred steps.
    np.testing.assert_allclose(run.q[:, 0], exact, atol=2e-8)
    np.testing.assert_allclose(run.v[:, 0], -np.sin(10 * run.time), atol=2e-7)
    np.testing.assert_allclose(run.a[:, 0], -100 * run.q[:, 0], atol=1e-12)


@pytest.mark.parametrize("method", METHODS)
def test_all_methods_agree_on_a_constrained_machine(method: str) -> None:
    rig = load_rig_text(four_bar())
    common = {"duration": 0.5, "output_rate": 200, "positions": BARS, "velocities": {"crank_joint": 8.0}}
    reference = simulate(rig, Scenario(**common, integrator={"rtol": 1e-12, "atol": 1e-13}))
    run = simulate(rig, Scenario(**common, **tight(method)))
    np.testing.assert_allclose(run.q, reference.q, atol=3e-8)
    np.testing.assert_allclose(run.reaction, reference.reaction, atol=3e-6 * np.abs(reference.reaction).max())


@pytest.mark.parametrize("method", METHODS)
def test_samples_lie_at_the_fixed_rate_whatever_the_steps_were(method: str) -> None:
    fine, coarse = (swing(method, 1e-3, rate) for rate in (1000, 30))
    np.testing.assert_array_equal(fine.time, np.arange(401) / 1000)
    np.testing.assert_array_equal(coarse.time, np.arange(13) / 30)
    # Both rates show the same motion at common times.
    np.testing.assert_allclose(coarse.q[::3], fine.q[::100], atol=1e-7)


def test_a_duration_that_is_no_multiple_of_the_rate_ends_where_it_was_asked_to() -> None:
    run = simulate(load_rig_text(SWING), Scenario(duration=0.0155, output_rate=1000))
    np.testing.assert_allclose(run.time, [*np.arange(16) / 1000, 0.0155], rtol=1e-15)


@pytest.mark.parametrize("method", ["DOP853", "Radau", "LSODA"])
def test_the_longest_step_is_respected(method: str) -> None:
    rig = load_rig_text(point_mass(2.0))
    # A tenth of a millisecond: rows of the record, a millisecond apart, bound the steps too.
    case = Scenario(duration=0.1, output_rate=20, **tight(method))
    free = simulate(rig, case).cost["steps"]
    bounded = simulate(rig, case.changed({"integrator.max_step": 1e-4})).cost["steps"]
    assert bounded >= 1000 > free


@pytest.mark.parametrize("method", METHODS)
def test_a_free_body_falls_and_keeps_its_angular_momentum(method: str) -> None:
    rig = load_rig_text(floating_body())
    spin = {"free.vx": 1.0, "free.vz": 2.0, "free.wx": 1.0, "free.wy": 6.0, "free.wz": 0.5}
    case = Scenario(duration=0.5, output_rate=200, velocities=spin, **tight(method))
    if method != "LSODA":
        case = case.changed({"stabilization.projection": True})
    run = simulate(rig, case)
    import pinocchio as pin

    data = rig.model.createData()
    momentum, centre = [], []
    for q, v in zip(run.q, run.v, strict=True):
        momentum.append(pin.computeCentroidalMomentum(rig.model, data, q, v).vector.copy())
        centre.append(data.com[0].copy())
    momentum, centre = np.array(momentum), np.array(centre)
    # Angular momentum about the centre of mass is constant, the centre falls on its parabola.
    np.testing.assert_allclose(momentum[:, 3:], np.tile(momentum[0, 3:], (len(momentum), 1)), atol=1e-7)
    fall = centre[0] + np.outer(run.time, momentum[0, :3] / 4.0) - np.outer(run.time**2 / 2, [0, 0, 9.81])
    np.testing.assert_allclose(centre, fall, atol=1e-8)
    assert np.ptp(run.q[:, 3]) > 0.1, "it must tumble"
    np.testing.assert_allclose(np.linalg.norm(run.q[:, 3:7], axis=1), 1.0, atol=1e-8)


def test_a_continuous_joint_counts_its_turns() -> None:
    wheel = robot(
        link("wheel", 1.0),
        joint("axle", "continuous", "world", "wheel"),
        extension=NO_GRAVITY + point("P", "wheel", (1, 0, 0)),
    )
    run = simulate(load_rig_text(wheel), Scenario(duration=2.0, output_rate=500, velocities={"axle": 50.0}))
    # Tolerance 1e-8 over sixteen turns.
    np.testing.assert_allclose(run.q[:, 0], 50.0 * run.time, atol=1e-6)


@pytest.mark.parametrize("method", METHODS)
def test_energy_and_work_balance_under_a_load_with_damping(method: str) -> None:
    extension = (
        '<joint_spring name="s" joint="x" stiffness="800" damping="5" rest="0"/>'
        '<load name="shake" kind="force" point="P" axis="1 0 0" frame="world"><harmonics mean="3" ramp="0.1">'
        '<term amplitude="40" frequency="5"/></harmonics></load>'
    )
    run = simulate(load_rig_text(point_mass(2.0, extension)), Scenario(duration=1.0, output_rate=100, **tight(method)))
    assert run.work_input[-1] > 1.0
    # Work carries a looser absolute tolerance than positions: 1e-6 of the work is the bar of the trust line.
    assert np.abs(run.energy_residual).max() < 1e-6 * run.work_input[-1]
