"""One connection of a client: uvicorn's own, for clients that say what they want in time."""

from __future__ import annotations

import asyncio
from typing import Any

from uvicorn.protocols.http.h11_impl import H11Protocol

#: The line and the headers of a request have to be there within this time [s].
HEAD_TIME = 10.0
LATE = b"HTTP/1.1 408 Request Timeout\r\nconnection: close\r\ncontent-length: 0\r\n\r\n"


class PromptConnection(H11Protocol):
    """Hangs up on who opens a connection and sends a request's beginning drop by drop.

    The body is the gate's concern, silence between requests uvicorn's.
    """

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self._head: asyncio.TimerHandle | None = None

    def connection_made(self, transport: Any) -> None:
        """Start the clock of the first request."""
        super().connection_made(transport)
        self._watch(waiting=True)

    def data_received(self, data: bytes) -> None:
        """Stop the clock when a request's head is complete, start it when the next one begins."""
        super().data_received(data)
        self._watch(waiting=self.cycle is None or self.cycle.response_complete)

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget the clock."""
        self._watch(waiting=False)
        super().connection_lost(exc)

    def _watch(self, *, waiting: bool) -> None:
        if waiting and self._head is None:
            self._head = self.loop.call_later(HEAD_TIME, self._too_late)
        elif not waiting and self._head is not None:
            self._head.cancel()
            self._head = None

    def _too_late(self) -> None:
        self._head = None
        if not self.transport.is_closing():
            self.transport.write(LATE)
            self.transport.close()
