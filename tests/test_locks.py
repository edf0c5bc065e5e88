"""Joints of no interest are locked by one line and stay where they stand."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from rigs import joint, link, point, robot

from drillrig_pin import ModelError, Scenario, ScenarioError, load_rig_text, simulate
from drillrig_pin.check import check_text
from drillrig_pin.scene.scene import build_scene
from drillrig_pin.trajectory import load_trajectory

ENGINES = ["core", "python"]


def carrier(extension: str, outrigger: str = "revolute", rpy: tuple[float, float, float] = (0, 0, 0)) -> str:
    """A boom on a spring, on a slewing carrier with a wheel and an outrigger that carries a box."""
    turned = joint("outrigger_pin", outrigger, "boom", "outrigger", (1, 0, 0), (0, 1, 0), rpy)
    return robot(
        link("boom", 400.0, (1.5, 0, 0), (10, 300, 300)),
        joint("boom_pin", "revolute", "world", "boom", (0, 0, 1), (0, 1, 0)),
        link("wheel", 30.0, inertia=(1, 2, 1)),
        joint("wheel_axle", "continuous", "boom", "wheel", (0, 1, 0), (0, 1, 0)).replace(
            "</joint>", '<dynamics damping="3"/></joint>'
        ),
        link("outrigger", 80.0, (0.5, 0, 0.2), (1, 9, 9)),
        turned,
        extension='<joint_spring name="hold" joint="boom_pin" stiffness="1e6" damping="1e3"/>'
        + point("tip", "boom", (3, 0, 0))
        + point("foot", "outrigger", (1, 0, 0))
        + extension,
    )


SWING = {"duration": 0.2, "velocities": {"boom_pin": 0.5}, "output_rate": 100}


@pytest.mark.parametrize("engine", ENGINES)
def test_a_locked_machine_moves_as_one_whose_joints_were_fixed_by_hand(engine: str) -> None:
    lock = '<lock joints="outrigger_pin" position="0.7"/><lock joints="wheel_.*"/>'
    locked = load_rig_text(carrier(lock))
    by_hand = load_rig_text(carrier('<lock joints="wheel_axle"/>', "fixed", (0, 0.7, 0)))
    assert locked.joints == ["boom_pin"]
    assert locked.locked == {"outrigger_pin": 0.7, "wheel_axle": 0.0}
    runs = [simulate(rig, Scenario(**SWING, engine=engine)) for rig in (locked, by_hand)]
    np.testing.assert_allclose(runs[0].q, runs[1].q, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(runs[0].point_position, runs[1].point_position, atol=1e-9)
    assert "locked joints: outrigger_pin at 0.7 rad, wheel_axle at 0 rad" in runs[0].notes


def test_they_stay_where_the_first_pose_puts_them_and_nowhere_else() -> None:
    pose = (
        '<pose name="work"><joint name="outrigger_pin" position="0.4"/><joint name="boom_pin" position="0.1"/></pose>'
    )
    rig = load_rig_text(carrier(pose + '<lock joints="outrigger_pin wheel_axle"/>'))
    assert rig.locked == {"outrigger_pin": 0.4, "wheel_axle": 0.0}
    simulate(rig, Scenario(**{**SWING, "positions": {"outrigger_pin": 0.4}}))
    with pytest.raises(ScenarioError, match=r"joint 'outrigger_pin' is locked at 0\.4"):
        simulate(rig, Scenario(**{**SWING, "positions": {"outrigger_pin": 0.5}}))


def test_a_result_is_run_again_and_drawn_with_its_locks(tmp_path: Path) -> None:
    run = simulate(
        load_rig_text(carrier('<lock joints="outrigger_pin wheel_axle" position="0.3"/>')), Scenario(**SWING)
    )
    run.save(tmp_path / "run.nc")
    read = load_trajectory(tmp_path / "run.nc")
    np.testing.assert_array_equal(simulate(load_rig_text(read.model), read.scenario).q, run.q)
    assert build_scene([read]) is not None


@pytest.mark.parametrize(
    ("extension", "words"),
    [
        ('<lock joints="whel_axle"/>', "<lock>: no moving joint 'whel_axle'"),
        ('<lock joints="[wheel"/>', "is no regular expression"),
        ('<lock joints="wheel_axle"/><lock joints=".*axle" position="1"/>', "is locked at two positions"),
        ('<lock joints="boom_pin"/>', "joint 'boom_pin' is locked"),
    ],
)
def test_locks_that_cannot_be_are_one_sentence(extension: str, words: str) -> None:
    with pytest.raises(ModelError) as caught:
        load_rig_text(carrier(extension))
    assert words in str(caught.value)


def test_check_finds_nothing_wrong_with_a_lock() -> None:
    text = carrier('<lock joints="wheel_axle outrigger_pin"/>')
    assert not [problem for problem in check_text(text, "carrier.urdf") if problem.severity == "error"]
