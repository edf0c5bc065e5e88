"""Makes what is asked for beside the runs themselves, in processes of their own: once, however many ask for it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Hashable
from typing import Any

from drillrig_pin.batch.pools import LocalPool, TimeOutError, outcome_of
from drillrig_pin.service.lanes import DRAW, Asked, Kind, Lane
from drillrig_pin.service.problems import Problem, ServiceError
from drillrig_pin.service.rendering import Made, guarded
from drillrig_pin.service.runs import PRELOAD
from drillrig_pin.service.settings import Limits
from drillrig_pin.service.visit import client, unless_gone


class RefusedError(ServiceError):
    """What a worker met, as it told it."""

    def __init__(self, problem: dict[str, Any], *, damaged: bool) -> None:
        found = Problem(**problem)
        super().__init__(found.status, found.what, where=found.where, todo=found.todo, field=found.field)
        self.problem, self.damaged = found, damaged


class Desk:
    """Worker processes of every kind of work, and who waits for what."""

    def __init__(self, limits: Limits) -> None:
        self.limits = limits
        self._pools: dict[str, LocalPool] = {}
        self._lanes: dict[str, Lane] = {}
        self._asked: dict[Hashable, Asked] = {}

    async def make(self, key: Hashable, function: Callable[..., Any], *arguments: Any, kind: Kind = DRAW) -> Any:
        """The value of a function of :mod:`drillrig_pin.service.rendering`; asks of one key share one call.

        Raises:
            ServiceError: it met an error, took too long, or too much waits already.
        """
        asked = self._asked.get(key)
        if asked is None or asked.future.done():
            lane = self._lane(kind)
            asked = Asked(client(), lambda: self._begin(kind, function, arguments))
            lane.put(asked)
            self._asked[key] = asked
            asked.future.add_done_callback(lambda done, asked=asked: self._done(key, asked, done))  # type: ignore[misc]
        asked.waiting += 1
        try:
            # A client that goes away must not take the others' answer with it.
            made: Made = await unless_gone(_shielded(asked.future))
        finally:
            asked.waiting -= 1
            if not asked.waiting:
                self._lane(kind).forget(asked)
        if made.problem is not None:
            raise RefusedError(made.problem, damaged=made.damaged)
        return made.value

    def warm_up(self) -> None:
        """Start the workers that draw ahead of the first question."""
        self._pool(DRAW).submit(DRAW.time, abs, 0)

    def close(self) -> None:
        """Kill the workers."""
        for pool in self._pools.values():
            pool.close()

    async def _begin(self, kind: Kind, function: Callable[..., Any], arguments: tuple[Any, ...]) -> Made:
        future: Any = self._pool(kind).submit(kind.time, guarded, self.limits, function, *arguments)
        await asyncio.wait([asyncio.wrap_future(future)])
        made: Made
        made, cause = outcome_of(future)
        if isinstance(cause, TimeOutError):
            raise ServiceError(503, f"making it took longer than {kind.time:g} s", headers={"Retry-After": "60"})
        if cause is not None:
            raise ServiceError(503, "the process that made it ended", todo="Try again.", headers={"Retry-After": "1"})
        return made

    def _pool(self, kind: Kind) -> LocalPool:
        if kind.name not in self._pools:
            self._pools[kind.name] = LocalPool(kind.workers, PRELOAD)
        return self._pools[kind.name]

    def _lane(self, kind: Kind) -> Lane:
        if kind.name not in self._lanes:
            self._lanes[kind.name] = Lane(kind, self.limits.made)
        return self._lanes[kind.name]

    def _done(self, key: Hashable, asked: Asked, done: asyncio.Future[Any]) -> None:
        if self._asked.get(key) is asked:
            del self._asked[key]
        if not done.cancelled():
            done.exception()


async def _shielded(future: asyncio.Future[Made]) -> Made:
    return await asyncio.shield(future)
