"""What of URDF is read, what is refused by line, what is warned of: nothing is lost silently."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from rigs import pendulum

from drillrig_pin import ModelError, load_rig_text
from drillrig_pin.check import check_model, check_text
from drillrig_pin.model.modelfile import read_model_text
from drillrig_pin.model.problem import Problem
from drillrig_pin.tree import load_tree

MASS = '<mass value="400"/>'
INERTIA = '<inertia ixx="10" ixy="0" ixz="0" iyy="300" iyz="0" izz="300"/>'
VISUAL = '<visual><origin xyz="1.5 0 0"/><geometry><box size="3 0.3 0.4"/></geometry></visual>'
LIMIT = '<limit lower="-1" upper="1" effort="1e5" velocity="1"/>'
BOOM = f"""<?xml version="1.0"?>
<robot name="boom">
  <link name="base"/>
  <link name="boom">
    <inertial><origin xyz="1.5 0 0"/>{MASS}{INERTIA}</inertial>
    {VISUAL}
  </link>
  <joint name="boom_pin" type="revolute">
    <origin xyz="0 0 1"/>
    <parent link="base"/><child link="boom"/>
    <axis xyz="0 1 0"/>
    {LIMIT}
  </joint>
  <drillrig>
    <joint_spring name="hold" joint="boom_pin" stiffness="1e6" damping="1e3"/>
    <point name="tip" link="boom" xyz="3 0 0"/>
  </drillrig>
</robot>
"""


def altered(old: str, new: str) -> str:
    assert BOOM.count(old) == 1, old
    return BOOM.replace(old, new)


def first_change(text: str) -> int:
    """The line in which a text begins to differ from the boom's."""
    return next(i for i, (a, b) in enumerate(zip(BOOM.splitlines(), text.splitlines(), strict=False), 1) if a != b)


def findings(text: str) -> list[Problem]:
    return check_text(text, "rig.urdf")


