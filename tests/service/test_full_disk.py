"""A disk that takes nothing stops nothing: how jobs end is kept and recorded later, and the queue goes on by itself."""

from __future__ import annotations

import errno
import os
import shutil
import sqlite3
from pathlib import Path

import pytest
from inside import Timers, timers  # noqa: F401
from queueing import Disk, Queue

from drillrig_pin.batch.store import Store
from drillrig_pin.batch.worker import TIME_LIMIT, Answer
from drillrig_pin.service import rendering
from drillrig_pin.service.kept import kept, write_text
from drillrig_pin.service.problems import ServiceError
from drillrig_pin.service.records import Job
from drillrig_pin.service.service import Service
from drillrig_pin.service.settings import Limits, Settings
from drillrig_pin.service.studies import StudyCarrier
from drillrig_pin.service.work import Ending

CODES = [
    (sqlite3.SQLITE_FULL, 507, "the disk is full"),
    (sqlite3.SQLITE_READONLY, 507, "only be read"),
    (sqlite3.SQLITE_IOERR_FSYNC, 507, "the disk failed"),
    (sqlite3.SQLITE_BUSY, 503, "another program"),
    (sqlite3.SQLITE_CORRUPT, 503, "damaged"),
    (sqlite3.SQLITE_NOMEM, 503, "memory"),
]


@pytest.fixture
def queue(tmp_path: Path) -> Queue:
    return Queue(tmp_path)


@pytest.mark.parametrize(("code", "status", "words"), CODES)
def test_an_end_is_kept_the_slot_is_free_and_the_queue_goes_on_when_there_is_room(
    queue: Queue,
    timers: type[Timers],  # noqa: F811
    code: int,
    status: int,
    words: str,
) -> None:
    for name in "abc":
        queue.ask(name)
    disk = Disk(queue.records)
    disk.code = code
    queue.carrier.ends["a"](Ending(summary={"x": 1}, digest="d", beside={"m": "e"}))
    assert (queue.status("a"), queue.jobs.running) == ("completed", 0)
    assert queue.job("a").beside == {"m": "e"}
    assert [job.id for job in queue.records.jobs("run", status="completed")] == ["a"]
    assert "a" not in [job.id for job in queue.records.jobs("run", status="running")]
    assert words in queue.records.trouble
    assert words in queue.jobs.held
    with pytest.raises(ServiceError) as told:
        queue.ask("d")
    assert (told.value.status, words in told.value.what) == (status, True)
    assert queue.records.job("d", "run") is None
    queue.jobs.cancel(queue.job("c"))
    assert queue.status("c") == "cancelled"
    assert queue.on_disk() == {"a": "running", "b": "queued", "c": "queued"}

    timers.fire()
    assert queue.status("b") == "queued"
    disk.code = 0
    timers.fire()
    assert queue.on_disk() == {"a": "completed", "b": "running", "c": "cancelled"}
    assert (queue.records.trouble, queue.jobs.held, queue.records.unrecorded) == ("", "", 0)
    queue.carrier.ends["b"](Ending(summary={}))
    assert queue.status("b") == "completed"
    assert not timers.waiting
    assert queue.steps.count(("a", "completed")) == 1


def test_a_job_goes_back_when_its_beginning_cannot_be_recorded(
    queue: Queue,
    timers: type[Timers],  # noqa: F811
) -> None:
    for name in "abc":
        queue.ask(name)
    disk = Disk(queue.records)
    disk.code, disk.only = sqlite3.SQLITE_FULL, "running"
    queue.jobs.cancel(queue.job("a"))
    assert [queue.status(name) for name in "abc"] == ["cancelled", "queued", "queued"]
    assert (queue.jobs.running, queue.jobs.waiting) == (0, 2)
    disk.code = 0
    timers.fire()
    assert [queue.status(name) for name in "abc"] == ["cancelled", "running", "queued"]


@pytest.mark.parametrize("error", [OSError(errno.ENOSPC, "full"), MemoryError(), ServiceError(503, "locked")])
def test_what_the_machine_lacks_is_waited_for(
    queue: Queue,
    timers: type[Timers],  # noqa: F811
    monkeypatch: pytest.MonkeyPatch,
    error: Exception,
) -> None:
    def start(job: Job, ended: object) -> None:
        raise error

    with monkeypatch.context() as patch:
        patch.setattr(queue.carrier, "start", start)
        queue.ask("a")
        queue.ask("b")
    assert [queue.status(name) for name in "ab"] == ["queued", "queued"]
    assert queue.job("a").attempts == 0
    assert queue.jobs.held
    timers.fire()
    assert [queue.status(name) for name in "ab"] == ["running", "queued"]


def test_a_job_that_cannot_be_begun_fails_and_the_next_one_is(queue: Queue, monkeypatch: pytest.MonkeyPatch) -> None:
    real = queue.carrier.start
    monkeypatch.setattr(queue.carrier, "start", lambda job, ended: real(None if job.id == "a" else job, ended))  # type: ignore[arg-type]
    queue.ask("a")
    queue.ask("b")
    assert [queue.status(name) for name in "ab"] == ["failed", "running"]
    assert "could not be begun (AttributeError" in (queue.job("a").error or {})["detail"]


