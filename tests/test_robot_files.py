"""URDF files nobody made for this package: each is read, or refused for a true reason in one sentence."""

from __future__ import annotations

from importlib.metadata import distribution
from pathlib import Path

import pytest

from drillrig_pin import ModelError
from drillrig_pin.model.modelfile import read_model
from drillrig_pin.rig import build_rig

#: Why some are refused: what their authors left out, or wrote wrongly.
REASONS = {
    "quadrotor_base.urdf": "no moving joint",
    "iris_simple.urdf": "no moving joint",
    "ur3.urdf": "no link",
    "alex_psyonic_hands.urdf": "no moving joint 'index_q1'",
    "romeo_laas_small.urdf": "principal moment of inertia is negative",
    "tiago.urdf": "principal moment of inertia is negative",
    "tiago_dual.urdf": "principal moment of inertia is negative",
    "tiago_no_hand.urdf": "principal moment of inertia is negative",
}
FILES = sorted(
    {Path(str(file.locate())) for file in distribution("example-robot-data").files or () if file.name.endswith(".urdf")}
)


def test_there_are_files() -> None:
    assert len(FILES) > 60


@pytest.mark.parametrize("path", FILES, ids=[path.name for path in FILES])
def test_it_is_read_or_refused_for_a_true_reason(path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    refused = ""
    try:
        assert build_rig(read_model(path)).model.nv > 0
    except ModelError as error:
        refused = str(error)
    if path.name in REASONS or refused:
        assert path.name in REASONS, refused
        assert REASONS[path.name] in refused
        assert "\n" not in refused
    assert capfd.readouterr().err == ""
