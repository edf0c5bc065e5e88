"""Study reports: what the page says and shows for studies of every shape, and that each case opens in replay."""

from __future__ import annotations

import json
import re
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rigs
from browser import Watched, chromium
from command import Command
from processes import PATIENCE
from test_ur5 import EXTENSION, POSE, ur5_text

from drillrig_pin.analysis.quantities import label_of
from drillrig_pin.analysis.shares import motion_shares
from drillrig_pin.batch.again import other_holes, recall
from drillrig_pin.batch.importance import Analysed, Index, Parameter, Sensitivity
from drillrig_pin.batch.runner import run_study
from drillrig_pin.batch.study import Study
from drillrig_pin.batch.table import read_table
from drillrig_pin.batch.worker import COMPLETED
from drillrig_pin.errors import ResultFileError
from drillrig_pin.rig import load_rig, load_rig_text
from drillrig_pin.scenario import Scenario
from drillrig_pin.simulation import simulate
from drillrig_pin.studyreport.content import gather
from drillrig_pin.studyreport.effects import effects_of
from drillrig_pin.studyreport.pictures import pictures
from drillrig_pin.studyreport.ranking import cases_data, rerun_command
from drillrig_pin.studyreport.subject import read_subject
from drillrig_pin.studyreport.write import write_study_report
from drillrig_pin.trajectory import load_trajectory

SHORT = {"scenario.duration": 0.25}
METRICS = ["S.across.rms", "*.share", "*.p_max", "*.p_min", "hole.*.worst", "trust.*"]
HOLES = {
    "left": {"at": [4.048, 0.795, 1.757], "source": "assumed: for the test"},
    "far": {"at": [4.048, 0.2, 4.4]},
    "printed": {"pose": "hole_9", "source": "paper"},
}


