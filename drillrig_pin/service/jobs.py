"""The queue: jobs wait in it, are carried out a few at a time, and survive the end of the server and of any worker."""

from __future__ import annotations

import contextlib
import dataclasses
import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Any

from drillrig_pin.errors import DrillrigError, SimulationError
from drillrig_pin.service.job import NotReadableError
from drillrig_pin.service.problems import ServiceError, problem_of
from drillrig_pin.service.queues import Queues
from drillrig_pin.service.records import Job, Kind, Records
from drillrig_pin.service.work import Carrier, Ending, GoesOn, Listener, Nothing, is_passing

#: A job that takes its worker, or the whole server, with it this many times is given up.
ATTEMPTS = 3
#: How long to wait before asking again for a cluster that went away, or a disk that is full [s].
PATIENCE = 5.0


class Jobs(Queues):
    """All jobs of a server. Every method may be called from any thread.

    How a job ends is never lost: what the disk does not take is kept in memory and recorded when it does. Nothing new
    is begun until then.

    Args:
        records: where they are kept.
        carriers: by kind.
        limit: how many may wait.
        listener: told of every step: ``queued``, ``running`` and the statuses of the end.
    """

    def __init__(self, records: Records, carriers: dict[Kind, Carrier], limit: int, listener: Listener) -> None:
        super().__init__(carriers, limit)
        self.records, self.carriers, self.listener = records, carriers, listener
        #: Ends that were heard of and not looked at yet.
        self._ends: deque[tuple[Job, object, Ending]] = deque()
        self._closed = self._asking_later = self._pumping = self._more = False
        #: Why nothing is begun.
        self._held = ""

    def recover(self) -> int:
        """Take up what an earlier server left; gives how many jobs that are."""
        with self._lock:
            left = self.records.unfinished()
            for job in left:
                if job.status == "queued":
                    self._waiting[job.kind][job.id] = job
                    continue
                got_on = self._reached(job) > job.reached or self.records.ended_since(job.started or job.created)
                tried = 0 if got_on else job.attempts
                if tried >= ATTEMPTS:
                    why = f"the server ended {tried} times while it was carried out, and nothing was recorded meanwhile"
                    self._fail(job, why, "Ask for it again to try it once more.")
                    continue
                self._wait(dataclasses.replace(job, status="queued", started=None, attempts=tried))
            self._pump()
        return len(left)

    def submit(self, job: Job) -> tuple[Job, bool]:
        """Queue a job, unless it is there; gives the job as it stands, and whether it is new.

        A failure that says something about the server, or a cancelled job, is tried again.

        Raises:
            ServiceError: 429, the queue is full; 503 or 507, it cannot be recorded, and is not queued.
        """
        with self._lock:
            known = self._known(job)
            if known is not None and not _again(known) and (known.ended or self._holds(known)):
                return known, False
            self._require_room()
            self.records.add(job)
            self._waiting[job.kind][job.id] = job
            self._tell("queued", job)
            self._pump()
            with contextlib.suppress(ServiceError):
                return self.records.job(job.id, job.kind) or job, True
            return job, True

    def repeat(self, job: Job, clear: Callable[[], None]) -> None:
        """Carry out a finished job once more, because its files were damaged; first they are cleared away.

        Nothing happens if it does not stand as ``job`` says: somebody else has seen to it.
        """
        with self._lock:
            known = self.records.job(job.id, job.kind)
            if known is not None and known.ended and known.finished == job.finished:
                clear()
                fresh: dict[str, Any] = {"summary": None, "error": None, "finished": None, "digest": "", "beside": None}
                self.records.keep(job.id, **fresh)
                self._wait(dataclasses.replace(known, status="queued", started=None, attempts=0, **fresh))
                self._tell("queued", job)
                self._pump()

    def cancel(self, job: Job) -> None:
        """Stop a job that has not ended; of an ended one, nothing happens."""
        with self._lock:
            work = self._running[job.kind].pop(job.id, None)
            if work is not None:
                self._marks.pop(job.id, None)
                with contextlib.suppress(OSError, RuntimeError):
                    work.stop()
            elif self._waiting[job.kind].pop(job.id, None) is None:
                known = self._known(job)
                if known is None or known.ended:
                    return
            self.records.keep(job.id, status="cancelled", finished=time.time())
            self._tell("cancelled", job)
            self._pump()

    @property
    def held(self) -> str:
        """Why what waits is not begun; empty: nothing is in its way but other jobs."""
        return self._held if self.waiting else ""

    def settle_later(self) -> None:
        """Something is kept in memory that could not be recorded: try again after a while."""
        with self._lock:
            self._later()

    def close(self) -> None:
        """Stop; what was under way is recorded as waiting and is carried out by the next server."""
        with self._lock:
            self._closed = True
            for kind, works in self._running.items():
                for number, work in works.items():
                    with contextlib.suppress(OSError, RuntimeError):
                        work.stop()
                    with contextlib.suppress(ServiceError):
                        job = self.records.job(number, kind)
                        if job is not None:
                            # It did not end the server: this attempt does not count.
                            self.records.keep(number, status="queued", started=None, attempts=max(0, job.attempts - 1))
                works.clear()
        for carrier in self.carriers.values():
            carrier.close()

    def _pump(self) -> None:
        """Look at what ended, and start what waits, as far as there is room for it. Never raises."""
        if self._pumping:
            # Whoever ends while it is being begun is looked at when that is over.
            self._more = True
            return
        self._pumping = self._more = True
        try:
            while self._more and not self._closed:
                self._more = False
                self._turn()
        finally:
            self._pumping = False

    def _turn(self) -> None:
        self._held = ""
        try:
            while self._ends:
                self._end(*self._ends[0])
                self._ends.popleft()
            if not self.records.settle():
                # What is begun now could not be recorded either.
                self._hold(self.records.trouble)
                return
        except MemoryError:
            self._hold("memory ran out")
            return
        for kind, queue in self._waiting.items():
            try:
                self._fill(kind, queue)
            except DrillrigError as error:
                self._hold(error.what)
            except OSError as error:
                self._hold(f"the machine does not allow it ({error.strerror})")
            except MemoryError:
                self._hold("memory ran out")

    def _hold(self, why: str) -> None:
        self._held = why
        self._later()

    def _later(self) -> None:
        if not self._asking_later:
            later = threading.Timer(PATIENCE, self._pump_again)
            later.daemon = True
            # Without a thread for it, the next request or end asks again.
            with contextlib.suppress(RuntimeError):
                later.start()
                self._asking_later = True

    def _pump_again(self) -> None:
        with self._lock:
            self._asking_later = False
            self._pump()

    def _fill(self, kind: Kind, queue: dict[str, Job]) -> None:
        carrier, works = self.carriers[kind], self._running[kind]
        while queue and not self._closed and len(works) < carrier.slots:
            job = next(iter(queue.values()))
            attempts, reached = job.attempts + 1, self._reached(job)
            begun = dataclasses.replace(job, status="running", started=time.time(), attempts=attempts, reached=reached)
            values = {"started": begun.started, "attempts": attempts, "reached": reached}
            self.records.change(job.id, status="running", **values)
            del queue[job.id]
            try:
                self._start(carrier, begun)
            except Exception as error:
                self._running[kind].pop(job.id, None)
                self._marks.pop(job.id, None)
                if not is_passing(error):
                    why = f"it could not be begun ({type(error).__name__}: {' '.join(str(error).split())[:200]})"
                    self._fail(begun, why, "Ask for it again to try it once more.")
                    continue
                self._wait(job, first=True)
                raise

    def _wait(self, job: Job, *, first: bool = False) -> None:
        """Put a job into its queue, at the end or before all others, and record that."""
        queue = self._waiting[job.kind]
        self._waiting[job.kind] = queue = {job.id: job, **queue} if first else {**queue, job.id: job}
        values = {"status": "queued", "started": None, "attempts": job.attempts, "reached": job.reached}
        self.records.keep(job.id, **values)

    def _start(self, carrier: Carrier, job: Job) -> None:
        mark = object()

        def ended(ending: Ending) -> None:
            with self._lock:
                self._ends.append((job, mark, ending))
                self._pump()

        self._marks[job.id] = mark
        # Whoever ends at once waits for the lock until the work is known.
        self._running[job.kind][job.id] = Nothing()
        self._running[job.kind][job.id] = carrier.start(job, ended)
        self._tell("running", job)

    def _end(self, job: Job, mark: object, ending: Ending) -> None:
        if self._closed or self._marks.get(job.id) is not mark or job.id not in self._running[job.kind]:
            return
        tried = 0 if ending.died and self._reached(job) > job.reached else job.attempts
        if ending.died and tried < ATTEMPTS:
            self._wait(dataclasses.replace(job, status="queued", started=None, attempts=tried), first=True)
            self._tell("died", job)
        elif ending.died:
            killed = ending.died.endswith("-9")
            todo = "It was killed (SIGKILL), as Linux does when memory runs out. " if killed else ""
            why = f"its process ended {job.attempts} times ({ending.died})"
            self._fail(job, why, f"{todo}Ask for it again to try it once more.")
        else:
            self._finish(job, ending)
        # Only now is the slot free: what went wrong so far is tried again.
        self._running[job.kind].pop(job.id, None)
        self._marks.pop(job.id, None)

    def _finish(self, job: Job, ending: Ending) -> None:
        now = time.time()
        error = None if ending.problem is None else {**ending.problem, "passing": ending.passing}
        values: dict[str, Any] = {
            "status": "completed" if error is None else "failed",
            "finished": now,
            "summary": ending.summary,
            "error": error,
            "digest": ending.digest,
            "beside": ending.beside,
        }
        self.records.keep(job.id, **values)
        if job.started is not None and job.id in self._running[job.kind]:
            self._times.append(now - job.started)
        self._tell(values["status"], dataclasses.replace(job, **values))

    def _fail(self, job: Job, what: str, todo: str) -> None:
        problem = problem_of(SimulationError(what, todo=todo)).model_dump()
        self._finish(job, Ending(problem=problem, passing=True))

    def _reached(self, job: Job) -> int:
        carrier = self.carriers[job.kind]
        with contextlib.suppress(OSError, DrillrigError):
            return carrier.reached(job) if isinstance(carrier, GoesOn) else 0
        return job.reached

    def _known(self, job: Job) -> Job | None:
        """What is recorded of a job; one whose record is damaged is not known."""
        with contextlib.suppress(NotReadableError):
            return self.records.job(job.id, job.kind)
        return None

    def _tell(self, step: str, job: Job) -> None:
        # A log that cannot be written stops nothing.
        with contextlib.suppress(OSError, ValueError, MemoryError):
            self.listener(step, job)


def _again(job: Job) -> bool:
    """Whether a job that ended is carried out once more when it is asked for again."""
    if job.status == "cancelled":
        return True
    return job.status == "failed" and bool((job.error or {}).get("passing"))
