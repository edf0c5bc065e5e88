"""Which parameter matters: indices of functions whose indices are known, holes in the plan, and the whole command."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pyarrow.parquet
import pytest
from command import Command, one_sentence

from drillrig_pin.batch.axes import Bounds
from drillrig_pin.batch.importance import Index, load_sensitivity
from drillrig_pin.batch.ranking import ranked, verdict
from drillrig_pin.batch.sensitivity import NothingToSayError, Sampled, indices_of, sample
from drillrig_pin.batch.space import Space, space_of
from drillrig_pin.batch.study import Study, load_study
from drillrig_pin.errors import DrillrigError, ResultFileError
from drillrig_pin.kinematics import Array

THREE = {f"model.{name}": [-math.pi, math.pi] for name in "abc"}


def sampled(**settings: object) -> Sampled:
    axes = [{"latin_hypercube": {"samples": 1, "bounds": THREE}}]
    return sample(Study(axes=axes, sensitivity=settings))


def values(plan: Sampled) -> Array:
    """Samples in the units of the bounds."""
    return np.array([list(plan.space.design(row).values()) for row in plan.shares])


def by_name(found: list[Index]) -> dict[str, Index]:
    return {index.parameter: index for index in found}


def linear(plan: Sampled) -> Array:
    """5 a - 2 b, each over a range of 2 pi."""
    return values(plan) @ [5.0, -2.0, 0.0]


def test_morris_finds_slopes_and_signs_of_a_linear_function_exactly() -> None:
    plan = sampled(method="morris", trajectories=6)
    found, about = indices_of(plan, linear(plan), "y", "m")
    assert [index.parameter for index in found] == ["model.a", "model.b", "model.c"]
    for index, slope in zip(found, (5, -2, 0), strict=True):
        # Designs have eight digits.
        assert index.mu == pytest.approx(slope * 2 * math.pi, abs=1e-5)
        assert index.importance == index.mu_star == pytest.approx(abs(slope) * 2 * math.pi, abs=1e-5)
        assert index.sigma == pytest.approx(0, abs=1e-5)
    assert "can be trusted" in about.verdict


def test_sobol_finds_the_shares_of_the_ishigami_function() -> None:
    plan = sampled(method="sobol", samples=2048)
    a, b, c = values(plan).T
    found, _ = indices_of(plan, np.sin(a) + 7 * np.sin(b) ** 2 + 0.1 * c**4 * np.sin(a), "y", "")
    closed = {"model.a": (0.3139, 0.5576), "model.b": (0.4424, 0.4424), "model.c": (0.0, 0.2437)}
    for name, (alone, total) in closed.items():
        index = by_name(found)[name]
        assert pytest.approx(alone, abs=0.03) == index.S1
        assert pytest.approx(total, abs=0.03) == index.ST
        assert index.ST_conf is not None
        assert abs(total - index.ST) < 2 * index.ST_conf + 0.005


def test_a_failed_design_costs_morris_its_trajectory_and_sobol_everything() -> None:
    plan = sampled(method="morris", trajectories=6)
    y = linear(plan)
    y[[1, 9]] = np.nan
    found, about = indices_of(plan, y, "y", "m")
    assert about.blocks == 4
    assert found[0].mu == pytest.approx(5 * 2 * math.pi, abs=1e-5)
    y[4:] = np.nan
    with pytest.raises(NothingToSayError, match="0 of 6 trajectories"):
        indices_of(plan, y, "y", "m")
    plan = sampled(method="sobol", samples=16)
    y = linear(plan)
    y[7] = np.nan
    with pytest.raises(NothingToSayError, match="1 of 80 designs have no number"):
        indices_of(plan, y, "y", "m")
    with pytest.raises(NothingToSayError, match="same in every design"):
        indices_of(plan, np.ones(80), "y", "m")


def test_a_larger_plan_of_the_same_seed_begins_with_the_smaller_one() -> None:
    for method, name in (("morris", "trajectories"), ("sobol", "samples")):
        few, many = (sampled(method=method, **{name: n}).shares for n in (8, 16))
        assert np.array_equal(few, many[: len(few)])
        assert not np.array_equal(few, sampled(method=method, **{name: 8}, seed=1).shares)


def test_overlapping_intervals_are_said_with_what_would_part_them() -> None:
    def told(*rows: tuple[float, float]) -> tuple[str, int | None]:
        plain = [{"mu_star": value, "mu_star_conf": conf, "mu": 0.0, "sigma": 0.0} for value, conf in rows]
        return verdict(ranked("y", "m", ["model.a", "model.b", "model.c"], plain), "morris", 10)

    assert told((3, 0.4), (2, 0.4), (1, 0.4)) == ("The ranking can be trusted: the intervals do not overlap.", None)
    sentence, advised = told((2, 0.6), (3, 0.6), (0.1, 0.1))
    assert sentence.startswith("Not separated, since their intervals overlap: b and a. About 20 trajectories")
    assert "less than 5 % of the first: c" in sentence
    assert advised == 20
    sentence, advised = told((2, 0.6), (2.001, 0.6), (1, 0.1))
    assert "matter about equally" in sentence
    assert advised is None


def test_ranges_are_searched_and_everything_else_is_a_condition() -> None:
    axes = [
        {"name": "model.a", "range": {"start": 1e6, "stop": 1e5, "count": 3, "scale": "log"}},
        {"grid": {"model.b": {"start": 0, "stop": 1, "count": 2}, "model.c": [1, 2]}},
        {"holes": {"places": {"h": {"pose": "p"}, "i": {"pose": "p"}, "j": {"pose": "p"}}}},
    ]
    space = space_of(Study(axes=axes))
    assert space.bounds["model.a"] == Bounds(low=1e5, high=1e6, scale="log")
    assert list(space.bounds) == ["model.a", "model.b"]
    assert len(space.conditions) == 6
    design = space.design([0.5, 1 / 3])
    assert design == {"model.a": 316227.77, "model.b": 0.33333333}
    assert space.shares(design) == pytest.approx([0.5, 1 / 3], abs=1e-7)
    assert Space(space.bounds, [{}], []).inside({"model.a": 1e5, "model.b": 1.0})


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("axes:\n  - name: model.rock_damping\n    list: [1, 2]\n", 2, "no axis gives bounds"),
        ("sensitivity:\n  samples: 60\n", 3, "power of two"),
        ("sensitivity:\n  metod: sobol\n", 3, "Did you mean 'method'?"),
        ("sensitivity:\n  metric: S.z.rmss\n", 3, "no metric ends like"),
        ("optimize:\n  minimize: S.z.rms\n  maximize: S.z.rms\n", 2, "either minimize or maximize"),
        ("optimize:\n  constraints:\n    - '*.p_min >= 1 bar'\n    - '*.p_min > 1'\n", 3, "is no constraint"),
        ("optimize:\n  constraints: ['*.p_min >= 1 psi']\n", 3, "no unit 'psi'"),
        ("optimize:\n  budget: 5\n", 2, "at least 20 designs"),
    ],
)
def test_an_error_in_a_section_names_its_line(tmp_path: Path, text: str, line: int, words: str) -> None:
    path = tmp_path / "study.yaml"
    path.write_text("scenario: hole_9\n" + text)
    with pytest.raises(DrillrigError) as caught:
        space_of(load_study(path))
    assert f"study.yaml:{line}: " in str(caught.value)
    assert words in str(caught.value)


STUDY = """
scenario: hole_9
set: {scenario.duration: 0.1}
axes:
  - grid:
      scenario.velocities.boom_swing: {start: 0, stop: 0.02, count: 2}
      scenario.velocities.boom_lift: {start: 0, stop: 0.002, count: 2}
  - holes:
      fixed: [head_rotation]
      places: {a: {pose: hole_9}, b: {at: [4.048, 0.195, 1.757]}}
