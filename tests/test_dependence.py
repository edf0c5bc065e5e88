"""Rows that depend on the others all along the motion are redundant; in one position alone, they make it singular."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from closed_forms import BARS
from hypothesis import given, settings
from hypothesis import strategies as st
from rigs import bennett, bricard, double_pendulum, floating_body, four_bar, joint, link, point, robot, slider_crank

from drillrig_pin import ResultFileError, Rig, Scenario, Status, load_rig_text, load_trajectory, simulate
from drillrig_pin.assembly import Assembly
from drillrig_pin.check import check_text
from drillrig_pin.cli.subject import read_subject
from drillrig_pin.simulation import prepare

ENGINES = ["core", "python"]
#: Two bars of 1 m and 1 m, hinges about y, the tip held on x and z.
ARM = robot(
    link("upper", 2.0, (0.5, 0, 0), (0.001, 0.1, 0.1)),
    link("lower", 2.0, (0.5, 0, 0), (0.001, 0.1, 0.1)),
    joint("s", "revolute", "world", "upper", axis=(0, 1, 0)),
    joint("e", "revolute", "upper", "lower", (1, 0, 0), (0, 1, 0)),
    extension=point("P", "lower", (1, 0, 0)) + '<hold name="h" point="P" axes="x z"/>\n',
)
#: Both positions of a four-bar of equal opposite sides, all bars in line.
FLAT = (1.0, 0.4, 1.0, 0.4)
HINGE = 'translations="x y z" rotations="x y"'


def assembled(rig: Rig, **scenario: Any) -> Assembly:
    return prepare(rig, Scenario(**scenario)).equilibrium.assembly


@pytest.mark.parametrize("angle", [0.0, 0.3, np.pi / 2, -2.0, np.pi])
def test_a_straight_arm_held_at_its_tip_is_singular_whichever_way_it_points(angle: float) -> None:
    found = assembled(load_rig_text(ARM), positions={"s": angle})
    assert len(found.singular) == 1
    assert not found.redundant


def test_an_arm_told_to_reach_as_far_as_it_can_is_singular_there() -> None:
    # Newton's steps end near the straight arm, to the square root of what counts as closed.
    found = assembled(load_rig_text(ARM), positions={"s": 0.3, "e": -0.5}, targets={"h.x": 2.0, "h.z": 0.0})
    assert len(found.singular) == 1


def test_a_bent_arm_held_at_its_tip_is_an_ordinary_truss() -> None:
    found = assembled(load_rig_text(ARM), positions={"s": 0.3, "e": -0.5})
    assert (found.redundant, found.singular) == ((), ())


@pytest.mark.parametrize(
    ("text", "positions", "redundant"),
    [
        (bennett(), {"j1": 1.0, "j2": 2.0, "j3": -1.0}, 3),
        (bricard(), {}, 1),
        (four_bar(BARS, HINGE), {"crank_joint": 0.4, "coupler_joint": 0.3, "rocker_joint": 1.2}, 3),
        (floating_body('<hold name="a" point="P" axes="x y z"/><hold name="b" point="P" axes="x"/>'), {}, 1),
    ],
    ids=["Bennett", "Bricard", "four-bar", "held twice"],
)
def test_rows_that_depend_along_the_whole_motion_are_redundant(
    text: str, positions: dict[str, float], redundant: int
) -> None:
    found = assembled(load_rig_text(text), positions=positions)
    assert len(found.redundant) == redundant
    assert not found.singular


@pytest.mark.parametrize(
    ("closure", "redundant"),
    [
        ('translations="x y"', ()),
        ('translations="x y z"', ("closure.z",)),
        (HINGE, ("closure.z", "closure.rx", "closure.ry")),
    ],
)
def test_a_flat_four_bar_is_singular_in_one_row_and_redundant_in_the_others(
    closure: str, redundant: tuple[str, ...]
) -> None:
    found = assembled(load_rig_text(four_bar(FLAT, closure)))
    assert found.singular == ("closure.x",)
    assert found.redundant == redundant


@given(turn=st.floats(-3.0, 3.0), lengths=st.tuples(st.floats(0.2, 2.0), st.floats(0.2, 2.0)), folded=st.booleans())
@settings(max_examples=25, deadline=None)
def test_arms_in_line_are_singular_and_bent_ones_are_not(
    turn: float, lengths: tuple[float, float], folded: bool
) -> None:
    first, second = lengths
    if folded and abs(first - second) < 0.01:
        second += 0.05  # the tip of equal bars folded up lies on the shoulder, about which it turns freely
    rig = load_rig_text(
        robot(
            link("upper", 2.0, (first / 2, 0, 0), (0.001, 0.1, 0.1)),
            link("lower", 2.0, (second / 2, 0, 0), (0.001, 0.1, 0.1)),
            joint("s", "revolute", "world", "upper", axis=(0, 1, 0)),
            joint("e", "revolute", "upper", "lower", (first, 0, 0), (0, 1, 0)),
            extension=point("P", "lower", (second, 0, 0)) + '<hold name="h" point="P" axes="x z"/>\n',
        )
    )
    straight = np.pi if folded else 0.0
    assert len(assembled(rig, positions={"s": turn, "e": straight}).singular) == 1
    assert not assembled(rig, positions={"s": turn, "e": straight + 0.2}).singular


@given(crank=st.floats(0.1, 0.5), ground=st.floats(0.6, 2.0), closure=st.sampled_from(['translations="x y"', HINGE]))
@settings(max_examples=15, deadline=None)
def test_parallelograms_are_singular_in_line_and_nowhere_else(crank: float, ground: float, closure: str) -> None:
    rig = load_rig_text(four_bar((ground, crank, ground, crank), closure))
    assert assembled(rig).singular == ("closure.x",)
    off = {"crank_joint": 0.3, "coupler_joint": -0.3, "rocker_joint": 0.3}
    assert not assembled(rig, positions=off).singular


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("formulation", ["multipliers", "null_space"])
def test_a_run_that_starts_singular_stops_there_and_says_which_rows(
    engine: str, formulation: str, tmp_path: Path
) -> None:
    run = simulate(load_rig_text(ARM), Scenario(duration=1.0, engine=engine, formulation=formulation))
    assert run.outcome.status is Status.SINGULAR
    assert run.outcome.time == 0.0
    assert "'h.x'" in run.outcome.cause
    assert any("singular" in note and "'h.x'" in note for note in run.notes)
    assert len(run.time) == 1, "the start itself is known"
    np.testing.assert_array_equal(run.q[0], [0.0, 0.0])
    run.save(tmp_path / "start.nc")
    assert load_trajectory(tmp_path / "start.nc").outcome == run.outcome
    with pytest.raises(ResultFileError, match="follows from the other constraint rows"):
        read_subject(tmp_path / "start.nc")


@pytest.mark.parametrize("engine", ENGINES)
def test_the_damped_formulation_may_start_singular_and_says_so(engine: str) -> None:
    run = simulate(load_rig_text(ARM), Scenario(duration=0.05, engine=engine, formulation="damped"))
    assert run.outcome.completed
    assert np.abs(run.point_displacement).max() < 1e-6, "the tip is held and cannot move"
    assert any("singular" in note for note in run.notes)


def test_check_names_a_singular_pose_as_an_error_and_a_singular_zero_position_as_a_warning() -> None:
    (problem,) = [p for p in check_text(ARM, "arm") if "singular" in p.message]
    assert (problem.severity, "'h.x'" in problem.message) == ("warning", True)
    pose = '<pose name="reach"><joint name="s" position="0.3"/></pose></drillrig>'
    (problem,) = [p for p in check_text(ARM.replace("</drillrig>", pose), "arm") if "singular" in p.message]
    assert problem.severity == "error"
    assert "pose 'reach'" in problem.message
    assert not [p for p in check_text(ARM, "arm") if "redundant" in p.message]


def test_many_redundant_rows_in_many_poses_are_one_warning() -> None:
    count = 40
    doors = [
        part
        for i in range(count)
        for part in (
            link(f"door_{i}", 1.0, (0.5, 0, 0)),
            joint(f"post_{i}", "revolute", "world", f"door_{i}", (i, 0, 0)),
        )
    ]
    holds = "".join(
        point(f"P{i}", f"door_{i}", (0, 0, 1)) + f'<hold name="held_{i}" point="P{i}" axes="x y z"/>\n'
        for i in range(count)
    )
    poses = "".join(
        f'<pose name="{name}"><joint name="post_0" position="{at}"/></pose>\n' for name, at in (("a", 0.0), ("b", 0.5))
    )
    found = [p for p in check_text(robot(*doors, extension=holds + poses), "doors") if "redundant" in p.message]
    assert len(found) == 1
    assert "'held_0.x'" in found[0].message
    assert f"of {count} constraints" in found[0].message
    assert found[0].source.line > 0


@pytest.mark.parametrize("engine", ENGINES)
def test_an_initial_velocity_that_the_holds_do_not_allow_is_said_to_be_taken_away(engine: str) -> None:
    rig = load_rig_text(double_pendulum('<hold name="face" point="P" axes="x z"/>'))
    case = Scenario(duration=0.01, positions={"shoulder": 0.4, "elbow": 0.9}, velocities={"elbow": 0.7}, engine=engine)
    (note,) = [note for note in simulate(rig, case).notes if "velocity" in note]
    assert "elbow 0.7 -> 0" in note
    assert "shoulder" not in note


@given(st.floats(-20.0, 20.0).filter(lambda v: abs(v) > 1e-3))
@settings(max_examples=10, deadline=None)
def test_what_a_run_starts_with_is_what_its_note_says(speed: float) -> None:
    rig = load_rig_text(slider_crank())
    run = simulate(rig, Scenario(duration=1e-3, positions={"crank_joint": 0.3}, velocities={"crank_joint": speed}))
    (note,) = [note for note in run.notes if "velocity" in note]
    for name, v, given_v in zip(run.labels["dof"], run.v[0], (speed, 0.0, 0.0), strict=True):
        assert f"{name} {given_v:.4g} -> {v:.4g}" in note


def test_an_initial_velocity_that_fits_is_not_mentioned() -> None:
    rig = load_rig_text(double_pendulum())
    run = simulate(rig, Scenario(duration=1e-3, velocities={"shoulder": 2.0}))
    assert not [note for note in run.notes if "velocity" in note]
