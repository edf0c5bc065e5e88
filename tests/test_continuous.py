"""A joint without limits has one angle that counts on over whole turns, in springs, work, results and tables."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rigs import NO_GRAVITY, joint, link, point, robot, tree

from drillrig_pin import Scenario, ScenarioError, load_rig_text, simulate
from drillrig_pin.older import count_turns
from drillrig_pin.simulation import start_state
from drillrig_pin.trajectory import Trajectory, load_trajectory

ENGINES = ["core", "python"]
SHAKEN = (
    '<joint_spring name="brake" joint="swing" stiffness="1e6" damping="1e3" rest="{rest}"/>'
    '<load name="shake" kind="torque" point="P" axis="0 0 1"><harmonics mean="0">'
    '<term amplitude="1000" frequency="10"/></harmonics></load>'
)


def slew(kind: str, extension: str) -> str:
    """A body of 100 kg on a vertical axle; 45 kg m^2 about it."""
    return robot(
        link("body", 100.0, (0.5, 0, 0), (5, 20, 20)),
        joint("swing", kind, "world", "body"),
        extension=point("P", "body", (1, 0, 0)) + extension,
    )


def ran(kind: str, extension: str, **fields: object) -> Trajectory:
    return simulate(load_rig_text(slew(kind, extension)), Scenario(**fields))


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("rest", ["initial", repr(math.pi)])
def test_a_machine_slewed_back_by_half_a_turn_vibrates_as_any_other(engine: str, rest: str) -> None:
    case = {"duration": 0.5, "positions": {"swing": math.pi}, "engine": engine, "output_rate": 500}
    endless, limited = (ran(kind, SHAKEN.format(rest=rest), **case) for kind in ("continuous", "revolute"))
    assert endless.labels["joint"] == ["swing"]
    # Two runs of one machine to a relative tolerance of 1e-8; 0.16 degrees is the whole swing.
    np.testing.assert_allclose(endless.q, limited.q, atol=1e-8)
    np.testing.assert_allclose(endless.element_coordinate, limited.element_coordinate, atol=1e-8)
    assert np.ptp(endless.q) == pytest.approx(math.radians(0.16), rel=0.02)


@settings(max_examples=15, deadline=None)
@given(start=st.floats(-40.0, 40.0), speed=st.floats(-30.0, 30.0), engine=st.sampled_from(ENGINES))
def test_wherever_it_starts_and_however_fast_it_spins_it_is_a_revolute_joint(
    start: float, speed: float, engine: str
) -> None:
    spring = '<joint_spring name="s" joint="swing" stiffness="400" damping="5" rest="initial"/>'
    case = {"duration": 0.3, "output_rate": 100, "positions": {"swing": start}, "engine": engine}
    runs = [
        ran(kind, spring, velocities={"swing": speed}, integrator={"rtol": 1e-10}, **case)
        for kind in ("continuous", "revolute")
    ]
    # A radian's tolerance, 1e-10, gathered over some ten steps.
    np.testing.assert_allclose(runs[0].q, runs[1].q, atol=1e-8)
    assert runs[0].q[0, 0] == pytest.approx(start)


@pytest.mark.parametrize(("engine", "minutes"), [("core", 10.0), ("python", 0.2)])
def test_a_motor_turns_a_rod_for_minutes_and_keeps_its_energy_balance(engine: str, minutes: float) -> None:
    motor = '<joint_torque name="motor" joint="swing" value="450"/>'
    time = 60.0 * minutes
    run = ran("continuous", motor, duration=time, output_rate=10, engine=engine)
    # 450 N m on 45 kg m^2: 5 t^2; 1e-8 of one radian a step over thousands of them.
    assert run.q[-1, 0] == pytest.approx(5.0 * time**2, abs=1e-5)
    assert np.abs(run.energy_residual).max() < 1e-9 * run.energy_kinetic[-1]


def test_far_out_an_angle_is_computed_as_closely_as_near_zero() -> None:
    swing = '<gravity xyz="0 -9.81 0"/>'
    case = {"duration": 2.0, "output_rate": 10}
    near, far = (ran("continuous", swing, positions={"swing": turns * math.tau}, **case) for turns in (0, 1000))
    # 6283 rad times the tolerance would be 6e-5 a step; sine and cosine of such an angle round to 1e-12.
    np.testing.assert_allclose(far.q - 1000 * math.tau, near.q, atol=1e-9)


def test_statics_hold_a_body_turned_by_more_than_half_a_turn() -> None:
    spring = '<gravity xyz="0 -9.81 0"/><joint_spring name="s" joint="swing" stiffness="1e5" rest="3.5"/>'
    rig = load_rig_text(slew("continuous", spring))
    state = start_state(rig, Scenario(positions={"swing": 3.52}))
    # 0.02 rad of 1e5 N m/rad against a weight of 981 N at 0.5 m cos(3.52), read off by what nothing carries.
    weight = 981.0 * 0.5 * math.cos(3.52)
    assert state.unbalanced == pytest.approx([weight + 0.02 * 1e5], rel=1e-9)
    assert state.x0["s"] == 3.52


def test_tables_name_one_angle_in_radians(tmp_path: Path) -> None:
    run = simulate(load_rig_text(tree()), Scenario(duration=0.01, positions={"spin": 7.0}))
    run.to_csv(tmp_path / "run.csv")
    header = next(csv.reader((tmp_path / "run.csv").open()))
    told = {"q.spin [rad]", "v.spin [rad/s]", "q.stretch [m]", "q.free.x [m]", "q.free.qw [1]", "v.free.wx [rad/s]"}
    assert told <= set(header)
    assert not [name for name in header if ".cos" in name or ".sin" in name]
    assert run.of("q", "spin")[0] == 7.0


def test_cosine_and_sine_as_a_position_are_refused_with_what_to_give() -> None:
    rig = load_rig_text(slew("continuous", ""))
    with pytest.raises(ScenarioError, match=r"takes 1 values, not 2.*an angle \[rad\] \(no cosine and sine\)"):
        simulate(rig, Scenario(positions={"swing": [1.0, 0.0]}))


def _as_written_before(run: Trajectory, joint_name: str) -> Trajectory:
    """The same result with that joint's angle as two columns."""
    i = run.labels["joint"].index(joint_name)
    angle = run.q[:, i]
    q = np.column_stack([run.q[:, :i], np.cos(angle), np.sin(angle), run.q[:, i + 1 :]])
    labels = dict(run.labels)
    labels["joint"] = [*labels["joint"][:i], f"{joint_name}.cos", f"{joint_name}.sin", *labels["joint"][i + 1 :]]
    return Trajectory(
        run.time, {**run.arrays, "q": q}, labels, run.outcome, run.scenario, run.model, run.arguments, run.cost
    )


