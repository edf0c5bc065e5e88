"""A heartbeat that every loop of a computation gives, so that whoever waits can end it: by a callback that raises."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

_listener: ContextVar[Callable[[], None] | None] = ContextVar("listener", default=None)


def beat() -> None:
    """Let whoever listens in this thread be heard; what it raises ends the computation."""
    hear = _listener.get()
    if hear is not None:
        hear()


def listened() -> bool:
    """True if somebody listens in this thread."""
    return _listener.get() is not None


@contextmanager
def listening(hear: Callable[[], None]) -> Iterator[None]:
    """Call ``hear`` at every beat within the block, behind whoever listens already.

    Beats come from the loops of assembly, equilibrium, choice of the method, modes, aim and integration, up to some
    thousand times a second; ``hear`` must be quick. An exception that it raises ends the computation.
    """
    before = _listener.get()

    def both() -> None:
        if before is not None:
            before()
        hear()

    token = _listener.set(both)
    try:
        yield
    finally:
        _listener.reset(token)
