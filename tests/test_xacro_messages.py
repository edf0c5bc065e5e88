"""What xacro stops at is one sentence: file and line, the macro with its parameters, what to write instead."""

from __future__ import annotations

from pathlib import Path

import pytest
from rigs import joint, link

from drillrig_pin import ModelError, load_rig
from drillrig_pin.check import check_model

HEAD = '<robot name="boom" xmlns:xacro="http://www.ros.org/wiki/xacro">'
BODY = "<link name='base'/>\n" + link("boom", 400.0, (1.5, 0, 0), (10, 300, 300))


def model(folder: Path, *lines: str, origin: str = '<origin xyz="0 0 1"/>') -> Path:
    """A machine whose lines 2 and following are ``lines``; its joint has the origin given."""
    pin = joint("boom_pin", "revolute", "base", "boom").replace(
        '<origin xyz="0.0 0.0 0.0" rpy="0.0 0.0 0.0"/>', f"\n{origin}\n"
    )
    path = folder / "rig.urdf.xacro"
    path.write_text("\n".join([HEAD, *lines, BODY + pin + "</robot>"]))
    return path


def line_of(path: Path, words: str) -> int:
    (found,) = (i for i, line in enumerate(path.read_text().splitlines(), start=1) if words in line)
    return found


@pytest.mark.parametrize(
    ("lines", "origin", "at", "words"),
    [
        (
            ['<xacro:macro name="at" params="x z:=1"><origin xyz="${x} 0 ${z}"/></xacro:macro>'],
            '<xacro:at x="0" y="1"/>',
            "<xacro:at ",
            ["the macro 'at' has no parameter 'y'", "Legal parameters: x, z."],
        ),
        (
            ['<xacro:macro name="at" params="x z"><origin xyz="${x} 0 ${z}"/></xacro:macro>'],
            '<xacro:at x="0"/>',
            "<xacro:at ",
            ["the call of the macro 'at' does not give 'z'", "It takes: x, z."],
        ),
        (
            ['<xacro:macro name="at" params="*block"><xacro:insert_block name="block"/></xacro:macro>'],
            "<xacro:at/>",
            "<xacro:at/",
            ["the call of the macro 'at' gives too few blocks", "It takes: *block."],
        ),
        (
            ['<xacro:macro name="at" params=""><origin xyz="0 0 1"/></xacro:macro>'],
            '<xacro:at><origin xyz="1 1 1"/></xacro:at>',
            "<xacro:at>",
            ["the macro 'at' takes no block <origin>"],
        ),
        ([], '<xacro:att x="0"/>', "<xacro:att", ["no macro 'att'"]),
        ([], '<origin xyz="0 0 $(arg height)"/>', "$(arg", ["'height' is not declared", "<xacro:arg name="]),
        (
            ['<xacro:property name="h" value="$(env NO_SUCH_VARIABLE)"/>'],
            '<origin xyz="0 0 ${h}"/>',
            "$(env",
            ["environment variable 'NO_SUCH_VARIABLE' is not set", "property 'h', used at", "optenv"],
        ),
        (
            ['<property name="h" value="1"/>'],
            '<origin xyz="0 0 ${h}"/>',
            "${h}",
            ["'h' is not defined", "rig.urdf.xacro:2 it lacks the prefix", "Write xacro:property"],
        ),
        (
            ['<xacro:property name="h" value="${1 / 0}"/>'],
            '<origin xyz="0 0 ${h}"/>',
            "${1 / 0}",
            ["division by zero, in ${1 / 0}", "property 'h'"],
        ),
        ([], '<origin xyz="0 0 ${2 *}"/>', "${2 *}", ["invalid syntax"]),
        (["<xacro:include filename='none.xacro'/>"], "", "none.xacro", ["none.xacro cannot be read", "No such file"]),
        (["<xacro:if value='perhaps'/>"], "", "perhaps", ["not a boolean"]),
        (["<xacro:insert_block name='b'/>"], "", "insert_block", ["Undefined block"]),
        (["<xacro:property value='1'/>"], "", "<xacro:property", ["xacro:property", "name"]),
    ],
)
def test_a_fault_is_one_sentence_at_its_line(
    tmp_path: Path, lines: list[str], origin: str, at: str, words: list[str]
) -> None:
    path = model(tmp_path, *lines, origin=origin)
    with pytest.raises(ModelError) as caught:
        load_rig(path)
    said = str(caught.value)
    assert said.startswith(f"{path}:{line_of(path, at)}: "), said
    for word in words:
        assert said.count(word) == 1, said
    for raw in ("<class", "Exception", "substitution_args", "\n"):
        assert raw not in said


