"""Imported by the process that forks workers: one whose master died before it said what to do ends in silence.

Such a worker meets the end of a pipe, or semaphores that are gone. That is no fault of the work, and the master, or
whoever killed it, has said what there was to say; the traceback that Python prints would only stand between the lines
of another command.
"""

from __future__ import annotations

import sys
from types import TracebackType

#: How the end of the master shows: in the pipe to it, and in the semaphores it shared.
CUT_OFF = (EOFError, BrokenPipeError, ConnectionResetError, FileNotFoundError)


def say_nothing_of_a_lost_master(
    kind: type[BaseException], error: BaseException, traceback: TracebackType | None
) -> None:
    """``sys.excepthook`` of a process that forks workers."""
    if not issubclass(kind, CUT_OFF):
        sys.__excepthook__(kind, error, traceback)


def in_fork_server() -> bool:
    """Whether this process was started to fork others."""
    return any("multiprocessing.forkserver" in word for word in sys.orig_argv)


if in_fork_server():
    sys.excepthook = say_nothing_of_a_lost_master
