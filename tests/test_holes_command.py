"""`drillrig holes` shows poses, drills them on request, and says what is out of reach."""

from __future__ import annotations

from pathlib import Path

import pytest
from command import Command

from drillrig_pin.batch.cases import unfold
from drillrig_pin.batch.study import Study
from drillrig_pin.batch.summary import Tally
from drillrig_pin.batch.worker import FAILED, Answer
from drillrig_pin.cli.sweep_words import standing

STUDY = """\
scenario: hole_9
set: {scenario.duration: 0.1}
axes:
  - holes:
      fixed: [head_rotation]
      places:
        near: {pose: hole_9, source: "paper: section 2"}
        far: {at: [9.0, 0.0, 1.0], source: "assumed: to be out of reach"}
metrics: [S.across.rms, "*.p_max", "*.p_min"]
"""


@pytest.fixture
def study(tmp_path: Path) -> Path:
    path = tmp_path / "two_holes.yaml"
    path.write_text(STUDY)
    return path


def test_poses_are_shown_and_a_hole_out_of_reach_says_why(drillrig: Command, study: Path) -> None:
    answer = drillrig("holes", str(study))
    assert answer.code == 0
    assert "boom_swing" in answer.out
    assert "far is out of reach" in answer.out
    assert "Next: drillrig holes" in answer.out


def test_drilled_holes_are_told_with_their_pressures(drillrig: Command, study: Path, tmp_path: Path) -> None:
    answer = drillrig("holes", str(study), "-o", str(tmp_path / "out"), "--workers", "1")
    assert answer.code == 0
    for words in ("near", "completed", "unreachable", "bar", "2 of 2 cases recorded", "drillrig sweep-report"):
        assert words in answer.out
    again = drillrig("holes", str(study), "-o", str(tmp_path / "out"), "--workers", "1")
    assert "(0 now, 2 before)" in again.out


def test_a_study_under_way_tells_cases_rate_failures_and_extremes() -> None:
    axis = {"name": "scenario.velocities.boom_swing", "list": [0.0, 0.01, 0.02, 0.03]}
    plan = unfold(Study(axes=[axis], metrics=["S.z.rms"]))
    tally = Tally(plan, [])
    assert standing(tally) == "0 of 4 cases"
    for case, value in zip(plan.cases[:2], (1e-3, 2e-3), strict=True):
        tally.add(Answer(case.question.key, metrics={"S.z.rms": value}, units={"S.z.rms": "m"}), tally.started + 1.0)
    tally.add(Answer(plan.cases[2].question.key, FAILED, "broke"), tally.started + 2.0)
    words = standing(tally)
    for part in ("3 of 4 cases", "/s", "left", "1 failed", "S.z.rms 1.00 mm to 2.00 mm"):
        assert part in words
