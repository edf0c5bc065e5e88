"""What keeps f(q) = 0: every correction obeys its own differential equation, and the sign of the multipliers."""

from __future__ import annotations

import numpy as np
import pytest
from rigs import double_pendulum, four_bar, pendulum, point_mass
from scipy.integrate import solve_ivp

from drillrig_pin import Scenario, Trajectory, load_rig_text, simulate
from drillrig_pin.dynamics import Dynamics
from drillrig_pin.kinematics import Array
from drillrig_pin.simulation import prepare

HELD = double_pendulum('<hold name="face" point="P" axes="z"/>')
START = {"shoulder": 0.4, "elbow": 0.9}
OFF = 1e-3


def disturbed(settings: dict[str, object]) -> tuple[Array, Array, Array]:
    """Residual and rate over 0.2 s of a machine started 1 mm off its constraint."""
    case = Scenario(positions=START, stabilization=settings)
    dynamics = prepare(load_rig_text(HELD), case)
    dynamics.targets = dynamics.targets - OFF
    t = np.linspace(0, 0.2, 41)
    y = solve_ivp(dynamics.rate, (0, 0.2), dynamics.initial(), "DOP853", t, rtol=1e-12, atol=1e-14).y.T
    f, rate = np.zeros(len(t)), np.zeros(len(t))
    for i, state in enumerate(y):
        equations = dynamics.assemble(float(t[i]), state[:2], state[2:4])
        f[i], rate[i] = equations.f[0], equations.f_dot[0]
    return t, f, rate


def test_without_correction_an_error_stays_and_its_rate_is_constant() -> None:
    _, f, rate = disturbed({"method": "none"})
    # f_ddot = 0 with f(0) = OFF, f_dot(0) = 0, integrated to 1e-12.
    np.testing.assert_allclose(f, OFF, atol=1e-11)
    np.testing.assert_allclose(rate, 0.0, atol=1e-10)


@pytest.mark.parametrize(("alpha", "beta"), [(50.0, 50.0), (80.0, 40.0), (20.0, 60.0)])
def test_baumgarte_decays_at_its_theoretical_rate(alpha: float, beta: float) -> None:
    t, f, _ = disturbed({"method": "baumgarte", "alpha": alpha, "beta": beta})
    # f_ddot + 2 alpha f_dot + beta^2 f = 0, f(0) = OFF, f_dot(0) = 0: over-, critically and underdamped.
    root = np.emath.sqrt(alpha**2 - beta**2)
    if root == 0:
        expected = OFF * (1 + alpha * t) * np.exp(-alpha * t)
    else:
        expected = OFF * np.real(np.exp(-alpha * t) * (np.cosh(root * t) + alpha / root * np.sinh(root * t)))
    np.testing.assert_allclose(f, expected, atol=1e-8 * OFF)


def test_sliding_mode_reaches_its_surface_and_then_decays_on_it() -> None:
    rate, gain, width = 40.0, 2.0, 1e-4
    t, f, f_dot = disturbed({"method": "sliding_mode", "rate": rate, "gain": gain, "width": width})
    s = f_dot + rate * f
    # Outside the layer |s| falls by gain per second, from rate * OFF; inside it decays with gain / width.
    reached = (rate * OFF - width) / gain
    before, after = t < reached * 0.95, t > reached + 20 * width / gain
    np.testing.assert_allclose(s[before], rate * OFF - gain * t[before], atol=1e-6)
    assert np.abs(s[after]).max() < 1e-8
    ratio = f[after][-1] / f[after][0]
    assert ratio == pytest.approx(np.exp(-rate * np.ptp(t[after])), rel=1e-4)


def drift(settings: dict[str, object], duration: float = 10.0) -> Trajectory:
    """A four-bar in motion with a step so coarse that the constraint is not kept by itself."""
    rig = load_rig_text(four_bar())
    start = {"crank_joint": 0.4, "coupler_joint": 0.3, "rocker_joint": 1.2}
    case = Scenario(
        duration=duration,
        output_rate=100,
        positions=start,
        velocities={"crank_joint": 8.0},
        integrator={"method": "RK4", "step": 5e-3},
        stabilization=settings,
    )
    return simulate(rig, case)