def test_a_fault_inside_macros_names_who_called_them(tmp_path: Path) -> None:
    path = model(
        tmp_path,
        '<xacro:macro name="outer" params="x">',
        '<xacro:inner x="${x}"/>',
        "</xacro:macro>",
        '<xacro:macro name="inner" params="x">',
        '<origin xyz="${x / 0} 0 1"/>',
        "</xacro:macro>",
        origin='<xacro:outer x="1"/>',
    )
    with pytest.raises(ModelError) as caught:
        load_rig(path)
    said = str(caught.value)
    assert said.startswith(f"{path}:6: "), said
    assert f"in the macro 'inner' called at {path}:3; in the macro 'outer' called at {path}:" in said


def test_the_line_is_that_of_the_included_file(tmp_path: Path) -> None:
    (tmp_path / "part.xacro").write_text(f"{HEAD}\n\n\n<link name='x${{nowhere}}'/></robot>")
    path = model(tmp_path, "<xacro:include filename='part.xacro'/>")
    with pytest.raises(ModelError, match=r"part\.xacro:4: .*'nowhere' is not defined"):
        load_rig(path)


def test_an_optional_include_may_be_missing(tmp_path: Path) -> None:
    path = model(tmp_path, "<xacro:include filename='none.xacro' optional='true'/>")
    assert load_rig(path).joints == ["boom_pin"]


def test_what_xacro_only_warns_of_is_a_finding_with_its_line_and_nothing_on_the_terminal(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = model(tmp_path, "<xacro:property name='h' valu='1' value='2'/>")
    (problem,) = (p for p in check_model(path) if "valu" in p.message)
    assert problem.severity == "warning"
    assert problem.source.line == 2
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize("declaration", ["", '<?xml version="1.0"?>\n', '<?xml version="1.0" encoding="UTF-8"?>\n'])
def test_latin_1_that_is_not_declared_is_told_what_to_do(tmp_path: Path, declaration: str) -> None:
    path = tmp_path / "rig.urdf"
    path.write_bytes(f"{declaration}<robot name='r'>\n<link name='a'/>\n<!-- größe --></robot>".encode("latin-1"))
    line = 3 + declaration.count("\n")
    with pytest.raises(ModelError, match=rf"rig\.urdf:{line}: .*byte 0xf6.*Save the file as UTF-8, or .*ISO-8859-1"):
        load_rig(path)


def test_latin_1_that_is_declared_is_read(tmp_path: Path) -> None:
    path = tmp_path / "rig.urdf"
    text = BODY.replace("boom", "größe") + joint("pin", "revolute", "base", "größe")
    path.write_bytes(f'<?xml version="1.0" encoding="ISO-8859-1"?><robot name="r">{text}</robot>'.encode("latin-1"))
    assert load_rig(path).joints == ["pin"]


def test_a_model_is_read_from_any_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "urdf" / "sizes").mkdir(parents=True)
    (tmp_path / "urdf" / "sizes" / "h.yaml").write_text("h: 1.5\n")
    path = model(
        tmp_path / "urdf",
        "<xacro:property name='P' value=\"${xacro.load_yaml('sizes/h.yaml')}\"/>",
        origin="<origin xyz=\"0 0 ${P['h']}\"/>",
    )
    for folder, name in ((tmp_path, "urdf/rig.urdf.xacro"), (tmp_path / "urdf", path.name), (Path("/"), str(path))):
        monkeypatch.chdir(folder)
        assert load_rig(name).model.jointPlacements[1].translation[2] == 1.5
