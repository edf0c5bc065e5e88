"""The one reader of YAML: what it refuses, and the line it says."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from drillrig_pin import ModelError, Scenario, ScenarioError, load_rig, load_scenario
from drillrig_pin.yamlfile import MAX_BYTES, read_fields


def read(folder: Path, text: str | bytes) -> tuple[dict[str, object], object]:
    path = folder / "some.yaml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_fields(path, "a list")


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("a: 1\nb: *c", 2, "aliases"),
        ("a: 1\nb: !!float x", 2, "tags such as"),
        ("a:\n  !thing {}", 2, "tags such as !thing"),
        ("a: 1\nb: [1]]", 2, "YAML"),
        ("a: 1\n\n\tb: 2", 3, "YAML"),
        ("a: " + "[" * 30, 1, "nested deeper than 20 levels"),
        ("a: 2024-99-99", 0, "YAML"),
        ("a: " + "9" * 5000, 0, "YAML"),
        ("? [a]\n: b", 1, "unhashable"),
        ("a: 1\n---\nb: 2", 2, "another document"),
        ("a: \x07", 0, "YAML"),
        (b"a: \xff", 0, "YAML"),
        ("- a", 0, "a list is a list of `field: value` lines"),
        ("1: a", 0, "field: value"),
    ],
)
def test_what_is_no_plain_list_of_fields_is_refused_with_its_line(
    tmp_path: Path, text: str | bytes, line: int, words: str
) -> None:
    with pytest.raises(ScenarioError) as caught:
        read(tmp_path, text)
    sentence = str(caught.value)
    assert words in sentence
    assert "\n" not in sentence
    assert f"some.yaml:{line}: " in sentence if line else "some.yaml: " in sentence


def test_every_entry_knows_its_line(tmp_path: Path) -> None:
    content, lines = read(tmp_path, "\ufeffa: 1\nb:\n  - c: 2\n    d: 3\n  - 4\n")
    assert content == {"a": 1, "b": [{"c": 2, "d": 3}, 4]}
    for way, line in {("a",): 1, ("b",): 2, ("b", 0, "d"): 4, ("b", 1): 5, ("b", 0, "x"): 3, ("nowhere",): 1}.items():
        assert lines.at(way).line == line  # type: ignore[attr-defined]
    assert read(tmp_path, "# nothing\n")[0] == {}


def test_the_largest_file_takes_seconds_at_most_and_a_larger_one_is_refused(tmp_path: Path) -> None:
    text = "a: [" + "1," * ((MAX_BYTES - 10) // 2) + "]"
    started = time.process_time()
    assert len(read(tmp_path, text)[0]["a"]) == (MAX_BYTES - 10) // 2  # type: ignore[arg-type]
    assert time.process_time() - started < 20
    with pytest.raises(ScenarioError, match="larger than 1 MB"):
        read(tmp_path, text + " " * 20)


def test_a_table_of_numbers_that_a_model_loads_is_held_to_the_same(tmp_path: Path) -> None:
    model = "<robot name='r' xmlns:xacro='x'><xacro:property name='P' value='${xacro.load_yaml(&quot;p.yaml&quot;)}'/>"
    (tmp_path / "rig.urdf.xacro").write_text(model + "<link name='${P[\"a\"]}'/></robot>")
    for text, words in (("a: &b [1]\nc: *b", "aliases"), ("a: " + "[" * 30, "nested deeper"), ("a: \xff", "moving")):
        (tmp_path / "p.yaml").write_text(text)
        with pytest.raises(ModelError, match=words):
            load_rig(tmp_path / "rig.urdf.xacro")
    (tmp_path / "p.yaml").write_text("a: !degrees 180")
    with pytest.raises(ModelError, match="moving joint"):
        load_rig(tmp_path / "rig.urdf.xacro")


def test_a_wrong_field_of_a_scenario_is_shown_with_its_line(tmp_path: Path) -> None:
    path = tmp_path / "case.yaml"
    path.write_text("duration: 2\nintegrator:\n  method: RK4\n  rtol: 3\n")
    with pytest.raises(ScenarioError, match=r"case\.yaml:4: scenario\.integrator\.rtol"):
        load_scenario(path)
    path.write_text("duration: 2\n")
    with pytest.raises(ScenarioError, match=r"^no field|^the scenario has no field 'integrator\.rtl'"):
        load_scenario(path, **{"integrator.rtl": 1e-3})
    assert load_scenario(path, output_rate=7.0) == Scenario(name="case", duration=2.0, output_rate=7.0)
