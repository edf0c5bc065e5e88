"""The best design of a study: known minima and constraints, the same search every time, and a real pin moved."""

from __future__ import annotations

import json
import shlex
from collections.abc import Callable, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pyarrow.parquet
import pytest
from command import Command, one_sentence

from drillrig_pin.batch.cases import Case, Plan, Question
from drillrig_pin.batch.goal import Trial, goal_of
from drillrig_pin.batch.optimizer import Search, run_search
from drillrig_pin.batch.settings import parse_constraint
from drillrig_pin.batch.space import space_of
from drillrig_pin.batch.study import Study, load_study
from drillrig_pin.batch.worker import Answer
from drillrig_pin.errors import ScenarioError
from drillrig_pin.words import si

Function = Callable[[dict[str, Any]], dict[str, float] | None]


class Known:
    """Stands in for a session: answers by a function of the inputs, None for a case that fails."""

    def __init__(self, function: Function) -> None:
        self.function, self.asked = function, 0
        self.plan = SimpleNamespace(cases=[])
        self.tally = SimpleNamespace(expect=lambda count: None, note="")

    def extend(self, cases: Sequence[Case]) -> list[Answer]:
        self.plan.cases.extend(cases)
        self.asked += len(cases)
        return [self.answer(case) for case in cases]

    def answer(self, case: Case) -> Answer:
        found = self.function(case.inputs)
        key = case.question.key
        if found is None:
            return Answer(key, "failed", "cannot be built")
        return Answer(key, metrics=found, units={"S.z.rms": "m", "oil.p_min": "Pa"})


class Asking:
    """Stands in for what makes cases; the model of these studies knows its defaults."""

    base = SimpleNamespace(arguments={"a": 0.9, "b": 0.9}, model_dump=dict)
    file = SimpleNamespace(parameters=dict)

    def case(self, index: int, inputs: dict[str, Any], tags: dict[str, int]) -> Case:
        return Case(index, inputs, Question(str(index), inputs), tags)

    def plan(self, cases: list[Case]) -> Plan:
        raise NotImplementedError


def searched(function: Function, **settings: Any) -> Search:
    axes = [
        {"grid": {"model.a": {"start": 0, "stop": 1, "count": 2}, "model.b": {"start": 0, "stop": 1, "count": 2}}},
        {"name": "scenario.load", "list": [0.0, 1.0]},
    ]
    study = Study(axes=axes, metrics=["S.z.rms", "*.p_min"], optimize={"budget": 300, "starts": 1, **settings})
    search = Search(study, Known(function), Asking(), space_of(study), goal_of(study))  # type: ignore[arg-type]
    search.run()
    return search


def bowl(inputs: dict[str, Any]) -> dict[str, float]:
    """Least at (0.3, 0.7) without load, at (0.5, 0.7) with it."""
    at = 0.3 + 0.2 * inputs["scenario.load"]
    value = (inputs["model.a"] - at) ** 2 + (inputs["model.b"] - 0.7) ** 2
    return {"S.z.rms": value, "oil.p_min": 1e6 * inputs["model.a"]}


def best(search: Search) -> Trial:
    assert search.best is not None
    return search.best


def test_the_worst_condition_is_made_as_good_as_it_can_be() -> None:
    # Worst of both bowls: between them, where they are equal.
    found = best(searched(bowl))
    assert found.feasible
    assert found.design == pytest.approx({"model.a": 0.4, "model.b": 0.7}, abs=0.01)
    assert found.value == max(v for v in found.values if v is not None) == pytest.approx(0.01, abs=2e-4)


def test_the_default_design_is_tried_and_nothing_is_run_twice() -> None:
    search = searched(bowl, starts=2)
    assert search.default is not None
    assert search.default.design == {"model.a": 0.9, "model.b": 0.9}
    assert search.default.value == pytest.approx(0.6**2 + 0.2**2)
    assert search.session.asked == 2 * len(search.trials) <= 600  # type: ignore[attr-defined]
    values = [start.value for start in search.starts]
    assert values == pytest.approx([0.01, 0.01], abs=1e-3)


def test_a_constraint_holds_under_every_condition() -> None:
    found = best(searched(bowl, constraints=["oil.p_min >= 6 bar"]))
    assert found.feasible
    assert found.design == pytest.approx({"model.a": 0.6, "model.b": 0.7}, abs=0.01)
    nowhere = best(searched(bowl, constraints=["*.p_min >= 20 bar"], budget=100))
    assert not nowhere.feasible
    # Infeasible everywhere: the search went for what violates least.
    assert nowhere.design["model.a"] == pytest.approx(1.0, abs=0.01)
    assert [breach.reason for breach in nowhere.breaches] == ["oil.p_min is 10.00 bar"] * 2


def test_a_design_that_fails_under_one_condition_never_wins() -> None:
    def gap(inputs: dict[str, Any]) -> dict[str, float] | None:
        return None if inputs["scenario.load"] and inputs["model.a"] < 0.6 else bowl(inputs)

    search = searched(gap)
    assert best(search).feasible
    assert best(search).design["model.a"] == pytest.approx(0.6, abs=0.01)
    bad = next(trial for trial in search.trials.values() if not trial.feasible)
    assert bad.value is None
    assert [breach.reason for breach in bad.breaches] == ["cannot be built"]
    with pytest.raises(ScenarioError, match=r"none of the first 12 designs can be run, e\.g\. cannot be built"):
        searched(lambda inputs: None)


