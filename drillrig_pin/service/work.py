"""What the queue and those who carry out its jobs have to tell each other."""

from __future__ import annotations

import errno
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

from drillrig_pin.batch.pools import BatchError
from drillrig_pin.service.problems import ServiceError
from drillrig_pin.service.records import Job

#: What the machine lacks at the moment, whatever the job.
_LACKS = frozenset(
    getattr(errno, name) for name in ("ENOSPC", "EDQUOT", "EROFS", "EIO", "EMFILE", "ENFILE", "ENOMEM", "EAGAIN")
)


@dataclass(frozen=True, slots=True)
class Ending:
    """What became of a job: a summary or a problem. ``died``: its process ended without a word.

    ``passing``: the problem says something about the server, not about the job. ``digest`` and ``beside``: SHA-256 of
    the result file, and of those beside it by name.
    """

    summary: dict[str, Any] | None = None
    problem: dict[str, Any] | None = None
    passing: bool = False
    died: str = ""
    digest: str = ""
    beside: dict[str, str] | None = None


class Work(Protocol):
    """A job that is under way."""

    told: dict[str, Any]
    """What else it says of itself."""

    def progress(self) -> float:
        """The share that is done, 0 to 1."""

    def stop(self) -> None:
        """End it at once; how it ends is no longer told."""


class Carrier(Protocol):
    """Carries out jobs of one kind, ``slots`` of them at once."""

    @property
    def slots(self) -> int:
        """How many at once."""

    def start(self, job: Job, ended: Callable[[Ending], None]) -> Work:
        """Begin a job. ``ended`` is called once, from any thread.

        Raises:
            BatchError, ServiceError (5xx), OSError: not now.
        """

    def close(self) -> None:
        """Stop everything that is under way, without a word."""


@runtime_checkable
class GoesOn(Protocol):
    """A carrier that takes up a job where an earlier attempt left it."""

    def reached(self, job: Job) -> int:
        """How much of a job is recorded, so that it is not done again."""


Listener = Callable[[str, Job], None]


class Nothing:
    """Stands for work whose carrier has not answered yet."""

    def __init__(self) -> None:
        self.told: dict[str, Any] = {}

    def progress(self) -> float:
        """Nothing is done."""
        return 0.0

    def stop(self) -> None:
        """There is nothing to stop."""


def is_passing(error: BaseException) -> bool:
    """Whether an error says something about the machine at this moment, and nothing about the job."""
    if isinstance(error, OSError):
        return error.errno in _LACKS
    if isinstance(error, ServiceError):
        return error.status >= 500
    return isinstance(error, BatchError | MemoryError)
