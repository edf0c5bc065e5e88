"""A number whose unit slipped is named with the unit that would fit, wherever it is used; nothing is refused."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from command import Command
from hypothesis import given, settings
from hypothesis import strategies as st
from rigs import joint, link, robot

from drillrig_pin import Scenario, load_rig, load_rig_text, simulate
from drillrig_pin.check import check_model, check_text
from drillrig_pin.elements.registry import FORCES
from drillrig_pin.plausible import SLIPS, implausible, plausible_ranges

GOOD = {
    "bore": 0.08, "rod": 0.05, "length_retracted": 0.5, "dead_length_a": 0.05, "dead_length_b": 0.05,
    "bulk_modulus": 1.6e9, "precharge": 5e5, "relief_pressure": 2.1e7,
}  # fmt: skip


def machine(**changed: float) -> str:
    """A boom of 200 kg carried by one cylinder."""
    numbers = " ".join(f'{name}="{value!r}"' for name, value in (GOOD | changed).items())
    return f"""<robot name="case"><link name="world"/>
  <link name="boom"><inertial><origin xyz="1.0 0 0"/><mass value="200.0"/>
  <inertia ixx="1" ixy="0" ixz="0" iyy="60" iyz="0" izz="60"/></inertial></link>
  <joint name="lift" type="revolute"><parent link="world"/><child link="boom"/><origin xyz="0 0 0" rpy="0 0 0"/>
  <axis xyz="0 -1 0"/><limit lower="-100" upper="100" effort="1e9" velocity="1e9"/></joint>
  <drillrig><gravity xyz="0 0 -9.81"/><point name="base" link="world" xyz="0.5 0 -0.7"/>
  <point name="eye" link="boom" xyz="0.5 0 0"/><cylinder name="c" from="base" to="eye" {numbers}/></drillrig></robot>"""


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"bore": 80.0, "rod": 50.0}, ("bore = 80 m, plausible 0.01 to 0.5 m: did you mean 80 mm?", "rod = 50 m")),
        ({"bulk_modulus": 1.6}, ("bulk_modulus = 1.6 Pa", "did you mean 1.6 GPa?")),
        ({"bulk_modulus": 1600.0}, ("bulk_modulus = 1600 Pa", "did you mean 1600 MPa?")),
        ({"precharge": 5.0}, ("precharge = 5 Pa", "did you mean 5 bar?")),
        ({"relief_pressure": 210.0}, ("relief_pressure = 210 Pa", "did you mean 210 bar?")),
    ],
)
def test_cylinder_whose_unit_slipped(changed: dict[str, float], words: tuple[str, ...]) -> None:
    text = machine(**changed)
    found = [problem for problem in check_text(text, "case.urdf") if problem.severity == "warning"]
    for word in words:
        hit = [problem for problem in found if word in problem.message]
        assert hit
        assert hit[0].source.line == 7
    notes = simulate(load_rig_text(text), Scenario(model="case", duration=0.001, output_rate=1000)).notes
    assert all(any(word in note for note in notes) for word in words)


def test_plausible_cylinder_is_not_named() -> None:
    assert implausible(load_rig_text(machine())) == []


def test_nothing_of_the_shipped_machine_is_implausible() -> None:
    assert implausible(load_rig("mkz49")) == []


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("boom_swing_bore", 80, "boom_swing_bore = 80 m, sensible 0.063 to 0.1 m: did you mean 80 mm?"),
        ("bulk_modulus", 2850, "did you mean 2850 MPa?"),
        ("rock_stiffness", 3, "did you mean 3 MN/m?"),
        ("percussion_frequency", 2880, "did you mean 2880 per minute?"),
        ("load_ramp", 400, "ramp = 400 s"),
        ("force_mean", 9, "did you mean 9 kN?"),
        ("boom_lift_precharge", 50, "did you mean 50 bar?"),
        ("torque_mean", 0.35, "did you mean 0.35 kN*m?"),
    ],
)
def test_argument_of_the_shipped_machine(drillrig: Command, name: str, value: float, words: str) -> None:
    answer = drillrig("check", "mkz49", "--set", f"model.{name}={value}")
    assert answer.code == 0
    assert words in " ".join(answer.out.split())


def test_run_and_report_say_it(drillrig: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    answer = drillrig(
        "run", "--set", "model.boom_swing_bore=80", "--set", "scenario.duration=0.02", "--no-estimate", "-o", "run.nc"
    )
    words = "did you mean 80 mm?"
    assert words in " ".join(answer.out.split())
    assert drillrig("report", "run.nc", "-o", "report.html").code == 0
    assert words in Path("report.html").read_text()


def test_value_inside_its_range_is_not_named() -> None:
    assert implausible(load_rig("mkz49", boom_swing_bore=0.1, bulk_modulus=7e8)) == []


def test_machine_in_millimetres() -> None:
    text = robot(link("b", mass=5.0), joint("j", "revolute", "world", "b", xyz=(0, 0, 1940)))
    (found,) = implausible(load_rig_text(text))
    assert "'j'" in found.message
    assert "did you mean 1940 mm?" in found.message


@pytest.mark.parametrize(("mass", "said"), [(150.0, False), (150e3, True), (0.15, False), (1e-3, True)])
def test_density_of_a_box(mass: float, said: bool) -> None:
    box = '<visual><geometry><box size="1 0.2 0.1"/></geometry></visual>'
    text = robot(link("b", mass=mass).replace("<inertial>", box + "<inertial>"), joint("j", "revolute", "world", "b"))
    # 0.02 m^3: 7500, 7.5 million, 7.5 and 0.05 kg/m^3.
    assert any("kg/m^3" in problem.message for problem in implausible(load_rig_text(text))) == said


def test_ranges_name_fields_that_there_are() -> None:
    from drillrig_pin.elements.loads import LAWS, Term

    classes = {**FORCES, **LAWS, "term": Term}
    for name, known in plausible_ranges().items():
        tag, _, field = name.partition(".")
        assert known.low < known.high
        assert known.source.startswith(("assumed: ", "derived: "))
        if tag in classes:
            unit = classes[tag].model_fields[field].json_schema_extra["unit"]  # type: ignore[index, call-overload]
            assert known.unit in unit.split(" or ")
        else:
            assert tag in ("gravity", "point", "joint", "link")


SLIPPING = [(field, name, size) for field in GOOD for name, size in SLIPS[plausible_ranges()[f"cylinder.{field}"].unit]]


@settings(max_examples=60, deadline=None)
@given(slip=st.sampled_from(SLIPPING), share=st.floats(0, 1))
def test_any_slip_beyond_the_range_is_named_with_a_unit_that_fits(slip: tuple[str, str, float], share: float) -> None:
    field, _, size = slip
    known = plausible_ranges()[f"cylinder.{field}"]
    value = known.low * (known.high / known.low) ** share / size
    found = [p.message for p in check_text(machine(**{field: value}), "case.urdf") if f": {field} = " in p.message]
    outside = not known.low * (1 - 1e-9) <= value <= known.high * (1 + 1e-9)
    # An impossible machine (a rod thicker than its bore) is an error of its own, and is not looked at further.
    if any(problem.severity == "error" for problem in check_text(machine(**{field: value}), "case.urdf")):
        return
    assert bool(found) == outside or math.isclose(value, known.low) or math.isclose(value, known.high)
    if found:
        assert "did you mean" in found[0]


def test_findings_of_a_file_keep_their_line(tmp_path: Path) -> None:
    path = tmp_path / "case.urdf"
    path.write_text(machine(bore=80.0))
    (problem,) = [p for p in check_model(path) if "did you mean" in p.message]
    assert (Path(problem.source.file).name, problem.source.line) == ("case.urdf", 7)
