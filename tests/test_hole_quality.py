"""Hole quality of a feed line whose motion is known in closed form."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from rigs import joint, link, point, robot
from test_ur5 import EXTENSION, POSE, ur5_text

from drillrig_pin import Rig, Scenario, Trajectory, load_rig_text, simulate
from drillrig_pin.analysis.design import design_of
from drillrig_pin.analysis.hole_quality import feed_line, hole_quality
from drillrig_pin.analysis.metrics import measure
from drillrig_pin.analysis.verdict import findings

BEAM = 2.5
WHOLE = slice(0, None)

MACHINE = robot(
    link("beam"),
    joint("swing", "revolute", "world", "beam"),
    extension=point("tip", "beam", (BEAM, 0, 0))
    + point("drill", "beam")
    + '<contact name="rock" point="tip" axis="1 0 0" stiffness="1e6"/>\n'
    + '<load name="push" kind="force" point="drill" axis="-1 0 0" frame="body"><constant value="0"/></load>\n',
)


def moved(drill: np.ndarray, tip: np.ndarray) -> Trajectory:
    """A run of the machine whose drill and tip went along these paths, (n, 3) each."""
    run = simulate(load_rig_text(MACHINE), Scenario(duration=0.01))
    n = len(tip)
    arrays = {name: np.zeros((n, *array.shape[1:])) for name, array in run.arrays.items()}
    for name, path in (("tip", tip), ("drill", drill)):
        arrays["point_position"][:, run.labels["point"].index(name)] = path
    return replace(run, time=np.arange(n) / 1000.0, arrays=arrays)


def beam(angle: np.ndarray, tip: np.ndarray) -> np.ndarray:
    """Drill positions of a beam that stands at an angle to x in the x-y plane."""
    return tip - BEAM * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)


def errors(run: Trajectory, **options: object) -> dict[str, tuple[float, float, float]]:
    quality = hole_quality(run, design_of(run), WHOLE, **options)  # type: ignore[arg-type]
    assert quality is not None
    return {error.name: (error.static, error.vibration, error.worst) for error in quality.errors}


def test_a_tilt_about_the_tip_projects_to_depth_times_its_tangent() -> None:
    angle = np.full(1001, math.radians(1.5))
    angle[0] = 0.0
    tip = np.tile([BEAM, 0.0, 0.0], (1001, 1))
    quality = errors(moved(beam(angle, tip), tip))
    share = 1000 / 1001
    assert quality["angle"][2] == pytest.approx(math.radians(1.5))
    assert quality["angle"][0] == pytest.approx(math.atan(share * math.tan(math.radians(1.5))))
    assert quality["collar"] == pytest.approx((0, 0, 0), abs=1e-15)
    for depth in (3, 6, 12):
        static, _, worst = quality[f"toe_{depth}m"]
        assert worst == pytest.approx(depth * math.tan(math.radians(1.5)))
        assert static == pytest.approx(share * worst)


def test_a_shifted_tip_adds_its_offset_and_motion_along_the_hole_counts_nothing() -> None:
    n = 501
    tip = np.tile([BEAM, 0.0, 0.0], (n, 1))
    tip[1:, 1] += 0.004
    tip[1:, 0] += np.linspace(0, 0.05, n - 1)
    quality = errors(moved(beam(np.zeros(n), tip), tip))
    assert quality["collar"][2] == pytest.approx(0.004)
    assert quality["toe_12m"][2] == pytest.approx(0.004)
    assert quality["angle"][2] == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_shift_and_a_tilt_add_up_as_vectors(side: float) -> None:
    n = 11
    angle, tip = np.full(n, 0.01 * side), np.tile([BEAM, 0.0, 0.0], (n, 1))
    angle[0] = 0.0
    tip[1:, 1] += 0.002
    quality = errors(moved(beam(angle, tip), tip))
    assert quality["toe_6m"][2] == pytest.approx(abs(0.002 + side * 6 * math.tan(0.01)))


PIVOT = 6.0


def test_a_feed_that_turns_about_a_point_in_the_rock_is_straight_there() -> None:
    """The feed line through a fixed point at depth 6 m: by similar triangles the offset is |6 - L| tan(angle)."""
    angle = np.linspace(0, 0.009, 21)
    pivot = np.array([BEAM + PIVOT, 0.0, 0.0])
    along = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    quality = errors(moved(pivot - (BEAM + PIVOT) * along, pivot - PIVOT * along), depths=(3.0, 6.0, 12.0))
    for name, depth in (("collar", 0), ("toe_3m", 3), ("toe_6m", 6), ("toe_12m", 12)):
        # 1e-12 m: rounding of coordinates of some ten metres.
        assert quality[name][2] == pytest.approx(abs(PIVOT - depth) * math.tan(0.009), abs=1e-12)


def test_vibration_is_told_from_the_static_part() -> None:
    t = np.arange(4000) / 1000.0
    sag, shake = 0.003, 0.001
    angle = sag + shake * np.sin(2 * math.pi * 5 * t)
    angle[0] = 0.0
    tip = np.tile([BEAM, 0.0, 0.0], (len(t), 1))
    run = moved(beam(angle, tip), tip)
    quality = hole_quality(run, design_of(run), slice(1000, None))
    assert quality is not None
    found = quality.errors[0]
    assert found.static == pytest.approx(sag, rel=1e-3)
    assert found.vibration == pytest.approx(shake, rel=1e-2)
    assert found.worst == pytest.approx(sag + shake, rel=1e-3)


def test_a_direction_given_by_the_user_makes_the_aim_count_too() -> None:
    angle, tip = np.full(5, 0.02), np.tile([BEAM, 0.0, 0.0], (5, 1))
    run = moved(beam(angle, tip), tip)
    assert errors(run)["angle"][2] == pytest.approx(0, abs=1e-8)
    aimed = errors(run, direction=(2.0, 0.0, 0.0))
    assert aimed["angle"] == pytest.approx((0.02, 0, 0.02), abs=1e-12)
    assert aimed["toe_6m"][0] == pytest.approx(6 * math.tan(0.02))


def test_the_shipped_rig_has_a_feed_line_from_drill_to_tip(mkz49: Rig) -> None:
    run = simulate(mkz49, Scenario(duration=0.05))
    line = feed_line(run, design_of(run))
    assert line is not None
    assert (line.drill, line.tip) == ("T", "E")
    # The printed pose points 27.6 degrees down from the face's normal: axis z6 of the check value.
    assert line.direction == pytest.approx((0.8862, 0.0383, -0.4618), abs=1e-4)


def test_a_machine_that_does_not_drill_has_no_hole() -> None:
    rig = load_rig_text(ur5_text().replace("</robot>", EXTENSION + "</robot>"))
    run = simulate(rig, Scenario(duration=0.02, positions=POSE))
    assert feed_line(run, design_of(run)) is None
    assert hole_quality(run, design_of(run), WHOLE) is None


def two_links(axis: str, between: str = "prismatic", frame: str = "body") -> Rig:
    """A beam on a sled: the drilling force acts on the one, the tip is on the other."""
    return load_rig_text(
        robot(
            link("sled"),
            link("beam"),
            joint("swing", "revolute", "world", "sled"),
            joint("reach", between, "sled", "beam", (1.0, 0, 0), (1, 0, 0)),
            extension=point("tip", "beam", (1.5, 0, 0))
            + point("drill", "sled")
            + '<joint_spring name="s" joint="swing" stiffness="1e6"/>\n'
            + ('<joint_spring name="r" joint="reach" stiffness="1e6"/>\n' if between != "fixed" else "")
            + '<contact name="rock" point="tip" axis="1 0 0" stiffness="1e6"/>\n'
            + f'<load name="push" kind="force" point="drill" axis="{axis}" frame="{frame}">'
            + '<constant value="100"/></load>',
        )
    )


@pytest.mark.parametrize("frame", ["body", "world"])
@pytest.mark.parametrize("between", ["prismatic", "fixed", "revolute"])
def test_a_feed_of_two_links_has_a_feed_line(between: str, frame: str) -> None:
    run = simulate(two_links("-1 0 0", between, frame=frame), Scenario(duration=0.02))
    line = feed_line(run, design_of(run))
    assert line is not None
    assert (line.drill, line.tip) == ("drill", "tip")
    assert line.direction == pytest.approx((1, 0, 0), abs=1e-12)


def test_where_there_is_no_feed_line_the_reason_is_said() -> None:
    run = simulate(two_links("0 0 1"), Scenario(duration=0.02))
    assert feed_line(run, design_of(run)) is None
    metrics = measure(run)
    assert "acts along a line to it" in metrics.no_hole
    told = findings(metrics, design_of(run), None, {}, run.outcome)
    assert any(finding.title == "Hole quality" and "push" in finding.sentence for finding in told)


def test_across_the_hole_is_across_the_feed_line() -> None:
    """A beam at 30 degrees to the contact's axis, whose tip slides along itself: nothing of that is across the hole."""
    run = simulate(load_rig_text(MACHINE), Scenario(duration=0.01))
    n, slant = 200, np.array([math.cos(0.5), math.sin(0.5), 0.0])
    along = 0.01 * np.sin(np.linspace(0, 20, n))[:, None] * slant
    tip = BEAM * slant + along
    arrays = {name: np.zeros((n, *array.shape[1:])) for name, array in run.arrays.items()}
    places = [run.labels["point"].index(name) for name in ("tip", "drill")]
    for place, path in zip(places, (tip, tip - BEAM * slant), strict=True):
        arrays["point_position"][:, place] = path
        arrays["point_displacement"][:, place] = path - path[0]
    slid = replace(run, time=np.arange(n) / 1000.0, arrays=arrays, kept=None)
    metrics = measure(slid)
    assert metrics.across_what == "the feed line"
    assert metrics.survey is not None
    assert metrics.survey.across is not None
    assert metrics.survey.across.direction == pytest.approx(slant)
    # Across the contact's axis it would be 0.01 sin(0.5) = 4.8 mm.
    assert metrics.survey.across.farthest == pytest.approx(0, abs=1e-12)