def test_the_boom_itself_has_no_findings() -> None:
    assert findings(BOOM) == []


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (MASS, '<mass value="400 "/>'),
        (MASS, '<mass value="\n 4e2"/>'),
        ('xyz="1.5 0 0"/><mass', 'xyz=" 1.5   0\t0 "/><mass'),
        (LIMIT, '<limit lower="-1 " upper=" 1"/>'),
        (LIMIT, '<limit lower="-1" upper="1"/>'),
        (LIMIT, '<limit lower="-1" upper="1" effort="strong" velocity=""/>'),
        ("</robot>", '<material name="y"><color rgba="1 1 0 1"/></material>' * 2 + "</robot>"),
        ("<robot ", '<robot xmlns:xacro="http://www.ros.org/wiki/xacro" version="1.0" '),
    ],
)
def test_what_can_only_mean_one_thing_is_read_without_a_word(
    old: str, new: str, capfd: pytest.CaptureFixture[str]
) -> None:
    text = altered(old, new)
    assert findings(text) == []
    rig = load_rig_text(text)
    assert rig.model.inertias[1].mass == 400.0
    np.testing.assert_array_equal(rig.model.inertias[1].lever, [1.5, 0, 0])
    assert (rig.model.lowerPositionLimit[0], rig.model.upperPositionLimit[0]) == (-1, 1)
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('xyz="1.5 0 0"/><mass', 'xyz="1.5 0 0" rpy=""/><mass', ["rpy is empty and read as 0 0 0"]),
        ('<origin xyz="0 0 1"/>', '<orgin xyz="0 0 1"/>', ["<orgin> in <joint 'boom_pin'>", "Did you mean 'origin'"]),
        ('<origin xyz="0 0 1"/>', '<origin xzy="0 0 1"/>', ["no attribute 'xzy'", "Did you mean 'xyz'"]),
        ('<origin xyz="0 0 1"/>', '<insert_block name="at"/>', ["<insert_block>", "Write xacro:insert_block"]),
        ("  <drillrig>", "  <include file='a'/><drillrig>", ["<include> below <robot>", "Write xacro:include"]),
        ('<origin xyz="0 0 1"/>', "<origin>0 0 1</origin>", ["the text '0 0 1' inside <origin> is ignored"]),
        ('<origin xyz="0 0 1"/>', '<origin xyz="0 0 1"/><origin xyz="0 0 2"/>', ["a second <origin>", "rig.urdf:9"]),
        (VISUAL, VISUAL + MASS, ["<mass> in <link 'boom'>", "It belongs into <inertial>"]),
        (VISUAL, VISUAL.replace("0.3 0.4", "0.3"), ["<box> size = '3 0.3' holds 2 numbers, not 3"]),
        (VISUAL, VISUAL.replace("1.5 0 0", "1.5 0"), ["<origin> xyz = '1.5 0' holds 2 numbers"]),
        (
            VISUAL,
            VISUAL.replace("</v", '<material name="g"><color rgba="1 1 1"/></material></v'),
            ["rgba", "3 numbers"],
        ),
        (VISUAL, VISUAL.replace("</v", '<material name="g"/></v'), ["no material 'g' says its colour"]),
        (VISUAL, VISUAL.replace("<box", "<sphere radius='1'/><box"), ["more than one shape: <box> is ignored"]),
        (VISUAL, VISUAL.replace("box", "bxo"), ["<bxo>", "Did you mean 'box'"]),
        (
            "</robot>",
            '<material name="y"><color rgba="1 1 0 1"/></material><material name="y"><color rgba="1 0 0 1"/></material>'
            "</robot>",
            ["material 'y' has another colour"],
        ),
        ('<robot name="boom">', "<robot>", ["has no name and is called 'robot'"]),
        (VISUAL, VISUAL + "<gravity>0</gravity>", ["<gravity> in <link 'boom'> is ignored"]),
        (
            "</robot>",
            "<gazebo reference='boom_pin'><springStiffness>9</springStiffness></gazebo></robot>",
            ["<springStiffness> in <gazebo>", "<joint_spring>"],
        ),
        (
            "</robot>",
            "<gazebo><joint name='closing' type='revolute'/></gazebo></robot>",
            ["<joint> in <gazebo>", "<loop>"],
        ),
        (LIMIT, LIMIT.replace("velocity", "velocty"), ["no attribute 'velocty'", "Did you mean 'velocity'"]),
    ],
)
def test_what_is_left_out_or_mended_is_a_warning_at_its_line(
    old: str, new: str, words: list[str], capfd: pytest.CaptureFixture[str]
) -> None:
    text = altered(old, new)
    (problem,) = findings(text)
    assert problem.severity == "warning"
    for word in words:
        assert word in str(problem)
    assert load_rig_text(text).joints == ["boom_pin"], "and the machine runs"
    assert problem.source.line == first_change(text)
    assert capfd.readouterr().err == "", "nothing of another library on the terminal"


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (MASS, "<mass>400</mass>", ["<mass> lacks the attribute 'value'", '<mass value="400"/>']),
        (MASS, '<mass value=""/>', ["<mass> value is empty"]),
        (MASS, '<mass value="400,5"/>', ["'400,5' is not a finite number", "decimal point"]),
        (MASS, '<mass value="4_00"/>', ["'4_00' is not a finite number"]),
        (MASS, '<mass value="400 500"/>', ["holds 2 numbers, not 1"]),
        (MASS, "", ["<inertial> without <mass>"]),
        (INERTIA, "", ["no <inertia>"]),
        (INERTIA, INERTIA.replace(' iyy="300"', ""), ["<inertia> lacks the attribute 'iyy'"]),
        ('xyz="1.5 0 0"/><mass', 'xyz="1.5 0"/><mass', ["xyz = '1.5 0' holds 2 numbers, not 3"]),
        ('<origin xyz="0 0 1"/>', '<origin xyz="0 1"/>', ["xyz = '0 1' holds 2 numbers, not 3"]),
        ('<origin xyz="0 0 1"/>', '<origin xyz="" rpy="0 0 0"/>', ["<origin> xyz is empty"]),
        ('<origin xyz="0 0 1"/>', '<origin quat_xyzw="0 0 0 0"/>', ["quat_xyzw has the length 0 and not 1"]),
        (
            '<origin xyz="0 0 1"/>',
            '<origin rpy="0 0 1" quat_xyzw="0 0 0 1"/>',
            ["turned twice, by rpy and by quat_xyzw"],
        ),
        ('<axis xyz="0 1 0"/>', '<axis xyz="0 0 0"/>', ["'boom_pin': its axis '0 0 0' has no direction"]),
        ('<axis xyz="0 1 0"/>', "<axis/>", ["<axis> lacks the attribute 'xyz'"]),
        (LIMIT, "", ["has no <limit>"]),
        ('type="revolute"', 'type="planar"', ["'planar'", "two prismatic joints and a revolute one"]),
        ('type="revolute"', 'type="spherical"', ["'spherical'", "three revolute joints"]),
        (VISUAL, f"{VISUAL}<drillrig><hold name='h'/></drillrig>", ["<drillrig> block with <hold>", "below <robot>"]),
        ("</robot>", "<gazebo><drillrig/></gazebo></robot>", ["does not stand directly below <robot>"]),
        (f'<inertial><origin xyz="1.5 0 0"/>{MASS}{INERTIA}</inertial>', "", ["'boom_pin' moves no mass", "'boom'"]),
    ],
)
def test_what_would_be_lost_by_the_reader_below_is_refused_at_its_line(
    old: str, new: str, words: list[str], capfd: pytest.CaptureFixture[str]
) -> None:
    text = altered(old, new)
    (problem,) = (problem for problem in findings(text) if problem.severity == "error")
    for word in words:
        assert word in str(problem)
    assert problem.source.line > 0
    with pytest.raises(ModelError) as caught:
        load_rig_text(text, "rig.urdf")
    assert caught.value.what == problem.message
    assert capfd.readouterr().err == ""


