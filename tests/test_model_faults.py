"""Model files that are hostile, broken or slightly wrong: one sentence with file, line and the legal names."""

from __future__ import annotations

from pathlib import Path

import pytest
from rigs import double_pendulum, joint, link, mass_on_cylinder, point, point_mass, robot

from drillrig_pin import ModelError, load_rig, load_rig_text
from drillrig_pin.errors import Source

BOMB = '<!DOCTYPE r [<!ENTITY a "aaaaaaaaaa">' + "".join(
    f'<!ENTITY {chr(98 + i)} "{("&" + chr(97 + i) + ";") * 10}">' for i in range(9)
)


def refused(text: str, *words: str) -> ModelError:
    """The error of a text; every word must be in its one sentence."""
    with pytest.raises(ModelError) as caught:
        load_rig_text(text, "rig.urdf")
    sentence = str(caught.value)
    assert sentence.startswith("rig.urdf"), sentence
    assert "\n" not in sentence
    for word in words:
        assert word in sentence, sentence
    return caught.value


@pytest.mark.parametrize(
    ("text", "word"),
    [
        (BOMB + "]><robot name='r'>&j;</robot>", "DTD or an entity"),
        ('<!DOCTYPE r [<!ENTITY x SYSTEM "file:///etc/passwd">]><robot name="r">&x;</robot>', "DTD or an entity"),
        ('<!DOCTYPE robot SYSTEM "http://localhost/x.dtd"><robot name="r"/>', "DTD or an entity"),
        ("<robot>" + "<a>" * 5000 + "</a>" * 5000 + "</robot>", "nests deeper"),
        ("<robot>" + "<a/>" * 300_000 + "</robot>", "holds more than"),
        ("<robot name='r'><link name='a'></robot>", "not well-formed XML"),
        ("", "not well-formed XML"),
        ("hello", "not well-formed XML"),
        ("\x00\x01", "not well-formed XML"),
        ("<robot name='r'>&undefined;</robot>", "not well-formed XML"),
        ("<model name='r'/>", "not <robot>"),
        ("<robot name='r'/>", "no link"),
        ("<robot name='r'>" + " " * 21_000_000 + "</robot>", "larger than 20 MB"),
    ],
    ids=[
        "entity bomb", "external entity", "external DTD", "deep nesting", "many elements", "unclosed", "empty",
        "no XML", "binary", "undefined entity", "other root", "no links", "too large",
    ],
)  # fmt: skip
def test_text_that_is_no_model_is_refused_in_one_sentence(text: str, word: str) -> None:
    refused(text, word)


def test_a_file_in_another_encoding_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "rig.urdf"
    path.write_bytes(b'<?xml version="1.0" encoding="no-such-code"?><robot name="r"/>')
    with pytest.raises(ModelError, match="XML"):
        load_rig(path)
    path.write_bytes(b"<robot name='\xff\xfe'/>")
    with pytest.raises(ModelError, match="XML"):
        load_rig(path)


