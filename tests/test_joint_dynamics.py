"""What URDF says of a joint's friction acts, and a joint that passes its limits is told."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rigs import NO_GRAVITY, joint, link, point, robot

from drillrig_pin import ModelError, Scenario, load_rig_text, simulate
from drillrig_pin.analysis.design import design_of
from drillrig_pin.analysis.metrics import measure
from drillrig_pin.analysis.verdict import Level, findings
from drillrig_pin.check import check_text
from drillrig_pin.trajectory import Trajectory

ENGINES = ["core", "python"]
SPRING = '<joint_spring name="k" joint="slide" stiffness="1000" rest="0"/>'


def slider(inside: str = "", extension: str = NO_GRAVITY + SPRING, kind: str = "prismatic", name: str = "slide") -> str:
    """10 kg on a vertical joint, with ``inside`` written into that joint."""
    text = robot(link("mass", 10.0), joint(name, kind, "world", "mass"), extension=point("P", "mass") + extension)
    return text.replace("</joint>", f"{inside}</joint>")


def ran(text: str, **fields: object) -> Trajectory:
    return simulate(load_rig_text(text), Scenario(**{"duration": 5.0, "output_rate": 100, **fields}))


def damped(time: np.ndarray, c: float) -> np.ndarray:
    """10 kg on 1000 N/m let go at 0.1 m under viscous damping c [N s/m]."""
    decay = c / 20.0
    omega = math.sqrt(100.0 - decay**2)
    return 0.1 * np.exp(-decay * time) * (np.cos(omega * time) + decay / omega * np.sin(omega * time))


@pytest.mark.parametrize("engine", ENGINES)
def test_damping_of_urdf_damps_as_its_closed_form(engine: str) -> None:
    run = ran(slider('<dynamics damping="20" friction="0"/>'), positions={"slide": 0.1}, engine=engine)
    # Fifty periods at a tolerance of 1e-8; the envelope ends at 0.67 mm.
    np.testing.assert_allclose(run.q[:, 0], damped(run.time, 20.0), atol=1e-8)
    assert np.abs(run.q[-60:]).max() < 1.3 * 0.1 * math.exp(-4.4)
    # All that is lost is booked: 5 J less what is left.
    assert run.work_dissipated[-1] == pytest.approx(5.0, rel=1e-3)
    assert np.abs(run.energy_residual).max() < 1e-9 * 5.0


@settings(max_examples=10, deadline=None)
@given(damping=st.floats(0.5, 150.0), engine=st.sampled_from(ENGINES), kind=st.sampled_from(["prismatic", "revolute"]))
def test_any_damping_of_any_joint_is_a_damper_beside_the_spring(damping: float, engine: str, kind: str) -> None:
    written = NO_GRAVITY + SPRING.replace("/>", f' damping="{damping!r}"/>')
    case = {"positions": {"slide": 0.1}, "duration": 1.0, "engine": engine}
    urdf = ran(slider(f'<dynamics damping="{damping!r}"/>', kind=kind), **case)
    ours = ran(slider("", written, kind), **case)
    # The same sum formed in another order.
    np.testing.assert_allclose(urdf.q, ours.q, atol=1e-9)
    np.testing.assert_allclose(urdf.work_dissipated, ours.work_dissipated, atol=1e-7)


@pytest.mark.parametrize("engine", ENGINES)
def test_dry_friction_takes_the_same_off_every_half_swing_and_then_holds(engine: str) -> None:
    text = slider('<dynamics friction="5"/>')
    run = ran(text, positions={"slide": 0.1}, duration=4.0, output_rate=1000, engine=engine)
    q = run.q[:, 0]
    turning = q[np.r_[True, np.diff(np.sign(np.diff(q))) != 0, False]][1:9]
    # 2 F / k = 10 mm a half swing of T / 2 = pi / 10 s; smoothing over 1 mm/s of 1 m/s takes less than that share.
    np.testing.assert_allclose(np.abs(turning), 0.1 - 0.01 * np.arange(1, 9), atol=1e-4)
    assert abs(q[-1]) < 0.005, "at rest the spring pulls with less than 5 N"
    assert np.abs(run.v[-100:]).max() < 1e-3, "it creeps below the smoothing speed"
    assert np.abs(run.energy_residual).max() < 1e-6 * 5.0
    assert any("dry friction of 5 N or N m is smoothed: it creeps below 0.001" in note for note in run.notes)


def test_both_engines_brake_alike() -> None:
    text = slider('<dynamics damping="3" friction="2"/>')
    runs = [ran(text, positions={"slide": 0.1}, duration=2.0, engine=engine) for engine in ENGINES]
    np.testing.assert_allclose(runs[0].q, runs[1].q, atol=1e-9)
    assert runs[0].labels["element"] == ["k", "slide.friction"]


def test_no_dynamics_and_zeros_leave_the_machine_as_it_is() -> None:
    for inside in ("", "<dynamics/>", '<dynamics damping="0" friction="0.0"/>'):
        assert [element.name for element in load_rig_text(slider(inside)).forces] == ["k"]


def test_a_joint_of_any_name_is_braked_and_its_friction_is_kept_with_the_result() -> None:
    rig = load_rig_text(slider('<dynamics damping="1"/>', NO_GRAVITY, name="arm/slide 1"))
    run = simulate(rig, Scenario(duration=0.1))
    assert run.labels["element"] == ["arm/slide 1.friction"]
    assert run.added == ()
    assert [e.name for e in load_rig_text(run.model).forces] == ["arm/slide 1.friction"]


def test_a_negative_coefficient_and_a_taken_name_are_errors_with_their_line() -> None:
    with pytest.raises(ModelError, match="joint 'slide': <dynamics> has a negative coefficient"):
        load_rig_text(slider('<dynamics damping="-1"/>'))
    taken = NO_GRAVITY + '<joint_spring name="slide.friction" joint="slide" stiffness="1"/>'
    with pytest.raises(ModelError, match=r"'slide\.friction' is already defined"):
        load_rig_text(slider('<dynamics damping="1"/>', taken))


# --- limits -----------------------------------------------------------------------------------------------------------


def limited(low: float, high: float, extension: str = "", kind: str = "prismatic") -> str:
    return slider("", extension, kind).replace('lower="-100" upper="100"', f'lower="{low!r}" upper="{high!r}"')


@pytest.mark.parametrize("engine", ENGINES)
def test_a_fall_through_a_limit_is_told_with_time_and_amount(engine: str) -> None:
    run = ran(limited(-0.2, 0.2), duration=1.0, engine=engine)
    metrics = measure(run)
    (passed,) = metrics.passed
    assert (passed.joint, passed.bound, passed.unit, passed.limit) == ("slide", "lower", "m", -0.2)
    # 0.2 = g t^2 / 2; a row follows within 10 ms.
    assert passed.since == pytest.approx(math.sqrt(0.4 / 9.81), abs=0.011)
    assert passed.beyond == pytest.approx(9.81 / 2 - 0.2, rel=1e-6)
    words = "joint slide passes its lower limit of -200 mm"
    assert any(words in warning for warning in metrics.warnings)
    told = findings(metrics, design_of(run), None, {}, run.outcome)
    assert any(item.level is Level.BAD and item.title == "Joint slide" for item in told)


@settings(max_examples=15, deadline=None)
@given(
    low=st.floats(-0.15, -0.01),
    high=st.floats(0.01, 0.15),
    start=st.floats(-0.15, 0.15),
    kind=st.sampled_from(["prismatic", "revolute"]),
)
def test_a_swing_is_told_of_at_exactly_the_limits_it_passes(low: float, high: float, start: float, kind: str) -> None:
    # An undamped swing goes as far on one side as on the other; within 1e-4 of a limit the rows decide.
    if min(abs(abs(start) + low), abs(abs(start) - high)) < 1e-4:
        return
    run = ran(limited(low, high, NO_GRAVITY + SPRING, kind), duration=2.0, output_rate=1000, positions={"slide": start})
    found = {passed.bound: passed.beyond for passed in measure(run).passed}
    assert set(found) == {b for b, limit in (("lower", -low), ("upper", high)) if abs(start) > limit}
    for bound, beyond in found.items():
        assert beyond == pytest.approx(abs(start) - (-low if bound == "lower" else high), abs=1e-4)


def test_joints_within_their_limits_and_without_any_are_not_told() -> None:
    assert measure(ran(limited(-6.0, 0.0), duration=1.0)).passed == ()
    spun = ran(slider("", NO_GRAVITY, "continuous"), duration=1.0, velocities={"slide": 500.0})
    assert measure(spun).passed == ()


def test_check_finds_nothing_wrong_with_friction() -> None:
    assert not check_text(slider('<dynamics damping="2" friction="1"/>'), "m.urdf")
