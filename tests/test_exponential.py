"""The exponential Adams steps of the core: exact on linear machines, of order 8, controlled, right on any machine."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from rigs import double_pendulum, floating_body, mass_on_cylinder, point_mass, tree

from drillrig_pin import Rig, Scenario, Trajectory, load_rig_text, simulate
from drillrig_pin.simulation import Case

pytest.importorskip("drillrig_pin.core", reason="the package was built without a C++ compiler")

EXP = {"integrator.method": "ExpAdams", "engine": "core"}
EXACT = {"integrator.method": "DOP853", "engine": "core", "integrator.rtol": 1e-12, "integrator.atol": 1e-15}
LOOSE = {"integrator.rtol": 1e-2, "integrator.atol": 1.0}

SPRING = '<joint_spring name="s" joint="x" stiffness="{k}" damping="{c}"/>'
HUM = """<load name="hum" kind="force" point="P" axis="1 0 0">
  <harmonic amplitude="{}" frequency="{}" phase="0.3"/></load>"""
SAMPLES = "\n".join(f"{0.05 * k:.2f},{20 * np.sin(0.9 * k):.6f}" for k in range(9))
TABLE = f'<load name="l" kind="force" point="P" axis="1 0 0">\n<table>\n{SAMPLES}\n</table></load>'
GROUND = '<contact name="g" point="P" axis="0 0 -1" stiffness="2e4" preload="19.62" damping="40" mode="unilateral"/>'


def error(rig: Rig, case: Scenario, exact: Trajectory | None = None) -> float:
    """Largest difference of a position from the exact motion."""
    exact = exact or simulate(rig, case.changed(EXACT))
    run = simulate(rig, case.changed(EXP))
    assert run.outcome.completed, run.outcome
    assert run.method == "ExpAdams"
    np.testing.assert_array_equal(run.time, exact.time)
    return float(np.abs(run.q - exact.q).max())


def test_free_vibration_of_a_linear_machine_is_carried_exactly_over_long_steps() -> None:
    k, c, m, v0 = 2e4, 6.0, 2.0, 0.5
    rig = load_rig_text(
        point_mass(m, SPRING.format(k=k, c=c)).replace("<drillrig>", '<drillrig><gravity xyz="0 0 0"/>')
    )
    # Ten samples a second of a vibration of 16 Hz; steps of up to 20 ms, a third of its period.
    case = Scenario(duration=3.0, output_rate=10.0, velocities={"x": v0}, integrator={"max_step": 0.02})
    run = simulate(rig, case.changed({**EXP, **LOOSE, "integrator.max_step": 0.02}))
    decay, omega = c / (2 * m), np.sqrt(k / m - (c / (2 * m)) ** 2)
    x = v0 / omega * np.exp(-decay * run.time) * np.sin(omega * run.time)
    # The start is DOP853's at a loose tolerance; behind it the vibration must neither decay nor turn otherwise. What
    # remains is the Jacobian by differences, 1e-8 of k / m, over 300 rad.
    start = 9 * 0.02
    late = run.time > start
    assert run.cost["steps"] < 200
    closed = np.exp(-decay * run.time) * np.cos(omega * run.time)
    basis = np.stack([closed, x], axis=1)[late]
    amplitudes = np.linalg.lstsq(basis, run.of("q")[late, 0], rcond=None)[0]
    assert np.abs(basis @ amplitudes - run.of("q")[late, 0]).max() < 1e-5 * v0 / omega


def test_the_error_on_the_drilling_rig_falls_with_the_eighth_power_of_the_step(mkz49: Rig) -> None:
    case = Scenario(duration=0.5, output_rate=200.0).changed(LOOSE)
    exact = simulate(mkz49, case.changed(EXACT))
    # Spacings that divide the way between rows, or are longer.
    steps = np.array([1.25e-3, 1e-3, 5e-4, 1e-3 / 3])
    errors = [error(mkz49, case.changed({"integrator.max_step": h}), exact) for h in steps.tolist()]
    order = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    # Slopes between neighbours scatter by one about 8: the error is the sum of several vibrations.
    assert 7.0 < order < 9.0, (order, errors)


@pytest.mark.parametrize("rate", [200.0, 1000.0])
def test_the_tolerance_is_kept_and_costs_what_it_must(mkz49: Rig, rate: float) -> None:
    case = Scenario(duration=0.5, output_rate=rate)
    exact = simulate(mkz49, case.changed(EXACT))
    largest = float(np.ptp(exact.q, axis=0).max())
    costs = []
    for rtol in (1e-5, 1e-7, 1e-9):
        tight = case.changed({"integrator.rtol": rtol, "integrator.atol": rtol / 100})
        # The error adds up over some hundred steps.
        assert error(mkz49, tight, exact) < 100 * rtol * largest
        costs.append(simulate(mkz49, tight.changed(EXP)).cost["evaluations"])
    # Spacings divide the way between samples, so that neighbours may cost the same.
    assert costs[0] < 0.7 * costs[-1]
    assert costs[-1] < 0.4 * simulate(mkz49, case.changed({**EXACT, "integrator.rtol": 1e-9})).cost["evaluations"]


MACHINES: dict[str, tuple[Callable[[], Rig], dict[str, object]]] = {
    "large swings": (lambda: load_rig_text(double_pendulum()), {"velocities": {"shoulder": 3.0}}),
    "oil": (lambda: load_rig_text(mass_on_cylinder()), {"velocities": {"slide": 0.05}}),
    "breakpoints": (lambda: load_rig_text(point_mass(extension=TABLE + SPRING.format(k=1e4, c=5))), {}),
    "switches": (lambda: load_rig_text(point_mass(extension=GROUND)), {"velocities": {"z": 0.3}}),
    "free body": (lambda: load_rig_text(floating_body()), {"velocities": {"free.wx": 2.0, "free.wy": 0.5}}),
    "every kind of joint, held": (
        lambda: load_rig_text(tree('<hold name="h" point="R" axes="x z"/>')),
        {"velocities": {"spin": 1.0}},
    ),
    "held, null space": (
        lambda: load_rig_text(tree('<hold name="h" point="R" axes="x z"/>')),
        {"velocities": {"spin": 1.0}, "formulation": "null_space"},
    ),
}


@pytest.mark.parametrize("name", MACHINES)
@pytest.mark.parametrize("rate", [1000.0, 170.0])
def test_machines_that_are_far_from_linear_are_right_too(name: str, rate: float) -> None:
    make, changes = MACHINES[name]
    case = Scenario(duration=0.4, output_rate=rate).changed(
        {"integrator.rtol": 1e-9, "integrator.atol": 1e-11, **changes}
    )
    # Tolerance times some hundred steps, at velocities of the order of one.
    assert error(make(), case) < 1e-7


@pytest.mark.parametrize("rtol", [1e-12, 1e-13])
def test_a_tolerance_below_rounding_is_left_to_dop853(mkz49: Rig, rtol: float) -> None:
    case = Scenario(duration=0.5, output_rate=200.0).changed({"integrator.rtol": rtol, "integrator.atol": rtol / 100})
    assert error(mkz49, case) < 1e-11
    cost = [simulate(mkz49, case.changed(method)).cost["evaluations"] for method in (EXP, EXACT)]
    assert cost[0] < 3 * cost[1]


def test_a_stop_between_samples_and_an_odd_last_sample_change_nothing(mkz49: Rig) -> None:
    case = Scenario(duration=0.2345, output_rate=700.0)
    assert error(mkz49, case) < 1e-8


def test_the_work_of_the_loads_balances_the_energy(mkz49: Rig) -> None:
    run = simulate(mkz49, Scenario(duration=2.0).changed(EXP))
    assert np.abs(run.energy_residual).max() < 1e-6 * run.work_input.max()


# --- the choice -----------------------------------------------------------------------------------------------------


def chosen(rig: Rig, **fields: object) -> str:
    return Case(rig, Scenario(**{"duration": 0.4, **fields})).method


def test_auto_takes_it_for_a_rig_that_drills(mkz49: Rig) -> None:
    assert chosen(mkz49) == "ExpAdams"
    assert chosen(mkz49, formulation="null_space", output_rate=100.0) == "ExpAdams"
    assert chosen(mkz49, engine="python") == "DOP853"


@pytest.mark.parametrize(
    ("text", "fields"),
    [
        (double_pendulum(), {}),
        (mass_on_cylinder(), {"velocities": {"slide": 0.5}}),
        (point_mass(extension=GROUND), {}),
    ],
    ids=["falls", "moves already", "switches"],
)
def test_auto_takes_dop853_where_the_motion_is_not_a_small_vibration(text: str, fields: dict[str, object]) -> None:
    assert chosen(load_rig_text(text), **fields) == "DOP853"


def test_auto_takes_an_implicit_method_where_a_damper_is_fast() -> None:
    rig = load_rig_text(mass_on_cylinder(mass=1.0, options='friction="1e5"'))
    assert chosen(rig) == "RODAS"
    assert chosen(rig, engine="python") == "Radau"
