"""Loads over time: closed forms of the motion they drive, tables that are followed sample by sample."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rigs import NO_GRAVITY, floating_body, point_mass

from drillrig_pin import Scenario, Trajectory, load_rig_text, simulate
from drillrig_pin.elements.loads import Constant, TableLaw, read_samples
from drillrig_pin.kinematics import Array

MASS = 2.0
METHODS = ["RK4", "DOP853", "Radau", "LSODA"]


def pushed(law: str, method: str = "DOP853", **case: object) -> Trajectory:
    """A free mass pushed along world x."""
    load = f'<load name="push" kind="force" point="P" axis="1 0 0" frame="world">{law}</load>'
    settings = {"duration": 1.0, "integrator": {"method": method, "rtol": 1e-10, "step": 1e-3}, **case}
    if method == "LSODA":
        settings["stabilization"] = {"projection": False}
    return simulate(load_rig_text(point_mass(MASS, NO_GRAVITY + load)), Scenario(**settings))


def table(times: Array, values: Array) -> str:
    lines = "\n".join(f"{t!r},{v!r}" for t, v in zip(times.tolist(), values.tolist(), strict=True))
    return f"<table>\ntime,force\n{lines}\n</table>"


def test_a_constant_force_gives_a_parabola() -> None:
    run = pushed('<constant value="3"/>')
    np.testing.assert_allclose(run.q[:, 0], 0.5 * 3 / MASS * run.time**2, atol=1e-10)
    np.testing.assert_array_equal(run.of("load_value", "push"), 3.0)


def test_without_a_ramp_a_load_acts_from_the_first_instant() -> None:
    load = '<load name="{}" kind="force" point="P" axis="1 0 0" frame="world"><constant value="3" {}/></load>'
    # Beside a load with a ramp, as one stack.
    rig = load_rig_text(point_mass(MASS, NO_GRAVITY + load.format("at_once", "") + load.format("ramped", 'ramp="0.5"')))
    run = simulate(rig, Scenario(duration=0.01))
    np.testing.assert_array_equal(run.of("load_value", "at_once"), 3.0)
    assert run.of("load_value", "ramped")[0] == 0.0
    assert run.a[0, 0] == pytest.approx(3 / MASS)


def test_a_sum_of_harmonics_gives_the_integral_of_its_terms() -> None:
    run = pushed(
        '<harmonics mean="1"><term amplitude="4" frequency="3" phase="0.7"/>'
        '<term amplitude="2" frequency="11"/></harmonics>'
    )
    t, v = run.time, run.time / MASS
    for amplitude, frequency, phase in ((4, 3, 0.7), (2, 11, 0.0)):
        w = 2 * np.pi * frequency
        v = v + amplitude / (MASS * w) * (np.cos(phase) - np.cos(w * t + phase))
    np.testing.assert_allclose(run.v[:, 0], v, atol=1e-8)


def test_the_ramp_starts_and_ends_without_a_jerk() -> None:
    law = Constant(value=5.0, ramp=0.4).law()
    h = 1e-4

    def force(t: float) -> float:
        return float(np.ravel(law.force(np.zeros(1), np.zeros(1), t))[0])

    assert force(0.0) == 0.0
    assert force(0.2) == pytest.approx(2.5)
    assert force(0.4) == force(3.0) == 5.0
    for t in (0.0, 0.4):
        slope, bend = (force(t + h) - force(t - h)) / (2 * h), (force(t + h) - 2 * force(t) + force(t - h)) / h**2
        # First and second derivative vanish; the third, 60 F / T^3, leaves h^2 and h times itself.
        assert abs(slope) < 60 * 5 / 0.4**3 * h**2
        assert abs(bend) < 60 * 5 / 0.4**3 * h * 1.1


@pytest.mark.parametrize("kind", ["force", "torque"])
def test_a_load_in_body_axes_follows_the_body_and_one_in_world_axes_does_not(kind: str) -> None:
    from drillrig_pin.simulation import prepare

    for frame in ("body", "world"):
        load = f'<load name="l" kind="{kind}" point="P" axis="0 0 2" frame="{frame}"><constant value="7"/></load>'
        rig = load_rig_text(floating_body(load, gravity=False))
        turned = [0, 0, 0, np.sin(0.4), 0, 0, np.cos(0.4)]
        dynamics = prepare(rig, Scenario(positions={"free": turned}))
        generalised = dynamics.assemble(0.0, dynamics.equilibrium.assembly.q, np.zeros(6)).p1
        # Rotation of 0.8 rad about x: a world force along z is (0, sin, cos) seen from the body.
        axis = np.array([0, 0, 1]) if frame == "body" else np.array([0, np.sin(0.8), np.cos(0.8)])
        expected = np.concatenate([axis, np.cross([0.1, 0.2, -0.3], axis)]) if kind == "force" else [0, 0, 0, *axis]
        np.testing.assert_allclose(generalised, 7 * np.array(expected), atol=1e-14)


def test_a_table_reproduces_its_samples() -> None:
    t = np.linspace(0, 1, 101)
    values = np.sin(7 * t) + 0.3 * np.cos(40 * t)
    run = pushed(table(t, values), output_rate=100)
    np.testing.assert_allclose(run.of("load_value", "push"), values, atol=1e-14)


@given(st.lists(st.floats(-5, 5), min_size=4, max_size=4), st.floats(0, 1))
def test_a_table_of_a_cubic_is_that_cubic_everywhere(coefficients: list[float], where: float) -> None:
    t = np.linspace(0, 1, 9)
    law = TableLaw(t, np.polyval(coefficients, t))
    # Not-a-knot: cubics are exact, up to rounding of the tridiagonal solve.
    assert law.force(np.zeros(1), np.zeros(1), where)[0] == pytest.approx(np.polyval(coefficients, where), abs=1e-12)


@pytest.mark.parametrize("method", METHODS)
def test_a_narrow_pulse_in_a_table_is_not_stepped_over(method: str) -> None:
    t = np.arange(0, 2.0005, 1e-3)
    values = np.zeros(len(t))
    values[1234] = 1000.0
    # Two samples a second and a free mass: nothing but the table asks for small steps.
    run = pushed(table(t, values), method, duration=2.0, output_rate=2, integrator={"method": method, "step": 0.1})
    law = TableLaw(t, values)
    impulse = law._spline.integrate(0.0, 2.0)
    assert run.v[-1, 0] == pytest.approx(impulse / MASS, rel=1e-7)
    assert run.v[-1, 0] > 0.4


@pytest.mark.parametrize("method", METHODS)
def test_a_coarse_table_is_integrated_as_its_spline(method: str) -> None:
    t = np.linspace(0, 1, 21)
    values = 10 * np.sin(11 * t)
    run = pushed(table(t, values), method, output_rate=10)
    speed = TableLaw(t, values)._spline.antiderivative()
    np.testing.assert_allclose(run.v[:, 0], speed(run.time) / MASS, atol=1e-8)


def test_scale_multiplies_the_table() -> None:
    t = np.linspace(0, 1, 11)
    plain, scaled = (pushed(table(t, t**2).replace("<table>", f'<table scale="{s}">')) for s in ("1", "-2.5"))
    np.testing.assert_allclose(scaled.load_value, -2.5 * plain.load_value, rtol=1e-12)


def test_loads_can_be_switched_off_one_by_one() -> None:
    push = '<load name="{}" kind="force" point="P" axis="{}" frame="world"><constant value="2"/></load>'
    rig = load_rig_text(point_mass(MASS, NO_GRAVITY + push.format("a", "1 0 0") + push.format("b", "0 1 0")))
    ends = {loads: simulate(rig, Scenario(duration=0.1, loads=loads)).v[-1, :2] for loads in ("all", "none")}
    only_b = simulate(rig, Scenario(duration=0.1, loads=["b"]))
    np.testing.assert_allclose(ends["all"], [0.1, 0.1], rtol=1e-9)
    np.testing.assert_array_equal(ends["none"], 0.0)
    np.testing.assert_allclose(only_b.v[-1, :2], [0.0, 0.1], rtol=1e-9)
    assert only_b.labels["load"] == ["b"]


def test_several_loads_of_one_kind_act_as_each_alone() -> None:
    def load(name: str, axis: str, law: str) -> str:
        return f'<load name="{name}" kind="force" point="P" axis="{axis}" frame="world">{law}</load>'

    one = '<harmonics mean="2" ramp="0.05"><term amplitude="3" frequency="7" phase="0.2"/></harmonics>'
    two = '<harmonics ramp="0.2"><term amplitude="1" frequency="3"/><term amplitude="2" frequency="13"/></harmonics>'
    both = load_rig_text(point_mass(MASS, NO_GRAVITY + load("one", "1 0 0", one) + load("two", "0 1 0", two)))
    together = simulate(both, Scenario(duration=0.3))
    for column, law in ((0, one), (1, two)):
        alone = simulate(load_rig_text(point_mass(MASS, NO_GRAVITY + load("l", "1 0 0", law))), Scenario(duration=0.3))
        np.testing.assert_allclose(together.load_value[:, column], alone.load_value[:, 0], rtol=1e-13, atol=1e-14)


@pytest.mark.parametrize("header", ["", "time,force\n", "# measured\n", "time,force\n# at hole 9\n"])
def test_header_and_comments_of_a_table_are_passed_over(header: str) -> None:
    samples = read_samples(header + "0,1\n0.1,2\n\n0.2,3\n0.3,4\n", "table.csv")
    assert samples == ((0.0, 1.0), (0.1, 2.0), (0.2, 3.0), (0.3, 4.0))
