"""Result files and studies of somebody else: what they name is not run to look at them, and what they hold is data."""

from __future__ import annotations

import json
from pathlib import Path

import pyarrow.parquet
import pytest
import rigs
from command import Command, one_sentence

from drillrig_pin.batch.again import hole_places
from drillrig_pin.batch.runner import run_study
from drillrig_pin.batch.study import Study
from drillrig_pin.batch.table import read_table
from drillrig_pin.report.provenance import asks_the_same
from drillrig_pin.rig import load_rig
from drillrig_pin.scenario import Scenario
from drillrig_pin.simulation import simulate


@pytest.fixture
def evaluations(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Models that xacro was let loose on."""
    from drillrig_pin.model import expand

    seen: list[str] = []
    original = expand._run_xacro
    monkeypatch.setattr(expand, "_run_xacro", lambda path, *rest: seen.append(path.name) or original(path, *rest))
    return seen


@pytest.fixture(scope="module")
def theirs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run and a study whose model is a xacro file beside them."""
    folder = tmp_path_factory.mktemp("theirs")
    model = folder / "own.urdf.xacro"
    model.write_text(
        rigs.mass_on_cylinder().replace("<robot ", '<robot xmlns:xacro="http://www.ros.org/wiki/xacro" ', 1)
    )
    scenario = Scenario(name="theirs", model=str(model), duration=0.05)
    simulate(load_rig(model), scenario).save(folder / "run.nc")
    study = Study(
        scenario=scenario.model_dump(mode="json"),
        axes=[{"name": "scenario.duration", "list": [0.05, 0.06]}],
        metrics=["trust.*"],
    )
    run_study(study, folder / "study", workers=1)
    return folder


def test_looking_at_a_run_and_a_study_evaluates_no_xacro_that_they_name(
    theirs: Path, drillrig: Command, evaluations: list[str]
) -> None:
    study = str(theirs / "study")
    run = str(theirs / "run.nc")
    assert drillrig("report", run, "-o", "r.html").code == 0
    assert "if you trust the file" in Path("r.html").read_text()
    assert drillrig("sweep-report", study, "-o", "s.html").code == 0
    assert evaluations == []


def test_a_case_is_computed_again_with_a_xacro_of_ones_own_only_if_that_is_said(
    theirs: Path, drillrig: Command, evaluations: list[str]
) -> None:
    words = ("replay", str(theirs / "study"), "--case", "1", "--html", "x.html")
    one_sentence(drillrig(*words), "own.urdf.xacro", "--run-model")
    assert evaluations == []
    assert drillrig(*words, "--run-model").code == 0
    assert evaluations


def test_what_a_study_says_of_its_model_comes_from_the_text_it_keeps(tmp_path: Path, evaluations: list[str]) -> None:
    places = {"printed": {"pose": "hole_9", "source": "paper"}}
    study = Study(axes=[{"holes": {"fixed": ["head_rotation"], "places": places}}], set={"scenario.duration": 0.02})
    run_study(study, tmp_path, workers=1)
    evaluations.clear()
    rename_model(tmp_path, "elsewhere.urdf.xacro")
    assert hole_places(read_table(tmp_path))["printed"] == pytest.approx((4.0478, 0.1945, 1.0072), abs=1e-3)
    rename_model(tmp_path, "elsewhere.urdf.xacro", text=b"")
    assert hole_places(read_table(tmp_path)) == {}
    assert evaluations == []


def rename_model(folder: Path, name: str, text: bytes | None = None) -> None:
    path = folder / "results.parquet"
    table = pyarrow.parquet.read_table(path)
    about = dict(table.schema.metadata)
    base = json.loads(about[b"scenario"])
    about[b"scenario"] = json.dumps({**base, "model": name})
    if text is not None:
        about[b"model"] = text
    pyarrow.parquet.write_table(table.replace_schema_metadata(about), path)


def test_a_shipped_model_and_plain_urdf_are_compared_with_the_text_in_the_run(tmp_path: Path) -> None:
    run = simulate(load_rig("mkz49"), Scenario(duration=0.01))
    assert asks_the_same(run) is True
    plain = tmp_path / "plain.urdf"
    plain.write_text(rigs.mass_on_cylinder())
    case = Scenario(name="plain", model=str(plain), duration=0.01)
    run = simulate(load_rig(plain), case)
    assert asks_the_same(run) is True
    plain.write_text(rigs.mass_on_cylinder().replace('name="', 'name="other_', 1))
    assert asks_the_same(run) is False
