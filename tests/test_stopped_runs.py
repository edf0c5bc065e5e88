"""A run that cannot go on stops with a status, time and cause, and keeps what it has."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from rigs import NO_GRAVITY, double_pendulum, joint, link, mass_on_cylinder, point, point_mass, robot, slider_crank

from drillrig_pin import ModelError, Scenario, Status, Trajectory, load_rig_text, load_trajectory, simulate


def assert_kept(run: Trajectory, tmp_path: Path) -> None:
    """What there is belongs together, is finite, and survives a file."""
    assert not run.outcome.completed
    assert len(run.time) >= 1
    assert run.time[-1] <= run.outcome.time + 1e-12
    for name, values in run.arrays.items():
        assert len(values) == len(run.time), name
        assert np.isfinite(values).all(), name
    text = str(run.outcome)
    assert run.outcome.status.word in text
    assert run.outcome.cause in text
    assert run.outcome.status.advice in text
    run.save(tmp_path / "stopped.nc")
    assert load_trajectory(tmp_path / "stopped.nc").outcome == run.outcome


METHODS = ["RK4", "DOP853", "Radau", "LSODA"]


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("law", ["geometric", "printed"])
@pytest.mark.parametrize("speed", [150.0, -150.0])
def test_a_cylinder_that_leaves_its_stroke_stops_the_run_by_name(
    method: str, law: str, speed: float, tmp_path: Path
) -> None:
    # 500 kg at 150 m/s: far more than the oil can take before the piston reaches an end, 0.18 m away.
    rig = load_rig_text(mass_on_cylinder(options=f'law="{law}"'))
    settings = {"integrator": {"method": method}, "stabilization": {"projection": False}}
    run = simulate(rig, Scenario(duration=0.1, velocities={"slide": speed}, **settings))
    assert run.outcome.status is Status.DIVERGED
    assert "cylinder 'oil'" in run.outcome.cause
    assert "nan" not in run.outcome.cause
    assert 0.178 / 150 < run.outcome.time < 0.003
    assert run.cylinder_length.max() < 0.844, "nothing beyond the end of the stroke is kept"
    assert run.cylinder_length.min() > 0.472
    assert_kept(run, tmp_path)


def test_an_unstable_motion_that_leaves_finite_numbers_is_reported(tmp_path: Path) -> None:
    # A motor that pushes with the square of its own speed reaches infinity in finite time.
    from drillrig_pin.elements import Name, PluginElement, reference

    class Runaway(PluginElement):
        """F = x_dot^3."""

        tag = "runaway"
        joint: Name = reference("joint")

        def coordinate(self, resolver):
            return resolver.joint(self.joint)

        def force(self, x, xdot, t):
            return xdot**3

    rig = load_rig_text(point_mass(1.0), elements=[Runaway(name="motor", joint="x")])
    # v' = v^3 from 1: infinite at t = 0.5.
    run = simulate(rig, Scenario(duration=1.0, velocities={"x": 1.0}))
    assert run.outcome.status in (Status.DIVERGED, Status.STEP_TOO_SMALL)
    assert run.outcome.time == pytest.approx(0.5, abs=2e-3)
    assert_kept(run, tmp_path)
    fixed = simulate(rig, Scenario(duration=1.0, velocities={"x": 1.0}, integrator={"method": "RK4", "step": 1e-3}))
    assert fixed.outcome.status is Status.DIVERGED
    assert fixed.outcome.time == pytest.approx(0.5, abs=5e-3)
    assert_kept(fixed, tmp_path)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("rate", [1000.0, 100.0])
def test_a_singular_configuration_during_the_motion_stops_the_run(method: str, rate: float, tmp_path: Path) -> None:
    # Crank and rod of one length: at a crank angle of 90 degrees the rod lies on the crank, the slider at the origin,
    # and from there on the crank may either pull the slider through or turn with the rod around it.
    rig = load_rig_text(slider_crank(0.4, 0.4, gravity=False))
    case = Scenario(
        duration=1.0,
        output_rate=rate,
        positions={"crank_joint": 0.3, "rod_joint": -0.6, "slide": 0.76},
        velocities={"crank_joint": 20.0},
        integrator={"method": method},
        stabilization={"projection": method != "LSODA"},
    )
    run = simulate(rig, case)
    assert run.outcome.status is Status.SINGULAR, run.outcome
    assert "wrist.x, wrist.y" in run.outcome.cause
    angle = run.q[:, 0]
    # It came that far, to within a sample, and kept nothing of what it cannot know.
    assert (angle < np.pi / 2).all()
    assert angle[-1] > np.pi / 2 - 1.6 * run.v[-1, 0] / rate
    assert_kept(run, tmp_path)


def test_a_motion_that_only_comes_near_a_singular_configuration_goes_on() -> None:
    # The rod 1 % longer than the crank: steep, but one path only.
    rig = load_rig_text(slider_crank(0.4, 0.404, gravity=False))
    start = {"crank_joint": 0.3, "rod_joint": -0.6, "slide": 0.76}
    run = simulate(rig, Scenario(duration=1.0, positions=start, velocities={"crank_joint": 20.0}))
    assert run.outcome.completed, run.outcome
    assert np.ptp(run.q[:, 0]) > 2
    assert np.abs(run.constraint_error).max() < 1e-12


def test_an_interrupt_keeps_what_was_computed(tmp_path: Path) -> None:
    def stop(t: float) -> None:
        if t > 0.05:
            raise KeyboardInterrupt

    rig = load_rig_text(double_pendulum())
    # The Python engine, which calls back often enough; tests/test_core_runs.py interrupts the core.
    run = simulate(rig, Scenario(duration=1.0, engine="python"), progress=stop)
    assert run.outcome.status is Status.INTERRUPTED
    assert 0.05 < run.outcome.time < 0.1
    assert_kept(run, tmp_path)
    # What it has is what the whole run would have had.
    whole = simulate(rig, Scenario(duration=1.0, engine="python"))
    np.testing.assert_array_equal(run.q, whole.q[: len(run.q)])


def test_a_tolerance_that_no_step_meets_is_said(tmp_path: Path) -> None:
    from drillrig_pin.elements import Name, PluginElement, reference

    class Dry(PluginElement):
        """Dry friction without smoothing: its force jumps with the sign of the velocity."""

        tag = "dry"
        joint: Name = reference("joint")

        def coordinate(self, resolver):
            return resolver.joint(self.joint)

        def force(self, x, xdot, t):
            return np.where(t > 0.1, np.nan, -xdot)

    rig = load_rig_text(point_mass(1.0, NO_GRAVITY), elements=[Dry(name="d", joint="x")])
    run = simulate(rig, Scenario(duration=1.0, velocities={"x": 1.0}))
    assert run.outcome.status in (Status.STEP_TOO_SMALL, Status.DIVERGED)
    assert run.outcome.time == pytest.approx(0.1, abs=1e-3)
    assert_kept(run, tmp_path)


def test_progress_is_reported_in_order_to_the_end() -> None:
    seen: list[float] = []
    simulate(load_rig_text(double_pendulum()), Scenario(duration=0.5, engine="python"), progress=seen.append)
    assert seen == sorted(seen)
    assert 50 <= len(seen) <= 500
    assert seen[-1] == pytest.approx(0.5, abs=0.01)


def test_a_moving_link_without_mass_is_said_to_be_the_cause() -> None:
    text = robot(
        link("ghost", 0.0, inertia=(0.0, 0.0, 0.0)),
        joint("slide", "prismatic", "world", "ghost"),
        extension=point("P", "ghost"),
    )
    with pytest.raises(ModelError, match=r"joint 'slide' moves no mass: link 'ghost'"):
        load_rig_text(text)


def test_a_model_without_a_moving_joint_is_refused() -> None:
    with pytest.raises(ModelError, match="no moving joint"):
        load_rig_text(robot(link("stone"), joint("glue", "fixed", "world", "stone"), extension=point("P", "stone")))


def test_the_status_says_what_to_do() -> None:
    for status in Status:
        assert status.message
        assert status.word in repr(status)
        assert status.advice or status is Status.COMPLETED
