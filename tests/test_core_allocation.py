"""The time loop of the core asks for no memory: ten times the steps and samples ask for it no more often."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from drillrig_pin.scenario import CORE_METHODS

pytest.importorskip("drillrig_pin.core", reason="the package was built without a C++ compiler")

HERE = Path(__file__).parent / "core"


@pytest.fixture(scope="module")
def counter(tmp_path_factory: pytest.TempPathFactory) -> Path:
    library = tmp_path_factory.mktemp("counter") / "count_allocations.so"
    source = HERE / "count_allocations.c"
    subprocess.run(["gcc", "-O2", "-shared", "-fPIC", "-fno-builtin", "-o", str(library), str(source)], check=True)
    return library


@pytest.fixture(scope="module")
def counts(counter: Path) -> dict[str, list[int]]:
    answer = subprocess.run(
        [sys.executable, str(HERE / "count_in_runs.py")],
        env={**os.environ, "LD_PRELOAD": str(counter)},
        check=True,
        capture_output=True,
        text=True,
    )
    return dict(json.loads(answer.stdout))


def test_ten_times_the_steps_and_samples_ask_for_memory_no_more_often(counts: dict[str, list[int]]) -> None:
    assert {name: pair for name, pair in counts.items() if pair[0] != pair[1]} == {}
    for word in (
        "null_space",
        "damped",
        "redundant",
        "floating",
        "contact",
        "geared",
        "without projection",
        *CORE_METHODS,
    ):
        assert any(word in name for name in counts), word


def test_the_counter_counts(counts: dict[str, list[int]]) -> None:
    # A run makes its workspace once: some hundred requests. Zero would mean that nothing was counted.
    assert all(10 < pair[0] < 2000 for pair in counts.values()), counts
