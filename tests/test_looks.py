"""Shapes of links: meshes found beside the model, faults of looks noted with the link and never in the way."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner

from drillrig_pin import ModelError, Scenario, Trajectory, load_rig, load_rig_text, load_trajectory, simulate
from drillrig_pin.check import check_model, check_text
from drillrig_pin.cli.app import app
from drillrig_pin.model.meshes import find_mesh
from drillrig_pin.model.modelfile import read_model, read_model_text
from drillrig_pin.scene.links import machine_size
from drillrig_pin.scene.scene import build_scene
from drillrig_pin.scene.shapes import Ball, Box, Mesh
from drillrig_pin.scene.visuals import Visual, link_visuals

STL = """solid lug
facet normal 0 0 -1
outer loop
vertex 0 -0.2 0
vertex 0 0.2 0
vertex 3 0 0
endloop
endfacet
facet normal 0 -1 1
outer loop
vertex 0 -0.2 0
vertex 3 0 0
vertex 0 0 0.5
endloop
endfacet
endsolid lug
"""
DAE = """<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><created>2026-01-01</created><modified>2026-01-01</modified><unit name="meter" meter="1"/>
<up_axis>Z_UP</up_axis></asset>
<library_effects>
{effects}
</library_effects>
<library_materials>
{materials}
</library_materials>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="pa" count="12">0 0 0 1 0 0 0 2 0 0 0 3</float_array><technique_common>
<accessor source="#pa" count="4" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>
<param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
{triangles}
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node id="n"><instance_geometry url="#g"><bind_material><technique_common>
{bound}
</technique_common></bind_material></instance_geometry></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>"""


def dae(*colours: str) -> str:
    """A tetrahedron's faces in as many colours."""
    faces = ["0 1 2", "0 1 3", "1 2 3", "0 2 3"]
    numbers = range(len(colours))
    lambert = "<technique sid='t'><lambert><diffuse><color>{}</color></diffuse></lambert></technique>"
    parts = [faces[i :: len(colours)] for i in numbers]
    return DAE.format(
        effects="\n".join(
            f"<effect id='e{i}'><profile_COMMON>{lambert.format(colours[i])}</profile_COMMON></effect>" for i in numbers
        ),
        materials="\n".join(f"<material id='m{i}'><instance_effect url='#e{i}'/></material>" for i in numbers),
        triangles="\n".join(
            f"<triangles count='{len(parts[i])}' material='m{i}'><input semantic='VERTEX' source='#v' offset='0'/>"
            f"<p>{' '.join(parts[i])}</p></triangles>"
            for i in numbers
        ),
        bound="\n".join(f"<instance_material symbol='m{i}' target='#m{i}'/>" for i in numbers),
    )


def boom(*visuals: str, top: str = "") -> str:
    shapes = "".join(f"<visual>{visual}</visual>" for visual in visuals)
    return f"""<robot name="boom">{top}
  <link name="base"/>
  <link name="boom">
    <inertial><origin xyz="1.5 0 0"/><mass value="400"/>
      <inertia ixx="10" ixy="0" ixz="0" iyy="300" iyz="0" izz="300"/></inertial>
    {shapes}
  </link>
  <joint name="boom_pin" type="revolute"><origin xyz="0 0 1"/><parent link="base"/><child link="boom"/>
    <axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="1e5" velocity="1"/></joint>
  <drillrig><joint_spring name="hold" joint="boom_pin" stiffness="1e6" damping="1e3"/>
    <point name="tip" link="boom" xyz="3 0 0"/></drillrig>
</robot>"""


BOX = '<origin xyz="1.5 0 0"/><geometry><box size="3 0.3 0.4"/></geometry>'
BALL = '<geometry><sphere radius="0.2"/></geometry>'


