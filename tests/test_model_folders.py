"""Files that a model names are found beside the file that names them, from whatever folder the program runs in."""

from __future__ import annotations

import os
import shutil
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from command import Command
from hypothesis import given, settings
from hypothesis import strategies as st
from rigs import joint, link, robot

from drillrig_pin import Scenario, load_rig, simulate
from drillrig_pin.batch.study import load_study, require_names
from drillrig_pin.errors import ModelError
from drillrig_pin.files import shipped_folder
from drillrig_pin.model.modelfile import read_model
from drillrig_pin.scenario import load_scenario

XACRO = 'xmlns:xacro="http://www.ros.org/wiki/xacro"'
TABLE = "t,F\n0,5\n0.5,5\n1,5\n1.5,5\n2,5\n"

MAIN = f"""<robot name="bob" {XACRO}>
<xacro:include filename="{{parts}}/parts.xacro"/>
<link name="base"/>
<link name="bob"><inertial><origin xyz="0 0 0"/><mass value="${{{{number('mass')}}}}"/>
<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
<joint name="slide" type="prismatic"><parent link="base"/><child link="bob"/><axis xyz="1 0 0"/>
<limit lower="-9" upper="9" effort="0" velocity="0"/></joint>
<drillrig><point name="P" link="bob" xyz="0 0 0"/><xacro:push name="drill"/></drillrig></robot>""".replace(
    "number('mass')", "P['mass']"
)
#: The property waits for its first use, which is in the main file; the macro is called from there.
PARTS = f"""<robot {XACRO}>
<xacro:property name="P" value="${{xacro.load_yaml('data/numbers.yaml')}}"/>
<xacro:macro name="push" params="name"><load name="${{name}}" kind="force" point="P" axis="1 0 0" frame="world">
<table file="data/load.csv"/></load></xacro:macro></robot>"""


def write_rig(folder: Path, parts: str = "parts", mass: float = 2.5) -> Path:
    """A model whose include, in another folder, names a table of numbers and a load table beside itself."""
    place = folder / parts
    (place / "data").mkdir(parents=True, exist_ok=True)
    (place / "parts.xacro").write_text(PARTS)
    (place / "data" / "numbers.yaml").write_text(f"mass: {mass}\n")
    (place / "data" / "load.csv").write_text(TABLE)
    path = folder / "bob.urdf.xacro"
    path.write_text(MAIN.format(parts=parts))
    return path


def travelled(path: str | Path) -> float:
    return float(simulate(load_rig(path), Scenario(model=str(path), duration=1.0)).q[-1, 0])


@pytest.mark.parametrize("start", [".", "..", "sub", "/"])
@pytest.mark.parametrize("absolute", [True, False])
def test_model_is_read_from_any_working_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, start: str, absolute: bool
) -> None:
    path = write_rig(tmp_path / "rigs")
    (tmp_path / "rigs" / "sub").mkdir()
    monkeypatch.chdir(tmp_path / "rigs" / start)
    way = path if absolute else Path(os.path.relpath(path))
    # 5 N on 2.5 kg for 1 s: 1 m, exact for a constant force whatever the step; 1e-6 is the tolerance of the run.
    assert travelled(way) == pytest.approx(1.0, rel=1e-6)


@pytest.mark.parametrize("start", [".", "urdf", "urdf/params", ".."])
@pytest.mark.parametrize("command", ["check", "static", "expand", "params"])
def test_shipped_model_is_read_by_path_from_any_folder(
    drillrig: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: str, start: str
) -> None:
    shutil.copytree(shipped_folder(), tmp_path / "checkout" / "urdf")
    monkeypatch.chdir(tmp_path / "checkout" / start)
    way = os.path.relpath(tmp_path / "checkout" / "urdf" / "mkz49.urdf.xacro")
    answer = drillrig(command, way)
    assert (answer.code, answer.err) == (0, "")


