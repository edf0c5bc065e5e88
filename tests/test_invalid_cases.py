"""Cases whose numbers must not be used are named with the reason and are never best, whoever ranks."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pyarrow.parquet
import pytest
from command import Command
from rigs import mass_on_cylinder

from drillrig_pin.analysis.limits import read_limits
from drillrig_pin.analysis.verdict import Level
from drillrig_pin.batch.optimizer import run_search
from drillrig_pin.batch.runner import run_study
from drillrig_pin.batch.study import Study
from drillrig_pin.batch.table import read_table
from drillrig_pin.studyreport.content import gather
from drillrig_pin.studyreport.subject import read_subject

PULL = (
    '<load name="pull" kind="force" point="pin_b" axis="0 0 1" frame="world"><harmonics mean="0" ramp="0.05">'
    '<term amplitude="30000" frequency="10"/></harmonics></load>\n'
)


@pytest.fixture(scope="module")
def press(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A tonne pulled at by 30 kN on a cylinder whose precharge is an argument.

    Without precharge its oil is in tension and its highest pressure the lowest of all: the best there is, were it true.
    """
    text = mass_on_cylinder(1000.0, options='precharge="$(arg precharge)"', extension=PULL)
    arguments = '<xacro:arg name="precharge" default="5e6"/>'
    head = '<robot name="machine" xmlns:xacro="http://www.ros.org/wiki/xacro">'
    path = tmp_path_factory.mktemp("press") / "press.urdf.xacro"
    path.write_text(text.replace('<robot name="machine">', head + arguments))
    return path


def study(press: Path, axis: dict[str, Any], **fields: Any) -> Study:
    base = {"scenario": {"model": str(press), "duration": 0.2}, "metrics": ["*.p_max", "*.p_min"], "worst": "oil.p_max"}
    return Study(**{**base, "axes": [{"name": "model.precharge", **axis}], **fields})


def test_a_sweep_ranks_only_what_is_valid(press: Path, tmp_path: Path) -> None:
    values = [0.0, 1e5, 8e6, 12e6]
    finished = run_study(study(press, {"list": values}), tmp_path, workers=1)
    rows = pyarrow.parquet.read_table(finished.table).to_pylist()
    # The judgement a second time, from the table alone: vapour pressure is 0.1 bar absolute where a model says nothing.
    for row in rows:
        assert (row["status"] == "invalid") == (row["oil.p_min"] < 1e4)
        assert row["reason"].startswith("not valid from t = ") == (row["status"] == "invalid")
    assert [row["status"] for row in rows] == ["invalid", "invalid", "completed", "completed"]
    assert min(rows, key=lambda row: row["oil.p_max"])["status"] == "invalid", "else this shows nothing"
    tally = finished.tally
    assert tally.best is not None
    assert tally.best[0].inputs["model.precharge"] == 8e6
    assert "oil tears" in tally.reasons["invalid"][1]
    table = read_table(tmp_path)
    assert table.ranked("oil.p_max") == [3, 2]
    content = gather(read_subject(tmp_path, None, read_limits()))
    assert "case 2" in content.headline.sentence
    assert not any(f"case {case}" in content.headline.sentence for case in (0, 1))
    assert {case for failure in content.failures for case in failure.cases} == {0, 1}
    assert all(content.judgements[case].level is Level.BAD for case in (0, 1))


def test_a_search_does_not_end_where_oil_would_have_to_pull(press: Path, tmp_path: Path) -> None:
    asked = study(
        press,
        {"range": {"start": 0.0, "stop": 16e6, "count": 2}},
        optimize={"minimize": "oil.p_max", "budget": 40, "seed": 1},
    )
    found = run_search(asked, tmp_path, workers=1)
    assert found.best is not None
    assert found.best.feasible
    assert all(answer.status == "completed" for answer in found.best.answers)
    void = [trial for trial in found.trials if any(answer.status == "invalid" for answer in trial.answers)]
    assert void, "else this shows nothing"
    lowest = min(answer.metrics["oil.p_max"] for trial in void for answer in trial.answers)
    assert found.best.value is not None
    assert lowest < found.best.value
    assert all(not trial.feasible for trial in void)


def test_a_run_that_is_not_valid_is_neither_better_nor_worse(press: Path, drillrig: Command) -> None:
    for name, value in (("soft", "0"), ("stiff", "8e6")):
        drillrig(
            "run", str(press), "--set", f"model.precharge={value}", "--set", "scenario.duration=0.2", "-o", f"{name}.nc"
        )
    answer = drillrig("compare", "stiff.nc", "soft.nc", "--json")
    found = answer.document
    assert any("not valid from" in caution for caution in found["cautions"])
    assert {change["verdict"] for row in found["changes"] for change in row["runs"]} <= {"same", "other"}
