"""What an expansion keeps for the next one changes none of its results."""

from __future__ import annotations

import os
from contextlib import nullcontext
from pathlib import Path

import pytest

from drillrig_pin.errors import ModelError
from drillrig_pin.model import expand
from drillrig_pin.model.modelfile import read_model

MODEL = """<robot name="one" xmlns:xacro="http://www.ros.org/wiki/xacro">
<xacro:property name="P" value="${{xacro.load_yaml('numbers.yaml')}}"/>
<xacro:if value="{condition}"/>
<link name="base"/><link name="bob"><inertial><origin xyz="0 0 0"/><mass value="${{P['mass']}}"/>
<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
<joint name="swing" type="revolute"><parent link="base"/><child link="bob"/><axis xyz="0 1 0"/>
<limit lower="-1" upper="1" effort="0" velocity="0"/></joint></robot>"""


def write(folder: Path, mass: float, condition: str = "true") -> Path:
    (folder / "numbers.yaml").write_text(f"mass: {mass}\n")
    path = folder / "one.urdf.xacro"
    path.write_text(MODEL.format(condition=condition))
    return path


@pytest.mark.parametrize("arguments", [{}, {"boom_length": 2.1}, {"boom_swing_bore": 0.09, "cylinder_law": "printed"}])
def test_text_is_the_same_without_memory(monkeypatch: pytest.MonkeyPatch, arguments: dict[str, object]) -> None:
    kept = read_model("mkz49", arguments)
    again = read_model("mkz49", arguments)
    monkeypatch.setattr(expand, "remembering", lambda _: nullcontext())
    plain = read_model("mkz49", arguments)
    assert kept.text == again.text == plain.text
    assert kept.files == again.files == plain.files


def test_changed_table_of_numbers_is_read_again(tmp_path: Path) -> None:
    path = write(tmp_path, 1.0)
    assert 'value="1.0"' in read_model(path).text
    write(tmp_path, 2.5)
    os.utime(tmp_path / "numbers.yaml", ns=(1, 1))
    assert 'value="2.5"' in read_model(path).text


def test_model_that_alters_its_table_alters_no_other(tmp_path: Path) -> None:
    path = write(tmp_path, 1.0, condition="${not P.update(mass=7.0)}")
    assert 'value="7.0"' in read_model(path).text
    write(tmp_path, 1.0)
    assert 'value="1.0"' in read_model(path).text


def test_nothing_stays_behind_when_an_expansion_fails(tmp_path: Path) -> None:
    import xacro

    before = xacro.eval_text, xacro._global_symbols["xacro"]["load_yaml"]
    with pytest.raises(ModelError, match="nowhere"):
        read_model(write(tmp_path, 1.0, condition="${nowhere}"))
    assert (xacro.eval_text, xacro._global_symbols["xacro"]["load_yaml"]) == before
    assert not hasattr(xacro, "compile")