def test_a_quaternion_of_a_joint_and_an_inertia_is_read() -> None:
    turn = pin.Quaternion(np.array([0.1, -0.5, 0.3, 0.8])).normalized()
    words = " ".join(repr(1.05 * float(c)) for c in turn.coeffs())
    text = altered('<origin xyz="0 0 1"/>', f'<origin xyz="0 0 1" quat_xyzw="{words}"/>')
    placed = load_rig_text(text).model.jointPlacements[1]
    # Through roll, pitch, yaw and their text: a few roundings of 1e-16.
    np.testing.assert_allclose(placed.rotation, turn.toRotationMatrix(), atol=1e-14)
    for up in (1, -1):
        half = 0.5**0.5
        straight = altered('<origin xyz="0 0 1"/>', f'<origin xyz="0 0 1" quat_xyzw="0 {up * half!r} 0 {half!r}"/>')
        expected = pin.Quaternion(np.array([0, up * half, 0, half])).toRotationMatrix()
        np.testing.assert_allclose(load_rig_text(straight).model.jointPlacements[1].rotation, expected, atol=1e-7)


def test_rounding_in_an_inertia_is_no_fault() -> None:
    tiny = '<inertia ixx="-2.4e-35" ixy="0" ixz="1e-36" iyy="0" iyz="0" izz="0"/>'
    assert not [p for p in findings(altered(INERTIA, tiny)) if "negative" in p.message or "triangle" in p.message]
    assert [p for p in findings(altered(INERTIA, tiny.replace("e-35", ""))) if "negative" in p.message]


@pytest.mark.parametrize(
    ("mass", "moment", "words"),
    [
        (0.03, 1.0, "radius of gyration of 5.8 m, larger than its shape (3 m)"),
        (1e6, 1e-6, "radius of gyration of 1e-06 m, far smaller than its shape (3 m)"),
        (400.0, 0.0, "radius of gyration of 0 m, far smaller"),
        (400.0, 300.0, ""),
        (400.0, 800.0, ""),
    ],
)
def test_a_placeholder_inertia_is_suspected_against_the_shape(mass: float, moment: float, words: str) -> None:
    inertia = f'<inertia ixx="{moment}" ixy="0" ixz="0" iyy="{moment}" iyz="0" izz="{moment}"/>'
    text = altered(MASS, f'<mass value="{mass}"/>').replace(INERTIA, inertia)
    found = [str(p) for p in findings(text) if "radius" in p.message]
    assert bool(found) == bool(words)
    assert all(words in sentence and "rig.urdf:5" in sentence for sentence in found)