def test_a_result_with_cosine_and_sine_is_read_as_angles(tmp_path: Path) -> None:
    # Nine turns a second, sampled ten times a second: only the velocities tell how often it went round.
    rig = load_rig_text(tree(NO_GRAVITY))
    run = simulate(rig, Scenario(duration=2.0, output_rate=10, velocities={"spin": 9 * math.tau}))
    _as_written_before(run, "spin").save(tmp_path / "old.nc")
    read = load_trajectory(tmp_path / "old.nc")
    assert read.labels["joint"] == run.labels["joint"]
    np.testing.assert_allclose(read.q, run.q, atol=1e-9)
    assert simulate(load_rig_text(read.model), read.scenario).q[-1] == pytest.approx(run.q[-1])


def test_a_result_without_samples_or_continuous_joints_stays_as_it_is() -> None:
    labels = {"joint": ["a.cos", "a.sin", "b"], "dof": ["a", "b"]}
    arrays = {"q": np.zeros((0, 3)), "v": np.zeros((0, 2)), "time": np.zeros(0)}
    count_turns(arrays, labels)
    assert (labels["joint"], arrays["q"].shape) == (["a", "b"], (0, 2))
    labels, q = {"joint": ["a", "b"], "dof": ["a", "b"]}, np.ones((1, 2))
    arrays = {"q": q, "v": q, "time": np.zeros(1)}
    count_turns(arrays, labels)
    assert arrays["q"] is q


def test_every_python_method_takes_the_tolerance_of_an_endless_angle() -> None:
    motor = '<joint_torque name="motor" joint="swing" value="450"/>'
    for method in ("DOP853", "Radau", "LSODA"):
        run = ran(
            "continuous",
            motor,
            duration=1.0,
            engine="python",
            output_rate=10,
            integrator={"method": method},
            stabilization={"projection": False},
        )
        assert run.q[-1, 0] == pytest.approx(5.0, abs=1e-6), method
