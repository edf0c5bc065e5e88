"""Bad input at the command line: one clear sentence with the place and the legal names, and no file left behind."""

from __future__ import annotations

from pathlib import Path

import pytest
from command import Command, one_sentence
from rigs import joint, link, mass_on_cylinder, point, robot

from drillrig_pin.cli.guard import FAILED

SHORT = ("--set", "scenario.duration=0.05")
TABLE = '<load name="push" kind="force" point="pin_b" axis="0 0 1" frame="world"><table file="push.csv"/></load>\n'


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("run", "nope"), "Legal models: mkz49"),
        (("run", "nope.urdf"), "no such model file"),
        (("run", "--scenario", "hole9"), "'hole_9'"),
        (("run", "--set", "model.boom_lenght=2"), "'boom_length'"),
        (("run", "--set", "model.boom_length=nan"), "boom_length"),
        (("run", "--set", "boom_length=2"), "--set model.boom_length=2.1"),
        (("run", "--set", "scenario.durration=2"), "'duration'"),
        (("run", "--set", "scenario.duration=-1"), "greater than 0"),
        (("run", "--set", "scenario.duration=[1"), "YAML"),
        (("run", "--set", "scenario.targets.face.y=90"), "cannot be assembled"),
        (("run", "--set", "scenario.pose=hole_8"), "'hole_9'"),
        (("check", "mkz49", "--set", "scenario.duration=1"), "model.NAME"),
        (("plot", "nope.nc"), "no such result file"),
        (("export", "nope.nc"), "--csv"),
        (("expand", "mkz49", "-o", "nowhere/x.urdf"), "does not exist"),
    ],
)
def test_wrong_words_give_one_sentence(drillrig: Command, words: tuple[str, ...], said: str) -> None:
    one_sentence(drillrig(*words), said)
    assert list(Path().iterdir()) == []


BAD_MODELS = {
    "not xml": ("<robot><link", "well-formed"),
    "bomb": ('<!DOCTYPE r [<!ENTITY a "ha">]><robot name="&a;"><link name="b"/></robot>', "entity"),
    "nan": (mass_on_cylinder().replace('value="500.0"', 'value="nan"'), "finite"),
    "negative mass": (mass_on_cylinder(mass=-3.0), "negative mass"),
    "missing frame": (mass_on_cylinder(extension=point("P", "mast")), "'mass'"),
    "misspelt attribute": (mass_on_cylinder().replace("bore=", "boer="), "'bore'"),
    "impossible hold": (
        mass_on_cylinder(extension='<hold name="top" point="pin_b" axes="x" target="3"/>'),
        "cannot be assembled",
    ),
    "gap": (mass_on_cylinder(extension=TABLE), "gap"),
    "no tree": (robot(link("a"), joint("j", "revolute", "world", "b")), "no link 'b'"),
    "out of stroke": (mass_on_cylinder(length=2.0), "'oil'"),
}


@pytest.mark.parametrize("case", BAD_MODELS)
def test_bad_models_give_one_sentence(drillrig: Command, case: str) -> None:
    text, said = BAD_MODELS[case]
    Path("push.csv").write_text("".join(f"{t},1\n" for t in (0, 0.1, 0.2, 0.3, 5, 5.1)))
    Path("bad.urdf").write_text(text)
    one_sentence(drillrig("run", "bad.urdf", *SHORT), said)
    assert not Path("run.nc").exists()
    checked = drillrig("check", "bad.urdf")
    assert checked.code == FAILED
    assert said in " ".join(checked.out.split())


def test_a_misspelt_attribute_is_shown_with_file_and_line(drillrig: Command) -> None:
    Path("bad.urdf").write_text(BAD_MODELS["misspelt attribute"][0])
    one_sentence(drillrig("run", "bad.urdf"), "bad.urdf:7:", "'boer'", "bulk_modulus")


def test_a_load_shorter_than_the_run_is_refused(drillrig: Command) -> None:
    Path("push.csv").write_text("time,force\n" + "".join(f"{i / 10},{i}\n" for i in range(11)))
    Path("press.urdf").write_text(mass_on_cylinder(extension=TABLE))
    one_sentence(drillrig("run", "press.urdf", "--set", "scenario.duration=2"), "'push'", "2 s")
    assert drillrig("run", "press.urdf", *SHORT).code == 0