def test_a_missing_file_folder_or_name_is_said(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match="no such model file"):
        load_rig(tmp_path / "none.urdf")
    with pytest.raises(ModelError, match=r"no model named 'mkz48'.*Did you mean 'mkz49'"):
        load_rig("mkz48")
    with pytest.raises(ModelError, match="no such model file"):
        load_rig(tmp_path)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('mass value="500.0"', 'mass value="-5"', ("'mass'", "negative mass")),
        ('mass value="500.0"', 'mass value="nan"', ("mass", "finite")),
        ('mass value="500.0"', 'mass value="heavy"', ("'heavy'", "finite")),
        ('ixx="0.01"', 'ixx="inf"', ("finite",)),
        ('ixx="0.01"', 'ixx="-3"', ("principal moment",)),
        ('child link="mass"', 'child link="mas"', ("no link 'mas'", "Did you mean 'mass'")),
        ('parent link="world"', 'parent link="mass"', ("'mass' hangs on a ring", "<loop>")),
        ('type="prismatic"', 'type="prismatik"', ("'prismatik'", "Did you mean 'prismatic'")),
        ('type="prismatic"', 'type="planar"', ("'planar'", "Legal types")),
        ('axis xyz="0.0 0.0 1.0"', 'axis xyz="0 0 nan"', ("finite",)),
        ('<link name="world"/>', '<link name="world"/><link name="world"/>', ("link 'world' is already defined",)),
        ('<link name="world"/>', '<link name="world"/><link name="stray"/>', ("no parent", "'stray'")),
    ],
)
def test_faults_of_links_and_joints_are_found_at_their_line(old: str, new: str, words: tuple[str, ...]) -> None:
    text = mass_on_cylinder()
    assert old in text
    error = refused(text.replace(old, new), *words)
    assert isinstance(error.where, Source)
    assert error.where.line > 0


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("<cylinder", "<cylindre", ("unknown element <cylindre>", "Did you mean 'cylinder'", "joint_spring")),
        (' bore="', ' boer="', ("<cylinder 'oil'> has no attribute 'boer'", "Did you mean 'bore'", "length_retracted")),
        (' bore="0.063"', "", ("<cylinder 'oil'> lacks the attribute 'bore'",)),
        ('bore="0.063"', 'bore="0,063"', ("bore = '0,063'", "[m]")),
        ('bore="0.063"', 'bore="nan"', ("bore = 'nan'", "finite")),
        ('bore="0.063"', 'bore="-1"', ("bore = '-1'", "greater than 0")),
        ('bore="0.063"', 'bore="0.02"', ("'oil'", "not thinner than the bore")),
        ('dead_length_a="0.040"', 'dead_length_a="0.42"', ("'oil'", "no stroke")),
        ('from="pin_a"', 'from="pin_x"', ("'oil'", "no point 'pin_x'", "pin_a, pin_b")),
        ('link="mass" xyz', 'link="mss" xyz', ("'pin_b'", "no link 'mss'", "Did you mean 'mass'")),
        ('name="oil"', 'name="pin_a"', ("'pin_a' is already defined at rig.urdf:",)),
        ('name="oil"', 'name="two words"', ("name = 'two words'",)),
        ('xyz="0.0 0.0 -0.65"', 'xyz="0 0"', ("'pin_a'", "xyz = '0 0'")),
        ('xyz="0.0 0.0 -0.65"', 'xyz="0 0 inf"', ("'pin_a'", "xyz = '0 0 inf'", "finite")),
    ],
)
def test_faults_of_elements_are_found_at_their_line_with_the_legal_names(
    old: str, new: str, words: tuple[str, ...]
) -> None:
    text = mass_on_cylinder()
    assert old in text
    error = refused(text.replace(old, new, 1), *words)
    assert isinstance(error.where, Source)
    line = text.replace(old, new, 1).splitlines()[error.where.line - 1]
    assert new in line or "point" in line, "the line named is the line at fault"


@pytest.mark.parametrize(
    ("extension", "words"),
    [
        ('<hold name="h" point="P" axes="x w"/>', ("axes", "'x w'")),
        ('<hold name="h" point="P" axes="x x"/>', ("twice",)),
        ('<hold name="h" point="P" axes=""/>', ("axes",)),
        ('<hold name="h" point="P" axes="x y" target="1"/>', ("1 targets for 2 axes",)),
        ('<hold name="h" point="P" axes="x" target="later"/>', ("target",)),
        ('<hold name="h" point="Q" axes="x"/>', ("no point 'Q'",)),
        ('<joint_spring name="s" joint="w" stiffness="1"/>', ("no moving joint 'w'", "x, y, z")),
        ('<contact name="c" point="P" axis="0 0 0" stiffness="1"/>', ("no length",)),
        ('<contact name="c" point="P" stiffness="0"/>', ("greater than 0",)),
        ('<contact name="c" point="P" stiffness="1" mode="sticky"/>', ("'sticky'", "'bilateral' or 'unilateral'")),
        ('<load name="l" kind="force" point="P" axis="1 0 0"/>', ("exactly one of", "<constant>")),
        ('<load name="l" kind="force" point="P" axis="1 0 0"><constat value="1"/></load>', ("<constat>", "'constant'")),
        (
            '<load name="l" kind="push" point="P" axis="1 0 0"><constant value="1"/></load>',
            ("'push'", "'force' or 'torque'"),
        ),
        (
            '<load name="l" kind="force" point="P" axis="1 0 0"><constant value="1" ram="2"/></load>',
            ("'ram'", "'ramp'"),
        ),
        (
            '<load name="l" kind="force" point="P" axis="1 0 0"><harmonics><sine/></harmonics></load>',
            ("<sine>", "term"),
        ),
        ('<pose name="p"><joint name="w" position="1"/></pose>', ("no moving joint 'w'",)),
        ('<pose name="p"><joint name="x" position="1 2"/></pose>', ("takes 1 values, not 2",)),
        ('<pose name="p"><link name="x"/></pose>', ("<link> does not belong in a pose",)),
        ('<gravity xyz="0 0"/>', ("<gravity>", "xyz = '0 0'")),
    ],
)
def test_faults_of_every_kind_of_element_are_one_sentence(extension: str, words: tuple[str, ...]) -> None:
    refused(point_mass(extension=extension), *words)


