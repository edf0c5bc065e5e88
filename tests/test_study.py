"""Studies: what their axes unfold into, and errors that name file and line."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drillrig_pin.analysis.comparison import quantities
from drillrig_pin.batch.axes import size_of
from drillrig_pin.batch.cases import unfold
from drillrig_pin.batch.measures import SECTIONS, measured, require_known
from drillrig_pin.batch.study import Study, load_study
from drillrig_pin.errors import DrillrigError, ScenarioError
from drillrig_pin.files import shipped_studies

HEAD = "scenario: hole_9\n"


def values(*axes: object) -> list[dict[str, object]]:
    return [case.inputs for case in unfold(Study(axes=list(axes))).cases]


def column(axis: object) -> list[object]:
    return [next(iter(point.values())) for point in values(axis)]


def test_a_list_and_ranges_give_their_values_in_order() -> None:
    name = "model.rock_stiffness"
    assert column({"name": name, "list": ["1e6", 2e6]}) == [1e6, 2e6]
    assert column({"name": name, "range": {"start": 25, "stop": 26, "step": 0.1}}) == [
        float(f"{25 + i / 10:.1f}") for i in range(11)
    ]
    assert column({"name": name, "range": {"start": 1, "stop": 100, "count": 3, "scale": "log"}}) == [1, 10, 100]


def test_zipped_names_change_together_and_a_grid_takes_every_combination() -> None:
    a, b = "model.rock_stiffness", "scenario.integrator.rtol"
    assert values({"zip": {a: [1, 2], b: [1e-6, 1e-7]}}) == [{a: 1, b: 1e-6}, {a: 2, b: 1e-7}]
    assert len(values({"grid": {a: [1, 2], b: {"start": 1e-8, "stop": 1e-6, "count": 3}}})) == 6


def test_axes_multiply_and_the_last_changes_fastest() -> None:
    a, b = "model.rock_stiffness", "model.rock_damping"
    points = values({"name": a, "list": [1, 2]}, {"name": b, "list": [3, 4]})
    assert [tuple(point.values()) for point in points] == [(1, 3), (1, 4), (2, 3), (2, 4)]


def test_a_latin_hypercube_meets_every_slice_once_and_is_the_same_for_the_same_seed() -> None:
    def axis(seed: int) -> object:
        bounds = {"model.rock_stiffness": [1e6, 2e6], "model.rock_damping": {"low": 1, "high": 1e4, "scale": "log"}}
        return {"latin_hypercube": {"samples": 10, "seed": seed, "bounds": bounds}}

    sampled = np.array([list(point.values()) for point in values(axis(3))])
    assert sorted(np.floor((sampled[:, 0] - 1e6) / 1e5)) == list(range(10))
    assert sorted(np.floor(np.log10(sampled[:, 1]) / 0.4)) == list(range(10))
    assert values(axis(3)) == values(axis(3)) != values(axis(4))


def test_a_sobol_sequence_puts_equally_many_samples_into_every_quarter() -> None:
    bounds = {"model.rock_stiffness": [0, 1], "model.rock_damping": [0, 1]}
    sampled = np.array([list(p.values()) for p in values({"sobol": {"samples": 16, "seed": 1, "bounds": bounds}})])
    quarters = (sampled[:, 0] >= 0.5) * 2 + (sampled[:, 1] >= 0.5)
    assert np.bincount(quarters.astype(int)).tolist() == [4, 4, 4, 4]
    with pytest.raises(ScenarioError, match="power of two"):
        values({"sobol": {"samples": 10, "bounds": bounds}})


def test_the_key_of_a_case_changes_with_what_decides_its_numbers_only() -> None:
    def key(**changes: object) -> str:
        fields = {"axes": [{"name": "model.rock_stiffness", "list": [1e6]}], **changes}
        return unfold(Study(**fields)).cases[0].question.key

    assert key() == key(name="another", text="other words")
    other = [key(set={"scenario.duration": 5}), key(set={"model.rock_damping": 1}), key(metrics=["*.p_max"])]
    assert len({key(), *other}) == 4


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("axes:\n  - name: model.rock_stifness\n    list: [1]\n", 3, "Did you mean 'rock_stiffness'?"),
        ("axes:\n  - name: scenario.integrator.rtl\n    list: [1]\n", 3, "Did you mean 'rtol'?"),
        ("axes:\n  - name: rock_stiffness\n    list: [1]\n", 3, "model.ARGUMENT or scenario.FIELD"),
        ("axes:\n  - name: scenario.duration\n    list: [-1]\n", 3, "greater than 0"),
        ("axes:\n  - zip:\n      model.rock_damping: [1, 2]\n      model.rock_stiffness: [1]\n", 3, "equally many"),
        ("axes:\n  - name: model.rock_damping\n", 3, "exactly one of list, range"),
        ("axes:\n  - name: model.rock_damping\n    list: []\n", 4, "at least 1 item"),
        ("axes:\n  - name: model.rock_damping\n    range:\n      start: 1\n      stop: x\n      count: 3\n", 6, "'x'"),
        ("metrics: ['*.rmss']\n", 2, "no metric ends like"),
        ("nonsense: 1\n", 2, "Legal fields"),
        ("set:\n  model.rock_dampin: 1\n", 3, "Did you mean 'rock_damping'?"),
        ("axes: [\n", 3, "YAML"),
        ("axes:\n  - holes:\n      places:\n        a: {pitch: 3}\n", 5, "either at"),
        ("scenario: hole_8\n", 2, "no scenario named"),
    ],
)
def test_an_error_names_the_line_and_what_is_legal(tmp_path: Path, text: str, line: int, words: str) -> None:
    path = tmp_path / "study.yaml"
    path.write_text((HEAD if not text.startswith("scenario") else "\n") + text)
    with pytest.raises(DrillrigError) as caught:
        load_study(path)
    assert f"study.yaml:{line}: " in str(caught.value)
    assert words in str(caught.value)


def test_one_name_is_varied_once() -> None:
    axis = {"name": "model.rock_damping", "list": [1]}
    with pytest.raises(ScenarioError, match=r"axes 1 and 2 both vary model\.rock_damping"):
        Study(axes=[axis, axis])
    with pytest.raises(ScenarioError, match="both varied and set"):
        Study(axes=[axis], set={"model.rock_damping": 2})


@pytest.mark.parametrize("name", sorted(shipped_studies()))
def test_shipped_studies_fit_their_model(name: str) -> None:
    assert len(unfold(load_study(name)).cases) >= 9


def test_every_number_of_a_run_can_be_asked_for_by_its_name() -> None:
    from drillrig_pin import Scenario, load_rig, simulate
    from drillrig_pin.analysis.metrics import measure

    run = simulate(load_rig("mkz49"), Scenario(duration=0.5))
    metrics = measure(run)
    keys = [key for key in quantities(metrics, metrics.hole, ()) if key != "cost.wall_time"]
    assert {key.rpartition(".")[2] for key in keys} <= set(SECTIONS)
    everything = measured(run, ["*"])
    assert set(keys) <= set(everything)
    for key in keys:
        require_known([key])
        assert measured(run, [key]) == {key: everything[key]}


BOUNDS = {name: [0, 1] for name in (f"model.a{i}" for i in range(200))}
SPAN = {"start": 1, "stop": 2, "count": 1_000_000}
NAMES = [f"model.a{i}" for i in range(200)]


@pytest.mark.parametrize(
    ("axes", "size"),
    [
        ([{"name": name, "range": SPAN} for name in NAMES], 10**1200),
        ([{"grid": dict.fromkeys(NAMES, SPAN)}], 10**1200),
        ([{"zip": dict.fromkeys(NAMES, SPAN)}], 10**6),
        ([{"latin_hypercube": {"samples": 10**6, "bounds": BOUNDS}}], 10**6),
        ([{"sobol": {"samples": 2**19, "bounds": BOUNDS}}], 2**19),
        ([{"name": "model.a", "range": {"start": 0, "stop": 0.3, "step": 0.1}}], 4),
        ([{"name": "model.a", "list": [1, 2]}, {"holes": {"places": {"1": {"pose": "work"}}}}], 2),
    ],
)
def test_cases_are_counted_without_making_one(axes: list[dict[str, Any]], size: int) -> None:
    # Made one by one, the points of the first would outlast the universe.
    study = Study(axes=axes)
    assert size_of(study.axes) == size
    assert len(study.names) == sum(len(axis.sample()) for axis in study.axes)
    assert [name for axis in study.axes for name in axis.sample()] == list(study.names)


def test_an_axis_has_as_many_points_as_it_says() -> None:
    axes = [
        {"name": "model.a", "range": {"start": 0, "stop": 1, "step": 0.3}},
        {"name": "model.b", "range": {"start": 1, "stop": 100, "count": 7, "scale": "log"}},
        {"grid": {"model.c": [1, 2], "model.d": {"start": 0, "stop": 1, "count": 3}}},
        {"zip": {"model.e": [1, 2, 3], "model.f": {"start": 0, "stop": 1, "count": 3}}},
        {"sobol": {"samples": 8, "bounds": {"model.g": [0, 1]}}},
    ]
    for axis in Study(axes=axes).axes:
        points = list(axis.points())
        assert len(points) == axis.size
        assert set(points[0]) == set(axis.names)
        if not hasattr(axis, "sobol"):
            assert points[0] == axis.sample()
