"""Signals that ask a command to end: Ctrl-C, a polite kill, a terminal that was closed, all of them alike.

The first one is a KeyboardInterrupt: what was computed is kept. Asked again, the command ends at once.
"""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

#: What asks a command to end.
ENDING = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))
#: `timeout`, shells and terminals send a signal to a process and to its group: within this time it is one [s].
ONE = 1.0

_first: list[tuple[int, float]] = []
_held: list[bool] = []


@contextmanager
def ending_softly() -> Iterator[None]:
    """Hear the signals that ask to end as KeyboardInterrupt; those that were to be ignored stay ignored (`nohup`)."""
    _first.clear()
    _held.clear()
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    heard = [number for number in ENDING if signal.getsignal(number) not in (signal.SIG_IGN, None)]
    before = {number: signal.signal(number, _end) for number in heard}
    try:
        yield
    finally:
        for number, old in before.items():
            signal.signal(number, old)


@contextmanager
def holding() -> Iterator[None]:
    """Let a block end that saves what was computed; a signal that comes meanwhile is heard behind it."""
    _held.append(False)
    try:
        yield
    finally:
        came = _held.pop()
    if came:
        raise KeyboardInterrupt


def asked_to_end() -> bool:
    """Whether a signal came that asks to end."""
    return bool(_first)


def interrupted_code() -> int:
    """The exit code by convention: 128 and the number of the signal that came, 130 if none did."""
    return 128 + (_first[0][0] if _first else signal.SIGINT)


def _end(number: int, _: object) -> None:
    now = time.monotonic()
    if not _first:
        _first.append((number, now))
        if _held:
            _held[-1] = True
            return
        raise KeyboardInterrupt
    if now - _first[0][1] > ONE:
        os._exit(128 + number)
