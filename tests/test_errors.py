"""Errors of the package: one sentence each, the same on the other side of a process boundary."""

from __future__ import annotations

import copy
import pickle

import pytest

from drillrig_pin.errors import DrillrigError, FieldError, ModelError, ResultFileError, Source

ERRORS = [
    ModelError("the mass is missing", where=Source("rig.urdf", 3), todo="Give it."),
    FieldError("duration = -1 is too small", where="study", way=("axes", 0, "list")),
    ResultFileError("no such result file"),
]


@pytest.mark.parametrize("error", ERRORS, ids=lambda error: type(error).__name__)
@pytest.mark.parametrize("carried", [lambda e: pickle.loads(pickle.dumps(e)), copy.copy], ids=["pickled", "copied"])
def test_an_error_is_the_same_in_another_process(error: DrillrigError, carried: object) -> None:
    """Studies are solved in worker processes: an error that could not be carried back would hide what went wrong."""
    back = carried(error)  # type: ignore[operator]
    assert type(back) is type(error)
    assert str(back) == str(error)
    assert vars(back) == vars(error)


def test_an_error_says_where_what_and_what_to_do() -> None:
    assert [str(error) for error in ERRORS] == [
        "rig.urdf:3: the mass is missing. Give it.",
        "study: duration = -1 is too small.",
        "no such result file.",
    ]


def test_of_a_sentence_without_end_the_beginning_and_the_end_are_shown() -> None:
    told = str(ModelError("a" * 5000 + "z", where="b" * 5000, todo="c" * 5000))
    assert len(told) < 3000
    assert "aaa...aaa" in told
    assert "az. c" in told