metrics: [S.y.rms, S.z.rms, "*.p_min"]
sensitivity: {trajectories: 4}
"""


def test_the_command_ranks_keeps_its_cases_and_goes_on_with_more(drillrig: Command) -> None:
    Path("s.yaml").write_text(STUDY)
    first = drillrig("sensitivity", "s.yaml", "-o", "out", "--workers", "1", "--json").document
    assert (first["designs"], first["conditions"], first["cases"], first["failed"]) == (12, 2, 24, 0)
    assert [entry["parameter"].rpartition(".")[2] for entry in first["indices"][:2]] == ["boom_swing", "boom_lift"]
    assert first["indices"][0]["metric"] == first["metric"] == "S.y.rms"
    read = load_sensitivity(Path("out"))
    assert read.document()["indices"] == first["indices"]

    table = pyarrow.parquet.read_table("out/results.parquet").to_pylist()
    assert [row["design"] for row in table] == [i // 2 for i in range(24)]
    worst = [max(a["S.y.rms"], b["S.y.rms"]) for a, b in zip(table[::2], table[1::2], strict=True)]
    about = next(item for item in read.metrics if item.metric == "S.y.rms")
    assert (about.least, about.greatest) == (min(worst), max(worst))

    more = drillrig("sensitivity", "s.yaml", "-o", "out", "--workers", "1", "--trajectories", "5", "--over", "mean")
    assert "30 of 30 cases recorded" in more.out
    assert "before) in" in more.out  # those of the first command
    lines = [line for path in Path("out/journal").iterdir() for line in path.read_text().splitlines()]
    keys = [json.loads(line)["key"] for line in lines]
    assert len(keys) == len(set(keys))
    assert "S.y.rms, mean of 2" in more.out
    assert "boom_swing" in more.out.split("boom_lift")[0]
    assert json.loads(Path("out/sensitivity.json").read_text())["blocks"] == 5


def test_designs_that_cannot_be_run_are_told_and_sobol_refuses_them(drillrig: Command) -> None:
    # A boom of 1.0 m, the lowest of the four levels of Morris' grid, leaves nothing of its lower part.
    length = "model.boom_length: {start: 1.0, stop: 1.9, count: 2}"
    text = STUDY.replace("scenario.velocities.boom_lift: {start: 0, stop: 0.002, count: 2}", length)
    Path("s.yaml").write_text(text.replace("b: {at: [4.048, 0.195, 1.757]}", ""))
    told = drillrig("sensitivity", "s.yaml", "-o", "out", "--workers", "2", "--trajectories", "5")
    table = pyarrow.parquet.read_table("out/results.parquet").to_pylist()
    lost = {row["block"] for row in table if row["status"] == "failed"}
    assert 1 <= len(lost) <= 3
    words = " ".join(told.out.split())
    assert f"the {len(lost)} trajectories they belong to are left out, {5 - len(lost)} remain" in words
    assert "leaves a lower boom" in words
    Path("s.yaml").write_text(Path("s.yaml").read_text().replace("start: 1.0", "start: 0.5"))
    refused = drillrig("sensitivity", "s.yaml", "-o", "sobol", "--workers", "2", "--method", "sobol", "--samples", "2")
    one_sentence(refused, "s.yaml:4", "Sobol indices need every one", "--method morris")


def test_wrong_options_and_files_are_said(drillrig: Command, tmp_path: Path) -> None:
    one_sentence(
        drillrig("sensitivity", "oil_and_rock", "-o", "x", "--method", "moris"), "--method", "'morris' or 'sobol'"
    )
    one_sentence(drillrig("sensitivity", "nine_holes", "-o", "x"), "nine_holes.yaml", "no axis gives bounds")
    one_sentence(drillrig("sensitivity", "oil_and_rock", "-o", "x", "--samples", "12"), "--samples: a Sobol sequence")
    with pytest.raises(ResultFileError, match="drillrig sensitivity"):
        load_sensitivity(tmp_path)
    (tmp_path / "sensitivity.json").write_text("{}")
    with pytest.raises(ResultFileError, match="is not the file of a sensitivity study"):
        load_sensitivity(tmp_path)
