"""`$(find NAME)` without an installed ROS: where packages are looked for, and what is said where one is not found."""

from __future__ import annotations

from pathlib import Path

import pytest
from command import Command, one_sentence
from rigs import joint, link

from drillrig_pin import ModelError, load_rig
from drillrig_pin.check import check_model
from drillrig_pin.model.packages import VARIABLE, find_package

BODY = "<link name='base'/>" + link("boom", 400.0, (1.5, 0, 0), (10, 300, 300))
INCLUDE = "<xacro:include filename='$(find rig_description)/urdf/sizes.xacro'/>"


def model(head: str = INCLUDE) -> str:
    pin = joint("boom_pin", "revolute", "base", "boom").replace("0.0 0.0 0.0", "0 0 ${height}", 1)
    return f"<robot name='boom' xmlns:xacro='http://www.ros.org/wiki/xacro'>\n\n{head}\n{BODY}{pin}</robot>"


def package(folder: Path, name: str | None = "rig_description", height: float = 1.25) -> Path:
    """A package with a table of sizes; ``name``: what its package.xml says."""
    (folder / "urdf").mkdir(parents=True)
    (folder / "urdf" / "sizes.xacro").write_text(
        f"<robot xmlns:xacro='http://www.ros.org/wiki/xacro'><xacro:property name='height' value='{height}'/></robot>"
    )
    if name is not None:
        (folder / "package.xml").write_text(f"<package><name>{name}</name></package>")
    return folder


@pytest.fixture(autouse=True)
def _no_packages_known(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(VARIABLE, "")
    for variable in ("ROS_PACKAGE_PATH", "AMENT_PREFIX_PATH", "CMAKE_PREFIX_PATH"):
        monkeypatch.delenv(variable, raising=False)


def height(path: Path, **options: object) -> float:
    return float(load_rig(path, **options).model.jointPlacements[1].translation[2])


@pytest.mark.parametrize(
    ("where", "said"),
    [
        ("rig_description", "rig_description"),
        ("rig_description", None),
        ("checkout-of-main", "rig_description"),
    ],
    ids=["folder and package.xml", "folder of this name", "folder whose package.xml says it"],
)
def test_a_package_is_found_above_the_file_that_names_it(tmp_path: Path, where: str, said: str | None) -> None:
    folder = package(tmp_path / "ws" / "src" / where, said)
    (folder / "urdf" / "rig.urdf.xacro").write_text(model())
    assert height(folder / "urdf" / "rig.urdf.xacro") == 1.25


def test_a_package_beside_the_one_that_names_it_is_found(tmp_path: Path) -> None:
    package(tmp_path / "src" / "anything", "rig_description")
    other = package(tmp_path / "src" / "my_rig", "my_rig", height=9)
    (other / "urdf" / "rig.urdf.xacro").write_text(model())
    assert height(other / "urdf" / "rig.urdf.xacro") == 1.25


def test_a_folder_whose_package_is_another_is_not_taken(tmp_path: Path) -> None:
    package(tmp_path / "rig_description", "quite_another")
    with pytest.raises(ModelError, match="'rig_description' is not found"):
        find_package("rig_description", tmp_path / "rig.urdf.xacro")


def test_variables_of_ros_say_where_packages_are(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "mine").mkdir()
    path = tmp_path / "mine" / "rig.urdf.xacro"
    path.write_text(model())
    far = package(tmp_path / "far" / "away" / "stack" / "rig_description", height=2)
    monkeypatch.setenv("ROS_PACKAGE_PATH", f"/nowhere:{tmp_path / 'far'}")
    assert height(path) == 2
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(far))
    assert height(path) == 2
    monkeypatch.delenv("ROS_PACKAGE_PATH")
    package(tmp_path / "opt" / "share" / "rig_description", height=3)
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path / "opt"))
    assert height(path) == 3


def test_a_folder_may_be_said_in_python_and_goes_before_all_others(tmp_path: Path) -> None:
    folder = package(tmp_path / "rig_description")
    (folder / "rig.urdf.xacro").write_text(model())
    other = package(tmp_path / "other" / "copy", None, height=4)
    assert height(folder / "rig.urdf.xacro", packages={"rig_description": other}) == 4
    assert not [
        p for p in check_model(folder / "rig.urdf.xacro", packages={"rig_description": other}) if "find" in p.message
    ]
    with pytest.raises(ModelError, match=r"is said to be in .* no folder"):
        height(folder / "rig.urdf.xacro", packages={"rig_description": tmp_path / "none"})


def test_a_package_that_is_not_found_is_named_with_its_line_and_what_to_do(tmp_path: Path) -> None:
    path = tmp_path / "rig.urdf.xacro"
    path.write_text(model())
    with pytest.raises(ModelError) as caught:
        load_rig(path)
    said = str(caught.value)
    assert said.startswith(f"{path}:3: the package 'rig_description' is not found")
    for words in (f"upwards from '{tmp_path}'", "ROS_PACKAGE_PATH", "AMENT_PREFIX_PATH", "--package rig_description="):
        assert words in said
    assert "ament_index" not in said


def test_find_inside_an_expression_and_a_property_is_the_same(tmp_path: Path) -> None:
    folder = package(tmp_path / "rig_description")
    head = "<xacro:property name='here' value='$(find rig_description)'/>"
    (folder / "rig.urdf.xacro").write_text(model(f"{head}<xacro:include filename='${{here}}/urdf/sizes.xacro'/>"))
    assert height(folder / "rig.urdf.xacro") == 1.25


@pytest.mark.parametrize("name", ["", ".", "..", "../rig_description", "/etc"])
def test_a_name_is_no_way_out_of_the_folders(tmp_path: Path, name: str) -> None:
    package(tmp_path / "rig_description")
    with pytest.raises(ModelError, match="is not found"):
        find_package(name, tmp_path / "rig_description" / "rig.urdf.xacro")


def test_the_command_line_takes_folders_of_packages(drillrig: Command, tmp_path: Path) -> None:
    package(tmp_path / "elsewhere" / "stand", None, height=6)
    path = tmp_path / "mine" / "rig.urdf.xacro"
    path.parent.mkdir()
    path.write_text(model())
    assert "is not found" in drillrig("check", str(path)).out
    option = ("--package", f"rig_description={tmp_path / 'elsewhere' / 'stand'}")
    expanded = drillrig("expand", str(path), *option)
    assert expanded.code == 0, expanded.err
    assert '"0 0 6' in expanded.out
    one_sentence(drillrig("expand", str(path), "--package", "rig_description"), "--package", "NAME=FOLDER")
    one_sentence(drillrig("expand", str(path), "--package", "rig_description=/none"), "no such folder: '/none'")
