"""Numbers as people read them."""

from __future__ import annotations

import math

import pytest

from drillrig_pin.words import measure_name, quantity, reading


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (0.0123, "m", "12.3 mm"),
        (2.0, "m", "2.00 m"),
        (3.2e-6, "m", "3.20 µm"),
        (math.radians(0.5), "rad", "0.500°"),
        (21.1e6, "Pa", "211 bar"),
        (-4567.0, "N", "-4.57 kN"),
        (12.0, "N", "12.0 N"),
        (0.25, "1", "25.0 %"),
        (3.0, "s", "3.00 s"),
        (None, "m", "–"),
        (math.nan, "m", "nan m"),
    ],
)
def test_a_quantity_is_written_in_the_unit_people_use(value: float | None, unit: str, text: str) -> None:
    assert quantity(value, unit) == text


def test_the_unit_follows_the_size() -> None:
    assert [reading("m", size)[0] for size in (1.0, -0.01, 1e-6, 0.0)] == ["m", "mm", "µm", "µm"]
    assert reading("kg", 3.0) == ("kg", 1.0)


def test_names_of_measures_read_as_words() -> None:
    assert measure_name("toe_9.5m") == "Toe offset at 9.5 m"
    assert measure_name("angle") == "Angle error of the feed"