def test_a_placeholder_inertia_is_suspected_against_a_mesh_too(tmp_path: Path) -> None:
    facets = "".join(
        f"facet normal 0 0 0\nouter loop\nvertex {a}\nvertex {b}\nvertex {c}\nendloop\nendfacet\n"
        for a, b, c in [("0 0 0", "3 0 0", "0 0.3 0"), ("0 0 0", "3 0 0", "0 0 0.4"), ("3 0 0", "0 0.3 0", "0 0 0.4")]
    )
    (tmp_path / "boom.stl").write_text(f"solid boom\n{facets}endsolid boom\n")
    path = tmp_path / "rig.urdf"
    drawn = altered(VISUAL, '<visual><geometry><mesh filename="boom.stl"/></geometry></visual>')
    path.write_text(drawn)
    assert check_model(path) == []
    path.write_text(drawn.replace(MASS, '<mass value="0.03"/>').replace(INERTIA, INERTIA.replace("300", "10")))
    (problem,) = check_model(path)
    assert "radius of gyration of 18 m, larger than its shape (3 m)" in problem.message


def test_many_links_with_one_tensor_are_suspected_once() -> None:
    def chain(masses: list[float]) -> str:
        links = "".join(
            f'<link name="l{i}"><inertial><mass value="{m}"/>{INERTIA.replace("300", "10")}</inertial></link>'
            f'<joint name="j{i}" type="revolute"><parent link="{f"l{i - 1}" if i else "base"}"/><child link="l{i}"/>'
            f"{LIMIT}</joint>"
            for i, m in enumerate(masses)
        )
        return f'<robot name="r"><link name="base"/>{links}</robot>'

    (found,) = (p for p in findings(chain([20, 30, 40])) if "very same inertia" in p.message)
    assert "'l0', 'l1', 'l2'" in found.message
    assert not [p for p in findings(chain([20, 20, 20])) if "very same inertia" in p.message], "three wheels"


def test_the_clean_tree_is_the_one_pinocchio_reads_from_the_file_itself() -> None:
    for text in (BOOM, pendulum()):
        ours, plain = load_tree(read_model_text(text)), pin.buildModelFromXML(text)
        assert list(ours.names) == list(plain.names)
        assert all(a == b for a, b in zip(ours.jointPlacements, plain.jointPlacements, strict=True))
        assert all(a == b for a, b in zip(ours.inertias, plain.inertias, strict=True))


def test_a_mass_that_does_not_arrive_in_the_tree_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    def lossy(root: object) -> str:
        return BOOM.replace(MASS, '<mass value="399"/>')

    monkeypatch.setattr("drillrig_pin.tree.tree_text", lossy)
    with pytest.raises(ModelError, match=r"link 'boom'.* has 399 kg in the loaded tree and 400 kg in the file"):
        load_rig_text(BOOM)


def test_what_the_reader_below_complains_of_is_a_sentence_without_its_build_paths(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("drillrig_pin.tree.tree_text", lambda root: BOOM.replace(MASS, '<mass value="400 "/>'))
    with pytest.raises(ModelError) as caught:
        load_rig_text(BOOM, "rig.urdf")
    assert "mass [400 ] is not a float" in str(caught.value)
    assert "/" not in caught.value.what
    assert capfd.readouterr().err == ""


def test_a_model_without_files_reads_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "secret.csv").write_text("0,1\n1,1\n")
    monkeypatch.chdir(tmp_path)
    load = '<load name="l" kind="force" point="tip" axis="1 0 0">\n<table file="secret.csv"/></load></drillrig>'
    for attribute in ("", f' drillrig-named-in="{tmp_path / "x.urdf"}"'):
        text = altered("</drillrig>", load.replace("<table", f"<table{attribute}"))
        with pytest.raises(ModelError, match=r"rig\.urdf:\d+: the load table 'secret.csv' is a file"):
            load_rig_text(text, "rig.urdf")
