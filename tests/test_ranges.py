"""Ranges of a model's numbers: those shipped fit their model, broken ones are refused with the file."""

from __future__ import annotations

from pathlib import Path

import pytest

from drillrig_pin.errors import ModelError
from drillrig_pin.files import shipped_models
from drillrig_pin.model.modelfile import read_model
from drillrig_pin.model.ranges import read_ranges


def test_shipped_ranges_are_about_numbers_of_their_model_and_hold_its_own() -> None:
    for path in shipped_models().values():
        rows = read_model(path).parameters()
        for name, known in read_ranges(path).items():
            assert known.low <= float(rows[name].value) <= known.high, name
            assert known.source.partition(":")[0] in ("paper", "derived", "assumed")


@pytest.mark.parametrize(
    "text", ["length: 3", "length: {low: 1}", "length: {low: a, high: b, source: x}", "[1, 2]", "a: {", "\0"]
)
def test_a_broken_file_of_ranges_is_named(tmp_path: Path, text: str) -> None:
    (tmp_path / "params").mkdir()
    (tmp_path / "params" / "rig.ranges.yaml").write_text(text)
    with pytest.raises(ModelError, match=r"rig\.ranges\.yaml"):
        read_ranges(tmp_path / "rig.urdf.xacro")


def test_a_range_has_its_ends_in_order_and_a_model_need_not_have_any(tmp_path: Path) -> None:
    assert read_ranges(tmp_path / "rig.urdf") == {}
    (tmp_path / "params").mkdir()
    (tmp_path / "params" / "rig.ranges.yaml").write_text("length: {low: 2, high: 1, source: x}")
    with pytest.raises(ModelError, match="range of 'length' is none: 2 to 1"):
        read_ranges(tmp_path / "rig.urdf")
