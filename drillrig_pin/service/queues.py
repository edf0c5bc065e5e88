"""What waits and what is under way, by kind of job."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Iterable
from typing import Any

from drillrig_pin.service.problems import ServiceError
from drillrig_pin.service.records import Job, Kind
from drillrig_pin.service.work import Work


class Queues:
    """Queues of jobs, the first that was asked for first, and the work that is under way.

    Args:
        kinds: of jobs.
        limit: how many may wait.
    """

    def __init__(self, kinds: Iterable[Kind], limit: int) -> None:
        kinds = list(kinds)
        self.limit = limit
        self._lock = threading.RLock()
        self._waiting: dict[Kind, dict[str, Job]] = {kind: {} for kind in kinds}
        self._running: dict[Kind, dict[str, Work]] = {kind: {} for kind in kinds}
        #: Tells the latest beginning of a job from earlier ones, whose end no longer matters.
        self._marks: dict[str, object] = {}
        #: How long the latest jobs took [s].
        self._times: deque[float] = deque([1.0], maxlen=20)

    def progress(self, job: Job) -> float:
        """The share of a job that is done."""
        if job.status == "completed":
            return 1.0
        # Without the lock: whoever asks must not wait for a cluster that does not answer.
        work = self._running[job.kind].get(job.id)
        return work.progress() if work is not None else 0.0

    def told(self, job: Job) -> dict[str, Any]:
        """What a job that is under way says of itself."""
        work = self._running[job.kind].get(job.id)
        return work.told if work is not None else {}

    @property
    def waiting(self) -> int:
        """How many wait."""
        return sum(len(queue) for queue in self._waiting.values())

    @property
    def running(self) -> int:
        """How many are under way."""
        return sum(len(works) for works in self._running.values())

    def _holds(self, job: Job) -> bool:
        # A disk that refuses a record may have taken it nevertheless: such a job is in no queue.
        return job.id in self._waiting[job.kind] or job.id in self._running[job.kind]

    def _require_room(self) -> None:
        if self.waiting >= self.limit:
            each = sum(self._times) / len(self._times)
            wait = max(1, min(600, round(each * self.limit / 4 / max(1, self.running))))
            raise ServiceError(
                429,
                f"{self.waiting} jobs are waiting already",
                todo=f"Try again in {wait} s.",
                headers={"Retry-After": str(wait)},
            )
