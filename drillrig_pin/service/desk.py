"""Makes what is asked for beside the runs themselves, in a process of its own: once, however many ask for it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Hashable
from typing import Any

from drillrig_pin.batch.pools import LocalPool, TimeOutError, outcome_of
from drillrig_pin.service.problems import Problem, ServiceError
from drillrig_pin.service.rendering import Made, guarded
from drillrig_pin.service.runs import PRELOAD
from drillrig_pin.service.settings import Limits

#: A figure or a page takes a second or two; what takes longer than this hangs [s].
TIME = 120.0
#: More than this waiting is more than anybody will wait for.
WAITING = 64


class RefusedError(ServiceError):
    """What a worker met, as it told it."""

    def __init__(self, problem: dict[str, Any], *, damaged: bool) -> None:
        found = Problem(**problem)
        super().__init__(found.status, found.what, where=found.where, todo=found.todo, field=found.field)
        self.problem, self.damaged = found, damaged


class Desk:
    """One worker process, and who waits for what."""

    def __init__(self, limits: Limits) -> None:
        self.limits = limits
        self._pool: LocalPool | None = None
        self._making: dict[Hashable, asyncio.Future[Any]] = {}

    async def make(self, key: Hashable, function: Callable[..., Any], *arguments: Any) -> Any:
        """The value of a function of :mod:`drillrig_pin.service.rendering`; asks of one key share one call.

        Raises:
            ServiceError: it met an error, took too long, or too much waits already.
        """
        waiting = self._making.get(key)
        if waiting is None:
            if len(self._making) >= WAITING:
                raise ServiceError(
                    429, "too much is being drawn already", todo="Try again in 5 s.", headers={"Retry-After": "5"}
                )
            future = self._ready().submit(TIME, guarded, self.limits, function, *arguments)
            waiting = self._making[key] = asyncio.ensure_future(_told(future))
            waiting.add_done_callback(lambda done: self._done(key, done))
        # A client that goes away must not take the others' answer with it.
        made: Made = await asyncio.shield(waiting)
        if made.problem is not None:
            raise RefusedError(made.problem, damaged=made.damaged)
        return made.value

    def warm_up(self) -> None:
        """Start the worker ahead of the first question."""
        self._ready().submit(TIME, abs, 0)

    def _ready(self) -> LocalPool:
        if self._pool is None:
            self._pool = LocalPool(1, PRELOAD)
        return self._pool

    def close(self) -> None:
        """Kill the worker."""
        if self._pool is not None:
            self._pool.close()

    def _done(self, key: Hashable, done: asyncio.Future[Any]) -> None:
        self._making.pop(key, None)
        if not done.cancelled():
            done.exception()


async def _told(future: Any) -> Made:
    await asyncio.wait([asyncio.wrap_future(future)])
    made: Made
    made, cause = outcome_of(future)
    if isinstance(cause, TimeOutError):
        raise ServiceError(503, f"making it took longer than {TIME:g} s", headers={"Retry-After": "60"})
    if cause is not None:
        raise ServiceError(503, "the process that made it ended", todo="Try again.", headers={"Retry-After": "1"})
    return made
