"""A cluster that breaks says so in one sentence, whichever of the ways of its libraries it breaks in."""

from __future__ import annotations

import asyncio
import concurrent.futures
import socket
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import distributed
import pytest
from distributed.client import ClosedClientError

from drillrig_pin.batch.pools import BatchError, ClusterPool, DiedError, TimeOutError, outcome_of

#: What a client of Dask was seen to raise while its scheduler, its loop or itself went away.
BREAKS = [
    OSError("Timed out"),
    TimeoutError("timed out after 2 s."),
    RuntimeError("IOLoop is closed"),
    ClosedClientError("Client is closed. Can't send update-graph message."),
    concurrent.futures.CancelledError("scheduler-connection-lost"),
    asyncio.CancelledError(),
    UnboundLocalError("cannot access local variable 'result'"),
]
each_break = pytest.mark.parametrize("fault", BREAKS, ids=lambda fault: type(fault).__name__)


class Client:
    """A client that has lost its scheduler: it raises one fault wherever it is asked to."""

    status = "running"

    def __init__(self, at: str, fault: BaseException) -> None:
        self.at, self.fault = at, fault

    def __getattr__(self, name: str) -> Any:
        def answer(*arguments: Any, **options: Any) -> Any:
            if name == self.at:
                raise self.fault
            return {"a": 2}

        return answer


@pytest.fixture
def listening() -> Iterator[str]:
    """The address of something that listens and never answers."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        yield f"tcp://127.0.0.1:{server.getsockname()[1]}"


def pool_of(monkeypatch: pytest.MonkeyPatch, address: str, at: str, fault: BaseException) -> ClusterPool:
    def connect(*arguments: Any, **options: Any) -> Client:
        if at == "connect":
            raise fault
        return Client(at, fault)

    monkeypatch.setattr(distributed, "Client", connect)
    return ClusterPool(address)


@each_break
@pytest.mark.parametrize("at", ["connect", "wait_for_workers"])
def test_a_pool_without_a_scheduler_does_not_begin(
    monkeypatch: pytest.MonkeyPatch, listening: str, at: str, fault: BaseException
) -> None:
    with pytest.raises(BatchError, match=r"no scheduler answers|the scheduler (went away|has no workers)") as caught:
        pool_of(monkeypatch, listening, at, fault)
    assert listening in str(caught.value)


def test_another_version_of_the_scheduler_is_told_from_no_scheduler(
    monkeypatch: pytest.MonkeyPatch, listening: str
) -> None:
    with pytest.raises(BatchError, match=r"cannot be used .*Mismatched .*the same versions"):
        pool_of(monkeypatch, listening, "connect", ImportError("Mismatched versions found"))


@each_break
def test_a_scheduler_that_goes_away_in_the_middle_is_said(
    monkeypatch: pytest.MonkeyPatch, listening: str, fault: BaseException
) -> None:
    with pytest.raises(BatchError, match="the scheduler went away"):
        pool_of(monkeypatch, listening, "submit", fault).submit(None, abs, 1)
    assert pool_of(monkeypatch, listening, "nthreads", fault).workers == 1
    assert pool_of(monkeypatch, listening, "", fault).workers == 2
    pool_of(monkeypatch, listening, "close", fault).close()


def test_a_fault_of_our_own_is_not_put_on_the_scheduler(monkeypatch: pytest.MonkeyPatch, listening: str) -> None:
    with pytest.raises(TypeError, match="cannot pickle"):
        pool_of(monkeypatch, listening, "submit", TypeError("cannot pickle")).submit(None, abs, 1)


def future(value: Any = None, **raised: BaseException) -> Any:
    """A task that ended; ``exception`` and ``result`` may raise something of the connection instead of answering."""

    def method(name: str, answer: Any) -> Any:
        def call() -> Any:
            if name in raised:
                raise raised[name]
            return answer

        return call

    return SimpleNamespace(cancelled=lambda: False, exception=method("exception", None), result=method("result", value))


@each_break
@pytest.mark.parametrize("at", ["exception", "result"])
def test_an_answer_that_cannot_be_fetched_is_a_task_that_died(at: str, fault: BaseException) -> None:
    value, cause = outcome_of(future(3, **{at: fault}))
    assert value is None
    # Whether the scheduler is gone for good, the pool says; a task that died is sent again.
    assert isinstance(cause, DiedError | ClosedClientError)
    assert "did not arrive" in str(cause) or cause is fault


def test_an_answer_nobody_can_read_here_is_told_as_it_is() -> None:
    value, cause = outcome_of(future(3, result=ModuleNotFoundError("No module named 'their_plugin'")))
    assert value is None
    assert isinstance(cause, ModuleNotFoundError)


def test_what_a_task_itself_gives_or_raises_stays_its_own() -> None:
    assert outcome_of(future(3)) == (3, None)
    failed: concurrent.futures.Future[Any] = concurrent.futures.Future()
    failed.set_exception(RuntimeError("of the task"))
    value, cause = outcome_of(failed)
    assert value is None
    assert isinstance(cause, RuntimeError)
    late: concurrent.futures.Future[Any] = concurrent.futures.Future()
    late.set_exception(TimeoutError("too long"))
    assert isinstance(outcome_of(late)[1], TimeOutError)
    given_up: concurrent.futures.Future[Any] = concurrent.futures.Future()
    given_up.cancel()
    assert isinstance(outcome_of(given_up)[1], DiedError)
