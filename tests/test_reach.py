"""A number that changes no result is named: in the list of numbers, and as an axis before a study runs."""

from __future__ import annotations

from pathlib import Path

import pytest
from command import Command

from drillrig_pin.batch.idle import idle_axes
from drillrig_pin.batch.runner import run_study
from drillrig_pin.batch.study import Study
from drillrig_pin.files import shipped_models
from drillrig_pin.model.modelfile import read_model
from drillrig_pin.model.ranges import read_ranges
from drillrig_pin.model.reach import Reach, reach
from drillrig_pin.studyreport.content import gather
from drillrig_pin.studyreport.subject import read_subject

NUMBERS = ("mass", "base_mass", "paint", "spare", "eye", "along", "across", "push", "unread")
MODEL = """<robot name="bob" xmlns:xacro="http://www.ros.org/wiki/xacro">
{arguments}
<link name="base"><inertial><mass value="$(arg base_mass)"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>
</inertial></link>
<link name="bob"><visual><geometry><box size="$(arg paint) 1 1"/></geometry></visual>
<inertial><mass value="$(arg mass)"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
<joint name="slide" type="prismatic"><parent link="base"/><child link="bob"/><axis xyz="1 0 0"/>
<limit lower="-9" upper="9" effort="0" velocity="0"/></joint>
<drillrig>
{table}
<point name="spare" link="bob" xyz="$(arg spare) 0 0" track="true"/>
<point name="eye" link="bob" xyz="$(arg eye) 0 0"/><point name="wall" link="base" xyz="3 0 0"/>
<point name="T" link="bob" xyz="$(arg along) $(arg across) 0"/>
<spring name="s" from="wall" to="eye" stiffness="100"/>
<load name="drill" kind="force" point="T" axis="1 0 0" frame="body"><constant value="$(arg push)"/></load>
</drillrig></robot>"""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    arguments = "".join(f'<xacro:arg name="{name}" default="1"/>' for name in NUMBERS)
    row = '<parameter name="{0}" value="$(arg {0})" default="1" unit="m" source="assumed: a test" text="{0}"/>'
    file = tmp_path / "bob.urdf.xacro"
    file.write_text(MODEL.format(arguments=arguments, table="".join(row.format(name) for name in NUMBERS)))
    return file


@pytest.mark.parametrize(
    ("name", "acts", "idle"),
    [
        ("mass", ("inertia of bob",), ()),
        ("base_mass", (), ("inertia of base, which stands still",)),
        ("paint", (), ("drawing of bob",)),
        ("spare", (), ("point spare, where no force feels it",)),
        ("eye", ("point eye",), ()),
        # A force moved along its own line does the same; across it turns the body.
        ("along", (), ("point T, where no force feels it",)),
        ("across", ("point T",), ()),
        ("push", ("load drill",), ()),
        ("unread", (), ()),
    ],
)
def test_what_a_number_enters(path: Path, name: str, acts: tuple[str, ...], idle: tuple[str, ...]) -> None:
    found = reach(read_model(path), name, str(path))
    assert found == Reach(acts, idle)
    assert found.none == (not acts)


def test_a_name_that_is_no_number_is_not_judged(path: Path) -> None:
    found = reach(read_model(path), "nowhere", str(path))
    assert not found.known
    assert not found.none


def test_params_names_numbers_without_effect(drillrig: Command, path: Path) -> None:
    answer = drillrig("params", str(path), "--effect")
    assert "5 of 9 tried act on nothing and change no result" in " ".join(answer.out.split())
    rows = {row["name"]: row for row in drillrig("params", str(path), "--effect", "--json").document["parameters"]}
    assert rows["paint"]["enters"] == []
    assert rows["mass"]["enters"] == ["inertia of bob"]


def test_axis_without_effect_is_said_before_a_study_runs(path: Path) -> None:
    axes = [{"name": f"model.{name}", "list": [1.0, 2.0]} for name in ("paint", "mass")]
    (words,) = idle_axes(Study(model=str(path), scenario={"model": str(path)}, axes=axes))
    assert "model.paint changes nothing that acts" in words


def test_axis_without_effect_is_said_in_the_report_of_its_study(path: Path, tmp_path: Path) -> None:
    axes = [{"name": "model.paint", "list": [1.0, 2.0]}]
    study = Study(scenario={"model": str(path), "duration": 0.1}, axes=axes, metrics=["trust.*"])
    run_study(study, tmp_path, workers=1)
    said = [statement for statement in gather(read_subject(tmp_path)).statements if statement.title == "Without effect"]
    assert [statement.sentence.split(",")[0] for statement in said] == [
        "model.paint changes nothing that acts on the machine"
    ]


def test_no_shipped_range_is_offered_for_a_number_without_effect() -> None:
    model = shipped_models()["mkz49"]
    file = read_model(model)
    ranges = read_ranges(model)
    assert len(ranges) >= 15
    assert [name for name in ranges if reach(file, name, str(model)).none] == []
    assert reach(file, "drill_distance", str(model)).none


def test_static_says_what_check_says_of_the_pose(drillrig: Command) -> None:
    changed = ("--set", "model.boom_lift_precharge=0")
    said = "rests at 1.013 bar absolute"
    assert said in " ".join(drillrig("check", "mkz49", *changed).out.split())
    assert said in " ".join(drillrig("static", *changed).out.split())
    problems = drillrig("static", *changed, "--json").document["problems"]
    assert any(said in problem["message"] for problem in problems)
    assert drillrig("static", "--json").document["problems"] == []