def _late_and_early(run: Trajectory) -> tuple[float, float]:
    error = np.abs(run.constraint_error).max(axis=1)
    n = len(error) // 4
    return float(error[-n:].max()), float(error[:n].max())


def test_without_stabilisation_the_constraint_drifts_away() -> None:
    late, early = _late_and_early(drift({"method": "none", "projection": False}))
    assert late > 3 * early > 1e-9


@pytest.mark.parametrize("method", ["baumgarte", "sliding_mode"])
def test_with_a_correction_the_constraint_does_not_drift(method: str) -> None:
    late, early = _late_and_early(drift({"method": method, "projection": False}))
    loose, _ = _late_and_early(drift({"method": "none", "projection": False}))
    assert late < 2 * early
    assert late < loose / 10


@pytest.mark.parametrize("method", ["none", "baumgarte", "sliding_mode"])
def test_projection_keeps_residual_and_rate_at_rounding(method: str) -> None:
    run = drift({"method": method, "projection": True}, duration=1.0)
    # A machine of one metre moving at several metres a second: some units of the last place.
    assert np.abs(run.constraint_error).max() < 1e-14
    assert np.abs(run.constraint_rate).max() < 1e-13


def test_projection_takes_the_smallest_step_in_the_mass_metric() -> None:
    rig = load_rig_text(HELD)
    dynamics = prepare(rig, Scenario(positions=START))
    dynamics.rate(0.0, dynamics.initial())
    y = dynamics.initial()
    y[:2] += [1e-6, -2e-6]
    y[2:4] = [0.3, 0.5]
    e = dynamics.assemble(0.0, y[:2], y[2:4])
    M, J = e.M.copy(), e.J.copy()
    projected = dynamics.project(y)
    along = np.linalg.svd(J)[2][-1]
    # M-orthogonal to the motions the constraint allows; second-order terms of a 1e-6 step remain for q.
    assert abs(along @ M @ (projected[:2] - y[:2])) < 1e-11
    assert abs(along @ M @ (projected[2:4] - y[2:4])) < 1e-6
    assert abs(float(dynamics.assemble(0.0, projected[:2], projected[2:4]).f[0])) < 1e-15
    np.testing.assert_allclose(dynamics.project(projected), projected, atol=1e-15)


def _multipliers(text: str, **positions: float) -> tuple[Dynamics, Array]:
    dynamics = prepare(load_rig_text(text), Scenario(positions=positions))
    dynamics.rate(0.0, dynamics.initial())
    return dynamics, dynamics.multipliers


def test_the_reaction_on_a_held_weight_is_its_weight_upwards() -> None:
    _, reaction = _multipliers(point_mass(2.0, '<hold name="hook" point="P" axes="x y z"/>'))
    np.testing.assert_allclose(reaction, [0, 0, 2.0 * 9.81], atol=1e-13)


def test_the_tip_of_a_level_bar_rests_on_half_its_weight() -> None:
    _, reaction = _multipliers(pendulum(0.7, 3.0, '<hold name="support" point="P" axes="z"/>'))
    assert reaction[0] == pytest.approx(0.5 * 3.0 * 9.81, rel=1e-13)


@pytest.mark.parametrize("formulation", ["multipliers", "null_space"])
def test_a_rail_answers_the_part_of_a_push_it_does_not_let_through(formulation: str) -> None:
    push = '<load name="push" kind="force" point="P" axis="1 2 -3" frame="world"><constant value="10"/></load>'
    rail = '<gravity xyz="0 0 0"/><hold name="rail" point="P" axes="y z"/>'
    rig = load_rig_text(point_mass(2.0, rail + push))
    dynamics = prepare(rig, Scenario(formulation=formulation))
    dynamics.rate(1.0, dynamics.initial())
    unit = np.array([1.0, 2.0, -3.0]) / np.sqrt(14.0)
    np.testing.assert_allclose(dynamics.multipliers, -10 * unit[1:], rtol=1e-13)
    assert dynamics.a[0] == pytest.approx(10 * unit[0] / 2.0, rel=1e-13)