@pytest.fixture(scope="module")
def face(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three holes, one of them out of reach, over two tolerances; the worst case kept."""
    folder = tmp_path_factory.mktemp("face")
    study = Study(
        name="<b>holes</b>",
        set=SHORT,
        axes=[
            {"holes": {"fixed": ["head_rotation"], "places": HOLES}},
            {"name": "scenario.integrator.rtol", "list": [1e-7, 1e-8]},
        ],
        metrics=METRICS,
    )
    run_study(study, folder, workers=1, keep="worst:1")
    return folder


@pytest.fixture(scope="module")
def grid(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Durations by sampling rates."""
    folder = tmp_path_factory.mktemp("grid")
    axes = [{"grid": {"scenario.duration": [0.1, 0.2, 0.3], "scenario.output_rate": [500, 1000]}}]
    run_study(Study(name="grid", axes=axes, metrics=["S.across.rms", "*.p_max"]), folder, workers=1)
    return folder


@pytest.fixture(scope="module")
def page(face: Path) -> Iterator[tuple[Watched, Path]]:
    """The report of the holes in a browser."""
    written = write_study_report(face, face / "page.html", animations=True)
    with chromium() as watched:
        watched.page.goto(written.page.as_uri())
        watched.page.wait_for_function(
            "document.documentElement.dataset.drawn === 'S.across.rms'", timeout=PATIENCE * 1e3
        )
        yield watched, written.page


def test_shares_of_all_elements_add_up_to_the_whole_vibration() -> None:
    rig = load_rig("mkz49")
    trajectory = simulate(rig, Scenario(duration=0.3))
    shares = motion_shares(trajectory, rig, "S", slice(100, None), (1.0, 0.0, 0.0))
    # What is left over is of second order in the deviations.
    assert sum(share.share for share in shares) == pytest.approx(1.0, abs=1e-4)


def test_shares_of_two_springs_in_series_are_those_of_their_own_lengths() -> None:
    springs = "".join(
        f'<joint_spring name="spring_{name}" joint="slide_{name}" stiffness="{k}" rest="{rest}"/>\n'
        for name, k, rest in (("a", 500.0, 0.05), ("b", 2000.0, -0.02))
    )
    rig = rigs.rig(
        rigs.link("one"),
        rigs.link("two"),
        rigs.joint("slide_a", "prismatic", "world", "one", axis=(1, 0, 0)),
        rigs.joint("slide_b", "prismatic", "one", "two", axis=(1, 0, 0)),
        extension=rigs.point("end", "two") + springs,
    )
    trajectory = simulate(rig, Scenario(duration=1.0))
    a, b = (trajectory.of("element_coordinate", f"spring_{name}") for name in "ab")
    u = (a + b) - (a + b).mean()
    found = {share.element: share.share for share in motion_shares(trajectory, rig, "end", slice(None))}
    assert found["spring_a"] == pytest.approx(np.mean(u * (a - a.mean())) / np.mean(u**2), rel=1e-9)
    assert found["spring_b"] == pytest.approx(np.mean(u * (b - b.mean())) / np.mean(u**2), rel=1e-9)


def test_an_arm_on_one_spring_owes_it_only_the_motions_it_carries() -> None:
    rig = load_rig_text(ur5_text().replace("</robot>", EXTENSION + "</robot>"))
    trajectory = simulate(rig, Scenario(duration=0.3, positions=POSE))
    (cord,) = motion_shares(trajectory, rig, "tool", slice(None))
    assert cord.element == "cord"
    assert 0.0 < cord.rms < 1.0
    assert np.isfinite(cord.share)


def test_every_case_is_recalled_with_the_content_the_table_recorded(face: Path) -> None:
    table = read_table(face)
    kept = set(table.kept)
    for case in (case for case in table.cases if table.row(case)["status"] == COMPLETED):
        found = recall(table, case)
        assert found.same
        assert found.computed == (case not in kept)
        assert found.path is not None
        assert found.path.is_file()
    with pytest.raises(ResultFileError, match=r"stays .* off"):
        recall(table, next(case for case in table.cases if table.row(case)["status"] == "unreachable"))
    with pytest.raises(ResultFileError, match="no case 99"):
        recall(table, 99)


def test_a_case_that_cannot_be_kept_is_shown_all_the_same(grid: Path) -> None:
    table = read_table(grid)
    found = recall(table, 1, keep=False)
    assert found.path is None
    assert found.computed
    assert found.same


def test_the_printed_command_reruns_the_case(drillrig: Command, face: Path, tmp_path: Path) -> None:
    subject = read_subject(face)
    data = cases_data(gather(subject), {})
    i = subject.table.statuses["completed"] and data["status"].index("completed")
    words = shlex.split(f"{rerun_command(subject)} {data['settings'][i]}")
    assert words[0] == "drillrig"
    target = tmp_path / "again.nc"
    assert drillrig(*words[1:], "-o", str(target), "--quiet").code == 0
    assert load_trajectory(target).content_hash == subject.table.columns["content_hash"][i]


def test_replay_draws_the_other_holes_of_the_study(face: Path) -> None:
    table = read_table(face)
    places = other_holes(table, 0)
    assert len(places) == 2
    assert places[0] == (4.048, 0.2, 4.4)
    assert places[1] == pytest.approx((4.0478, 0.1945, 1.0072), abs=1e-3)


def test_replay_of_a_study_opens_the_worst_case_and_any_other(drillrig: Command, face: Path, tmp_path: Path) -> None:
    target = tmp_path / "case.html"
    worst = drillrig("replay", str(face), "--html", str(target))
    assert worst.code == 0
    assert "worst case" in worst.err
    assert drillrig("replay", str(face), "--case", "0", "--html", str(target)).code == 0
    assert "left" in target.read_text()
    wrong = drillrig("replay", str(next((face / "trajectories").glob("*.nc"))), "--case", "1")
    assert wrong.code == 1
    assert "--case" in wrong.err


def test_effects_average_over_the_other_axes(grid: Path) -> None:
    subject = read_subject(grid)
    effects = {effect.axis.name: effect for effect in effects_of(subject, "S.across.rms")}
    columns = subject.table.columns
    values = np.array(columns["S.across.rms"])
    for name, effect in effects.items():
        for stage in effect.stages:
            chosen = values[np.array(columns[name]) == stage.at]
            assert stage.count == len(chosen)
            assert stage.mean == pytest.approx(chosen.mean())
            assert (stage.least, stage.greatest) == pytest.approx((chosen.min(), chosen.max()))
    assert effects["scenario.duration"].swing > effects["scenario.output_rate"].swing


def test_what_random_samples_show_by_chance_is_said_to_be_chance() -> None:
    from drillrig_pin.studyreport.effects import _effect
    from drillrig_pin.studyreport.subject import StudyAxis

    axis = StudyAxis("x", "x", "", 1.0, "", log=False, words=False, count=800)
    x, noise = np.random.default_rng(4).standard_normal((2, 800))
    without, with_ = _effect(axis, list(x), noise), _effect(axis, list(x), noise + x)
    assert without.swing < without.chance
    assert with_.swing > 3 * with_.chance
    assert sum(stage.count for stage in with_.stages) == 800


def test_a_grid_becomes_a_heat_map_with_every_case_in_its_cell(grid: Path) -> None:
    subject = read_subject(grid)
    (trace,) = pictures(subject, "S.across.rms")["plane"]["data"]
    assert trace["type"] == "heatmap"
    for y, row in enumerate(trace["customdata"]):
        for x, case in enumerate(row):
            assert trace["z"][y][x] == pytest.approx(1e3 * subject.table.row(case)["S.across.rms"], rel=1e-5)
            assert trace["x"][x] == f"{subject.table.row(case)['scenario.duration']:g}"


def test_the_summary_names_worst_hole_blamed_cylinder_reach_and_assumptions(face: Path) -> None:
    content = gather(read_subject(face))
    words = " ".join(content.sentences)
    subject = content.subject
    assert subject.face is not None
    worst = subject.face.drilled[0]
    assert f"{worst.name} is the worst" in words
    leading = worst.leading(subject.face.cylinders)
    assert leading is not None
    assert leading[0] in words
    assert "Out of reach: far" in words
    assert "1 of 3 hole positions" in words
    assert re.search(r"\d+ of \d+ numbers of the model", words)
    (failure,) = content.failures
    assert failure.status == "unreachable"
    assert "upper limit" in failure.reason
    assert len(failure.cases) == 2


def test_limits_given_judge_the_cases(face: Path) -> None:
    from drillrig_pin.analysis.limits import read_limits
    from drillrig_pin.analysis.verdict import Level

    strict = gather(read_subject(face, limits=read_limits(settings=["toe_6m=0.01mm"])))
    judged = [strict.judgements[case] for case, _ in strict.subject.table.values("S.across.rms")]
    assert all(found.level is Level.BAD and "hole.toe_6m.worst" in found.metrics for found in judged)


def test_labels_of_metrics_read_as_words() -> None:
    assert label_of("S.across.rms") == "S across the hole, RMS"
    assert label_of("hole.toe_6m.worst") == "Toe offset at 6 m, at worst"
    assert label_of("tip.greatest", "N m") == "tip, greatest moment"
    assert label_of("unheard_of") == "unheard_of"


def test_sensitivity_indices_are_shown_with_their_confidence(grid: Path, tmp_path: Path) -> None:
    indices = tuple(
        Index("S.across.rms", "m", f"scenario.{name}", rank, value, 0.1, True, True,
              S1=value / 2, S1_conf=0.1, ST=value, ST_conf=0.1)
        for rank, (name, value) in enumerate((("duration", 0.9), ("output_rate", 0.2)), 1)
    )  # fmt: skip
    analysed = Analysed("S.across.rms", "m", 8, 1e-3, 5e-4, 2e-3, "duration matters most.")
    parameters = (Parameter("scenario.duration", 0.1, 0.3), Parameter("scenario.output_rate", 500, 1000))
    rest = {"study": "grid", "text": "", "method": "sobol", "seed": 1, "confidence": 0.95, "over": "", "conditions": 1}
    counts = {"designs": 32, "blocks": 8, "failed": 0, "metric": "S.across.rms"}
    Sensitivity(**rest, **counts, parameters=parameters, indices=indices, metrics=(analysed,)).save(grid)
    try:
        subject = read_subject(grid)
        alone, total = pictures(subject, "S.across.rms")["importance"]["data"]
        assert total["y"][-1] == "duration"
        assert total["x"][-1] == 0.9
        assert total["error_x"]["array"] == [0.1, 0.1]
        assert alone["x"] == [0.1, 0.45]
        assert "duration matters most." in gather(subject).sentences
        assert "95 % confidence" in write_study_report(grid, tmp_path / "s.html").page.read_text()
    finally:
        (grid / "sensitivity.json").unlink()


@pytest.mark.parametrize(
    ("axes", "words"),
    [([], "S across the hole, RMS: "), ([{"name": "model.boom_lift_pin_to_z", "list": [0.4]}], "None of the 1 cases")],
)
def test_single_and_failed_studies_have_a_report_too(
    drillrig: Command, tmp_path: Path, axes: list[Any], words: str
) -> None:
    run_study(Study(set=SHORT, axes=axes, metrics=["S.across.rms"]), tmp_path, workers=1)
    result = drillrig("sweep-report", str(tmp_path))
    assert result.code == 0
    assert result.out.startswith(words)
    assert (tmp_path / "report.html").stat().st_size > 1e6


def test_the_command_says_what_is_wrong(drillrig: Command, grid: Path, tmp_path: Path) -> None:
    assert "results.parquet" in drillrig("sweep-report", str(tmp_path)).err
    assert "no metric 'S.rms'" in drillrig("sweep-report", str(grid), "--metric", "S.rms").err
    found = json.loads(drillrig("sweep-report", str(grid), "--json", "-o", str(tmp_path / "page.html")).out)
    assert found["metric"] == "S.across.rms"
    assert Path(found["report"]).is_file()


def test_the_picture_of_the_face_is_written_for_print(face: Path, tmp_path: Path) -> None:
    written = write_study_report(face, tmp_path / "page.html", figures=tmp_path)
    assert [path.name for path in written.pictures] == ["face.png", "face.svg"]
    assert (tmp_path / "face.svg").read_text().count("<path") > 50


def test_the_page_asks_nobody_and_draws_everything(page: tuple[Watched, Path]) -> None:
    watched, target = page
    assert not watched.errors
    assert not watched.outside
    assert "<b>holes</b>" not in target.read_text()
    drawn = watched.page.evaluate("[...document.querySelectorAll('.plot')].map((p) => Boolean(p._fullLayout))")
    assert drawn
    assert all(drawn)
    assert watched.page.locator("#ranking-table tbody tr").count() == 6


def test_another_metric_redraws_and_ranks_anew(page: tuple[Watched, Path]) -> None:
    browser = page[0].page
    browser.select_option("#metric", "lift_cylinder.p_min")
    browser.wait_for_function(
        "document.documentElement.dataset.drawn === 'lift_cylinder.p_min'", timeout=PATIENCE * 1e3
    )
    column = browser.locator("#ranking-table tbody tr td:nth-child(4)").all_inner_texts()
    values = [float(text.replace("−", "-")) for text in column if text != "–"]
    assert values == sorted(values)
    assert "lowest pressure" in browser.locator("#effects-title").inner_text()
    browser.select_option("#metric", "S.across.rms")


def test_a_row_shows_how_its_case_is_opened_and_the_filter_finds_it(page: tuple[Watched, Path]) -> None:
    browser, target = page[0].page, page[1]
    browser.fill("#find", "hole=printed integrator.rtol<5e-8")
    assert browser.locator("#ranking-table tbody tr").count() == 1
    browser.locator("#ranking-table tbody tr").first.click()
    told = browser.locator("#case").inner_text()
    assert f"drillrig replay {target.parent} --case 5" in told
    assert "--set scenario.integrator.rtol=1e-08" in told
    browser.fill("#find", "unreachable")
    assert browser.locator("#ranking-table tbody tr").count() == 2
    links = json.loads(browser.locator("#study-data").text_content() or "")["links"]
    kept = [link for link in links if "animation" in link]
    assert kept
    assert all((target.parent / link["animation"]).is_file() for link in kept)