def test_an_element_needs_a_joint_of_one_dof() -> None:
    free = robot(
        link("body"),
        joint("free", "floating", "world", "body"),
        extension='<joint_spring name="s" joint="free" stiffness="1"/>',
    )
    refused(free, "'free' has 6 dofs, not one")


def test_two_joints_to_one_link_and_a_ring_of_links_are_told_to_use_a_loop() -> None:
    twice = robot(link("a"), joint("j", "revolute", "world", "a"), joint("k", "revolute", "world", "a"))
    refused(twice, "child of two joints, 'j' and 'k'", "<loop>")
    ring = (
        '<robot name="r"><link name="a"/><link name="b"/>'
        + joint("j", "revolute", "a", "b")
        + joint("k", "revolute", "b", "a")
        + "</robot>"
    )
    refused(ring, "ring", "<loop>")


def test_several_faults_are_refused_at_the_first_in_the_file() -> None:
    text = double_pendulum('\n<hold name="one" point="A" axes="x"/>\n<hold name="two" point="B" axes="x"/>')
    assert "'one'" in str(refused(text))


XACRO = '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">{}</robot>'


@pytest.mark.parametrize(
    ("body", "word"),
    [
        ("${1 / 0}", "division by zero"),
        ("<link name='${undefined_thing}'/>", "undefined_thing"),
        ("<xacro:include filename='missing.xacro'/>", "missing.xacro"),
        ("<xacro:no_such_macro/>", "no_such_macro"),
        ("<xacro:macro name='m'><xacro:m/></xacro:macro><xacro:m/>", "without end"),
        ("<link name='${__import__(\"os\").getcwd()}'/>", "xacro cannot expand"),
        ("<link name='${open(\"/etc/passwd\").read()}'/>", "xacro cannot expand"),
    ],
)
def test_faults_of_xacro_are_one_sentence(tmp_path: Path, body: str, word: str) -> None:
    path = tmp_path / "rig.urdf.xacro"
    path.write_text(XACRO.format(body))
    with pytest.raises(ModelError) as caught:
        load_rig(path)
    assert word in str(caught.value)
    assert str(tmp_path) in str(caught.value), "with the file"
    assert "\n" not in str(caught.value)


def test_lines_are_those_of_the_included_file(tmp_path: Path) -> None:
    (tmp_path / "part.xacro").write_text(XACRO.format("\n\n<drillrig>\n<pont name='P' link='a'/>\n</drillrig>"))
    (tmp_path / "rig.urdf.xacro").write_text(
        XACRO.format(
            "<link name='a'/><link name='b'/>"
            + joint("j", "revolute", "a", "b")
            + "<xacro:include filename='part.xacro'/>"
        )
    )
    with pytest.raises(ModelError, match=r"part\.xacro:4: unknown element <pont>.*Did you mean 'point'"):
        load_rig(tmp_path / "rig.urdf.xacro")


def test_xacro_in_a_plain_urdf_is_told_its_right_name(tmp_path: Path) -> None:
    (tmp_path / "rig.urdf").write_text(XACRO.format("<link name='a'/>\n<xacro:property name='h' value='1'/>"))
    with pytest.raises(ModelError, match=r"rig\.urdf:2: <xacro:property> needs xacro.*named \*\.xacro"):
        load_rig(tmp_path / "rig.urdf")


def test_a_failed_expansion_does_not_spoil_the_next_one(tmp_path: Path) -> None:
    (tmp_path / "bad.urdf.xacro").write_text(XACRO.format("${1 / 0}"))
    with pytest.raises(ModelError):
        load_rig(tmp_path / "bad.urdf.xacro")
    assert load_rig("mkz49").name == "mkz49"


def test_points_may_stand_on_the_world_and_on_links_merged_away() -> None:
    rig = load_rig_text(
        robot(link("a"), link("b"), joint("j", "revolute", "world", "a"), joint("f", "fixed", "a", "b", (1, 2, 3)),
              extension=point("P", "b", (1, 0, 0)) + point("Q", "world", (4, 5, 6)))
    )  # fmt: skip
    assert rig.point("P").vector == pytest.approx((2, 2, 3))
    assert rig.point("Q").joint == 0
