"""Slider-crank and four-bar against their closed-form kinematics and their equation of motion with one coordinate."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from closed_forms import BARS, CRANK, ROD, bar_motion, crank_motion, derivative
from rigs import four_bar, slider_crank

from drillrig_pin import Scenario, Trajectory, load_rig_text, simulate
from drillrig_pin.kinematics import Array

#: Positions follow from the closed form to the tolerance of the constraints, a few roundings of a metre.
CLOSED = 1e-12


@pytest.fixture(scope="module")
def crank_run() -> Trajectory:
    rig = load_rig_text(slider_crank(CRANK, ROD))
    case = Scenario(duration=1.0, velocities={"crank_joint": 70.0}, positions={"crank_joint": 0.3})
    return simulate(rig, case.changed({"integrator.rtol": 1e-12, "integrator.atol": 1e-13}))


@pytest.fixture(scope="module")
def bar_run() -> Trajectory:
    rig = load_rig_text(four_bar(BARS))
    start = {"crank_joint": 0.4, "coupler_joint": 0.3, "rocker_joint": 1.2}
    case = Scenario(duration=1.0, velocities={"crank_joint": 30.0}, positions=start)
    return simulate(rig, case.changed({"integrator.rtol": 1e-12, "integrator.atol": 1e-13}))


def _turned(theta: Array) -> float:
    return float(np.ptp(np.unwrap(theta)))


def test_slider_crank_follows_its_closed_form_over_revolutions(crank_run: Trajectory) -> None:
    q = crank_run.q
    theta = q[:, 0]
    rod, slider = crank_motion(theta)
    assert _turned(theta) > 2 * np.pi
    np.testing.assert_allclose(q[:, 1], rod + 2 * np.pi * np.round((q[:, 1] - rod) / (2 * np.pi)), atol=CLOSED)
    np.testing.assert_allclose(q[:, 2], slider, atol=CLOSED)


def test_slider_crank_velocities_are_the_derivatives_of_its_closed_form(crank_run: Trajectory) -> None:
    q, v = crank_run.q, crank_run.v
    theta = q[:, 0]
    for column, which in ((1, 0), (2, 1)):
        slope = derivative(lambda s, which=which: crank_motion(s)[which], theta)
        # Velocities of 10 rad/s, known to the same relative digits as the positions.
        np.testing.assert_allclose(v[:, column], slope * v[:, 0], atol=20 * CLOSED)


def test_slider_crank_accelerates_as_its_equation_with_one_coordinate(crank_run: Trajectory) -> None:
    def parts(theta: Array) -> tuple[Array, Array]:
        """Positions of the three centres of mass as functions of the crank angle, (3, 2, n); absolute rod angle."""
        rod = crank_motion(theta)[0] + theta
        centre_crank = CRANK / 2 * np.array([np.cos(theta), np.sin(theta)])
        centre_rod = np.array([CRANK * np.cos(theta), CRANK * np.sin(theta)]) + ROD / 2 * np.array(
            [np.cos(rod), np.sin(rod)]
        )
        return np.array([centre_crank, centre_rod, [crank_motion(theta)[1], 0 * theta]]), rod

    _check_acceleration(crank_run, parts, masses=(2.0, 1.0, 3.0), moments=(0.01, 0.03))


def test_four_bar_follows_its_closed_form_over_a_revolution(bar_run: Trajectory) -> None:
    q, v = bar_run.q, bar_run.v
    coupler, rocker = bar_motion(q[:, 0])
    assert _turned(q[:, 0]) > 2 * np.pi
    np.testing.assert_allclose(q[:, 1], coupler, atol=10 * CLOSED)
    np.testing.assert_allclose(q[:, 2], rocker, atol=10 * CLOSED)
    for column in (1, 2):
        slope = derivative(lambda s, column=column: bar_motion(s)[column - 1], q[:, 0])
        np.testing.assert_allclose(v[:, column], slope * v[:, 0], atol=200 * CLOSED)


def test_four_bar_accelerates_as_its_equation_with_one_coordinate(bar_run: Trajectory) -> None:
    ground, crank, coupler_length, rocker_length = BARS

    def parts(theta: Array) -> tuple[Array, Array, Array]:
        relative, phi = bar_motion(theta)
        angle = relative + theta
        centre = [
            crank / 2 * np.array([np.cos(theta), np.sin(theta)]),
            np.array([crank * np.cos(theta), crank * np.sin(theta)])
            + coupler_length / 2 * np.array([np.cos(angle), np.sin(angle)]),
            np.array([ground + rocker_length / 2 * np.cos(phi), rocker_length / 2 * np.sin(phi)]),
        ]
        return np.array(centre), angle, phi

    _check_acceleration(bar_run, parts, masses=(1.0, 2.0, 1.5), moments=(0.012, 0.14, 0.06))


def _check_acceleration(
    run: Trajectory, parts: Callable[[Array], tuple[Array, ...]], masses: tuple[float, ...], moments: tuple[float, ...]
) -> None:
    """I(theta) a + I'(theta) theta_dot^2 / 2 + V'(theta) = 0, with I and V of the closed form, gravity along -y.

    ``parts`` gives the centres of mass and the absolute angles of all turning links but the crank.
    """
    q = run.q
    theta = q[:, 0]
    weight = np.array(masses)

    def inertia(s: Array) -> Array:
        # Derivatives of the centres by a five-point rule on real arguments.
        h = 1e-3
        rates = [
            sum(w * np.asarray(parts(s + k * h)[i]) for k, w in ((-2, 1), (-1, -8), (1, 8), (2, -1))) / (12 * h)
            for i in range(len(moments))
        ]
        turning = moments[0] + sum(m * rate**2 for m, rate in zip(moments[1:], rates[1:], strict=True))
        return np.einsum("b,bin->n", weight, rates[0] ** 2) + turning

    h = 1e-3
    slope = (inertia(theta - 2 * h) - 8 * inertia(theta - h) + 8 * inertia(theta + h) - inertia(theta + 2 * h)) / (
        12 * h
    )
    gravity = 9.81 * np.einsum("b,bn->n", weight, derivative(lambda s: parts(s)[0], theta)[:, 1])
    expected = -(0.5 * slope * run.v[:, 0] ** 2 + gravity) / inertia(theta)
    # Two nested five-point rules leave about 1e-9 of accelerations of up to 100 rad/s^2.
    np.testing.assert_allclose(run.a[:, 0], expected, atol=1e-6 * np.abs(expected).max())


@pytest.mark.parametrize("run", ["crank_run", "bar_run"])
def test_a_driven_linkage_keeps_its_energy_and_its_loop(run: str, request: pytest.FixtureRequest) -> None:
    trajectory: Trajectory = request.getfixturevalue(run)
    assert trajectory.outcome.completed
    exchanged = np.ptp(trajectory.energy_kinetic)
    assert np.abs(trajectory.energy_residual).max() < 1e-9 * exchanged
    assert np.abs(trajectory.constraint_error).max() < 1e-12
    assert np.abs(trajectory.constraint_rate).max() < 1e-10