def test_the_mean_and_a_maximum_can_be_asked_for() -> None:
    mean = best(searched(bowl, over="mean", minimize="S.z.rms"))
    assert mean.value == pytest.approx(0.01, abs=2e-4)
    high = best(searched(bowl, maximize="oil.p_min"))
    assert high.design["model.a"] == pytest.approx(1.0, abs=0.01)
    with pytest.raises(ScenarioError, match="means 2 metrics"):
        searched(bowl, minimize="*")


def test_the_same_seed_tries_the_same_designs() -> None:
    tried = [list(searched(bowl, seed=seed, budget=60).trials) for seed in (3, 3, 4)]
    assert tried[0] == tried[1] != tried[2]


def test_constraints_are_read_with_their_units() -> None:
    constraint = parse_constraint("lift.p_min>=2.5 bar")
    assert (constraint.metric, constraint.least, constraint.bound, constraint.unit) == ("lift.p_min", True, 2.5e5, "Pa")
    assert constraint.broken(2.4e5)
    assert not constraint.broken(2.5e5)
    assert 0 < constraint.excess(2.4e5) < constraint.excess(-9e9) < 1
    assert si("90 deg") == (pytest.approx(1.5707963), "rad")
    assert si("-1e-3") == (-1e-3, "")
    assert si("5 %") == (0.05, "1")
    with pytest.raises(ScenarioError, match="measured in Pa"):
        searched(bowl, constraints=["*.p_min >= 2 mm"])


#: Two holes, short: what counts here is that numbers come out again, not that they are the machine's.
STUDY = """
scenario: hole_9
set: {scenario.duration: 0.5}
axes:
  - name: model.boom_swing_pin_from_x
    range: {start: -1.05, stop: -0.85, count: 5}
  - holes:
      fixed: [head_rotation]
      places: {nine: {pose: hole_9}, five: {at: [4.048, 0.195, 1.757]}}
metrics: [S.across.rms, "swing_cylinder.p_m*"]
optimize: {starts: 1, budget: 20, constraints: ["swing_cylinder.p_max <= 78 bar"]}
"""


@pytest.fixture(scope="module")
def alone(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[dict[str, Any]]]:
    """The folder of a search by one worker, and its table."""
    folder = tmp_path_factory.mktemp("search")
    (folder / "pin.yaml").write_text(STUDY)
    found = run_search(load_study(folder / "pin.yaml"), folder, workers=1)
    assert found.differences == []
    return folder, rows(found.table)


def rows(table: Path) -> list[dict[str, Any]]:
    times = ("solve_time", "wall_time")
    return [{k: v for k, v in row.items() if k not in times} for row in pyarrow.parquet.read_table(table).to_pylist()]


def test_a_moved_pin_improves_on_the_default_and_its_study_gives_the_same_numbers(
    alone: tuple[Path, list[dict[str, Any]]], drillrig: Command
) -> None:
    folder, before = alone
    again = drillrig("optimize", str(folder / "pin.yaml"), "-o", str(folder), "--workers", "1")
    assert again.code == 0
    words = " ".join(again.out.split())
    assert f"(0 now, {len(before)} before)" in words
    assert "gives the same numbers to the last digit" in words
    assert rows(folder / "results.parquet") == before
    found = json.loads((folder / "optimum.json").read_text())
    assert found["best"]["value"] < found["default"]["value"]
    assert found["improvement"] > 0.05
    assert 0 < found["infeasible"] < found["designs"]
    assert "breaks swing_cylinder.p_max <= 78 bar" in words
    assert found["reproduced"] is True
    assert found["default"]["design"] == {"model.boom_swing_pin_from_x": -0.95}

    assert shlex.split(again.out.strip().splitlines()[-1].removeprefix("Next: "))[:2] == ["drillrig", "sweep"]
    drillrig("sweep", str(folder / "best.yaml"), "-o", "best", "--workers", "1", "--quiet")
    best_rows = rows(Path("best/results.parquet"))
    assert [row["S.across.rms"] for row in best_rows] == [case["value"] for case in found["best"]["cases"]]
    assert max(row["S.across.rms"] for row in best_rows) == found["best"]["value"]
    assert [row["hole"] for row in best_rows] == ["nine", "five"]


def test_an_interrupted_search_goes_on_and_ends_as_one_that_was_not(
    alone: tuple[Path, list[dict[str, Any]]], tmp_path: Path
) -> None:
    study = load_study(alone[0] / "pin.yaml")

    def stop(tally: Any) -> None:
        if tally.since_start >= 12:
            raise KeyboardInterrupt

    first = run_search(study, tmp_path, workers=2, listener=stop)
    assert first.interrupted
    assert 12 <= len(rows(first.table)) < len(alone[1])
    second = run_search(study, tmp_path, workers=2)
    assert second.tally.before >= 12
    assert rows(second.table) == alone[1]


def test_what_cannot_be_searched_is_said(drillrig: Command, alone: tuple[Path, list[dict[str, Any]]]) -> None:
    study = str(alone[0] / "pin.yaml")
    one_sentence(drillrig("optimize", "nine_holes", "-o", "x"), "nine_holes.yaml", "no axis gives bounds")
    one_sentence(drillrig("optimize", study, "-o", "x", "--constraint", "p_min"), "--constraint: 'p_min' is no")
    one_sentence(drillrig("optimize", study, "-o", "x", "--budget", "6"), "--budget: a start needs at least 20 designs")
    told = drillrig("optimize", study, "-o", "x", "--minimize", "S.acros.rms", "--workers", "1")
    one_sentence(told, "--minimize: no run of this study has a metric 'S.acros.rms'", "Did you mean 'S.across.rms'?")


def test_the_shipped_search_fits_its_model() -> None:
    study = load_study("best_pin")
    assert len(space_of(study).conditions) == 9
    assert goal_of(study).lower
