"""What is drawn of a run: where parts stand, how much is exaggerated, which moments become frames."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from rigs import double_pendulum, floating_body, mass_on_cylinder, slider_crank, tree

from drillrig_pin import ResultFileError, Rig, Scenario, ScenarioError, Trajectory, load_rig_text, simulate
from drillrig_pin.errors import Outcome, Status
from drillrig_pin.kinematics import Array
from drillrig_pin.replay.keyframes import packed, tracks
from drillrig_pin.scene.motion import LARGEST, OPEN, VISIBLE, Posing
from drillrig_pin.scene.options import ReplayOptions, round_down
from drillrig_pin.scene.rotations import quaternions, turning_z_to
from drillrig_pin.scene.scene import build_scene
from drillrig_pin.scene.shapes import Part
from drillrig_pin.scene.timing import frame_times, resampled
from drillrig_pin.scene.views import matrix, placement_of
from drillrig_pin.workspace import Workspace

#: Slow enough for a frame per sample.
TRUE = ReplayOptions(exaggeration=1.0, speed=0.01)


@pytest.fixture(scope="module")
def run(mkz49: Rig) -> Trajectory:
    return simulate(mkz49, Scenario(duration=2.0))


def world(parts: list[Part], path: tuple[str, ...], frame: int) -> Array:
    """Placement of a part in the world, from all parts on the way to it."""
    placements = {part.path: placement_of(part, frame) for part in parts}
    found = np.eye(4)
    for n in range(1, len(path) + 1):
        found = found @ placements.get(path[:n], np.eye(4))
    return found


def named(parts: list[Part], name: str) -> Part:
    (part,) = (part for part in parts if part.path[-1] == name)
    return part


@pytest.mark.parametrize("text", [tree(), floating_body(), double_pendulum(), slider_crank()])
def test_at_true_scale_every_joint_stands_where_the_run_puts_it(text: str) -> None:
    rig = load_rig_text(text)
    run = simulate(rig, Scenario(duration=0.3))
    scene = build_scene([run], TRUE)
    data = rig.model.createData()
    for frame in (0, len(scene.frames) // 2, len(scene.frames) - 1):
        sample = int(np.argmin(np.abs(run.time - scene.frames[frame])))
        assert run.time[sample] == pytest.approx(scene.frames[frame])
        pin.forwardKinematics(rig.model, data, run.q[sample])
        for joint, name in enumerate(rig.joints, start=1):
            drawn = world(scene.parts, named(scene.parts, name).path, frame)
            np.testing.assert_allclose(drawn, data.oMi[joint].homogeneous, atol=1e-9)


def test_links_carry_the_shapes_of_the_model(run: Trajectory, mkz49: Rig) -> None:
    scene = build_scene([run], TRUE)
    shaped = {part.path[-2] for part in scene.parts if part.shape is not None and part.path[-1].isdigit()}
    assert shaped == {f"link {link.attributes['name']}" for link in mkz49.file.root.named("link") if link.children}
    beam = named(scene.parts, "feed_lift").path
    (box,) = (p for p in scene.parts if p.path == (*beam, "link feed_beam", "0"))
    assert box.colour == (0.93, 0.65, 0.08, 1.0)


def test_barrel_and_rod_lie_on_the_line_between_the_pins(run: Trajectory) -> None:
    scene = build_scene([run])
    barrel, rod = (named(scene.parts, f"lift_cylinder {part}") for part in ("barrel", "rod"))
    for frame in (0, 100, len(scene.frames) - 1):
        first, second = world(scene.parts, barrel.path, frame), world(scene.parts, rod.path, frame)
        axis = second[:3, 3] - first[:3, 3]
        axis /= np.linalg.norm(axis)
        np.testing.assert_allclose(first[:3, 2], axis, atol=1e-6)
        np.testing.assert_allclose(second[:3, 2], -axis, atol=1e-6)


def test_pressure_colours_the_chambers(run: Trajectory) -> None:
    scene = build_scene([run])
    feed = [part for part in scene.parts if "feed_cylinder barrel" in part.path and part.tint is not None]
    a, b = (part.tint for part in sorted(feed, key=lambda part: part.path))
    assert a is not None
    assert b is not None
    assert a[0, 0] > a[0, 2], "chamber A carries the beam: warm"
    assert b[0, 2] > b[0, 0], "chamber B is nearly empty: cold"


def test_arrows_are_as_long_as_the_forces_are_strong(run: Trajectory) -> None:
    scene = build_scene([run])
    text = next(key.text for key in scene.keys if key.text.startswith("drilling force"))
    assert text == "drilling force, 100 mm per kN"
    arrow = named(scene.parts, "arrow drilling_force")
    frame = int(np.argmax(arrow.scale[:, 0]))
    force = np.interp(scene.frames[frame], run.time, run.of("load_value", "drilling_force"))
    assert arrow.scale[frame, 0] == pytest.approx(1e-4 * force, rel=0.01)
    reaction = named(scene.parts, "arrow reaction face rock")
    held = np.array([run.of("reaction", f"face.{axis}") for axis in "yz"])
    both = np.sqrt((held**2).sum(axis=0) + run.of("element_force", "rock") ** 2)
    assert reaction.scale[0, 0] == pytest.approx(1e-4 * both[0], rel=0.01)


def test_auto_makes_the_largest_deviation_visible_and_says_so(run: Trajectory) -> None:
    scene = build_scene([run])
    found = scene.exaggeration
    assert VISIBLE / 2.6 < found.factor * found.largest / scene.size <= VISIBLE
    assert f"× {found.factor:g}" in scene.sentences[0]


def test_a_factor_too_large_for_a_picture_is_bounded_and_said(run: Trajectory) -> None:
    scene = build_scene([run], ReplayOptions(exaggeration=1e6))
    assert scene.exaggeration.asked == 1e6
    assert scene.exaggeration.factor * scene.exaggeration.largest <= LARGEST * scene.size
    assert "was asked for" in scene.sentences[0]


def test_a_machine_at_rest_is_not_exaggerated() -> None:
    scene = build_scene([simulate(load_rig_text(mass_on_cylinder()), Scenario(duration=0.1))])
    assert scene.exaggeration.factor == 1.0
    assert scene.sentences[0].startswith("True scale")


def test_a_loop_stays_closed_however_much_is_exaggerated() -> None:
    rig = load_rig_text(slider_crank())
    run = simulate(rig, Scenario(duration=0.04))
    posing = Posing(rig, run.q, run.q)
    factor = posing.exaggeration(30.0).factor
    assert factor > 3
    space = Workspace(rig, ())
    opened = []
    for q in posing.drawn(factor).q:
        space.update(q, np.zeros(rig.model.nv))
        opened.append(np.abs(space.x_constraint).max())
    assert max(opened) <= OPEN * posing.size


def test_the_tip_stays_on_its_axes_when_exaggerated(run: Trajectory) -> None:
    scene = build_scene([run])
    path = named(scene.parts, "point E").position
    assert np.ptp(path[:, 0]) > 0.01, "it moves along the hole"
    assert np.ptp(path[:, 1:], axis=0).max() < 3 * OPEN * scene.size


def test_frames_show_a_vibration_or_its_mean_but_never_another_one() -> None:
    time = np.arange(0, 2.0005, 0.001)
    fast, slow = np.sin(2 * np.pi * 48 * time), np.sin(2 * np.pi * 1.0 * time)
    frames = frame_times(time, 30.0)
    inner = slice(2, -2)
    # One sample per frame would show 48 Hz as 12 Hz with its full amplitude.
    assert np.abs(np.interp(frames, time, fast)).max() > 0.9
    assert np.abs(resampled(time, fast, frames)[inner]).max() < 0.22
    np.testing.assert_allclose(resampled(time, slow, frames)[inner], np.sin(2 * np.pi * frames)[inner], atol=0.01)
    dense = frame_times(time, 600.0)
    shown = resampled(time, fast, dense)[inner]
    np.testing.assert_allclose(shown, np.sin(2 * np.pi * 48 * dense)[inner], atol=0.04)


def test_percussion_is_slowed_down_to_what_the_eye_can_follow(run: Trajectory) -> None:
    scene = build_scene([run])
    assert scene.fastest == pytest.approx(48, abs=0.5)
    assert scene.speed == 0.05
    assert scene.sentences[1] == "0.05 × real time: 48 Hz is seen as 2.4 Hz."
    real = build_scene([run], ReplayOptions(speed=1.0))
    assert real.sentences[1] == "Real time."
    assert "averaged out" in real.sentences[2]


def test_a_part_of_a_run_is_shown_about_the_same_mean_pose(run: Trajectory) -> None:
    whole, part = build_scene([run], TRUE), build_scene([run], ReplayOptions(exaggeration=1.0, start=1.0, end=1.5))
    assert (part.frames[0], part.frames[-1]) == (1.0, 1.5)
    assert part.parts[0].path == whole.parts[0].path


def test_runs_side_by_side_do_not_touch(run: Trajectory) -> None:
    scene = build_scene([run, run], ReplayOptions(side_by_side=True))
    first, second = (named(scene.parts, root) for root in ("machine", "machine 2"))
    assert first.position[1] == 0
    assert second.position[1] < -2.0


def test_a_shorter_run_stands_still_beyond_its_end(run: Trajectory, mkz49: Rig) -> None:
    short = simulate(mkz49, Scenario(duration=0.5))
    scene = build_scene([run, short])
    assert scene.frames[-1] == pytest.approx(2.0)
    ghost = next(p for p in scene.parts if p.path[0] == "ghost 1" and p.path[-1] == "boom_swing")
    last = scene.frames > 0.5
    assert np.ptp(ghost.quaternion[last], axis=0).max() < 1e-12


def test_other_holes_lie_on_the_face(run: Trajectory) -> None:
    face = named(build_scene([run]).parts, "rock rock")
    hole = (face.position[0] + 3.0, face.position[1] + 0.4, face.position[2])
    scene = build_scene([run], ReplayOptions(holes=(hole,)))
    other = named(scene.parts, "other hole 0")
    np.testing.assert_allclose(other.position - face.position, (0.0, 0.4, 0.0), atol=1e-9)


def test_a_run_that_broke_down_is_shown_up_to_there(run: Trajectory) -> None:
    q = run.q.copy()
    q[1500:] = np.nan
    outcome = Outcome(Status.DIVERGED, 1.5, 1500)
    scene = build_scene([replace(run, arrays={**run.arrays, "q": q}, outcome=outcome)])
    assert scene.frames[-1] == pytest.approx(1.499)


def test_a_run_of_one_sample_is_one_sentence(run: Trajectory) -> None:
    arrays = {name: values[:1] for name, values in run.arrays.items()}
    with pytest.raises(ResultFileError, match="fewer than two samples"):
        build_scene([replace(run, time=run.time[:1], arrays=arrays)])


@pytest.mark.parametrize("given", [{"exaggeration": float("nan")}, {"speed": 0.0}, {"rate": 0.0}, {"view": "below"}])
def test_options_that_make_no_picture_are_refused(given: dict[str, float]) -> None:
    with pytest.raises(ScenarioError):
        ReplayOptions(**given)  # type: ignore[arg-type]


def test_keyframes_come_back_to_sixteen_bits(run: Trajectory) -> None:
    """What player.js does, in Python."""
    scene = build_scene([run])
    block = packed(scene.parts, scene.frames)
    length = int.from_bytes(block[:4], "little")
    head = json.loads(block[4 : 4 + length])
    steps = np.frombuffer(block[4 + length :], "<u2").reshape(-1, head["frames"])
    row = 0
    for track, told in zip(tracks(scene.parts), head["tracks"], strict=True):
        for k in range(track.values.shape[1]):
            whole = np.cumsum(steps[row].astype(np.int64)) & 0xFFFF
            values = told["low"][k] + told["step"][k] * whole
            assert np.abs(values - track.values[:, k]).max() <= 0.6 * told["step"][k] + 1e-9
            row += 1
    assert row == len(steps)


def test_quaternions_are_pinocchios(rng: np.random.Generator) -> None:
    rotations = np.array([pin.exp3(rng.uniform(-np.pi, np.pi, 3)) for _ in range(200)])
    for R, quaternion in zip(rotations, quaternions(rotations), strict=True):
        np.testing.assert_allclose(matrix(quaternion), R, atol=1e-12)
    directions = rng.normal(size=(50, 3))
    directions = np.vstack([directions / np.linalg.norm(directions, axis=1)[:, None], [(0, 0, -1), (0, 0, 1)]])
    for n, quaternion in zip(directions, turning_z_to(directions), strict=True):
        np.testing.assert_allclose(matrix(quaternion)[:, 2], n, atol=1e-9)


@pytest.mark.parametrize(("value", "below"), [(66.9, 50), (0.0521, 0.05), (1.0, 1), (2.0, 2), (1999, 1000), (0.3, 0.2)])
def test_factors_are_round_numbers(value: float, below: float) -> None:
    assert round_down(value) == below
