"""What the server makes of a result is what the command line makes of it; a fault comes back as a problem."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest
import scipy.io

from drillrig_pin import Scenario, load_rig, load_trajectory, simulate
from drillrig_pin.batch.runner import run_study
from drillrig_pin.batch.study import Study
from drillrig_pin.errors import ResultFileError
from drillrig_pin.model.modelfile import read_model_text
from drillrig_pin.service import rendering
from drillrig_pin.service.problems import ServiceError
from drillrig_pin.service.settings import Limits


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("rendering") / "run.nc"
    simulate(load_rig("mkz49"), Scenario(duration=0.3)).save(path)
    return path


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("study")
    axes = [{"name": "scenario.velocities.boom_swing", "list": [0.0, 0.01]}]
    asked = Study(axes=axes, set={"scenario.duration": 0.1}, metrics=["S.*.rms"])
    run_study(asked, folder, workers=1)
    return folder


def test_tables_hold_the_run(run: Path, tmp_path: Path) -> None:
    rendering.csv(run, tmp_path / "run.csv")
    rendering.mat(run, tmp_path / "run.mat")
    samples = len(load_trajectory(run).time)
    rows = list(csv.reader((tmp_path / "run.csv").open()))
    assert sum(1 for row in rows if row and row[0][:1].isdigit()) == samples
    assert scipy.io.loadmat(tmp_path / "run.mat")["q"].shape[0] == samples


def test_figures_are_listed_drawn_and_an_unknown_one_is_not_found(run: Path, tmp_path: Path) -> None:
    listed = rendering.figure_list(run)
    assert all(entry["title"] and entry["caption"] for entry in listed)
    drawn = rendering.figure(run, listed[0]["name"], "svg", tmp_path / "figures")
    assert "<svg" in (tmp_path / "figures" / drawn).read_text()
    with pytest.raises(ServiceError) as found:
        rendering.figure(run, "nowhere", "svg", tmp_path)
    assert found.value.status == 404


def test_pages_are_written_whole(run: Path, tmp_path: Path) -> None:
    rendering.report(run, tmp_path / "report.html")
    rendering.replay([run, run], tmp_path / "replay.html")
    for name in ("report.html", "replay.html"):
        assert (tmp_path / name).read_text().rstrip().endswith("</html>")


def test_a_page_that_cannot_be_written_says_so(run: Path, tmp_path: Path) -> None:
    with pytest.raises(ResultFileError, match="cannot be written"):
        rendering.replay([run], tmp_path / "nowhere" / "replay.html")


def test_a_run_differs_in_nothing_from_itself(run: Path) -> None:
    found = rendering.compare([run, run], ["a", "b"])
    assert found["differences"] == []


def test_checks_and_expansion_are_those_of_the_command_line() -> None:
    assert rendering.check("mkz49", "", {}, "mkz49")["errors"] == 0
    text = rendering.expanded("mkz49", {"boom_length": 2.1})
    assert rendering.check("", text, {}, "upload")["errors"] == 0
    assert read_model_text(text).parameters()["boom_length"].value == "2.1"


def test_a_study_is_a_table_a_file_and_a_page(study: Path, tmp_path: Path) -> None:
    document = rendering.study_table(study / "results.parquet")
    assert document["inputs"] == ["scenario.velocities.boom_swing"]
    assert len(document["rows"]) == 2
    assert "S.z.rms" in document["metrics"]
    rendering.study_csv(study / "results.parquet", tmp_path / "table.csv")
    assert len((tmp_path / "table.csv").read_text().splitlines()) == 3
    rendering.study_report(study, tmp_path / "study.html")
    assert (tmp_path / "study.html").stat().st_size > 100_000
    with pytest.raises(ResultFileError, match="cannot be written"):
        rendering.study_csv(study / "results.parquet", tmp_path / "nowhere" / "table.csv")


def test_faults_travel_as_problems(run: Path, tmp_path: Path) -> None:
    made = rendering.guarded(Limits(job_memory=10**13), rendering.expanded, "nowhere", {})
    assert made.value is None
    assert made.problem is not None
    assert "no model named" in made.problem["detail"]
    damaged = tmp_path / "damaged.nc"
    damaged.write_bytes(run.read_bytes()[:1000])
    assert rendering.guarded(Limits(job_memory=10**13), rendering.csv, damaged, tmp_path / "x.csv").damaged
