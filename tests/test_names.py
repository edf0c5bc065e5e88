"""Links, joints and the robot may bear any name; it comes back unchanged in results, tables, settings and pages."""

from __future__ import annotations

import csv
from pathlib import Path
from xml.sax.saxutils import quoteattr

import pytest
from command import Command
from hypothesis import given, settings
from hypothesis import strategies as st

from drillrig_pin import Scenario, load_rig_text, simulate
from drillrig_pin.check import check_text
from drillrig_pin.replay.objects import node_path
from drillrig_pin.scene.shapes import Part

ODD = ("arm/pin 1 [red]", 'Gelenk, "größe" đúng; <b>')


def machine(arm: str, tip: str, first: str, second: str) -> str:
    """Two bars on springs; link and joint names as given, elements with letters of several scripts."""
    arm, tip, first, second = map(quoteattr, (arm, tip, first, second))
    body = (
        '<inertial><origin xyz="0.5 0 0"/><mass value="40"/><inertia ixx="1" ixy="0" ixz="0" iyy="4" iyz="0" izz="4"/>'
    )
    hinge = '<axis xyz="0 1 0"/><limit lower="-2" upper="2"/></joint>'
    return (
        f'<robot name="rig/1 größe"><link name="base"/><link name={arm}>{body}</inertial></link>'
        f"<link name={tip}>{body}</inertial></link>"
        f'<joint name={first} type="revolute"><parent link="base"/><child link={arm}/>{hinge}'
        f'<joint name={second} type="revolute"><parent link={arm}/><child link={tip}/><origin xyz="1 0 0"/>{hinge}'
        f'<drillrig><point name="Spitze/ä" link={tip} xyz="1 0 0"/>'
        f'<joint_spring name="feder/1" joint={first} stiffness="1e5" damping="100"/>'
        f'<joint_spring name="lò_xo" joint={second} stiffness="1e5" damping="100"/>'
        f'<pose name="góc/1"><joint name={first} position="0.2"/></pose></drillrig></robot>'
    )


@pytest.mark.parametrize("engine", ["core", "python"])
def test_both_engines_keep_any_name(engine: str) -> None:
    run = simulate(load_rig_text(machine("a b", "ä/ö", *ODD)), Scenario(duration=0.01, engine=engine))
    assert run.outcome.completed
    assert run.labels["joint"] == list(ODD)
    assert run.labels["point"] == ["Spitze/ä"]
    assert run.of("q", ODD[1]).shape == (11,)


def test_the_command_line_takes_and_gives_any_name(drillrig: Command, tmp_path: Path) -> None:
    path, out, table = tmp_path / "odd.urdf", tmp_path / "odd.nc", tmp_path / "odd.csv"
    path.write_text(machine("a b", "ä/ö", *ODD))
    assert "nothing wrong found" in drillrig("check", str(path)).out
    position = ("--set", f"scenario.positions.{ODD[0]}=0.3")
    rest = drillrig("static", str(path), *position, "--json").document
    assert rest["q"] == {ODD[0]: 0.3, ODD[1]: 0.0}
    answer = drillrig("run", str(path), *position, "--set", "scenario.duration=0.2", "-o", str(out))
    assert answer.code == 0, answer.err
    assert ODD[0] in answer.out, "and its brackets are no colour"
    assert drillrig("export", str(out), "--csv", str(table)).code == 0
    with table.open(newline="") as stream:
        head, row = [next(rows) for rows in [csv.reader(stream)] for _ in range(2)]
    assert len(head) == len(row)
    assert f"q.{ODD[1]} [rad]" in head


def test_a_slash_in_a_name_moves_no_other_part() -> None:
    assert not node_path(Part(("machine", "arm/pin"))).startswith(node_path(Part(("machine", "arm"))) + "/")


names = st.text(st.characters(exclude_categories=["Cc", "Cs", "Cn", "Co"]), min_size=1, max_size=20)


@settings(max_examples=25, deadline=None)
@given(st.lists(names, min_size=4, max_size=4, unique=True))
def test_any_text_is_a_name(given: list[str]) -> None:
    arm, tip, first, second = given
    text = machine(arm, tip, first, second)
    rig = load_rig_text(text)
    assert rig.coordinate_names == [first, second]
    assert {point.link for point in rig.points.values()} == {tip}
    assert check_text(text, "odd.urdf") == []
    assert load_rig_text(rig.file.text).coordinate_names == [first, second], "also from the text kept with results"


@pytest.mark.parametrize("name", ["universe", "root_joint", "base", "world"])
def test_a_name_that_means_something_elsewhere_is_a_name(name: str) -> None:
    assert load_rig_text(machine("arm", "tip", name, "second")).coordinate_names == [name, "second"]
    assert load_rig_text(machine(name if name != "base" else "arm", "tip", "first", "second")).joints == [
        "first",
        "second",
    ]
