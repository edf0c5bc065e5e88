"""The tip on the rock: a mass that bounces, against its piecewise closed form; energy through every switch."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rigs import NO_GRAVITY, point_mass
from scipy.optimize import brentq

from drillrig_pin import Scenario, Trajectory, load_rig_text, simulate
from drillrig_pin.elements.contact import Contact, UnilateralContact
from drillrig_pin.kinematics import Array

MASS, G, C = 2.0, 9.81, 2e4
METHODS = ["RK4", "DOP853", "Radau", "LSODA"]


def on_ground(options: str, extension: str = "") -> str:
    """A mass above ground whose contact points down; it rests at z = 0 under its own weight."""
    rail = '<hold name="rail" point="P" axes="x y"/>'
    ground = f'<contact name="ground" point="P" axis="0 0 -1" stiffness="{C!r}" preload="{MASS * G!r}" {options}/>'
    return point_mass(MASS, rail + ground + extension)


def thrown(options: str, v0: float, method: str = "DOP853", duration: float = 0.6, rate: float = 1000) -> Trajectory:
    settings = {"method": method, "rtol": 1e-11, "atol": 1e-12, "step": 1e-4}
    case = Scenario(
        duration=duration,
        output_rate=rate,
        velocities={"z": v0},
        integrator=settings,
        stabilization={"projection": method != "LSODA"},
    )
    return simulate(load_rig_text(on_ground(options)), case)


def bounce(t: Array, v0: float) -> tuple[Array, list[float]]:
    """z(t) of the undamped bounce: sine about equilibrium while touching, parabola in flight; times of the switches."""
    omega, sag = np.sqrt(C / MASS), MASS * G / C
    z = np.full(len(t), np.nan)
    # Leaves where z = sag (the ground is relaxed), with the speed left there.
    leave = np.arcsin(sag * omega / v0) / omega
    speed = v0 * np.cos(omega * leave)
    flight = 2 * speed / G
    # Back below: from z = sag with -speed through the lowest point to z = sag with +speed.
    touch = (np.pi + 2 * np.arcsin(sag * omega / v0)) / omega
    z[t <= leave] = v0 / omega * np.sin(omega * t[t <= leave])
    start, switches = leave, [leave]
    while start < t[-1]:
        air = (t > start) & (t <= start + flight)
        z[air] = sag + speed * (t[air] - start) - G / 2 * (t[air] - start) ** 2
        ground = (t > start + flight) & (t <= start + flight + touch)
        z[ground] = v0 / omega * np.sin(omega * (t[ground] - start - flight) + np.pi - omega * leave)
        switches += [start + flight, start + flight + touch]
        start += flight + touch
    return z, [s for s in switches if s < t[-1]]


@pytest.mark.parametrize("method", METHODS)
def test_a_thrown_mass_flies_for_2v_over_g_and_bounces_as_its_closed_form(method: str) -> None:
    run = thrown('mode="unilateral"', 1.0, method)
    z, switches = bounce(run.time, 1.0)
    # An error of dt in a switch shows as g dt v / ... in z later: 1e-8 m means switches met to about 1e-8 s. RK4 at
    # omega h = 0.01 is exact to (omega h)^4 per radian of contact.
    np.testing.assert_allclose(run.q[:, 2], z, atol=1e-8)
    flying = run.of("element_force", "ground") == 0.0
    inside = np.array([sum(s < t for s in switches) % 2 == 1 for t in run.time])
    np.testing.assert_array_equal(flying, inside)


@pytest.mark.parametrize("method", METHODS)
def test_switches_are_met_however_few_samples_are_asked_for(method: str) -> None:
    run = thrown('mode="unilateral"', 1.0, method, rate=5)
    z, switches = bounce(run.time, 1.0)
    np.testing.assert_allclose(run.q[:, 2], z, atol=1e-8)
    # Touching and pushing are two switching functions; without damping both change sign together.
    assert run.cost["switches"] >= len(switches)


@pytest.mark.parametrize("method", METHODS)
def test_a_damped_ground_lets_go_as_soon_as_it_would_have_to_pull(method: str) -> None:
    k, v0 = 60.0, 1.0
    run = thrown(f'mode="unilateral" damping="{k}"', v0, method, duration=0.15)
    decay = k / (2 * MASS)
    omega = np.sqrt(C / MASS - decay**2)

    def touching(t: Array | float) -> tuple[Array, Array]:
        """z and z_dot of the damped oscillation about equilibrium."""
        z = v0 / omega * np.exp(-decay * t) * np.sin(omega * t)
        return z, v0 * np.exp(-decay * t) * np.cos(omega * t) - decay * z

    def pressing(t: float) -> float:
        z, rate = touching(t)
        return float(MASS * G - C * z - k * rate)

    # At the start the damper would pull at once: c z + k v0 > m g. It lets go there, and flies from z = 0.
    assert pressing(0.0) < 0
    z = v0 * run.time - G / 2 * run.time**2
    flying = run.time < 2 * v0 / G * 0.95
    np.testing.assert_allclose(run.q[flying, 2], z[flying], atol=1e-8)

    # Thrown more slowly it is pressed on at first, and let go before the spring is relaxed.
    v0 = 0.25
    run = thrown(f'mode="unilateral" damping="{k}"', v0, method, duration=0.04)
    leave = brentq(pressing, 0.0, np.pi / omega / 2, xtol=1e-15)
    height, speed = (float(value) for value in touching(leave))
    assert 0 < height < MASS * G / C
    later = run.time - leave
    z = np.where(later < 0, touching(run.time)[0], height + speed * later - G / 2 * later**2)
    np.testing.assert_allclose(run.q[:, 2], z, atol=1e-8)


@pytest.mark.parametrize("method", METHODS)
def test_energy_is_balanced_through_all_switches_with_damping(method: str) -> None:
    # Radau in Python takes a quarter of a minute for each second, and loses seven eighths of the energy in this one.
    run = thrown('mode="unilateral" damping="40"', 1.5, method, duration=0.8 if method == "Radau" else 1.5)
    force = run.of("element_force", "ground")
    start = 0.5 * MASS * 1.5**2
    assert run.cost["switches"] >= 6
    assert force.max() <= 0.0, "the ground never pulls"
    assert (np.diff(run.work_dissipated) >= -1e-12).all()
    assert run.work_dissipated[-1] > 0.3 * start
    # The trust line's bar for work, here of the energy put in at the start.
    assert np.abs(run.energy_residual).max() < 1e-6 * start


def test_each_bounce_with_damping_is_lower_than_the_one_before() -> None:
    run = thrown('mode="unilateral" damping="40"', 1.5, duration=1.5)
    z = run.q[:, 2]
    tops = z[1:-1][(z[1:-1] > z[:-2]) & (z[1:-1] >= z[2:]) & (z[1:-1] > 0.005)]
    assert len(tops) >= 3
    assert (np.diff(tops) < 0).all()


def test_a_very_stiff_ground_throws_back_what_falls_on_it() -> None:
    # Half an oscillation on 1e9 N/m lasts 0.14 ms; samples are 0.1 s apart.
    rail = '<hold name="rail" point="P" axes="x y"/>'
    ground = '<contact name="ground" point="P" axis="0 0 -1" stiffness="1e9" mode="unilateral"/>'
    rig = load_rig_text(point_mass(MASS, rail + ground))
    case = Scenario(duration=1.0, output_rate=10, velocities={"z": 1.0}, integrator={"rtol": 1e-11, "atol": 1e-12})
    run = simulate(rig, case)
    flight, touch = 2 * 1.0 / G, np.pi / np.sqrt(1e9 / MASS)
    phase = np.mod(run.time, flight + touch)
    # While flying (all samples do), z is the same parabola after every bounce, but for the sag of 2e-8 m.
    assert (phase < flight).all()
    np.testing.assert_allclose(run.q[:, 2], phase - G / 2 * phase**2, atol=5e-6)
    assert run.cost["switches"] >= 8


def test_bilateral_contact_holds_the_mass_that_unilateral_contact_lets_go() -> None:
    run = thrown('mode="bilateral"', 1.0)
    omega = np.sqrt(C / MASS)
    np.testing.assert_allclose(run.q[:, 2], np.sin(omega * run.time) / omega, atol=1e-9)
    assert run.of("element_force", "ground").max() > 0, "it pulls"
    assert run.cost["switches"] == 0


@pytest.mark.parametrize("mode", ["unilateral", "bilateral"])
def test_at_rest_the_ground_carries_the_weight_as_preload(mode: str) -> None:
    run = thrown(f'mode="{mode}" damping="10"', 0.0, duration=0.2)
    assert np.abs(run.q).max() < 1e-13
    np.testing.assert_allclose(run.of("element_force", "ground"), -MASS * G, rtol=1e-12)


@given(depth=st.floats(-1e-2, 1e-2), rate=st.floats(-5, 5), damping=st.floats(0, 1e3), preload=st.floats(0, 1e3))
def test_unilateral_contact_pushes_never_pulls_and_never_creates_energy(
    depth: float, rate: float, damping: float, preload: float
) -> None:
    law = UnilateralContact(0.1, preload, C, damping)
    x, x_dot = np.array([0.1 - preload / C + depth]), np.array([rate])
    assert law.force(x, x_dot, 0.0)[0] <= 0.0
    # Power that is lost is a difference of products of up to 1e5 W: never negative but for their rounding.
    assert law.dissipation(x, x_dot)[0] >= -1e-9
    assert law.energy(x)[0] >= 0.0


def test_contact_pushes_against_its_axis() -> None:
    element = Contact(name="rock", point="E", stiffness=1e6, damping=2e3, preload=100.0)
    law = element.bind(1.0, 0.0)
    assert law.force(np.array([1.001]), np.array([0.5]), 0.0)[0] == pytest.approx(-(100 + 1000 + 1000))


def test_contact_in_flight_leaves_a_body_to_itself() -> None:
    ground = f'<contact name="ground" point="P" axis="0 0 -1" stiffness="{C!r}" mode="unilateral"/>'
    rig = load_rig_text(point_mass(MASS, NO_GRAVITY + ground))
    run = simulate(rig, Scenario(duration=0.5, velocities={"z": 0.2}))
    np.testing.assert_allclose(run.q[:, 2], 0.2 * run.time, atol=1e-12)
