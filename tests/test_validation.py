"""The short form of `scripts/validate.py`: the same claims on smaller cases."""

from __future__ import annotations

import math

import pytest
from validation.page import render
from validation.record import Row, Section
from validation.sections import SECTIONS


@pytest.mark.parametrize("section", SECTIONS, ids=lambda section: section.title)
def test_every_claim_holds_or_is_known_not_to(section: Section) -> None:
    rows = list(section.rows(True))
    assert rows
    failed = [row for row in rows if not row.met and not row.miss]
    assert not failed, failed
    repaired = [row for row in rows if row.met and row.miss]
    assert not repaired, ("these hold now; take their excuse away", repaired)


def test_a_figure_that_is_no_number_or_beyond_its_bar_is_not_met() -> None:
    assert Row("c", "r", 1.0, high=1.0).met
    assert not Row("c", "r", math.nan, high=1.0).met
    assert not Row("c", "r", 3.0, 3.5, 4.5).met


def test_the_page_counts_what_holds_and_says_what_does_not() -> None:
    rows = [
        Row("a|b", "r", 1.0, high=2.0, unit="m"),
        Row("c", "r", 3.0, high=2.0),
        Row("d", "r", 3.0, high=2.0, miss="why"),
    ]
    page = render([(Section("A title", "How.", lambda short: rows), rows)])
    assert "1 of 3 claims hold; 1 known not to hold, each with its reason; **1 fail**." in page
    assert "| a\\|b | r | 1 m | ≤ 2 m | holds |" in page
    assert "| c | r | 3 | ≤ 2 | **fails** |" in page
    assert "| d | r | 3 | ≤ 2 | no: why |" in page
    assert "[A title](#a-title) | 3 | 1 |" in page
