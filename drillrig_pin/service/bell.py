"""Wakes who waits for a job when the job takes a step, so that a thousand who wait cost as little as one."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Iterator


class Bell:
    """One for all jobs of a server."""

    def __init__(self) -> None:
        self._listening: dict[str, set[asyncio.Event]] = {}
        self._loop: asyncio.AbstractEventLoop | None = None

    @contextlib.contextmanager
    def listening(self, number: str) -> Iterator[asyncio.Event]:
        """An event that is set at every step of a job. In the event loop only."""
        self._loop = asyncio.get_running_loop()
        event = asyncio.Event()
        self._listening.setdefault(number, set()).add(event)
        try:
            yield event
        finally:
            others = self._listening[number]
            others.discard(event)
            if not others:
                del self._listening[number]

    def ring(self, number: str) -> None:
        """Tell of a step. From any thread."""
        if number in self._listening and self._loop is not None:
            # A loop that is closed has nobody left who waits.
            with contextlib.suppress(RuntimeError):
                self._loop.call_soon_threadsafe(self._wake, number)

    def _wake(self, number: str) -> None:
        for event in self._listening.get(number, ()):
            event.set()
