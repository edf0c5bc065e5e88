"""Many at once: who hangs up, says nothing or asks for much keeps nobody else from being answered."""

from __future__ import annotations

import asyncio
import contextlib
import json
import socket
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from processes import PATIENCE, wait_for
from serving import Server

from drillrig_pin.service.bell import Bell
from drillrig_pin.service.crowd import RESERVE, Crowd
from drillrig_pin.service.desk import Desk
from drillrig_pin.service.events import awaited
from drillrig_pin.service.lanes import CHECK, READ, WAITING, Asked, Kind, Lane
from drillrig_pin.service.problems import ServiceError
from drillrig_pin.service.records import Job
from drillrig_pin.service.settings import Limits
from drillrig_pin.service.visit import VISIT, Visit

UNDER_WAY, CONNECTIONS = 5, 20


@pytest.fixture(scope="module")
def tight(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A server that few can ask at once."""
    found = Server(
        tmp_path_factory.mktemp("waits") / "data", limits={"under_way": UNDER_WAY, "connections": CONNECTIONS}
    )
    yield found
    found.stop()


@contextlib.contextmanager
def connections(server: Server, count: int, content: bytes = b"") -> Iterator[list[socket.socket]]:
    """So many, each of which says this and then nothing more."""
    with contextlib.ExitStack() as opened:
        found = [
            opened.enter_context(socket.create_connection(("127.0.0.1", server.port), timeout=PATIENCE))
            for _ in range(count)
        ]
        for connection in found:
            connection.sendall(content)
        yield found


def log(server: Server) -> list[dict[str, Any]]:
    """What the server has said."""
    return [json.loads(line) for line in server.log.read_text().splitlines() if line.startswith("{")]


def test_silent_connections_make_room_for_who_asks(tight: Server) -> None:
    with connections(tight, 3 * CONNECTIONS) as silent:
        assert tight.http.get("/v1/models").status_code == 200
        # Those that were silent longest were hung up on.
        assert all(connection.recv(1) == b"" for connection in silent[: CONNECTIONS // 2])


def test_who_waits_for_too_much_is_told_so_and_hanging_up_ends_the_wait(tight: Server) -> None:
    run = tight.submit(scenario={"duration": 300.0, "engine": "python"})["id"]
    ask = f"GET /v1/runs/{run}?wait=60 HTTP/1.1\r\nHost: localhost\r\n\r\n".encode()
    asked = 0
    with contextlib.ExitStack() as opened:

        def full() -> bool:
            nonlocal asked
            asked += 1
            opened.enter_context(connections(tight, 1, ask))
            return tight.http.get("/v1/models").status_code == 429

        wait_for(full)
        answer = tight.http.get("/v1/models")
        assert answer.status_code == 429
        assert int(answer.headers["retry-after"]) >= 1
        assert answer.headers["content-type"] == "application/problem+json"
        assert tight.http.get("/healthz").json()["status"] == "ok"
    assert asked >= UNDER_WAY - 1

    def ends() -> Counter[int]:
        return Counter(line["status"] for line in log(tight) if line.get("path", "").endswith(run))

    # Every one of them asked to wait for a minute, which would end in 200.
    wait_for(lambda: ends().total() == asked)
    assert set(ends()) <= {400, 429}
    assert tight.http.get("/v1/models").status_code == 200
    tight.http.delete(f"/v1/runs/{run}")


class Service:
    """Of a service, what somebody who waits for a job looks at."""

    def __init__(self) -> None:
        self.bell = Bell()
        self.now = Job("0" * 32, "run", "running", "a", "b", "", {})

    def job(self, number: str, kind: str) -> Job:
        del number, kind
        return self.now


def test_a_step_of_the_job_wakes_who_waits_for_it_and_hanging_up_ends_it() -> None:
    service: Any = Service()
    ended = Job("0" * 32, "run", "completed", "a", "b", "", {})

    async def woken() -> Job:
        waiting = [asyncio.ensure_future(awaited(service.now, service, 1e9)) for _ in range(500)]
        await asyncio.sleep(0)
        service.now = ended
        await asyncio.to_thread(service.bell.ring, ended.id)
        return (await asyncio.gather(*waiting))[-1]

    async def left() -> None:
        async def hangs_up() -> dict[str, str]:
            await asyncio.sleep(0)
            return {"type": "http.disconnect"}

        VISIT.set(Visit("somebody", hangs_up))  # type: ignore[arg-type]
        service.now = Job("0" * 32, "run", "running", "a", "b", "", {})
        await awaited(service.now, service, 1e9)

    assert asyncio.run(woken()) is ended
    with pytest.raises(ServiceError, match="went away"):
        asyncio.run(left())
    assert not service.bell._listening


def connection(address: str, *, silent: bool) -> Any:
    """A connection of which only this is known."""
    found = SimpleNamespace(address=address, silent=silent, gone=False)
    found.hang_up = lambda: setattr(found, "gone", True)
    return _Hashable(found)


class _Hashable:
    def __init__(self, inside: Any) -> None:
        self._inside = inside

    def __getattr__(self, name: str) -> Any:
        return getattr(self._inside, name)


def test_connections_are_bounded_by_address_and_a_proxys_are_many_clients() -> None:
    crowd = Crowd(3, 1000, lambda address: address == "10.0.0.1")
    busy = [connection("192.0.2.1", silent=False) for _ in range(3)]
    assert [crowd.enter(one) for one in busy] == [True] * 3
    one_more = [crowd.enter(connection("192.0.2.1", silent=False)) for _ in range(RESERVE + 1)]
    assert one_more == [False] * RESERVE + [None]
    assert crowd.enter(connection("192.0.2.2", silent=False)) is True
    assert all(crowd.enter(connection("10.0.0.1", silent=False)) for _ in range(100))

    silent = [connection("192.0.2.3", silent=True) for _ in range(3)]
    for one in silent:
        crowd.enter(one)
    crowd.spoke(silent[0])
    assert crowd.enter(connection("192.0.2.3", silent=False)) is True
    assert [one.gone for one in silent] == [False, True, False]


def test_of_all_connections_the_address_with_most_gives_way() -> None:
    crowd = Crowd(80, 100)
    many = [connection("192.0.2.1", silent=True) for _ in range(60)]
    few = [connection("192.0.2.2", silent=True) for _ in range(40)]
    for one in (*many, *few):
        crowd.enter(one)
    assert crowd.enter(connection("192.0.2.3", silent=False)) is True
    assert sum(one.gone for one in many) == 1
    assert not any(one.gone for one in few)


def test_slow_work_is_done_in_turn_for_every_client() -> None:
    begun: list[str] = []

    async def turns() -> None:
        lane, go = Lane(Kind("made", 1.0, workers=2), 4), asyncio.Event()

        def work(name: str) -> Asked:
            async def begin() -> None:
                begun.append(name)
                await go.wait()

            return Asked(name[0], begin)

        greedy = [work(f"a{i}") for i in range(5)]
        for asked in greedy:
            lane.put(asked)
        with pytest.raises(ServiceError, match="waiting to be made") as refused:
            lane.put(work("a5"))
        assert refused.value.status == 429
        others = [work(name) for name in ("b0", "b1", "c0")]
        for asked in others:
            lane.put(asked)
        await asyncio.sleep(0)
        # One client has one of two workers, however much it asks for.
        assert begun == ["a0", "b0"]
        lane.forget(greedy[1])
        go.set()
        await asyncio.gather(*(asked.future for asked in (*greedy[2:], *others)))

    asyncio.run(turns())
    assert begun.index("c0") < begun.index("a3")
    assert "a1" not in begun


def test_more_than_anybody_waits_for_is_refused() -> None:
    async def full() -> None:
        lane = Lane(Kind("made", 1.0), 1)

        async def begin() -> None:
            await asyncio.Event().wait()

        for i in range(lane.kind.workers + WAITING):
            lane.put(Asked(str(i), begin))
        with pytest.raises(ServiceError) as refused:
            lane.put(Asked("one more", begin))
        assert (refused.value.status, refused.value.headers) == (503, {"Retry-After": "5"})

    asyncio.run(full())


def _until(path: str) -> str:
    """Work that lasts until a file is there."""
    wait_for(Path(path).exists)
    return "done"


def test_one_kind_of_slow_work_keeps_no_other_waiting(tmp_path: Path) -> None:
    async def both() -> list[str]:
        desk = Desk(Limits())
        try:
            slow = [asyncio.ensure_future(desk.make(i, _until, str(tmp_path / "go"), kind=CHECK)) for i in range(2)]
            quick = await desk.make("quick", str.upper, "read", kind=READ)
            assert not any(work.done() for work in slow)
            (tmp_path / "go").touch()
            return [quick, *await asyncio.gather(*slow)]
        finally:
            desk.close()

    assert asyncio.run(both()) == ["READ", "done", "done"]