def test_a_log_that_cannot_be_written_stops_nothing(queue: Queue) -> None:
    def full(step: str, job: Job) -> None:
        raise OSError(errno.ENOSPC, "full")

    queue.jobs.listener = full
    queue.ask("a")
    queue.carrier.ends["a"](Ending(summary={}))
    assert queue.status("a") == "completed"


def test_a_job_that_is_recorded_and_in_no_queue_is_queued_when_it_is_asked_for(queue: Queue) -> None:
    # As a disk leaves it that takes a record and says that it did not.
    queue.records.add(Job("a", "run", "queued", "a", "m", "a", {}))
    assert queue.ask("a")[1]
    assert queue.status("a") == "running"


def test_what_is_recorded_between_two_ends_resets_their_count(tmp_path: Path) -> None:
    reached: dict[str, int] = {}
    for attempt in range(8):
        server = Queue(tmp_path, reached=reached)
        server.jobs.recover()
        server.ask("a")
        assert server.status("a") == "running"
        if attempt % 2:
            reached["a"] = attempt
        server.records.close()
    for attempt in range(8):
        server.carrier.recorded["a"] = attempt + 100
        if attempt == 0:
            server = Queue(tmp_path, reached=server.carrier.recorded)
            server.jobs.recover()
        server.carrier.ends["a"](Ending(died="exit code 1"))
        assert server.status("a") == "running"
    for _ in range(3):
        server.carrier.ends["a"](Ending(died="exit code 1"))
    told = (server.job("a").error or {})["detail"]
    assert "ended 3 times (exit code 1)" in told
    assert "memory" not in told


def test_the_end_of_the_server_is_not_held_against_a_job_while_others_come_to_their_end(tmp_path: Path) -> None:
    for attempt in range(6):
        server = Queue(tmp_path)
        server.carrier.slots = 2  # type: ignore[misc]
        server.jobs.recover()
        server.ask("a")
        server.ask(f"other {attempt}")
        server.carrier.ends[f"other {attempt}"](Ending(summary={}))
        server.records.close()
    for _ in range(3):
        server = Queue(tmp_path)
        server.jobs.recover()
        server.records.close()
    last = Queue(tmp_path)
    last.jobs.recover()
    told = (last.job("a").error or {})["detail"]
    assert "the server ended 3 times" in told
    assert "memory" not in told


def test_a_killed_process_is_called_killed(queue: Queue) -> None:
    queue.ask("a")
    for _ in range(3):
        queue.carrier.ends["a"](Ending(died="exit code -9"))
    assert "SIGKILL" in (queue.job("a").error or {})["todo"]


@pytest.fixture
def service(tmp_path: Path) -> Service:
    return Service(Settings(tmp_path / "data"), lambda step, job: None)


def test_progress_of_a_study_is_what_no_later_attempt_computes_again(service: Service) -> None:
    job = Job("e" * 32, "study", "running", "s", "m", "s", {})
    carrier = service.jobs.carriers["study"]
    assert isinstance(carrier, StudyCarrier)
    assert carrier.reached(job) == 0
    store = Store(service.folder(job))
    store.record([Answer("1"), Answer("2")])
    store.record([Answer("3", status=TIME_LIMIT)])
    store.close()
    assert carrier.reached(job) == 2
    service.close()


def test_a_job_is_forgotten_on_a_full_disk_and_its_room_is_free(service: Service) -> None:
    job = Job("f" * 32, "run", "completed", "s", "m", "s", {})
    service.records.add(job)
    service.folder(job).mkdir()
    (service.folder(job) / "run.nc").write_bytes(b"x")
    disk = Disk(service.records)
    disk.code = sqlite3.SQLITE_FULL
    service.delete(job.id, "run")
    assert not service.folder(job).exists()
    assert service.records.job(job.id, "run") is None
    assert service.records.jobs("run") == []
    (told,) = service.problems()
    assert "kept in memory until it can be recorded: 1" in told
    assert "the disk is full" in told
    disk.code = 0
    assert service.records.settle()
    assert service.problems() == []
    service.close()


def test_files_that_cannot_be_removed_leave_the_job_as_it_is(service: Service, monkeypatch: pytest.MonkeyPatch) -> None:
    job = Job("f" * 32, "run", "completed", "s", "m", "s", {})
    service.records.add(job)
    service.folder(job).mkdir()

    def read_only(*_: object) -> None:
        raise OSError(errno.EROFS, os.strerror(errno.EROFS))

    with monkeypatch.context() as patch:
        patch.setattr(os, "rename", read_only)
        with pytest.raises(ServiceError, match="cannot be removed \\(Read-only file system\\)"):
            service.delete(job.id, "run")
    assert service.records.job(job.id, "run") == job
    # The next attempt, and what somebody removed by hand.
    shutil.rmtree(service.folder(job))
    service.delete(job.id, "run")
    assert service.records.job(job.id, "run") is None
    service.close()


def test_what_is_drawn_and_finds_no_room_says_so(tmp_path: Path) -> None:
    def full(target: Path) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(target))

    for function in (full, lambda target: write_text(target / "nowhere" / "x", "")):
        made = rendering.guarded(Limits(job_memory=0, output=0), kept, tmp_path / "x.html", function, tmp_path)
        assert made.problem is not None
        assert made.problem["status"] == 507
        assert str(tmp_path) not in str(made.problem)
