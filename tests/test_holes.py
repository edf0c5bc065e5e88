"""Inverse kinematics of holes: poses against closed forms, limits respected, what is out of reach said."""

from __future__ import annotations

import math

import numpy as np
import pinocchio as pin
import pytest
from rigs import joint, link, point, rig

from drillrig_pin import Rig, Scenario, simulate
from drillrig_pin.batch.holes import Aim, Hole, UnreachableError, aim_at
from drillrig_pin.batch.study import load_study
from drillrig_pin.elements.cylinder import Cylinder
from drillrig_pin.errors import ScenarioError

FIXED = Aim(fixed=("head_rotation",))


def planar_arm() -> Rig:
    """Three links of 1.0, 0.8 and 0.5 m in the x-z plane, turning about -y, so that angles count upwards."""
    axis = (0, -1, 0)
    return rig(
        link("upper"),
        link("lower"),
        link("hand"),
        joint("shoulder", "revolute", "world", "upper", axis=axis),
        joint("elbow", "revolute", "upper", "lower", (1.0, 0, 0), axis=axis),
        joint("wrist", "revolute", "lower", "hand", (0.8, 0, 0), axis=axis),
        extension=point("tip", "hand", (0.5, 0, 0))
        + '<pose name="start"><joint name="shoulder" position="0.3"/><joint name="elbow" position="-0.5"/></pose>',
    )


@pytest.mark.parametrize("pitch", [0.0, 20.0, -35.0])
def test_a_planar_arm_takes_the_pose_of_the_law_of_cosines(pitch: float) -> None:
    aim = Aim(point="tip", axis=(1, 0, 0), direction=(1, 0, 0))
    x, z, up = 1.6, 0.4, math.radians(pitch)
    found = aim_at(planar_arm(), Hole(at=(x, 0, z), pitch=pitch), aim).positions
    w = np.array([x - 0.5 * math.cos(up), z - 0.5 * math.sin(up)])
    cosine = (w @ w - 1.0 - 0.64) / 1.6
    assert found["elbow"] == pytest.approx(-math.acos(cosine), abs=1e-9)
    behind = math.atan2(0.8 * math.sin(found["elbow"]), 1.0 + 0.8 * math.cos(found["elbow"]))
    assert found["shoulder"] == pytest.approx(math.atan2(w[1], w[0]) - behind, abs=1e-9)
    assert found["shoulder"] + found["elbow"] + found["wrist"] == pytest.approx(up, abs=1e-9)


def test_the_tip_meets_the_hole_and_the_feed_its_direction_within_all_limits(mkz49: Rig) -> None:
    data = mkz49.model.createData()
    for y, z, pitch, yaw in [(0.8, 2.5, 0, 0), (0.2, 2.0, 5, -8), (-0.4, 1.0, -27.5, 0), (-0.4, 1.8, 0, 10)]:
        aimed = aim_at(mkz49, Hole(at=(4.05, y, z), pitch=pitch, yaw=yaw), FIXED)
        q = mkz49.configuration(None, aimed.positions)
        pin.framesForwardKinematics(mkz49.model, data, q)
        frame = data.oMf[mkz49.model.getFrameId("feed_beam")]
        tip = frame.act(np.array([0, 0, 1.929]))
        p, s = math.radians(pitch), math.radians(yaw)
        wanted = [math.cos(p) * math.cos(s), math.cos(p) * math.sin(s), math.sin(p)]
        assert np.abs(tip - [4.05, y, z]).max() < 1e-9
        assert np.abs(frame.rotation[:, 2] - wanted).max() < 1e-9
        assert aimed.positions["head_rotation"] == mkz49.configuration("hole_9")[3]
        assert (mkz49.model.lowerPositionLimit <= q).all()
        assert (q <= mkz49.model.upperPositionLimit).all()
        run = simulate(mkz49, Scenario(positions=aimed.positions, duration=0.01))
        for element in (e for e in mkz49.forces if isinstance(e, Cylinder)):
            shortest, longest = element.length_range
            assert shortest < run.of("cylinder_length", element.name)[0] < longest


def test_a_hole_out_of_reach_names_the_limit_it_hits(mkz49: Rig) -> None:
    with pytest.raises(UnreachableError, match=r"boom_extension stands at its upper limit of 2\.3 m"):
        aim_at(mkz49, Hole(at=(5.5, 0.2, 2.0)), FIXED)
    with pytest.raises(UnreachableError, match="boom_swing stands at its upper limit of 40 deg"):
        aim_at(mkz49, Hole(at=(4.05, 2.5, 2.0)), FIXED)


def test_a_stroke_limits_the_reach_as_a_joint_does() -> None:
    machine = rig(
        link("slider"),
        joint("slide", "prismatic", "world", "slider", axis=(1, 0, 0)),
        extension=point("pin_a", "world", (-0.5, 0, 0))
        + point("pin_b", "slider")
        + '<cylinder name="oil" from="pin_a" to="pin_b" bore="0.063" rod="0.030" length_retracted="0.472" '
        'dead_length_a="0.040" dead_length_b="0.060" bulk_modulus="2.85e9"/>',
    )
    aim = Aim(point="pin_b", axis=(1, 0, 0), direction=(1, 0, 0))
    assert aim_at(machine, Hole(at=(0.3, 0, 0)), aim).positions["slide"] == pytest.approx(0.3, abs=1e-9)
    with pytest.raises(UnreachableError, match=r"oil stands at its longest, 0\.844 m"):
        aim_at(machine, Hole(at=(0.5, 0, 0)), aim)


def test_hole_9_is_drilled_in_the_printed_pose() -> None:
    holes = load_study("nine_holes").holes
    assert holes is not None
    assumed = [name for name, hole in holes.places.items() if hole.source.startswith("assumed")]
    assert sorted(assumed) == [f"hole_{i}" for i in range(1, 9)]
    assert holes.places["hole_9"].pose == "hole_9"


def test_names_that_are_not_there_are_said(mkz49: Rig) -> None:
    with pytest.raises(ScenarioError, match="Did you mean 'head_rotation'"):
        aim_at(mkz49, Hole(at=(4, 0, 2)), Aim(fixed=("head_rotatio",)))
    with pytest.raises(ScenarioError, match="no contact"):
        aim_at(planar_arm(), Hole(at=(1, 0, 0)))
