"""Whatever a disk refuses, and whenever: a study loses nothing that it recorded, and the same command completes it.

Every single thing that is asked of the disk fails once, one after the other. ``DRILLRIG_FAULTS=all`` tries all of them
with both ways to fail; else those of a full disk, and every third of a disk that fails once.
"""

from __future__ import annotations

import errno
import os
from collections.abc import Callable
from concurrent.futures import Future
from pathlib import Path
from types import SimpleNamespace
from typing import Any, ClassVar

import pyarrow.parquet
import pytest
from command import Command
from faults import every_fault
from rigs import mass_on_cylinder

import drillrig_pin.batch.session
import drillrig_pin.batch.worker
from drillrig_pin.batch.runner import run_study
from drillrig_pin.batch.store import recorded
from drillrig_pin.batch.study import Study
from drillrig_pin.errors import DrillrigError, Outcome, Status
from drillrig_pin.files import saving
from drillrig_pin.scenario import Scenario

ALL = os.environ.get("DRILLRIG_FAULTS") == "all"
#: Number of the error, whether all that follows fails too, and which of the faults are tried.
WAYS = [(errno.ENOSPC, True, 1 if ALL else 2), (errno.EIO, False, 1 if ALL else 3)]


class Here:
    """A pool whose one worker is this process."""

    workers = 1
    local = True

    def submit(self, timeout: float | None, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        future: Future[Any] = Future()
        try:
            future.set_result(function(*arguments))
        except Exception as error:
            future.set_exception(error)
        return future

    def require_alive(self) -> None: ...

    def close(self) -> None: ...


class Run:
    """Stands for a case and its trajectory: what is asked of the disk is the same, and nothing is integrated."""

    time = (0.0, 1.0)
    cost: ClassVar[dict[str, float]] = {"wall_time": 0.0}
    content_hash = "same"
    outcome = Outcome(Status.COMPLETED, 1.0, 1)

    def __init__(self, rig: object, scenario: Scenario) -> None:
        self.speed = scenario.velocities["slide"]

    def run(self, progress: object) -> Run:
        return self

    def save(self, target: str | Path) -> None:
        with saving(Path(target), where=target) as aside:
            aside.write_text(f"a run at {self.speed}")


@pytest.fixture
def study(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Study:
    """Three cases, solved in this process and in no time."""
    monkeypatch.setattr(drillrig_pin.batch.session, "_started", lambda *_: Here())
    monkeypatch.setattr(drillrig_pin.batch.worker, "Case", Run)
    monkeypatch.setattr(drillrig_pin.batch.worker, "invalid", lambda run: [])
    monkeypatch.setattr(
        drillrig_pin.batch.worker,
        "measured",
        lambda run, names, rig: {"oil.p_max": SimpleNamespace(value=run.speed, unit="Pa")},
    )
    model = tmp_path / "press.urdf"
    model.write_text(mass_on_cylinder())
    scenario = {"model": str(model), "duration": 0.01, "output_rate": 200.0}
    axes = [{"name": "scenario.velocities.slide", "list": [0.0, 0.01, 0.02]}]
    return Study(scenario=scenario, axes=axes, metrics=["oil.p_max"])


def content(folder: Path) -> dict[str, list[Any]]:
    """The table but for the time it took."""
    found = pyarrow.parquet.read_table(folder / "results.parquet").to_pydict()
    return {name: values for name, values in found.items() if name not in ("solve_time", "wall_time")}


@pytest.mark.parametrize(("error", "lasting", "step"), WAYS, ids=["full", "once"])
def test_a_study_survives_every_fault_of_its_disk(
    study: Study, tmp_path: Path, error: int, lasting: bool, step: int
) -> None:
    whole, folder = tmp_path / "whole", tmp_path / "study"
    run_study(study, whole, keep="all")
    struck = set()
    for number, fault in enumerate(every_fault(tmp_path, error, lasting=lasting, step=step)):
        folder = tmp_path / f"study{number}"
        try:
            with fault:
                run_study(study, folder, keep="all")
            said = ""
        except DrillrigError as refused:
            said = str(refused)
        assert not fault.struck or os.strerror(error) in said, f"{fault.struck}: {said}"
        struck.add(fault.struck.partition(" ")[0])
        # What can be seen is whole, whoever looks at it now.
        safe = [answer.key for answer in recorded(folder)]
        for path in folder.glob("trajectories/case_*.nc"):
            assert path.read_text().startswith("a run at ")
        if (folder / "results.parquet").exists():
            assert len(content(folder)["key"]) <= len(safe)

        finished = run_study(study, folder, keep="all")
        assert finished.tally.before == len(safe), fault.struck
        assert content(folder) == content(whole), fault.struck
        keys = [answer.key for answer in recorded(folder)]
        assert len(keys) == len(set(keys)) == 3, fault.struck
        names = {str(path.relative_to(folder)) for path in folder.rglob("*")}
        assert {n for n in names if "journal/" not in n} == {
            str(path.relative_to(whole)) for path in whole.rglob("*") if "journal/" not in str(path)
        }, fault.struck
    assert struck >= {"open", "write", "rename"}


@pytest.mark.parametrize("words", [("run", "press.urdf", "-o", "out"), ("export", "run.nc", "--csv", "out")])
def test_one_file_is_there_as_a_whole_or_not_at_all(drillrig: Command, tmp_path: Path, words: tuple[str, ...]) -> None:
    Path("press.urdf").write_text(mass_on_cylinder())
    short = ("--set", "scenario.duration=0.01", "--no-estimate", "-q")
    words = (*words, *short) if words[0] == "run" else words
    assert drillrig("run", "press.urdf", *short, "-o", "run.nc").code == 0
    assert drillrig(*words).code == 0
    before = Path("out").read_bytes()
    for fault in every_fault(tmp_path, errno.ENOSPC, step=1 if ALL else 3):
        with fault:
            answer = drillrig(*words)
        if fault.struck:
            assert answer.code == 1, fault.struck
            assert answer.err.startswith("error: "), answer.err
            assert os.strerror(errno.ENOSPC) in answer.err
            assert Path("out").read_bytes() == before
    assert sorted(path.name for path in tmp_path.iterdir()) == ["out", "press.urdf", "run.nc"]
