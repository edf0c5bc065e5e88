"""The constraints are looked at behind every step: a run ends before a singular position, and where it leaves them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rigs import four_bar, joint, link, point, robot, slider_crank
from scipy.optimize import brentq
from validation.library import a02_exact, n_four_bar

from drillrig_pin import Rig, Scenario, Status, Trajectory, load_rig_text, simulate
from drillrig_pin.kinematics import Array

ENGINES = ["core", "python"]
BAR = {"crank_joint": 0.4, "coupler_joint": 0.3, "rocker_joint": 1.2}


def _flat(n: int) -> float:
    """When n four-bars in a row, started upright at 1 rad/s, first lie flat."""
    return float(brentq(lambda t: float(a02_exact(np.array(t), n)[0]), 0.1, 2.0))


def _fall(rig: Rig, n: int, **changes: object) -> Trajectory:
    start = {f"foot_{i}": np.pi / 2 for i in range(n + 1)} | {f"knee_{i}": -np.pi / 2 for i in range(n)}
    turning = {f"foot_{i}": -1.0 for i in range(n + 1)} | {f"knee_{i}": 1.0 for i in range(n)}
    case = Scenario(duration=4.0, positions=start, velocities=turning, output_rate=200.0)
    return simulate(rig, case.changed(dict(changes)))


def _assert_ended_before(run: Trajectory, n: int) -> None:
    assert run.outcome.status is Status.SINGULAR, run.outcome
    # As good as lost is a ten-thousandth of what rank has to spare, a ten-thousandth of a radian at 5 rad/s.
    assert run.outcome.time == pytest.approx(_flat(n), abs=2e-3)
    assert run.time[-1] < _flat(n), "no sample of what lies behind is kept"
    exact: Array = a02_exact(run.time, n)[0]
    # On the one branch that leads there.
    np.testing.assert_allclose(run.of("q", "foot_0"), exact, atol=1e-3)


@pytest.mark.parametrize("rate", [0.5, 20.0, 200.0, 1000.0])
@pytest.mark.parametrize("n", [1, 2, 3])
@pytest.mark.parametrize("engine", ENGINES)
def test_a_run_ends_before_a_singular_position_whatever_its_output_rate(engine: str, n: int, rate: float) -> None:
    _assert_ended_before(_fall(load_rig_text(n_four_bar(n)), n, engine=engine, output_rate=rate), n)


@pytest.mark.parametrize("tolerance", [1e-4, 1e-6, 1e-10])
@pytest.mark.parametrize(
    ("engine", "method"),
    [
        ("core", "RK4"),
        ("core", "RODAS"),
        ("core", "ExpAdams"),
        ("python", "RK4"),
        ("python", "Radau"),
        ("python", "LSODA"),
    ],
)
def test_every_method_ends_before_it_at_every_tolerance(engine: str, method: str, tolerance: float) -> None:
    changes = {"integrator.method": method, "integrator.rtol": tolerance, "integrator.atol": tolerance / 100}
    changes |= {"integrator.step": 2e-3, "stabilization.projection": method != "LSODA", "output_rate": 5.0}
    _assert_ended_before(_fall(load_rig_text(n_four_bar(2)), 2, engine=engine, **changes), 2)


@given(order=st.permutations(range(3)), axes=st.sampled_from(["x y", "y x"]), engine=st.sampled_from(ENGINES))
@settings(max_examples=8, deadline=None)
def test_the_order_of_rows_and_with_it_the_rounding_does_not_matter(order: list[int], axes: str, engine: str) -> None:
    # All three loops lose rank at once: no singular vector is anybody's there.
    lines = n_four_bar(3).splitlines()
    places = [i for i, line in enumerate(lines) if "<loop " in line]
    loops = [lines[i][lines[i].index("<loop ") :].replace('"x y"', f'"{axes}"') for i in places]
    for place, i in zip(places, order, strict=True):
        lines[place] = lines[place][: lines[place].index("<loop ")] + loops[i]
    _assert_ended_before(_fall(load_rig_text("\n".join(lines)), 3, engine=engine, output_rate=10.0), 3)


@given(longer=st.floats(1e-4, 0.3), speed=st.floats(2.0, 40.0))
@settings(max_examples=15, deadline=None)
def test_a_motion_that_passes_a_singular_position_at_a_distance_goes_on(longer: float, speed: float) -> None:
    # Rods of 0.4 m, from 0.04 mm longer than the crank.
    rig = load_rig_text(slider_crank(0.4, 0.4 * (1 + longer), gravity=False))
    start = {"crank_joint": 0.3, "rod_joint": -0.6, "slide": 0.76}
    case = Scenario(duration=3.0 / speed, positions=start, velocities={"crank_joint": speed}, output_rate=50.0)
    run = simulate(rig, case)
    assert run.outcome.completed, run.outcome


@pytest.mark.parametrize("engine", ENGINES)
def test_drift_ends_a_run_between_its_samples_and_names_the_row(engine: str) -> None:
    case = Scenario(
        duration=10.0,
        output_rate=0.5,
        positions=BAR,
        velocities={"crank_joint": 8.0},
        engine=engine,
        integrator={"method": "RK4", "step": 0.05},
        stabilization={"method": "none", "projection": False},
    )
    run = simulate(load_rig_text(four_bar()), case)
    assert run.outcome.status is Status.DRIFTED, run.outcome
    assert "closure." in run.outcome.cause
    assert 0 < run.outcome.time < 10.0
    assert np.abs(run.constraint_error).max() <= 1e-3, "nothing is kept of where it is not"
    # A tenth of the step keeps the same machine together.
    kept = simulate(load_rig_text(four_bar()), case.changed({"integrator.step": 0.005}))
    assert kept.outcome.completed


def test_both_engines_end_at_the_same_time() -> None:
    rig = load_rig_text(n_four_bar(2))
    times = [_fall(rig, 2, engine=engine, output_rate=5.0).outcome.time for engine in ENGINES]
    # Both say a time at which s is below its limit, a ten-thousandth; the positions themselves agree to 1e-7.
    assert times[0] == pytest.approx(times[1], abs=1e-4)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_machine_whose_every_row_is_redundant_runs_as_if_it_had_none(engine: str) -> None:
    # A point on the hinge's own axis is held: it could not move anyway.
    door = [link("door", 1.0, (0.5, 0, 0)), joint("post", "revolute", "world", "door")]
    gravity = '<gravity xyz="0 -9.81 0"/>'
    hold = point("P", "door", (0, 0, 1)) + '<hold name="held" point="P" axes="x y z"/>\n'
    case = Scenario(duration=0.5, output_rate=50.0, engine=engine)
    held, free = (simulate(load_rig_text(robot(*door, extension=gravity + more)), case) for more in (hold, ""))
    assert held.outcome.completed
    np.testing.assert_allclose(held.q, free.q, atol=1e-9)
