"""The time loop of the core asks for no memory: ten times the steps and samples ask for it no more often."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

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
    explicit = {name: pair for name, pair in counts.items() if "RODAS" not in name}
    assert {name: pair for name, pair in explicit.items() if pair[0] != pair[1]} == {}
    for word in ("null_space", "redundant", "floating", "contact", "RK4", "DOP853", "without projection"):
        assert any(word in name for name in explicit), word


def test_rodas_asks_once_a_step_where_odeint_adds_its_matrices(counts: dict[str, list[int]]) -> None:
    # boost::numeric::odeint::rosenbrock4 writes `jac += identity / ...`, for which ublas makes one temporary.
    rodas = {name: pair for name, pair in counts.items() if "RODAS" in name}
    assert rodas
    # The step is 1 / 2000 of the run at most; samples and switches shorten some.
    assert {name: pair for name, pair in rodas.items() if pair[1] - pair[0] > 1.5 * (2000 - 200)} == {}


def test_the_counter_counts(counts: dict[str, list[int]]) -> None:
    # A run makes its workspace once: some hundred requests. Zero would mean that nothing was counted.
    assert all(10 < pair[0] < 2000 for name, pair in counts.items() if "RODAS" not in name), counts
