"""What a reader would take otherwise than its author meant is refused by name and line, at every door."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
import yaml
from command import Command, one_sentence
from hypothesis import given, settings
from hypothesis import strategies as st

from drillrig_pin import Scenario, ScenarioError, load_scenario
from drillrig_pin.analysis.limits import read_limits
from drillrig_pin.batch.study import load_study
from drillrig_pin.check import check_model
from drillrig_pin.errors import ModelError
from drillrig_pin.model.modelfile import read_model
from drillrig_pin.yamlfile import parse


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("duration: 2\nname: a\nduration: 3\n", ("case.yaml:3", "'duration' is given twice, first in line 1")),
        ("integrator:\n  rtol: 1e-6\n  rtol: 1e-8\n", ("case.yaml:3", "'rtol'", "line 2")),
        ("positions: {boom_lift: 1, boom_lift: 1}", ("'boom_lift' is given twice",)),
        ('duration: 2\n"duration": 3\n', ("given twice",)),
        ("duration: 012\n", ("case.yaml:1", "012", "write 12")),
        ("duration: 1:30\n", ("1:30", "base 60")),
        ("duration: true\n", ("duration", "true", "truth value")),
        ("positions: {boom_lift: false}\n", ("positions.boom_lift", "truth value")),
        ("integrator: {rtol: true}\n", ("rtol", "truth value")),
        ("duration: yes\n", ("duration", "yes")),
        ("duration: .inf\n", ("duration", "finite")),
        ("duration: .nan\n", ("duration",)),
        ("arguments: {boom_length: .nan}\n", ("boom_length",)),
        ("positions: {boom_lift: .inf}\n", ("boom_lift",)),
        ("duration: 5 s\n", ("duration", "5 s")),
        ("duration:\n", ("duration",)),
        ("arguments: {boom_length: }\n", ("boom_length",)),
        ("arguments:\n", ("arguments",)),
        ("durations: 5\n", ("durations",)),
        ("name: 2020-01-01\n", ("name",)),
        ("", ("holds nothing",)),
        ("# duration: 5\n---\n", ("holds nothing",)),
        ("a: 1\n---\nb: 2\n", ("case.yaml",)),
    ],
)
def test_scenario_that_would_be_misread_is_refused(tmp_path: Path, text: str, words: tuple[str, ...]) -> None:
    path = tmp_path / "case.yaml"
    path.write_text(text)
    with pytest.raises(ScenarioError) as told:
        load_scenario(path)
    for word in words:
        assert word in str(told.value)


def test_words_and_numbers_as_their_author_means_them(tmp_path: Path) -> None:
    path = tmp_path / "case.yaml"
    path.write_text(
        'name: no\ntext: "1:30"\npose: on\nduration: "5"\noutput_rate: 1e3\n'
        "arguments: {switch: true, way: no}\n"
        "stabilization: {projection: off}\n"
    )
    case = load_scenario(path)
    assert (case.name, case.text, case.pose, case.duration, case.output_rate) == ("no", "1:30", "on", 5, 1000)
    assert case.arguments == {"switch": "true", "way": "no"}
    assert case.stabilization.projection is False


def test_every_other_file_is_read_as_strictly(tmp_path: Path) -> None:
    (tmp_path / "twice.yaml").write_text("name: s\naxes: [{name: scenario.duration, list: [1]}]\nname: t\n")
    with pytest.raises(ScenarioError, match=r"twice\.yaml:3.*'name' is given twice, first in line 1"):
        load_study(tmp_path / "twice.yaml")
    (tmp_path / "bounds.yaml").write_text("axes: [{sobol: {samples: 2, bounds: {model.boom_length: [true, 3]}}}]\n")
    with pytest.raises(ScenarioError):
        load_study(tmp_path / "bounds.yaml")
    (tmp_path / "empty.yaml").write_text("")
    for read in (load_study, read_limits):
        with pytest.raises(ScenarioError, match="holds nothing"):
            read(tmp_path / "empty.yaml")
    (tmp_path / "limits.yaml").write_text("toe_6m: 0.1\ntoe_6m: 0.2\n")
    with pytest.raises(ScenarioError, match="given twice"):
        read_limits(tmp_path / "limits.yaml")
    (tmp_path / "limits.yaml").write_text("toe_6m:\n")
    with pytest.raises(ScenarioError, match="no value"):
        read_limits(tmp_path / "limits.yaml")
    with pytest.raises(ScenarioError, match="given twice"):
        read_limits(None, ["toe_6m=0.1m", "toe_6m = 0.2m"])


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ("mass: 1\nmass: 2\n", r"numbers\.yaml:2.*'mass' is given twice"),
        ("mass: 012\n", "write 12"),
        ("mass: on\n", "truth value"),
    ],
)
def test_table_of_numbers_of_a_model(tmp_path: Path, table: str, words: str) -> None:
    (tmp_path / "numbers.yaml").write_text(table)
    path = tmp_path / "one.xacro"
    path.write_text(
        '<robot name="one" xmlns:xacro="http://www.ros.org/wiki/xacro">'
        "<link name=\"a${xacro.load_yaml('numbers.yaml')['mass']}\"/></robot>"
    )
    with pytest.raises(ModelError, match=words):
        read_model(path)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (("model.boom_length=2", "model.boom_length=2.1"), ("model.boom_length is given twice, as 2 and 2.1",)),
        (("scenario.arguments.boom_length=2", "model.boom_length=2.1"), ("given twice",)),
        (("model.boom_length=",), ("gives no value",)),
        (("scenario.pose=",), ("gives no value",)),
        (("scenario.duration=true",), ("duration", "truth value")),
        (("scenario.duration=1:30",), ("--set",)),
        (("scenario.duration=nan",), ("duration",)),
    ],
)
def test_command_line(drillrig: Command, given: tuple[str, ...], words: tuple[str, ...]) -> None:
    one_sentence(drillrig("static", *(part for text in given for part in ("--set", text))), *words)


def test_the_same_twice_is_once(drillrig: Command) -> None:
    assert drillrig("static", "--set", "model.boom_length=2", "--set", "model.boom_length=2").code == 0


@pytest.mark.parametrize("name", ["boom_swing", "boom_lift", "boom_extension", "bracket_swing", "feed_lift"])
def test_no_cylinder_rests_without_pressure_unsaid(drillrig: Command, name: str) -> None:
    told = [p for p in check_model("mkz49", {f"{name}_precharge": 0}) if "releases air" in p.message]
    assert len(told) == 1
    assert "rests at 1.013 bar absolute" in told[0].message
    answer = drillrig("check", "mkz49", "--set", f"model.{name}_precharge=0")
    assert "releases air" in answer.out


WORDS = st.text("abkyno012", min_size=1, max_size=3)


@settings(max_examples=150, deadline=None)
@given(st.lists(st.tuples(WORDS, st.integers(0, 9)), min_size=1, max_size=6))
def test_a_mapping_is_read_whole_or_refused(rows: list[tuple[str, int]]) -> None:
    text = "".join(f'"{key}": {value}\n' for key, value in rows)
    if len({key for key, _ in rows}) == len(rows):
        assert parse(text, "t")[0] == dict(rows)
    else:
        with pytest.raises(ScenarioError, match="given twice"):
            parse(text, "t")


@settings(max_examples=200, deadline=None)
@given(st.from_regex(r"[-+]?[0-9]{1,4}(:[0-5][0-9])?(\.[0-9]{1,2})?", fullmatch=True))
def test_a_number_is_the_one_its_digits_say(word: str) -> None:
    try:
        read = parse(f"a: {word}", "t")[0]["a"]
    except ScenarioError:
        # Refused are only those that YAML 1.1 reads to another base.
        assert ":" in word or word.lstrip("+-").startswith("0")
        return
    assert math.isclose(float(read), float(word))


@settings(max_examples=60, deadline=None)
@given(st.sampled_from(["on", "Off", "YES", "no", "y", "n", "true", "False", "null", "~", "1e3", "0x1F"]))
def test_a_name_is_the_word_that_stands_there(word: str) -> None:
    try:
        case = Scenario(**parse(f"pose: {word}", "t")[0])
    except ScenarioError:
        # No word to YAML 1.2 either.
        assert not isinstance(yaml.safe_load(word), str) or word in ("y", "n")
        return
    assert case.pose in (word, None)
    assert (case.pose is None) == (word in ("null", "~"))


@pytest.mark.parametrize("word", ["trueish", "false start", "False}", "TRUE2"])
def test_a_word_that_begins_like_a_truth_value_is_a_word(word: str) -> None:
    assert parse(f"a: {word}", "t")[0] == {"a": word}