def mesh(name: str, extra: str = "") -> str:
    return f'<geometry><mesh filename="{name}" {extra}/></geometry>'


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A package as people lay it out, and no other in sight."""
    for variable in ("ROS_PACKAGE_PATH", "AMENT_PREFIX_PATH", "CMAKE_PREFIX_PATH", "DRILLRIG_PACKAGES"):
        monkeypatch.delenv(variable, raising=False)
    for name in ("urdf", "meshes"):
        (tmp_path / "rig_description" / name).mkdir(parents=True)
    (tmp_path / "rig_description" / "meshes" / "boom.stl").write_text(STL)
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    return tmp_path


def written(folder: Path, *visuals: str) -> Path:
    path = folder / "rig_description" / "urdf" / "boom.urdf"
    path.write_text(boom(*visuals))
    return path


def visuals_of(path: Path) -> tuple[list[Visual], list[str]]:
    file = read_model(path)
    rig = load_rig(path)
    found, faults = link_visuals(file.root, file.folder, machine_size(rig))
    return found.get("boom", []), [str(fault) for fault in faults]


def short_run(path: Path) -> Trajectory:
    return simulate(load_rig(path), Scenario(duration=0.02))


# --- meshes ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "name",
    [
        "../meshes/boom.stl",
        "..\\meshes\\boom.stl",
        "package://rig_description/meshes/boom.stl",
        "model://rig_description/meshes/boom.stl",
        "file://../meshes/boom.stl",
        "{absolute}",
        "file://{absolute}",
    ],
)
def test_a_mesh_beside_the_model_is_drawn_from_any_folder_and_from_the_result(folder: Path, name: str) -> None:
    absolute = folder / "rig_description" / "meshes" / "boom.stl"
    path = written(folder, BOX, mesh(name.format(absolute=absolute)))
    assert not check_model(path)
    run = short_run(path)
    run.save("a.nc")
    for trajectory in (run, load_trajectory("a.nc")):
        scene = build_scene([trajectory])
        assert scene.notes == []
        (drawn,) = (part.shape for part in scene.parts if isinstance(part.shape, Mesh) and part.path[-1] == "1")
        np.testing.assert_allclose(np.ptp(drawn.vertices, axis=0), [3.0, 0.4, 0.5])


def test_a_package_may_bear_another_folder_name_than_its_own(folder: Path) -> None:
    (folder / "rig_description").rename(folder / "checkout")
    (folder / "checkout" / "package.xml").write_text("<package><name>rig_description</name></package>")
    path = folder / "checkout" / "urdf" / "boom.urdf"
    path.write_text(boom(BOX, mesh("package://rig_description/meshes/boom.stl")))
    shapes, faults = visuals_of(path)
    assert faults == []
    assert isinstance(shapes[1].shape, Mesh)


@pytest.mark.parametrize("variable", ["ROS_PACKAGE_PATH", "AMENT_PREFIX_PATH", "DRILLRIG_PACKAGES"])
def test_variables_say_where_a_package_is(folder: Path, monkeypatch: pytest.MonkeyPatch, variable: str) -> None:
    other = folder / "far" / "share" / "arm"
    other.mkdir(parents=True)
    (other / "x.stl").write_text(STL)
    places = {
        "ROS_PACKAGE_PATH": other.parent,
        "AMENT_PREFIX_PATH": folder / "far",
        "DRILLRIG_PACKAGES": f"arm={other}",
    }
    path = written(folder, mesh("package://arm/x.stl"))
    assert any("not found" in fault for fault in visuals_of(path)[1])
    monkeypatch.setenv(variable, str(places[variable]))
    assert visuals_of(path)[1] == []


def test_a_mesh_named_in_an_include_elsewhere_counts_from_the_include(folder: Path) -> None:
    parts = folder / "parts"
    (parts / "meshes").mkdir(parents=True)
    (parts / "meshes" / "lug.stl").write_text(STL)
    macro = f'<xacro:macro name="looks"><visual>{mesh("meshes/lug.stl")}</visual></xacro:macro>'
    (parts / "lug.xacro").write_text(f'<robot xmlns:xacro="http://www.ros.org/wiki/xacro">{macro}</robot>')
    text = boom(BOX).replace("<robot ", '<robot xmlns:xacro="http://www.ros.org/wiki/xacro" ')
    text = text.replace('<link name="base"/>', '<xacro:include filename="../../parts/lug.xacro"/><link name="base"/>')
    path = folder / "rig_description" / "urdf" / "boom.urdf.xacro"
    path.write_text(text.replace("<visual>", "<xacro:looks/><visual>", 1))
    shapes, faults = visuals_of(path)
    assert faults == []
    assert [type(shape.shape) for shape in shapes] == [Mesh, Box]
    assert build_scene([short_run(path)]).notes == []


def test_what_is_not_found_is_one_note_with_count_places_and_remedy_and_warnings_of_check(folder: Path) -> None:
    path = written(folder, BOX, *(mesh(f"../missing/{i}.stl") for i in range(5)), mesh("package://nowhere/x.dae"))
    scene = build_scene([short_run(path)])
    (note,) = scene.notes
    for words in ("6 meshes are not found here", "'../missing/0.stl'", "and 3 more", str(folder), "ROS_PACKAGE_PATH"):
        assert words in note
    assert "--package" in note
    problems = check_model(path)
    assert [problem.severity for problem in problems] == ["warning"] * 6
    assert all(problem.source.file.endswith("boom.urdf") and problem.source.line for problem in problems)
    assert "looked in" in problems[0].message
    assert "looked upwards from" in problems[5].message


def test_no_shapes_is_said_only_where_there_are_none(folder: Path) -> None:
    (note,) = build_scene([short_run(written(folder))]).notes
    assert "gives its links no shapes" in note
    notes = build_scene([short_run(written(folder, mesh("../missing.stl")))]).notes
    assert not any("gives its links no shapes" in note for note in notes)
    assert any("None of the shapes of the links can be drawn: bones" in note for note in notes)


@pytest.mark.parametrize(
    ("factor", "scale", "said"),
    [
        (1000, "1 1 1", "3.07e+03 m long"),
        (1000, "0.001 0.001 0.001", ""),
        (1, "1 1 1", ""),
        (1, "1e-5 1e-5 1e-5", "long"),
    ],
)
def test_a_mesh_in_another_unit_is_suspected(folder: Path, factor: float, scale: str, said: str) -> None:
    rows = [line.split() for line in STL.splitlines()]
    text = "\n".join(
        " ".join(["vertex", *(f"{float(word) * factor:g}" for word in row[1:])])
        if row[0] == "vertex"
        else " ".join(row)
        for row in rows
    )
    (folder / "rig_description" / "meshes" / "boom.stl").write_text(text)
    path = written(folder, BOX, mesh("../meshes/boom.stl", f'scale="{scale}"'))
    faults = visuals_of(path)[1]
    assert bool(faults) == bool(said)
    assert all(said in fault and "the machine 3." in fault for fault in faults)
    assert len(check_model(path)) == len(faults)


def test_colours_of_a_dae_are_kept_unless_the_model_says_another(folder: Path) -> None:
    meshes = folder / "rig_description" / "meshes"
    (meshes / "red.dae").write_text(dae("1 0 0 1"))
    (meshes / "two.dae").write_text(dae("1 0 0 1", "0 0 1 1"))
    path = written(
        folder,
        mesh("../meshes/red.dae"),
        mesh("../meshes/two.dae"),
        mesh("../meshes/red.dae") + '<material name="g"><color rgba="0 1 0 1"/></material>',
    )
    shapes, faults = visuals_of(path)
    assert faults == []
    red, blue, green = (1.0, 0.0, 0.0, 1.0), (0.0, 0.0, 1.0, 1.0), (0.0, 1.0, 0.0, 1.0)
    assert [shape.colour for shape in shapes] == [red, red, blue, green]
    assert all(isinstance(shape.shape, Mesh) for shape in shapes)


@pytest.mark.parametrize(
    "name", ["/etc/passwd", "file:///etc/hostname", "../secret.csv", "package://rig_description/k.txt", ""]
)
def test_only_mesh_files_are_opened(folder: Path, name: str) -> None:
    with pytest.raises(ModelError, match="no mesh file"):
        find_mesh(name, [folder])
    assert any("is no mesh file" in fault for fault in visuals_of(written(folder, mesh(name)))[1])


def test_a_pipe_a_folder_and_a_name_of_any_kind_are_no_mesh(folder: Path) -> None:
    import os

    os.mkfifo(folder / "pipe.stl")
    (folder / "folder.stl").mkdir()
    for name in ("pipe.stl", "folder.stl", "x" * 5000 + ".stl", "a\0b.stl", "package:///x.stl", "package://../x.stl"):
        assert find_mesh(name, [folder]).path is None
    with pytest.raises(ModelError, match="not on this machine"):
        find_mesh("https://example.org/x.stl", [folder])


def test_a_damaged_mesh_is_a_note(folder: Path) -> None:
    for name, content in (("empty.stl", b""), ("noise.dae", b"\x00\xff" * 99), ("text.obj", b"hello\n")):
        (folder / "rig_description" / "meshes" / name).write_bytes(content)
        faults = visuals_of(written(folder, BOX, mesh(f"../meshes/{name}")))[1]
        assert len(faults) == 1
        assert "link 'boom': a shape is not drawn" in faults[0]


# --- faults of looks ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("rgba", "colour", "words"),
    [
        ("0.5 0.5 0.5", (0.5, 0.5, 0.5, 1.0), "three numbers; it is drawn opaque"),
        ("255 128 0 1", (1.0, 1.0, 0.0, 1.0), "leaves 0 to 1"),
        ("0.5 0.5", None, "is no colour"),
        ("1 0 0 1 1", None, "is no colour"),
        ("", None, "is no colour"),
        ("0.1 0.2 0.3 0.4", (0.1, 0.2, 0.3, 0.4), ""),
    ],
)
def test_a_colour_is_drawn_as_far_as_it_says_one(rgba: str, colour: tuple[float, ...] | None, words: str) -> None:
    material = f'<material name="m"><color rgba="{rgba}"/></material>'
    for text in (boom(BOX + material), boom(BOX + '<material name="m"/>', top=material)):
        found, faults = link_visuals(read_model_text(text).root)
        (visual,) = found["boom"]
        assert visual.colour == (colour or (0.75, 0.76, 0.78, 1.0))
        assert [words in str(fault) and "'boom'" in str(fault) for fault in faults] == ([True] if words else [])


@pytest.mark.parametrize(
    ("visual", "words"),
    [
        ('<origin xyz="1 0"/>' + BALL, "xyz = '1 0' has two numbers, not three"),
        ('<origin xyz="1 0 0 0"/>' + BALL, "has four numbers, not three"),
        ('<origin xyz=""/>' + BALL, "has 0 numbers, not three"),
        ('<origin rpy="0.1"/>' + BALL, "rpy = '0.1' has one number, not three"),
        ('<origin quat_xyzw="0 0 0 2"/>' + BALL, "quaternion has the length 2"),
        ('<origin quat_xyzw="0 0 1"/>' + BALL, "has three numbers, not four"),
        ('<origin rpy="0 0 0" quat_xyzw="0 0 0 1"/>' + BALL, "turned twice"),
        ('<geometry><box size="1 2"/></geometry>', "has two numbers, not three"),
        ('<geometry><box size="1 0 1"/></geometry>', "no volume"),
        ('<geometry><sphere radius="-1"/></geometry>', "no length"),
        ('<geometry><sphere radius="1e300"/></geometry>', "is not one number"),
        ("<geometry><sphere/></geometry>", "has 0 numbers, not one"),
        ('<geometry><cylinder radius="1"/></geometry>', "length = '' has 0 numbers"),
        ('<geometry><ellipsoid size="1 1 1"/></geometry>', "no geometry <ellipsoid>"),
        ("<geometry/>", "no geometry"),
        ("", "no geometry"),
        (mesh("x.stl", 'scale="0.001"'), "has one number, not three"),
        (mesh("x.stl", 'scale="1 0 1"'), "scale of its mesh is zero"),
    ],
)
def test_a_shape_that_cannot_be_drawn_is_noted_with_its_link_and_the_others_are_drawn(visual: str, words: str) -> None:
    found, faults = link_visuals(read_model_text(boom(BOX, visual, BALL)).root)
    assert [type(shape.shape) for shape in found["boom"]] == [Box, Ball]
    (fault,) = faults
    assert words in str(fault)
    assert str(fault).startswith("link 'boom': a shape is not drawn, ")
    assert fault.source.line > 0


def test_a_quaternion_turns_a_shape_as_the_same_angles_do() -> None:
    half = np.sqrt(0.5)
    ways = [
        f'<origin xyz="1 2 3" {way}/>{BALL}'
        for way in ('rpy="0 0 1.5707963267948966"', f'quat_xyzw="0 0 {half} {half}"')
    ]
    by_angles, by_quaternion = link_visuals(read_model_text(boom(*ways)).root)[0]["boom"]
    np.testing.assert_allclose(by_angles.placement, by_quaternion.placement, atol=1e-15)


def test_a_material_that_nobody_describes_is_noted() -> None:
    faults = link_visuals(read_model_text(boom(BOX + '<material name="steel"/>')).root)[1]
    assert ["no material 'steel'" in str(fault) for fault in faults] == [True]


@pytest.mark.parametrize(
    "spoilt", ['<material name="grey"><color rgba="0.5 0.5 0.5"/></material>', '<origin xyz="1 0"/>']
)
def test_replay_report_and_check_go_on_where_looks_are_at_fault(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, spoilt: str
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "rig.urdf").write_text(boom(BOX, spoilt + BALL))
    simulate(load_rig("rig.urdf"), Scenario(duration=0.02)).save("a.nc")
    runner = CliRunner()
    for command in (["replay", "a.nc", "--html", "a.html"], ["report", "a.nc", "-o", "r.html"]):
        assert runner.invoke(app, command).exit_code == 0
    result = runner.invoke(app, ["check", "rig.urdf"])
    assert result.exit_code == 0
    assert "rig.urdf:6: warning: " in result.output
    assert "1 warning." in result.output


numbers = st.lists(st.sampled_from(["0", "1", "-1", "0.5", "1e9", "1e-9", "255"]), max_size=5).map(" ".join)


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow])
@given(xyz=numbers, rpy=numbers, quaternion=st.none() | numbers, size=numbers, rgba=numbers, scale=numbers)
def test_whatever_numbers_looks_have_the_machine_is_drawn_or_a_note_names_the_link(
    xyz: str, rpy: str, quaternion: str | None, size: str, rgba: str, scale: str
) -> None:
    turn = f'rpy="{rpy}"' if quaternion is None else f'quat_xyzw="{quaternion}"'
    origin, colour = f'<origin xyz="{xyz}" {turn}/>', f'<material name="m"><color rgba="{rgba}"/></material>'
    shapes = [
        f'<box size="{size}"/>',
        f'<cylinder radius="{size}" length="{xyz}"/>',
        f'<mesh filename="x.stl" scale="{scale}"/>',
    ]
    text = boom(*(f"{origin}<geometry>{shape}</geometry>{colour}" for shape in shapes))
    found, faults = link_visuals(read_model_text(text).root)
    drawn = found.get("boom", [])
    assert len(drawn) + sum(not fault.drawn for fault in faults) == len(shapes)
    for visual in drawn:
        assert np.isfinite(visual.placement).all()
        assert all(0.0 <= channel <= 1.0 for channel in visual.colour)
    assert all("'boom'" in str(fault) for fault in faults)


def test_a_text_without_a_folder_reads_no_file_of_the_working_directory(folder: Path) -> None:
    (Path.cwd() / "boom.stl").write_text(STL)
    text = boom(BOX, mesh("boom.stl"))
    run = simulate(load_rig_text(text), Scenario(duration=0.02))
    assert any("not found" in note for note in build_scene([run]).notes)
    assert any("not found" in problem.message for problem in check_text(text, "m.urdf"))
