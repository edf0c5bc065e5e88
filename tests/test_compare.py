"""Runs beside each other: a known change is found, named, signed and sorted; different machines are said to be so."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command import Command, one_sentence
from rigs import mass_on_cylinder
from test_ur5 import EXTENSION, POSE, ur5_text

from drillrig_pin import Rig, Scenario, Trajectory, load_rig, load_rig_text, simulate
from drillrig_pin.analysis.comparison import Comparison, Row, compare_runs
from drillrig_pin.analysis.differences import differences
from drillrig_pin.figures.overlay import overlay
from drillrig_pin.figures.registry import sheets_of
from drillrig_pin.figures.subject import subject_of

CASE = Scenario(duration=0.5)


@pytest.fixture(scope="module")
def drilling(mkz49: Rig) -> Trajectory:
    return simulate(mkz49, CASE)


@pytest.fixture(scope="module")
def longer() -> Trajectory:
    return simulate(load_rig("mkz49", boom_length=2.1), CASE)


@pytest.fixture(scope="module")
def robot_arm() -> Trajectory:
    rig = load_rig_text(ur5_text().replace("</robot>", EXTENSION + "</robot>"))
    return simulate(rig, Scenario(duration=0.3, positions=POSE))


def row(found: Comparison, key: str) -> Row:
    (only,) = (row for row in found.rows if row.reference.key == key)
    return only


def scaled(run: Trajectory, variable: str, factor: float) -> Trajectory:
    return replace(run, arrays={**run.arrays, variable: factor * run.arrays[variable]})


def test_a_run_is_the_same_as_itself(drilling: Trajectory) -> None:
    found = compare_runs([drilling, drilling])
    assert found.rows
    assert not any(row.changed for row in found.rows)
    assert found.differences == found.missing == found.cautions == ()


def test_a_known_change_is_measured_signed_and_comes_first(drilling: Trajectory) -> None:
    found = compare_runs([drilling, scaled(drilling, "point_displacement", 1.5)])
    assert found.rows[0].changed
    (change,) = row(found, "S.y.rms").changes
    assert change.relative == pytest.approx(0.5)
    assert change.absolute == pytest.approx(0.5 * row(found, "S.y.rms").reference.value)
    assert change.verdict == "worse"
    changed = {row.reference.key.split(".")[0] for row in found.rows if row.changed}
    assert changed == {"S"}, "nothing else moved"
    (back,) = row(compare_runs([scaled(drilling, "point_displacement", 1.5), drilling]), "S.y.rms").changes
    assert (back.verdict, back.relative) == ("better", pytest.approx(-1 / 3))


def test_a_higher_lowest_pressure_is_better_and_a_frequency_is_neither(drilling: Trajectory) -> None:
    arrays = {**drilling.arrays, "pressure_a": drilling.pressure_a + 3e5, "pressure_b": drilling.pressure_b + 3e5}
    found = compare_runs([drilling, replace(drilling, arrays=arrays)])
    assert row(found, "lift_cylinder.p_min").changes[0].verdict == "better"
    assert row(found, "lift_cylinder.p_max").changes[0].verdict == "worse"
    assert row(found, "frequency.strongest").reference.better == ""


def test_the_order_is_by_importance_then_size(drilling: Trajectory, longer: Trajectory) -> None:
    found = compare_runs([drilling, longer])
    changed = [row for row in found.rows if row.changed]
    assert found.rows[: len(changed)] == tuple(changed)
    groups = [row.reference.group for row in changed]
    assert groups[0] == "hole"
    assert groups == sorted(groups, key=list(dict.fromkeys(groups)).index)
    for group in set(groups):
        sizes = [row.size for row in changed if row.reference.group == group]
        assert sizes == sorted(sizes, reverse=True)


def test_the_parameter_that_was_changed_is_named_and_its_consequences_are_told_apart(
    drilling: Trajectory, longer: Trajectory
) -> None:
    found = differences([drilling, longer])
    (parameter,) = (d for d in found if d.kind == "parameter")
    assert (parameter.name, parameter.values, parameter.unit) == ("boom_length", ("1.94", "2.1"), "m")
    assert {d.kind for d in found} == {"parameter", "model"}


def test_a_model_without_parameters_shows_the_attribute_itself() -> None:
    one, other = mass_on_cylinder(), mass_on_cylinder().replace('bore="0.063"', 'bore="0.08"')
    runs = [simulate(load_rig_text(text), Scenario(duration=0.05)) for text in (one, other)]
    (difference,) = differences(runs)
    assert difference.kind == "model"
    assert difference.name.endswith("cylinder oil bore")
    assert difference.values == ("0.063", "0.08")


def test_fields_of_the_scenario_and_versions_are_compared(mkz49: Rig, drilling: Trajectory) -> None:
    other = simulate(mkz49, CASE.changed({"integrator.rtol": 1e-9, "name": "another", "loads": "none"}))
    other = replace(other, made_with={**other.made_with, "scipy": "1.0"})
    found = {(d.kind, d.name): d.values for d in differences([drilling, other])}
    assert found["scenario", "integrator.rtol"] == ("1e-08", "1e-09")
    assert found["scenario", "loads"] == ("all", "none")
    assert found["software", "scipy"][1] == "1.0"
    assert ("scenario", "name") not in found


def test_three_runs_are_held_against_the_first(drilling: Trajectory) -> None:
    runs = [drilling, *(scaled(drilling, "point_displacement", f) for f in (2.0, 0.5))]
    changes = row(compare_runs(runs), "S.x.peak_to_peak").changes
    assert [change.relative for change in changes] == pytest.approx([1.0, -0.5])


def test_different_machines_are_compared_as_far_as_that_goes(drilling: Trajectory, robot_arm: Trajectory) -> None:
    found = compare_runs([drilling, robot_arm])
    assert found.machines == ("mkz49", "ur5")
    assert any("different machines" in caution for caution in found.cautions)
    assert any("Toe offset" in label for label in found.missing)
    assert {row.reference.group for row in found.rows} <= {"forces", "frequencies", "trust", "cost"}


def test_figures_lie_over_each_other_in_one_unit(drilling: Trajectory) -> None:
    small = scaled(scaled(drilling, "point_displacement", 1e-3), "cylinder_force", 1e-3)
    runs = [(name, sheets_of(subject_of(run))) for name, run in (("a", drilling), ("b", small))]
    sheets = {sheet.name: sheet for sheet in overlay(runs)}
    assert set(sheets) == {sheet.name for sheet in runs[0][1]}
    panel = sheets["survey"].panels[2]
    assert panel.y_label == "z [mm]"
    first, second = panel.curves
    assert (first.name, second.name) == ("a", "b")
    np.testing.assert_allclose(second.y, 1e-3 * first.y, rtol=1e-12)
    force = sheets["cylinder_forces"].panels[0]
    np.testing.assert_allclose(force.curves[1].y, 1e-3 * force.curves[0].y, rtol=1e-12)


def test_figures_of_different_machines_share_what_both_have(drilling: Trajectory, robot_arm: Trajectory) -> None:
    runs = [(name, sheets_of(subject_of(run))) for name, run in (("a", drilling), ("b", robot_arm))]
    assert {sheet.name for sheet in overlay(runs)} >= {"reaction", "energy", "constraints"}
    assert "pressures" not in {sheet.name for sheet in overlay(runs)}


def test_the_command_prints_writes_and_draws(drillrig: Command) -> None:
    drillrig("run", "--set", "scenario.duration=0.1", "-q", "-o", "a.nc")
    drillrig("run", "--set", "scenario.duration=0.1", "--set", "model.boom_length=2.1", "-q", "-o", "b.nc")
    answer = drillrig("compare", "a.nc", "b.nc", "-o", "both")
    assert answer.code == 0
    assert "boom_length" in answer.out
    assert "worse" in answer.out
    assert Path("both/survey.png").exists()
    assert Path("both/survey.svg").exists()
    document = drillrig("compare", "a.nc", "b.nc", "--json").document
    assert document["differences"][0]["name"] == "boom_length"
    assert document["changes"][0]["runs"][0]["verdict"] in ("better", "worse")
    assert "No number changed" in drillrig("compare", "a.nc", "a.nc").out
    one_sentence(drillrig("compare", "a.nc"), "a.nc")
    one_sentence(drillrig("compare", "a.nc", "c.nc"), "c.nc")
