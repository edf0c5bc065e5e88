"""The queue: jobs wait in it, are carried out a few at a time, and survive the end of the server and of any worker."""

from __future__ import annotations

import contextlib
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

from drillrig_pin.batch.pools import BatchError
from drillrig_pin.errors import SimulationError
from drillrig_pin.service.problems import ServiceError, problem_of
from drillrig_pin.service.records import Job, Kind, Records

#: A job that takes its worker, or the whole server, with it this many times is given up.
ATTEMPTS = 3
#: How long to wait before asking for a cluster that went away [s].
PATIENCE = 5.0


@dataclass(frozen=True, slots=True)
class Ending:
    """What became of a job: a summary or a problem. ``died``: its process ended without a word.

    ``passing``: the problem says something about the server, not about the job.
    """

    summary: dict[str, Any] | None = None
    problem: dict[str, Any] | None = None
    passing: bool = False
    died: str = ""
    digest: str = ""


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
        """Begin a job. ``ended`` is called once, from any thread. BatchError: not now."""

    def close(self) -> None:
        """Stop everything that is under way, without a word."""


Listener = Callable[[str, Job], None]


class Jobs:
    """All jobs of a server. Every method may be called from any thread.

    Args:
        records: where they are kept.
        carriers: by kind.
        limit: how many may wait.
        listener: told of every step: ``queued``, ``running`` and the statuses of the end.
    """

    def __init__(self, records: Records, carriers: dict[Kind, Carrier], limit: int, listener: Listener) -> None:
        self.records, self.carriers, self.limit, self.listener = records, carriers, limit, listener
        self._lock = threading.RLock()
        self._waiting: dict[Kind, deque[str]] = {kind: deque() for kind in carriers}
        self._running: dict[Kind, dict[str, Work]] = {kind: {} for kind in carriers}
        #: Tells the latest beginning of a job from earlier ones, whose end no longer matters.
        self._marks: dict[str, object] = {}
        self._times: deque[float] = deque([1.0], maxlen=20)
        self._closed = self._asking_later = False

    def recover(self) -> int:
        """Take up what an earlier server left; gives how many jobs that are."""
        with self._lock:
            left = self.records.unfinished()
            for job in left:
                if job.status == "running" and job.attempts >= ATTEMPTS:
                    self._fail(job, f"the server ended {job.attempts} times while it was carried out")
                    continue
                self.records.change(job.id, status="queued")
                self._waiting[job.kind].append(job.id)
            self._pump()
        return len(left)

    def submit(self, job: Job) -> tuple[Job, bool]:
        """Queue a job, unless it is there; gives the job as it stands, and whether it is new.

        A failure that says something about the server, or a cancelled job, is tried again.

        Raises:
            ServiceError: 429, the queue is full.
        """
        with self._lock:
            known = self.records.job(job.id, job.kind)
            if known is not None and not _again(known):
                return known, False
            self._require_room()
            self.records.add(job)
            self._waiting[job.kind].append(job.id)
            self.listener("queued", job)
            self._pump()
            return self.records.job(job.id, job.kind) or job, True

    def repeat(self, job: Job) -> None:
        """Carry out a finished job once more, because its files were damaged."""
        with self._lock:
            known = self.records.job(job.id, job.kind)
            if known is not None and known.ended:
                self.records.change(job.id, status="queued", attempts=0, summary=None, error=None, finished=None)
                self._waiting[job.kind].append(job.id)
                self.listener("queued", job)
                self._pump()

    def cancel(self, job: Job) -> None:
        """Stop a job that has not ended; of an ended one, nothing happens."""
        with self._lock:
            work = self._running[job.kind].pop(job.id, None)
            if work is not None:
                work.stop()
            elif job.id in self._waiting[job.kind]:
                self._waiting[job.kind].remove(job.id)
            else:
                return
            self.records.change(job.id, status="cancelled", finished=time.time())
            self.listener("cancelled", job)
            self._pump()

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

    def close(self) -> None:
        """Stop; what was under way is recorded as waiting and is carried out by the next server."""
        with self._lock:
            self._closed = True
            for kind, works in self._running.items():
                for number, work in works.items():
                    work.stop()
                    job = self.records.job(number, kind)
                    if job is not None:
                        # It did not end the server: this attempt does not count.
                        values = {"status": "queued", "started": None, "attempts": job.attempts - 1}
                        with contextlib.suppress(ServiceError):
                            self.records.change(number, **values)
                works.clear()
        for carrier in self.carriers.values():
            carrier.close()

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

    def _pump(self) -> None:
        """Start what waits, as far as there is room for it."""
        for kind, queue in self._waiting.items():
            try:
                self._fill(kind, queue)
            except BatchError:
                if not self._asking_later:
                    self._asking_later = True
                    later = threading.Timer(PATIENCE, self._pump_again)
                    later.daemon = True
                    later.start()

    def _fill(self, kind: Kind, queue: deque[str]) -> None:
        carrier, works = self.carriers[kind], self._running[kind]
        while queue and not self._closed and len(works) < carrier.slots:
            job = self.records.job(queue.popleft(), kind)
            if job is None or job.status != "queued":
                continue
            self.records.change(job.id, status="running", started=time.time(), attempts=job.attempts + 1)
            try:
                self._start(carrier, job)
            except BatchError:
                self.records.change(job.id, status="queued", started=None, attempts=job.attempts)
                queue.appendleft(job.id)
                raise

    def _pump_again(self) -> None:
        with self._lock:
            self._asking_later = False
            self._pump()

    def _start(self, carrier: Carrier, job: Job) -> None:
        mark = object()

        def ended(ending: Ending) -> None:
            with self._lock:
                if self._marks.get(job.id) is mark and self._running[job.kind].pop(job.id, None) is not None:
                    self._end(job, ending)
                    self._pump()

        self._marks[job.id] = mark
        # Whoever ends at once waits for the lock until the work is known.
        self._running[job.kind][job.id] = _Nothing()
        try:
            work = carrier.start(job, ended)
        except BatchError:
            del self._running[job.kind][job.id]
            raise
        if job.id in self._running[job.kind]:
            self._running[job.kind][job.id] = work
        self.listener("running", job)

    def _end(self, job: Job, ending: Ending) -> None:
        now = time.time()
        if self._closed:
            return
        if ending.died and job.attempts + 1 < ATTEMPTS:
            self.records.change(job.id, status="queued", started=None)
            self._waiting[job.kind].appendleft(job.id)
            self.listener("died", job)
            return
        if ending.died:
            self._fail(job, f"its process ended {job.attempts + 1} times ({ending.died})")
            return
        status = "completed" if ending.problem is None else "failed"
        error = None if ending.problem is None else {**ending.problem, "passing": ending.passing}
        self.records.change(
            job.id, status=status, finished=now, summary=ending.summary, error=error, digest=ending.digest
        )
        ended = self.records.job(job.id, job.kind) or job
        if ended.started is not None:
            self._times.append(now - ended.started)
        self.listener(status, ended)

    def _fail(self, job: Job, what: str) -> None:
        error = SimulationError(what, todo="It may need more memory than the machine has; ask for less at once.")
        problem = {**problem_of(error).model_dump(), "passing": True}
        self.records.change(job.id, status="failed", finished=time.time(), error=problem)
        self.listener("failed", self.records.job(job.id, job.kind) or job)


class _Nothing:
    """Stands for work whose carrier has not answered yet."""

    def __init__(self) -> None:
        self.told: dict[str, Any] = {}

    def progress(self) -> float:
        return 0.0

    def stop(self) -> None:
        pass


def _again(job: Job) -> bool:
    """Whether a job that ended is carried out once more when it is asked for again."""
    if job.status == "cancelled":
        return True
    return job.status == "failed" and bool((job.error or {}).get("passing"))
