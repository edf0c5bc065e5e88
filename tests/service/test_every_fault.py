"""The n-th thing that a server asks of its disk or memory fails, for n = 1, 2, 3, ...: no job is lost or doubled.

Long form, with real runs in place of small files: DRILLRIG_LONG=1 python -m pytest tests/service/test_every_fault.py
"""

from __future__ import annotations

import contextlib
import errno
import os
import sqlite3
from collections.abc import Callable
from concurrent.futures import Future
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from faults import MOST, Fault
from inside import Timers, timers  # noqa: F401

from drillrig_pin.errors import DrillrigError, ResultFileError
from drillrig_pin.files import saving
from drillrig_pin.service import runs, worker
from drillrig_pin.service.kept import METRICS, RESULT, sha256_of
from drillrig_pin.service.library import Library
from drillrig_pin.service.records import Job
from drillrig_pin.service.service import Service
from drillrig_pin.service.settings import Limits, Settings

LONG = bool(os.environ.get("DRILLRIG_LONG"))
NAMES = {name: name * 32 for name in "abcde"}


class OneByOne:
    """A pool that carries out a task when the test says so."""

    local, workers = True, 1
    tasks: list[tuple[Future[Any], Callable[..., Any], tuple[Any, ...]]]

    def __init__(self, *_: Any, **__: Any) -> None:
        pass

    def submit(self, timeout: float | None, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        future: Future[Any] = Future()
        self.tasks.append((future, function, arguments))
        return future

    @classmethod
    def work(cls) -> None:
        """Carry out the task that waits longest."""
        while cls.tasks:
            future, function, arguments = cls.tasks.pop(0)
            if future.set_running_or_notify_cancel():
                future.set_result(function(*arguments))
                return

    def require_alive(self) -> None:
        pass

    def close(self) -> None:
        self.tasks.clear()


class Base:
    """Between the records and their file: what is written there is asked for as well."""

    def __init__(self, base: sqlite3.Connection, fault: Fault, place: Path, *, late: bool) -> None:
        self.base, self._fault, self._place, self._late = base, fault, place, late

    def execute(self, statement: str, values: list[Any]) -> Any:
        if self._late:
            # The disk takes it, and says that it did not.
            self.base.execute(statement, values)
        try:
            self._fault.ask("record", self._place)
        except OSError:
            error = sqlite3.OperationalError("refused")
            error.sqlite_errorcode = sqlite3.SQLITE_IOERR_FSYNC if self._late else sqlite3.SQLITE_FULL
            raise error from None
        return None if self._late else self.base.execute(statement, values)

    def close(self) -> None:
        self.base.close()


def small(order: worker.Order, folder: Path) -> worker.Answer:
    """What a run leaves behind, without a simulation."""
    with worker._progress(folder / worker.PROGRESS, 1.0, 60.0) as tick:
        tick(0.5)
    for name in (RESULT, METRICS):
        with saving(folder / name, where=None) as aside:
            aside.write_bytes(name.encode())
    beside = {METRICS: sha256_of(folder / METRICS)}
    return worker.Answer(summary={}, digest=sha256_of(folder / RESULT), beside=beside)


@pytest.fixture
def small_runs(monkeypatch: pytest.MonkeyPatch, timers: type[Timers]) -> type[Timers]:  # noqa: F811
    monkeypatch.setattr(runs, "LocalPool", OneByOne)
    if not LONG:
        monkeypatch.setattr(worker, "_into", small)
        entry = SimpleNamespace(path="", text="x", fingerprint="f")
        monkeypatch.setattr(Library, "entry", lambda library, name: entry)
    return timers


class Server:
    """A service whose jobs are carried out one by one."""

    def __init__(self, data: Path, fault: Fault | None = None, *, late: bool = False) -> None:
        OneByOne.tasks = []
        self.steps: list[tuple[str, str]] = []
        settings = Settings(data, workers=1, limits=Limits(job_memory=0, output=0))
        self.service = Service(settings, lambda step, job: self.steps.append((job.id, step)))
        if fault is not None:
            base = self.service.records._base
            base._writer = Base(base._writer, fault, data / "records.sqlite", late=late)  # type: ignore[assignment]
        self.service.jobs.recover()

    def ask(self, name: str) -> None:
        request = {"model": "mkz49", "arguments": {}, "scenario": {"duration": 0.01, "name": name}}
        self.service.submit(Job(NAMES[name], "run", "queued", name, "mkz49", name, request))

    def job(self, name: str) -> Job | None:
        return self.service.records.job(NAMES[name], "run")

    def mend(self, fault: Fault) -> None:
        """From now on the disk takes what is written, also into files that are open already."""
        fault._number = 0
        base = self.service.records._base
        if isinstance(base._writer, Base):
            base._writer = base._writer.base

    def killed(self) -> None:
        """The process ends without a word: what was only in memory is gone."""
        records = self.service.records
        records._kept, records._forgotten = {}, set()
        records.close()
        self.service._lock.close()

    def stop(self) -> None:
        self.service.close()


def a_day(server: Server, acknowledged: set[str], forgotten: set[str]) -> None:
    """What clients ask of a server. Whoever is refused knows it."""

    def asked(function: Callable[..., Any], *arguments: Any) -> bool:
        with contextlib.suppress(DrillrigError, MemoryError):
            function(*arguments)
            return True
        return False

    for name in "abcd":
        if asked(server.ask, name):
            acknowledged.add(name)
    OneByOne.work()
    for name, verb in (("c", server.service.jobs.cancel), ("d", lambda job: server.service.delete(job.id, "run"))):
        job = server.job(name)
        if job is not None and asked(verb, job) and name == "d":
            forgotten.add(name)
    job = server.job("a")
    if job is not None and job.status == "completed":
        server.service.seal(job, "report.html", "0")
    OneByOne.work()


def drained(server: Server, timers: type[Timers]) -> None:  # noqa: F811
    """Let everything come to its end."""
    for _ in range(40):
        timers.fire()
        OneByOne.work()
        if not (timers.waiting or OneByOne.tasks or server.service.jobs.waiting):
            break


def all_is_well(server: Server, acknowledged: set[str], forgotten: set[str]) -> None:
    assert (server.service.jobs.waiting, server.service.jobs.running) == (0, 0)
    assert server.service.problems() == []
    for name in acknowledged - forgotten:
        job = server.job(name)
        assert job is not None, f"{name} is lost"
        assert job.ended, f"{name} is {job.status}"
        if job.status == "completed":
            assert server.service.sound(job, RESULT), name
            assert server.service.sound(job, METRICS), name
        elif job.status == "failed":
            assert (job.error or {})["detail"].endswith(".")
    listed = [job.id for job in server.service.records.jobs("run")]
    assert len(listed) == len(set(listed))
    assert not {NAMES[name] for name in forgotten} & set(listed)


class Short(Fault):
    """Memory runs out instead."""

    def ask(self, what: str, path: object) -> None:
        try:
            super().ask(what, path)
        except OSError:
            raise MemoryError from None


@pytest.mark.parametrize("kind", ["full", "once", "late", "memory"])
def test_every_job_that_was_taken_is_there_once_whatever_fails(
    tmp_path: Path,
    small_runs: type[Timers],
    kind: str,
) -> None:
    error = errno.ENOSPC if kind == "full" else errno.EIO
    struck = []
    for number in range(1, MOST, 1 if LONG else 3):
        # Every other time the server is killed after it, and the next one takes up what is left.
        killed = bool(number % 2)
        fault = (Short if kind == "memory" else Fault)(tmp_path, number, error, lasting=kind == "full")
        data = tmp_path / str(len(struck))
        acknowledged: set[str] = set()
        forgotten: set[str] = set()
        server = None
        with fault:
            # A server that cannot start says so, and nobody has asked it for anything yet.
            with contextlib.suppress(ResultFileError, MemoryError):
                server = Server(data, fault, late=kind == "late")
            if server is not None:
                a_day(server, acknowledged, forgotten)
        struck.append(fault.struck)
        if server is not None:
            server.mend(fault)
        if server is not None and killed:
            server.killed()
            server = None
            # What was forgotten in memory only comes back: nothing is lost by that.
            forgotten = set()
        server = server or Server(data)
        server.service.jobs.settle_later()
        drained(server, small_runs)
        if killed:
            acknowledged.discard("d")
        all_is_well(server, acknowledged, forgotten)
        assert all(server.steps.count((number, "completed")) <= 1 for number in NAMES.values())
        server.ask("e")
        drained(server, small_runs)
        assert (server.job("e") or server).status == "completed"  # type: ignore[union-attr]
        stood = server.service.records.jobs("run")
        server.stop()
        again = Server(data)
        assert again.service.records.jobs("run") == stood
        again.stop()
        if not fault.struck:
            break
    assert len(struck) > (20 if LONG else 6)
    if LONG:
        assert {what.split()[0] for what in struck if what} >= {"open", "mkdir", "rename", "record"}
