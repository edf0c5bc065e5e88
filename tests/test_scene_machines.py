"""Machines nobody made for this package are drawn too: meshes of other packages, and models without any shape."""

from __future__ import annotations

from dataclasses import replace
from importlib.metadata import distribution

import numpy as np
import pytest
from rigs import mass_on_cylinder, slider_crank, tree
from test_ur5 import EXTENSION, POSE

from drillrig_pin import Scenario, Trajectory, load_rig_text, simulate
from drillrig_pin.scene import meshes
from drillrig_pin.scene.scene import build_scene
from drillrig_pin.scene.shapes import Ball, Mesh


@pytest.fixture(scope="module")
def ur5() -> Trajectory:
    (path,) = (f for f in distribution("example-robot-data").files or () if f.name == "ur5_robot.urdf")
    rig = load_rig_text(path.read_text().replace("</robot>", EXTENSION + "</robot>"))
    return simulate(rig, Scenario(duration=0.5, positions=POSE))


def test_a_ur5_is_drawn_with_its_meshes_and_its_spring(ur5: Trajectory) -> None:
    scene = build_scene([ur5])
    drawn = {part.path[-2] for part in scene.parts if isinstance(part.shape, Mesh) and part.path[-1].isdigit()}
    assert drawn == {
        f"link {name}_link" for name in ("base", "shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3")
    }
    (cord,) = (part for part in scene.parts if part.path[-1] == "cord")
    length = ur5.of("element_coordinate", "cord")
    assert np.ptp(cord.scale[:, 2]) == pytest.approx(np.ptp(length), rel=0.05), "the coil stretches with the spring"
    assert scene.notes == []
    low, high = scene.views["side"].low, scene.views["side"].high
    assert 0.8 < high[2] - low[2] < 1.6, "as large as a UR5"


def test_without_its_meshes_it_is_a_skeleton_and_that_is_said(ur5: Trajectory, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(meshes, "_shares", lambda: iter(()))
    scene = build_scene([ur5])
    assert any("package://" in note and "not found" in note for note in scene.notes)
    assert any("bones" in note for note in scene.notes)
    assert sum(isinstance(part.shape, Ball) and part.path[-1] == "joint" for part in scene.parts) == 6


def test_a_law_whose_plugin_is_not_installed_does_not_hide_the_machine() -> None:
    run = simulate(load_rig_text(mass_on_cylinder()), Scenario(duration=0.1))
    strange = run.model.replace("</drillrig>", '<air_drag name="drag" joint="slide" c="5"/></drillrig>')
    scene = build_scene([replace(run, model=strange)])
    assert any("air_drag" in note for note in scene.notes)
    assert any(part.path[-1] == "oil barrel" for part in scene.parts)


@pytest.mark.parametrize("text", [mass_on_cylinder(), slider_crank(), tree()])
def test_a_model_without_shapes_is_drawn_as_bones(text: str) -> None:
    rig = load_rig_text(text)
    scene = build_scene([simulate(rig, Scenario(duration=0.1))])
    joints = [part for part in scene.parts if part.path[-1] == "joint"]
    assert len(joints) == len(rig.joints)
    for part in scene.parts:
        for rows in (part.position, part.quaternion, part.scale):
            assert np.isfinite(rows).all()
