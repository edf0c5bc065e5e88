"""One connection of a client: uvicorn's own, for clients that say what they want in time."""

from __future__ import annotations

import asyncio
import sys
import uuid
from collections.abc import Callable
from http import HTTPStatus
from typing import Any

from uvicorn.protocols.http.h11_impl import H11Protocol

from drillrig_pin.service.crowd import TOTAL, Crowd
from drillrig_pin.service.headers import USUAL
from drillrig_pin.service.problems import MEDIA_TYPE, plain_problem

#: The line and the headers of a request have to be there within this time [s].
HEAD_TIME = 10.0
#: A client that does not take the answer it asked for is hung up on after this time [s].
STALL_TIME = 60.0
SENTENCES = {
    400: "This is not readable as an HTTP request.",
    408: "The request did not arrive in time.",
    431: "The headers of the request are too long.",
    503: "More connections are open than this server keeps.",
}


class PromptConnection(H11Protocol):
    """Hangs up on who opens a connection and sends a request's beginning drop by drop, or does not read the answer.

    The body is the gate's concern, silence between requests uvicorn's.

    Attributes:
        crowd: all connections of the server.
        tell: told of requests that never were one: number, address, status.
        address: of the client or its proxy.
    """

    crowd = Crowd(TOTAL, TOTAL)
    tell: Callable[[str, str, int], None] = staticmethod(lambda *_: None)
    address = "local"

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self._head: asyncio.TimerHandle | None = None
        self._stall: asyncio.TimerHandle | None = None

    @property
    def silent(self) -> bool:
        """Whether no request is being answered."""
        return self.cycle is None or self.cycle.response_complete

    def connection_made(self, transport: Any) -> None:
        """Start the clock of the first request."""
        super().connection_made(transport)
        self.address = self.client[0] if self.client else "local"
        room = self.crowd.enter(self)
        if room is None:
            self._refuse(503)
            return
        if not room:
            # The gate tells it so, unless it asks whether the server lives.
            self.app_state = {**self.app_state, "crowded": True}
        self._watch(waiting=True)

    def data_received(self, data: bytes) -> None:
        """Stop the clock when a request's head is complete, start it when the next one begins."""
        before = self.cycle
        super().data_received(data)
        if self.cycle is not before:
            self.crowd.spoke(self)
        self._watch(waiting=self.silent)

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget the clocks."""
        self.crowd.leave(self)
        self._watch(waiting=False)
        self._taken()
        super().connection_lost(exc)

    def pause_writing(self) -> None:
        """The client takes nothing: start the clock."""
        super().pause_writing()
        if self._stall is None:
            self._stall = self.loop.call_later(STALL_TIME, self.transport.abort)

    def resume_writing(self) -> None:
        """The client took something."""
        self._taken()
        super().resume_writing()

    def hang_up(self) -> None:
        """End a connection that has nothing under way."""
        self.transport.close()

    def send_400_response(self, msg: str) -> None:
        """What h11 could not read; called where it is caught."""
        self._refuse(getattr(sys.exception(), "error_status_hint", 400))

    def _taken(self) -> None:
        if self._stall is not None:
            self._stall.cancel()
            self._stall = None

    def _watch(self, *, waiting: bool) -> None:
        if waiting and self._head is None:
            self._head = self.loop.call_later(HEAD_TIME, self._too_late)
        elif not waiting and self._head is not None:
            self._head.cancel()
            self._head = None

    def _too_late(self) -> None:
        self._head = None
        self._refuse(408)

    def _refuse(self, status: int) -> None:
        """Answer what is no request, and end the connection. What was asked before it is answered no more."""
        if self.transport.is_closing():
            return
        if self.silent:
            number = uuid.uuid4().hex
            self.tell(number, self.address, status)
            self.transport.write(_answer(status, number))
        self.transport.close()


def _answer(status: int, number: str) -> bytes:
    if status not in SENTENCES:
        status = 400
    problem = plain_problem(status, SENTENCES[status]).model_copy(update={"request_id": number})
    body = problem.model_dump_json().encode()
    told = [
        (b"content-type", MEDIA_TYPE.encode()),
        (b"content-length", str(len(body)).encode()),
        (b"connection", b"close"),
        (b"x-request-id", number.encode()),
        *([(b"retry-after", b"2")] if status == 503 else []),
        *USUAL,
    ]
    line = f"HTTP/1.1 {status} {HTTPStatus(status).phrase}\r\n".encode()
    return line + b"".join(name + b": " + value + b"\r\n" for name, value in told) + b"\r\n" + body
