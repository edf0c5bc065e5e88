"""`check_model` finds what is wrong, all at once, and says where."""

from __future__ import annotations

from pathlib import Path

import pytest
from rigs import CYLINDER, joint, link, mass_on_cylinder, point, robot

from drillrig_pin.check import check_model
from drillrig_pin.model.problem import Problem


@pytest.fixture
def findings(tmp_path: Path):
    def check(text: str) -> list[Problem]:
        path = tmp_path / "machine.urdf"
        path.write_text(text)
        return check_model(path)

    return check


def the(problems: list[Problem], *words: str) -> Problem:
    """The one finding that has all these words."""
    found = [p for p in problems if all(word in str(p) for word in words)]
    assert len(found) == 1, "\n".join(map(str, problems))
    return found[0]


def lever(arm: float, *, retracted: float = 0.472, extension: str = "") -> str:
    """A hanging bar turned by a cylinder 0.65 m long, whose line passes the hinge at ``arm``."""
    return robot(
        link("bar", 20.0, com=(0.5, 0, 0)),
        joint("hinge", "revolute", "world", "bar", axis=(0, 1, 0)),
        extension=point("pin_a", "world", (arm, 0, -0.65))
        + point("pin_b", "bar", (arm, 0, 0))
        + CYLINDER.format('precharge="3e6"').replace('length_retracted="0.472"', f'length_retracted="{retracted}"')
        + extension,
    )


def test_the_shipped_model_has_no_errors() -> None:
    assert [str(p) for p in check_model("mkz49") if p.severity == "error"] == []


def test_a_sound_machine_has_no_findings(findings) -> None:
    assert findings(mass_on_cylinder(options='precharge="3e6"')) == []


def test_several_mistakes_are_found_at_once_with_their_lines(findings) -> None:
    text = robot(
        link("arm", -2.0),
        joint("hinge", "revolut", "world", "arm"),
        extension='<cylinder name="c" from="a" to="b" boer="0.1"/>\n<sprnig name="s"/>\n',
    )
    problems = findings(text)
    assert "machine.urdf:2" in str(the(problems, "negative mass"))
    assert "'revolute'" in the(problems, "type 'revolut'").advice
    assert "machine.urdf:5" in str(the(problems, "<cylinder 'c'>"))
    assert "'spring'" in the(problems, "<sprnig>").advice
    assert all(p.severity == "error" for p in problems)


def test_a_misspelt_attribute_shows_the_legal_names_and_its_line(findings) -> None:
    problem = the(findings(lever(0.3).replace("bore=", "boer=")), "no attribute 'boer'")
    assert problem.source.file.endswith("machine.urdf")
    assert problem.source.line == 7
    assert "'bore'" in problem.advice
    assert "bulk_modulus" in problem.advice


@pytest.mark.parametrize(("retracted", "severity"), [(0.64, "warning"), (0.66, "error"), (0.30, "error")])
def test_a_cylinder_at_or_beyond_an_end_of_its_stroke(findings, retracted: float, severity: str) -> None:
    assert the(findings(lever(0.3, retracted=retracted)), "'oil'", "its stroke").severity == severity


def test_a_short_lever_arm_is_suspicious(findings) -> None:
    problem = the(findings(lever(0.05)), "lever arm")
    assert problem.severity == "warning"
    assert "'hinge'" in problem.message
    assert not [p for p in findings(lever(0.3)) if "lever arm" in p.message]


def test_static_pressures_outside_the_limits_are_named(findings) -> None:
    overloaded = lever(0.3).replace('value="20.0"', 'value="4000.0"')
    assert "chamber A" in str(the(findings(overloaded), "above its relief pressure"))


def test_a_pose_beyond_the_joint_limits_is_an_error(findings) -> None:
    pose = '<pose name="far"><joint name="hinge" position="200"/></pose>\n'
    assert the(findings(lever(0.3, extension=pose)), "'far'", "outside its limits").severity == "error"


def test_pins_that_coincide_or_sit_on_one_body(findings) -> None:
    coincident = lever(0.3).replace(' xyz="0.3 0.0 -0.65"', ' xyz="0.3 0.0 0.0"')
    assert the(findings(coincident), "coincide").severity == "error"
    one_body = lever(0.3).replace('name="pin_a" link="world"', 'name="pin_a" link="bar"')
    assert the(findings(one_body), "sit on one body").severity == "warning"


def test_redundant_constraint_rows_are_named(findings) -> None:
    hold = '<hold name="top" point="pin_b" axes="x y z"/>\n'
    problems = findings(lever(0.3, extension=hold))
    assert "'top.y'" in the(problems, "redundant").message


def test_what_nothing_carries_is_named(findings) -> None:
    falling = robot(link("mass"), joint("slide", "prismatic", "world", "mass"))
    problem = the(findings(falling), "nothing carries")
    assert "'slide'" in problem.message
    assert problem.severity == "warning"


def test_a_machine_that_cannot_be_assembled_is_an_error(findings) -> None:
    hold = '<hold name="top" point="pin_b" axes="x" target="9"/>\n'
    assert the(findings(lever(0.3, extension=hold)), "cannot be assembled").severity == "error"


def test_a_missing_frame_gives_the_legal_links(findings) -> None:
    problem = the(findings(lever(0.3, extension=point("P", "bra"))), "no link 'bra'")
    assert "'bar'" in problem.advice


def test_what_cannot_be_read_at_all_is_one_finding_with_its_line(findings) -> None:
    (problem,) = findings('<robot name="x">\n<link name="a">\n</robot>')
    assert problem.source.line == 3
    assert "well-formed" in problem.message


def test_an_xml_bomb_is_refused(findings) -> None:
    bomb = '<!DOCTYPE r [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;">]><robot name="x"><link name="&b;"/></robot>'
    (problem,) = findings(bomb)
    assert problem.severity == "error"
    assert "entity" in problem.message
