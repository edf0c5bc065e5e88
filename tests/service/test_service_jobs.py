"""The queue on its own, with a carrier that does what the test says."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from queueing import Queue

from drillrig_pin.service import jobs as module
from drillrig_pin.service.problems import ServiceError
from drillrig_pin.service.work import Ending


@pytest.fixture
def queue(tmp_path: Path) -> Queue:
    return Queue(tmp_path)


def test_jobs_are_carried_out_in_the_order_they_were_asked_for(queue: Queue) -> None:
    for name in "abc":
        assert queue.ask(name)[1]
    assert [queue.status(name) for name in "abc"] == ["running", "queued", "queued"]
    assert not queue.ask("b")[1]
    queue.carrier.ends["a"](Ending(summary={"x": 1}))
    assert [queue.status(name) for name in "abc"] == ["completed", "running", "queued"]
    queue.carrier.ends["a"](Ending(summary={"x": 2}))
    job = queue.records.job("a", "run")
    assert job is not None
    assert job.summary == {"x": 1}
    assert queue.jobs.progress(job) == 1.0


def test_a_full_queue_says_when_to_come_back(tmp_path: Path) -> None:
    queue = Queue(tmp_path, limit=2)
    for name in "abc":
        queue.ask(name)
    with pytest.raises(ServiceError, match="2 jobs are waiting already") as told:
        queue.ask("d")
    assert told.value.status == 429
    assert int(told.value.headers["Retry-After"]) >= 1
    assert not queue.ask("c")[1]
    assert queue.records.job("d", "run") is None


def test_a_job_that_takes_its_worker_with_it_is_given_up_after_three_times(queue: Queue) -> None:
    queue.ask("a")
    for _ in range(3):
        assert queue.status("a") == "running"
        queue.carrier.ends["a"](Ending(died="exit code -9"))
    job = queue.records.job("a", "run")
    assert job is not None
    assert job.status == "failed"
    assert "ended 3 times (exit code -9)" in (job.error or {})["detail"]
    assert queue.ask("a")[1]


def test_a_failure_of_the_job_stays_and_one_of_the_server_is_tried_again(queue: Queue) -> None:
    for name, passing in (("a", False), ("b", True)):
        queue.ask(name)
        queue.carrier.ends[name](Ending(problem={"detail": "no"}, passing=passing))
        assert queue.status(name) == "failed"
        assert queue.ask(name)[1] is passing


def test_what_was_cancelled_tells_nothing_any_more(queue: Queue) -> None:
    a, _ = queue.ask("a")
    b, _ = queue.ask("b")
    queue.jobs.cancel(b)
    queue.jobs.cancel(a)
    assert queue.carrier.works["a"].stopped
    late = queue.carrier.ends["a"]
    assert [queue.status(name) for name in "ab"] == ["cancelled", "cancelled"]
    queue.ask("a")
    late(Ending(summary={"from": "the first time"}))
    assert queue.status("a") == "running"
    assert queue.jobs.running == 1


def test_the_next_server_goes_on_and_counts_only_ends_without_a_word(tmp_path: Path) -> None:
    for _ in range(4):
        ordered = Queue(tmp_path)
        ordered.jobs.recover()
        ordered.ask("a")
        ordered.ask("b")
        assert ordered.status("a") == "running"
        ordered.jobs.close()
        ordered.records.close()
    for _ in range(3):
        killed = Queue(tmp_path)
        killed.jobs.recover()
        assert killed.status("a") == "running"
        killed.records.close()
    last = Queue(tmp_path)
    last.jobs.recover()
    assert (last.status("a"), last.status("b")) == ("failed", "running")
    job = last.records.job("a", "run")
    assert job is not None
    assert "the server ended 3 times" in (job.error or {})["detail"]


def test_jobs_wait_for_a_cluster_that_went_away(queue: Queue, monkeypatch: pytest.MonkeyPatch) -> None:
    waits: list[Callable[[], None]] = []

    class Timer:
        daemon = False

        def __init__(self, seconds: float, call: Callable[[], None]) -> None:
            waits.append(call)

        def start(self) -> None:
            pass

    monkeypatch.setattr(module.threading, "Timer", Timer)
    queue.carrier.gone = True
    queue.ask("a")
    queue.ask("b")
    assert [queue.status(name) for name in "ab"] == ["queued", "queued"]
    (again,) = waits
    queue.carrier.gone = False
    again()
    assert [queue.status(name) for name in "ab"] == ["running", "queued"]
