"""Who asks, and whether they are still there: what a request that takes long looks at."""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine
from contextvars import ContextVar
from typing import Any, TypeVar

from starlette.types import Receive

from drillrig_pin.service.problems import ServiceError

Result = TypeVar("Result")
#: Of a client that sends where nothing is expected, so much is read before it counts as gone [bytes].
PATIENCE = 1_000_000


class Visit:
    """One request's client.

    Attributes:
        client: what counts as one client for bounds and queues.
        receive: hands out its body, and says when it hangs up.
    """

    def __init__(self, client: str, receive: Receive) -> None:
        self.client, self.receive = client, receive

    async def gone(self) -> None:
        """Until the client has hung up."""
        read = 0
        while read < PATIENCE:
            message = await self.receive()
            if message["type"] == "http.disconnect":
                return
            read += len(message.get("body", b"")) + 1


#: The request under way; None outside of any.
VISIT: ContextVar[Visit | None] = ContextVar("visit", default=None)


def client() -> str:
    """The client of the request under way."""
    visit = VISIT.get()
    return visit.client if visit is not None else "local"


async def unless_gone(work: Coroutine[Any, Any, Result]) -> Result:
    """What the work gives; it is cancelled as soon as the client hangs up, and ServiceError says so."""
    visit = VISIT.get()
    if visit is None:
        return await work
    doing, gone = asyncio.ensure_future(work), asyncio.ensure_future(visit.gone())
    try:
        await asyncio.wait({doing, gone}, return_when=asyncio.FIRST_COMPLETED)
        if not doing.done():
            raise ServiceError(400, "the client went away while it waited")
        return doing.result()
    finally:
        doing.cancel()
        gone.cancel()
