"""Where a machine is judged: at the poses it names, at the start of a scenario, or at zero, and then it is said so."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from command import Command
from rigs import joint, link, pendulum, point, robot

from drillrig_pin import Scenario, load_rig_text, simulate
from drillrig_pin.check import check_model, check_text

#: A hinge whose range does not hold zero.
HIGH = pendulum(extension='<joint_spring name="s" joint="hinge" stiffness="1e5"/>').replace(
    'lower="-100" upper="100"', 'lower="0.6" upper="2.6"'
)
POSE = '<pose name="{}"><joint name="hinge" position="{}"/></pose></drillrig>'


def test_a_zero_position_outside_limits_is_a_warning_with_the_line_to_write() -> None:
    (problem,) = check_text(HIGH, "rig.urdf")
    assert problem.severity == "warning"
    assert "names no pose" in problem.message
    assert "'hinge' stands at 0, outside its limits 0.6 to 2.6" in problem.message
    line = re.search(r"<pose.*</pose>", problem.advice)
    assert line is not None
    assert check_text(HIGH.replace("</drillrig>", line[0] + "</drillrig>"), "rig.urdf") == [], "as the advice says"


def test_a_pose_of_the_model_outside_limits_stays_an_error() -> None:
    (problem,) = check_text(HIGH.replace("</drillrig>", POSE.format("low", 0.1)), "rig.urdf")
    assert problem.severity == "error"
    assert "pose 'low'" in problem.message


@pytest.mark.parametrize("engine", ["core", "python"])
def test_a_run_that_starts_outside_limits_says_so(engine: str) -> None:
    case = Scenario(duration=0.01, engine=engine)
    (note,) = (note for note in simulate(load_rig_text(HIGH), case).notes if "limits" in note)
    assert note == "at the start joint 'hinge' stands at 0, outside its limits 0.6 to 2.6 [rad or m]"
    inside = case.changed({"positions": {"hinge": 1.0}})
    assert not [note for note in simulate(load_rig_text(HIGH), inside).notes if "limits" in note]


def four_bar() -> str:
    """Sides 1, 2, 2 and 2.5 m. At zero all lie in one line, whose ends do not meet; elsewhere the loop closes."""
    return robot(
        link("crank", 1.0, (0.5, 0, 0)),
        link("coupler", 1.0, (1, 0, 0)),
        link("rocker", 1.0, (0.5, 0, 0)),
        joint("a", "revolute", "world", "crank", axis=(0, 1, 0)),
        joint("b", "revolute", "crank", "coupler", (1, 0, 0), (0, 1, 0)),
        joint("c", "revolute", "world", "rocker", (2.5, 0, 0), (0, 1, 0)),
        extension=point("end", "coupler", (2, 0, 0))
        + point("pin", "rocker", (2, 0, 0))
        + '<loop name="close" from="end" to="pin" translations="x z"/>',
    )


def test_a_machine_is_judged_at_the_start_of_its_scenario(tmp_path: Path, drillrig: Command) -> None:
    path = tmp_path / "high.urdf"
    path.write_text(HIGH)
    case = Scenario(positions={"hinge": 1.0}, duration=0.01)
    assert check_model(path, scenario=case) == []
    (problem,) = check_model(path, scenario=case.changed({"positions": {"hinge": 0.2}}))
    assert (problem.severity, "the start of" in problem.message) == ("warning", True)
    (tmp_path / "case.yaml").write_text("positions: {hinge: 1.0}\nduration: 0.01\n")
    answer = drillrig("check", str(path), "-s", str(tmp_path / "case.yaml"))
    assert (answer.code, "nothing wrong found" in answer.out) == (0, True), answer
    assert "names no pose" in drillrig("check", str(path)).out


def test_a_four_bar_that_runs_from_its_scenario_is_no_error_there(tmp_path: Path) -> None:
    path = tmp_path / "four_bar.urdf"
    path.write_text(four_bar())
    (problem,) = (p for p in check_model(path) if p.severity == "error")
    assert "the zero position" in problem.message
    assert "--scenario" in problem.advice
    case = Scenario(positions={"a": -1.5, "b": 1.2, "c": -1.9}, duration=0.05)
    assert simulate(load_rig_text(four_bar()), case).outcome.completed
    assert not [p for p in check_model(path, scenario=case) if p.severity == "error"]


HUB = robot(link("bar", 3.0, (0, 0.4, 0), (0, 0, 0)), joint("hinge", "revolute", "world", "bar", axis=(0, 1, 0)))


def test_a_hinge_through_a_point_mass_is_named() -> None:
    problem = next(p for p in check_text(HUB, "rig.urdf") if p.severity == "error")
    assert "no mass or inertia resists a motion of 'hinge'" in problem.message
    beside = HUB.replace('xyz="0.0 0.4 0.0"', 'xyz="0.1 0.4 0.0"')
    assert beside != HUB
    assert not [p for p in check_text(beside, "rig.urdf") if p.severity == "error"]


@pytest.mark.parametrize("engine", ["core", "python"])
def test_a_run_that_it_stops_names_it_as_well(engine: str) -> None:
    outcome = simulate(load_rig_text(HUB), Scenario(duration=0.01, engine=engine)).outcome
    assert "no mass or inertia resists a motion of 'hinge'" in str(outcome)


def test_the_cross_of_a_universal_joint_may_have_no_mass() -> None:
    cross = robot(
        link("cross", 0.0, inertia=(0, 0, 0)),
        link("bar", 3.0, (0.4, 0, 0)),
        joint("first", "revolute", "world", "cross", axis=(0, 1, 0)),
        joint("second", "revolute", "cross", "bar", axis=(0, 0, 1)),
    )
    assert [p for p in check_text(cross, "rig.urdf") if p.severity == "error"] == []
