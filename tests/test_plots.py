"""Figures are drawn for every kind of run, and only where there is something to show."""

from __future__ import annotations

from pathlib import Path

import pytest
from rigs import joint, link, mass_on_cylinder, robot

from drillrig_pin import ResultFileError, Rig, Scenario, load_rig_text, simulate
from drillrig_pin.plots import FIGURES, save_figures

PNG = b"\x89PNG\r\n\x1a\n"


def test_the_shipped_rig_has_every_figure(mkz49: Rig, tmp_path: Path) -> None:
    written = save_figures(simulate(mkz49, Scenario(duration=0.1)), tmp_path)
    assert [path.name for path in written] == [f"{name}.png" for name in FIGURES]
    for path in written:
        assert path.read_bytes().startswith(PNG)
    assert sorted(tmp_path.iterdir()) == sorted(written)


def test_a_machine_without_points_and_constraints_leaves_figures_out(tmp_path: Path) -> None:
    spinner = robot(link("wheel"), joint("axle", "continuous", "world", "wheel"))
    run = simulate(load_rig_text(spinner), Scenario(duration=0.05))
    assert {path.stem for path in save_figures(run, tmp_path)} == {"joints", "trust"}


def test_a_run_too_short_for_a_spectrum_leaves_it_out(tmp_path: Path) -> None:
    run = simulate(load_rig_text(mass_on_cylinder()), Scenario(duration=0.01))
    assert {path.stem for path in save_figures(run, tmp_path)} == {"joints", "survey_point", "cylinders", "trust"}


@pytest.mark.filterwarnings("error")
def test_a_run_at_rest_is_drawn_without_complaint(tmp_path: Path) -> None:
    run = simulate(load_rig_text(mass_on_cylinder()), Scenario(duration=0.1))
    assert len(save_figures(run, tmp_path)) == 5


def test_one_figure_by_name(mkz49: Rig, tmp_path: Path) -> None:
    run = simulate(mkz49, Scenario(duration=0.02))
    assert [path.name for path in save_figures(run, tmp_path, ["trust"])] == ["trust.png"]


def test_a_missing_folder_is_one_sentence(mkz49: Rig, tmp_path: Path) -> None:
    run = simulate(mkz49, Scenario(duration=0.02))
    with pytest.raises(ResultFileError, match="cannot be written"):
        save_figures(run, tmp_path / "nowhere", ["trust"])
