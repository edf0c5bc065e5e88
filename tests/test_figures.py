"""Figures are drawn for every kind of run, only where there is something to show, and lose no peak."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from rigs import joint, link, mass_on_cylinder, robot
from test_ur5 import EXTENSION, POSE, ur5_text

from drillrig_pin import ResultFileError, Rig, Scenario, Trajectory, load_rig_text, simulate
from drillrig_pin.analysis.measured import Measurement
from drillrig_pin.figures.printed import DOTS_PER_INCH, WIDTH, save_sheets
from drillrig_pin.figures.registry import FIGURES, sheets_of
from drillrig_pin.figures.sheet import Curve, Panel, Sheet
from drillrig_pin.figures.subject import subject_of
from drillrig_pin.figures.thin import thin, thin_path


def names(run: Trajectory) -> set[str]:
    return {sheet.name for sheet in sheets_of(subject_of(run))}


def sheet_of(run: Trajectory, name: str) -> Sheet:
    (sheet,) = sheets_of(subject_of(run), [name])
    return sheet


@pytest.fixture(scope="module")
def drilling(mkz49: Rig) -> Trajectory:
    return simulate(mkz49, Scenario(duration=0.5))


def test_the_shipped_rig_has_every_figure_but_that_of_a_measurement(drilling: Trajectory, tmp_path: Path) -> None:
    sheets = sheets_of(subject_of(drilling))
    assert [sheet.name for sheet in sheets] == [name for name in FIGURES if name != "measured"]
    written = save_sheets(sheets, tmp_path)
    assert sorted(tmp_path.iterdir()) == sorted(written)
    assert {path.suffix for path in written} == {".png", ".svg"}
    for path in written:
        if path.suffix == ".png":
            picture = Image.open(path)
            assert picture.width == round(WIDTH * DOTS_PER_INCH), "one column wide"
            assert len(set(picture.convert("L").resize((60, 60)).tobytes())) > 10, f"{path.name} is blank"
        else:
            assert path.read_text().count("<path") > 5


def test_every_panel_over_time_tells_its_unit(drilling: Trajectory) -> None:
    for sheet in sheets_of(subject_of(drilling)):
        for panel in sheet.panels:
            assert re.search(r"\[.+\]", panel.x_label), (sheet.name, panel.key)
            assert re.search(r"\[.+\]|/ h", panel.y_label), (sheet.name, panel.key)


def test_a_machine_without_points_and_constraints_leaves_figures_out() -> None:
    spinner = robot(link("wheel"), joint("axle", "continuous", "world", "wheel"))
    run = simulate(load_rig_text(spinner), Scenario(duration=0.05))
    assert names(run) == {"joints", "joint_spectra", "energy"}


def test_a_run_too_short_for_a_spectrum_leaves_it_out() -> None:
    run = simulate(load_rig_text(mass_on_cylinder()), Scenario(duration=0.01))
    assert not {"survey_spectrum", "joint_spectra"} & names(run)
    assert {"joints", "survey", "pressures", "cylinder_forces"} <= names(run)


@pytest.mark.filterwarnings("error")
def test_a_run_at_rest_is_drawn_without_complaint(tmp_path: Path) -> None:
    run = simulate(load_rig_text(mass_on_cylinder()), Scenario(duration=0.1))
    assert len(save_sheets(sheets_of(subject_of(run)), tmp_path, ["png"])) >= 5


@pytest.mark.filterwarnings("error")
def test_a_robot_without_cylinders_contact_and_loads_is_drawn(tmp_path: Path) -> None:
    rig = load_rig_text(ur5_text().replace("</robot>", EXTENSION + "</robot>"))
    sheets = sheets_of(subject_of(simulate(rig, Scenario(duration=0.3, positions=POSE))))
    assert {sheet.name for sheet in sheets} == {
        "joints", "survey", "path", "survey_spectrum", "joint_spectra", "reaction", "constraints", "energy",
    }  # fmt: skip
    assert not any(panel.marks for sheet in sheets for panel in sheet.panels), "nothing percusses"
    save_sheets(sheets, tmp_path)


def test_the_blows_and_their_harmonics_are_marked_in_the_spectra(drilling: Trajectory) -> None:
    for name in ("survey_spectrum", "joint_spectra"):
        for panel in sheet_of(drilling, name).panels:
            assert [mark.x for mark in panel.marks] == pytest.approx([48, 96, 144])
            assert [(band.low, band.high) for band in panel.bands] == [(0, 15), (15, 80)]


def test_pressures_are_drawn_absolute_with_both_limits(drilling: Trajectory) -> None:
    panel = sheet_of(drilling, "pressures").panels[0]
    assert [level.name for level in panel.levels] == ["gas release", "relief"]
    gauge = drilling.of("pressure_a", panel.key)
    np.testing.assert_allclose(panel.curves[0].y, (gauge + 101_325) / 1e5)


def test_one_figure_or_one_panel_by_name(drilling: Trajectory, tmp_path: Path) -> None:
    sheets = sheets_of(subject_of(drilling), ["energy", "joints.boom_lift"])
    assert [path.name for path in save_sheets(sheets, tmp_path, ["svg"])] == ["energy.svg", "joints.boom_lift.svg"]
    assert [len(sheet.panels) for sheet in sheets] == [3, 1]


@pytest.mark.parametrize(
    ("name", "words"),
    [("jonts", "'joints'"), ("joints.boom_lif", "'boom_lift'"), ("measured", "--measured")],
)
def test_a_figure_that_is_not_there_is_one_sentence_with_the_names_that_are(
    drilling: Trajectory, name: str, words: str
) -> None:
    with pytest.raises(ResultFileError, match=re.escape(words)):
        sheets_of(subject_of(drilling), [name])


def test_a_missing_folder_is_one_sentence(drilling: Trajectory, tmp_path: Path) -> None:
    with pytest.raises(ResultFileError, match="cannot be written"):
        save_sheets(sheets_of(subject_of(drilling), ["energy"]), tmp_path / "nowhere")


def test_a_window_cuts_time_and_leaves_frequencies(drilling: Trajectory) -> None:
    cut = sheet_of(drilling, "survey").between(0.2, 0.3)
    assert all(0.2 <= t <= 0.3 for panel in cut.panels for curve in panel.curves for t in curve.x)
    spectrum = sheet_of(drilling, "survey_spectrum")
    assert spectrum.between(0.2, 0.3) == spectrum
    assert not sheet_of(drilling, "survey").between(7, 8).panels


def test_names_of_a_model_cannot_choose_where_a_figure_goes(tmp_path: Path) -> None:
    panel = Panel("k", "t", "x [m]", "y [m]", (Curve("c", np.arange(3.0), np.arange(3.0)),))
    (path,) = save_sheets([Sheet("joints.../../etc", "t", "c", (panel,))], tmp_path, ["png"])
    assert path.parent == tmp_path


def test_names_of_a_model_are_not_read_as_formulas(tmp_path: Path) -> None:
    name = r"$\broken{_x$"
    panel = Panel("k", name, "x [m]", "y [m]", (Curve(name, np.arange(3.0), np.arange(3.0)),), note=name)
    save_sheets([Sheet("odd", name, name, (panel, panel))], tmp_path)


def test_ten_seconds_at_a_kilohertz_make_a_small_vector_figure(tmp_path: Path) -> None:
    time = np.arange(10_001) / 1000
    noise = np.random.default_rng(1).standard_normal((3, len(time)))
    panels = tuple(Panel(str(i), "noise", "time [s]", "y [m]", (Curve("y", time, y),)) for i, y in enumerate(noise))
    (path,) = save_sheets([Sheet("noise", "Noise", "", panels)], tmp_path, ["svg"])
    assert path.stat().st_size < 300_000


def test_thinning_keeps_every_peak_and_the_ends(rng: np.random.Generator) -> None:
    x, y = np.arange(10_000.0), rng.standard_normal(10_000)
    y[4321], y[8765] = 50.0, -60.0
    thin_x, thin_y = thin(x, y, 300)
    assert len(thin_x) <= 602
    assert (thin_x[0], thin_x[-1]) == (0.0, 9999.0)
    assert (np.diff(thin_x) > 0).all()
    np.testing.assert_array_equal(thin_y, y[thin_x.astype(int)])
    for part in np.split(np.arange(10_000), np.linspace(0, 10_000, 301).astype(int)[1:-1]):
        inside = thin_y[(thin_x >= part[0]) & (thin_x <= part[-1])]
        assert (inside.min(), inside.max()) == (y[part].min(), y[part].max())


def test_thinning_leaves_a_short_curve_alone_and_survives_what_is_not_finite() -> None:
    x = np.arange(10.0)
    assert thin(x, x, 5)[0] is x
    wild = np.full(1000, np.nan)
    wild[500] = np.inf
    assert len(thin(np.arange(1000.0), wild, 10)[0]) <= 22


def test_a_path_that_repeats_itself_is_drawn_once() -> None:
    angle = np.arange(100_000) / 1000 * 2 * np.pi
    x, y = thin_path(np.cos(angle), np.sin(angle))
    assert len(x) < 2500
    drawn = np.isfinite(x)
    np.testing.assert_allclose(np.hypot(x[drawn], y[drawn]), 1.0)
    assert (np.ptp(x[drawn]), np.ptp(y[drawn])) == pytest.approx((2, 2))


def test_a_gap_of_a_measurement_is_no_line_and_not_where_the_close_up_looks(drilling: Trajectory) -> None:
    z, there = drilling.of("point_displacement", "S", "z"), (drilling.time < 0.2) | (drilling.time > 0.3)
    gauge = Measurement(drilling.time[there], z[there], "gauge.csv")
    (sheet,) = sheets_of(subject_of(drilling, measurement=gauge, measured_shift=0.0), ["measured"])
    signals, close_up, difference = sheet.panels
    for curve in (signals.curves[0], difference.curves[0]):
        assert np.isnan(curve.y).sum() == 1
        assert 0.2 < curve.x[np.isnan(curve.y)][0] < 0.3
    assert len(close_up.curves[0].x) > 5
    assert "gaps of the measurement are left out: 1" in sheet.caption
