"""Queues of slow work: one for every kind, and in it one for every client, served in turn."""

from __future__ import annotations

import asyncio
from collections import Counter, OrderedDict, deque
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Any

from drillrig_pin.service.problems import ServiceError


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of work, which keeps no other waiting.

    Attributes:
        name: for people.
        time: what takes longer hangs, and its process is killed [s].
        workers: processes. One client never has all of them.
    """

    name: str
    time: float
    workers: int = 2


DRAW = Kind("drawn", 120.0)
CHECK = Kind("checked", 60.0)
READ = Kind("read", 30.0)
PLAN = Kind("planned", 60.0)
#: More than this waiting is more than anybody will wait for.
WAITING = 128


class Asked:
    """One piece of work that was asked for.

    Attributes:
        client: who asked first.
        begin: does it.
        future: what became of it.
        waiting: how many wait for it.
    """

    def __init__(self, client: str, begin: Callable[[], Awaitable[Any]]) -> None:
        self.client, self.begin = client, begin
        self.future: asyncio.Future[Any] = asyncio.get_running_loop().create_future()
        self.waiting = 0


class Lane:
    """The queue of one kind.

    Args:
        kind: what it is about.
        each: so much may wait for one client.
    """

    def __init__(self, kind: Kind, each: int) -> None:
        self.kind, self.each = kind, each
        #: By client, the next to be served first.
        self._waiting: OrderedDict[str, deque[Asked]] = OrderedDict()
        self._running: Counter[str] = Counter()
        self._tasks: set[asyncio.Task[None]] = set()

    def put(self, asked: Asked) -> None:
        """Queue a piece of work.

        Raises:
            ServiceError: 429, its client waits for too much already; 503, all clients together do.
        """
        own = self._waiting.get(asked.client, ())
        if len(own) >= self.each:
            raise _later(429, f"{len(own)} things of yours are waiting to be {self.kind.name} already")
        if sum(map(len, self._waiting.values())) >= WAITING:
            raise _later(503, f"too much is waiting to be {self.kind.name} already")
        self._waiting.setdefault(asked.client, deque()).append(asked)
        self._pump()

    def forget(self, asked: Asked) -> None:
        """Nobody waits for it any more: unless it is under way, it need not be done."""
        own = self._waiting.get(asked.client)
        if own is not None and asked in own:
            own.remove(asked)
            asked.future.cancel()
            if not own:
                del self._waiting[asked.client]

    def _pump(self) -> None:
        while self._running.total() < self.kind.workers:
            # One worker is left for whoever else comes.
            share = max(1, self.kind.workers - 1)
            client = next((name for name in self._waiting if self._running[name] < share), None)
            if client is None:
                return
            own = self._waiting[client]
            asked = own.popleft()
            if own:
                self._waiting.move_to_end(client)
            else:
                del self._waiting[client]
            self._running[client] += 1
            task = asyncio.get_running_loop().create_task(self._carry_out(asked))
            self._tasks.add(task)
            task.add_done_callback(lambda done, client=client: self._ended(done, client))  # type: ignore[misc]

    async def _carry_out(self, asked: Asked) -> None:
        try:
            made = await asked.begin()
            if not asked.future.done():
                asked.future.set_result(made)
        except Exception as error:
            if not asked.future.done():
                asked.future.set_exception(error)

    def _ended(self, task: asyncio.Task[None], client: str) -> None:
        self._tasks.discard(task)
        self._running[client] -= 1
        if not self._running[client]:
            del self._running[client]
        # Who ends the loop cancels what is under way; nothing new begins then.
        if not task.cancelled():
            self._pump()


def _later(status: int, what: str) -> ServiceError:
    return ServiceError(status, what, todo="Try again in 5 s.", headers={"Retry-After": "5"})