def test_include_in_a_folder_beside_the_models(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write_rig(tmp_path / "rigs", "../shared/parts")
    monkeypatch.chdir(tmp_path)
    assert travelled(path.relative_to(tmp_path)) == pytest.approx(1.0, rel=1e-6)


def test_nearest_file_of_a_name_counts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write_rig(tmp_path / "rigs")
    for place in (tmp_path, tmp_path / "rigs"):
        (place / "data").mkdir()
        (place / "data" / "numbers.yaml").write_text("mass: 100\n")
        (place / "data" / "load.csv").write_text(TABLE.replace(",5", ",500"))
    monkeypatch.chdir(tmp_path)
    assert travelled(path) == pytest.approx(1.0, rel=1e-6)


def test_links_and_dots(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write_rig(tmp_path / "rigs")
    elsewhere = tmp_path / "elsewhere" / "deep"
    elsewhere.mkdir(parents=True)
    (elsewhere / "linked.urdf.xacro").symlink_to(path)
    (elsewhere / "rigs").symlink_to(tmp_path / "rigs" / "parts")
    monkeypatch.chdir(elsewhere)
    for way in ("linked.urdf.xacro", "rigs/../bob.urdf.xacro", "../../elsewhere/../rigs/bob.urdf.xacro"):
        assert travelled(way) == pytest.approx(1.0, rel=1e-6), way


def test_name_given_to_a_macro_of_another_folder_is_found_beside_its_caller(tmp_path: Path) -> None:
    (tmp_path / "lib").mkdir()
    (tmp_path / "lib" / "m.xacro").write_text(
        f'<robot {XACRO}><xacro:macro name="read" params="file"><xacro:property name="P" scope="parent" '
        'value="${xacro.load_yaml(file)}" lazy_eval="false"/></xacro:macro></robot>'
    )
    (tmp_path / "mine.yaml").write_text("mass: 3\n")
    path = tmp_path / "one.urdf.xacro"
    path.write_text(
        f'<robot name="one" {XACRO}><xacro:include filename="lib/m.xacro"/><xacro:read file="mine.yaml"/>'
        "<link name=\"w${P['mass']}\"/></robot>"
    )
    assert 'name="w3"' in read_model(path).text


def test_missing_file_is_named_as_written_with_the_line(tmp_path: Path) -> None:
    path = tmp_path / "one.urdf.xacro"
    path.write_text(f"<robot name=\"one\" {XACRO}>\n<link name=\"${{xacro.load_yaml('no.yaml')['a']}}\"/></robot>")
    with pytest.raises(ModelError) as told:
        read_model(path)
    assert "load_yaml('no.yaml')" in str(told.value)
    assert str(tmp_path / "no.yaml") in str(told.value)
    assert "one.urdf.xacro:2" in str(told.value)


def test_scenario_and_study_name_a_model_beside_them(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_rig(tmp_path / "rigs")
    (tmp_path / "cases").mkdir()
    (tmp_path / "cases" / "case.yaml").write_text("model: ../rigs/bob.urdf.xacro\nduration: 1\n")
    (tmp_path / "study.yaml").write_text(
        "scenario: cases/case.yaml\naxes: [{name: scenario.duration, list: [1.0]}]\nmetrics: [trust.*]\n"
    )
    (tmp_path / "cases" / "models.yaml").write_text(
        "scenario: {duration: 1}\nset: {scenario.model: ../rigs/bob.urdf.xacro}\n"
        "axes: [{name: scenario.duration, list: [1.0]}]\n"
    )
    (tmp_path / "cases" / "axis.yaml").write_text(
        "model: ../rigs/bob.urdf.xacro\naxes: [{name: scenario.model, list: [../rigs/bob.urdf.xacro]}]\n"
    )
    monkeypatch.chdir("/")
    case = load_scenario(tmp_path / "cases" / "case.yaml")
    assert travelled(case.model) == pytest.approx(1.0, rel=1e-6)
    for name in ("study.yaml", "cases/models.yaml", "cases/axis.yaml"):
        study = load_study(tmp_path / name)
        assert require_names(study).name == "bob"
        for point in study.axes[0].points():
            assert read_model(point.get("scenario.model", study.base.model)).name == "bob"


def test_threads_read_models_of_many_folders(tmp_path: Path) -> None:
    paths = [write_rig(tmp_path / f"rig{i}", mass=i + 1.0) for i in range(8)]
    with ThreadPoolExecutor(4) as pool:
        texts = [file.text for file in pool.map(read_model, paths * 2)]
    for i, text in enumerate(texts):
        assert f'<mass value="{i % 8 + 1.0}"/>' in text


NAMES = st.text("abcé ü-_.", min_size=1, max_size=6).filter(lambda name: set(name) != {"."} and name == name.strip())


@settings(max_examples=30, deadline=None)
@given(st.lists(NAMES, max_size=3), st.lists(NAMES, min_size=1, max_size=3), st.booleans())
def test_any_pair_of_folders(rig: list[str], parts: list[str], up: bool) -> None:
    with tempfile.TemporaryDirectory() as name:
        place = "/".join(["..", *parts] if up else parts)
        path = write_rig(Path(name).joinpath("top", *rig), place)
        file = read_model(path)
        assert '<mass value="2.5"/>' in file.text
        assert {read.name for read in file.files} == {"bob.urdf.xacro", "parts.xacro", "numbers.yaml", "load.csv"}
        assert all(read.is_file() for read in file.files)


def test_plain_urdf_and_text_of_rigs_stay_as_they_were(tmp_path: Path) -> None:
    text = robot(link("a"), link("b"), joint("j", "revolute", "a", "b"))
    (tmp_path / "plain.urdf").write_text(text)
    assert "drillrig-" not in read_model(tmp_path / "plain.urdf").text
