"""Carry a study out: send its cases in chunks, record the answers, and survive whatever happens to a worker."""

from __future__ import annotations

import queue
import time
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from drillrig_pin.batch.cases import Case, Plan, unfold
from drillrig_pin.batch.pools import ClusterPool, DiedError, LocalPool, Pool, TimeOutError, cause_of
from drillrig_pin.batch.store import Store
from drillrig_pin.batch.study import Study
from drillrig_pin.batch.summary import Tally
from drillrig_pin.batch.worker import FAILED, TIME_LIMIT, WORKER_DIED, Answer, Order, solve, warm
from drillrig_pin.errors import ResultFileError

#: A chunk is meant to take this long [s]: long against sending it, short against what its loss would cost.
CHUNK_TIME = 1.0
LARGEST_CHUNK = 64
#: Kept trajectories are megabytes each.
LARGEST_KEEPING_CHUNK = 4
#: Time a worker has to start and to load models before it is taken for hung [s].
GRACE = 30.0
#: A case that takes its worker with it this many times is given up.
ATTEMPTS = 3
#: Default time limit of a case [s].
TIME_LIMIT_DEFAULT = 600.0

Listener = Callable[["Tally"], None]


@dataclass(frozen=True)
class Finished:
    """A study carried out.

    Attributes:
        table: the Parquet file.
        tally: counts, best and worst case.
        interrupted: stopped by Ctrl-C.
        kept: trajectories, by case number.
    """

    table: Path
    tally: Tally
    interrupted: bool = False
    kept: dict[int, Path] = field(default_factory=dict)


def run_study(
    study: Study | Plan,
    folder: str | Path,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    keep: str = "none",
    time_limit: float | None = TIME_LIMIT_DEFAULT,
    listener: Listener | None = None,
) -> Finished:
    """Run all cases of a study that are not in the folder yet, and write the table.

    A script that calls this guards it with ``if __name__ == "__main__":``, since every worker imports the script.

    Args:
        study: the study, or its unfolded plan.
        folder: where journal and table go; what an earlier, interrupted command left there is not computed again.
        workers: processes on this machine; None: one a core.
        scheduler: address of a Dask scheduler to use instead, e.g. ``tcp://host:8786``.
        keep: trajectories to keep: ``none``, ``all`` or ``worst:10``.
        time_limit: of a case [s]; one that takes longer becomes a row that says so. None: no limit.
        listener: called after every chunk and a few times a second with the tally.

    Raises:
        ScenarioError, ModelError: the study does not fit its model.
        ResultFileError: the folder cannot be written.
        BatchError: the scheduler cannot be reached or went away.
    """
    wanted = parse_keep(keep)
    store = Store(Path(folder))
    pool = None
    try:
        # Workers start while the study is unfolded here: both take their half second.
        pool = ClusterPool(scheduler) if scheduler else _started(study, workers)
        plan = study if isinstance(study, Plan) else unfold(study)
        tally = Tally(plan, store.settled())
        order = Order(plan.base.model_dump(), plan.fingerprint, plan.study.all_metrics(), plan.study.holes, time_limit)
        todo = _in_order_of_models(case for case in plan.cases if case.question.key not in store.done)
        run = _Run(order, store, tally, listener, pool)
        interrupted = False
        kept: dict[int, Path] = {}
        try:
            run.answer(todo, keeping=wanted is None)
            kept = run.keep(_to_keep(plan, tally, wanted))
        except KeyboardInterrupt:
            interrupted = True
        finally:
            table = store.write_table(plan)
        return Finished(table, tally, interrupted, kept)
    finally:
        if pool is not None:
            pool.close()
        store.close()


def parse_keep(text: str) -> int | None:
    """How many of the worst are kept; None: all. ResultFileError for anything but none, all and worst:N."""
    if text == "none":
        return 0
    if text == "all":
        return None
    word, colon, count = text.partition(":")
    if word == "worst" and colon and count.isdecimal():
        return int(count)
    raise ResultFileError(f"{text!r} does not say what to keep", where="--keep", todo="Write none, all or worst:10.")


def _started(study: Study | Plan, workers: int | None) -> LocalPool:
    """Workers of this machine, told to load the model that all cases share."""
    base = study.base
    shared = not any(name == "scenario.model" or name.startswith("model.") for name in _names(study))
    pool = LocalPool(workers)
    for _ in range(pool.workers):
        pool.submit(None, warm, base.model if shared else None, base.arguments)
    return pool


def _names(study: Study | Plan) -> tuple[str, ...]:
    return study.study.names if isinstance(study, Plan) else study.names


def _in_order_of_models(cases: Iterable[Case]) -> list[Case]:
    """Cases of one model after the other, so that a worker loads it once; each question once."""

    def model(case: Case) -> str:
        changes = case.question.changes
        return repr(sorted((k, v) for k, v in changes.items() if k == "model" or k.startswith("arguments.")))

    return sorted({case.question.key: case for case in cases}.values(), key=model)


def _to_keep(plan: Plan, tally: Tally, wanted: int | None) -> list[Case]:
    """Cases whose trajectory is wanted: all that have one, or the worst."""
    if wanted == 0:
        return []
    return tally.ranked(plan.cases) if wanted is None else tally.ranked(plan.cases)[:wanted]


@dataclass(slots=True)
class _Chunk:
    cases: list[Case]
    attempts: int = 0


class _Run:
    """One pass over cases after the other on one pool."""

    def __init__(self, order: Order, store: Store, tally: Tally, listener: Listener | None, pool: Pool) -> None:
        self.order, self.store, self.tally, self.listener, self.pool = order, store, tally, listener, pool
        self.done: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self._mean = 0.0

    def keep(self, wanted: list[Case]) -> dict[int, Path]:
        """Make sure that the trajectories of these cases are there; runs give the same numbers every time."""
        paths = {case.index: self.store.trajectory_path(case) for case in wanted}
        missing = [case for case in wanted if not paths[case.index].exists()]
        self.answer(missing, keeping=True)
        return {index: path for index, path in paths.items() if path.exists()}

    def answer(self, todo: list[Case], *, keeping: bool) -> None:
        """Answer and record all of these cases, and save their trajectories if wanted."""
        if keeping and todo:
            self.store.trajectory_path(todo[0]).parent.mkdir(exist_ok=True)
        waiting, again = deque(todo), deque[_Chunk]()
        flying: dict[Any, _Chunk] = {}
        prepared = False
        while waiting or again or flying:
            while (waiting or again) and len(flying) < 2 * self.pool.workers:
                chunk = again.popleft() if again else self._chunk(waiting, keeping)
                self._send(chunk, flying, keeping)
            if not prepared and self.tally.since_start:
                self.store.prepare_table()
                prepared = True
            try:
                future = self.done.get(timeout=0.2)
            except queue.Empty:
                self.pool.require_alive()
            else:
                chunk = flying.pop(future)
                again.extend(self._receive(future, chunk, keeping))
            if self.listener is not None:
                self.listener(self.tally)

    def _chunk(self, waiting: deque[Case], keeping: bool) -> _Chunk:
        """The next cases, as many as take about ``CHUNK_TIME``, and few enough to leave all workers some."""
        size = int(CHUNK_TIME / self._mean) if self._mean else 1
        share = -(-len(waiting) // (2 * self.pool.workers))
        size = max(1, min(size, share, LARGEST_KEEPING_CHUNK if keeping else LARGEST_CHUNK))
        return _Chunk([waiting.popleft() for _ in range(min(size, len(waiting)))])

    def _send(self, chunk: _Chunk, flying: dict[Any, _Chunk], keeping: bool) -> None:
        questions = [case.question for case in chunk.cases]
        targets = {}
        if keeping:
            paths = {case.question.key: self.store.trajectory_path(case) for case in chunk.cases}
            targets = {key: str(path.absolute()) if self.pool.local else "" for key, path in paths.items()}
        limit = self.order.time_limit
        # The worker watches the time of each case; this is for one that hangs so badly that it cannot.
        hard = None if limit is None else limit + GRACE + 4 * self._mean * len(questions)
        future = self.pool.submit(hard, solve, self.order, questions, targets)
        flying[future] = chunk
        future.add_done_callback(self.done.put)

    def _receive(self, future: Any, chunk: _Chunk, keeping: bool) -> list[_Chunk]:
        """Record what came back; gives what has to be sent again."""
        cause = cause_of(future)
        if cause is None:
            self._record(future.result(), chunk)
            return []
        self.pool.require_alive()
        if len(chunk.cases) > 1:
            # One of them did it; alone, it will be known which.
            return [_Chunk([case]) for case in chunk.cases]
        key, attempts = chunk.cases[0].question.key, chunk.attempts + 1
        if isinstance(cause, DiedError) and attempts < ATTEMPTS:
            return [_Chunk(chunk.cases, attempts)]
        if isinstance(cause, TimeOutError):
            answer = Answer(key, TIME_LIMIT, f"did not answer within {self.order.time_limit or 0:g} s and was stopped")
        elif isinstance(cause, DiedError):
            answer = Answer(key, WORKER_DIED, f"its worker ended {attempts} times ({cause})")
        else:
            answer = Answer(key, FAILED, f"{type(cause).__name__}: {' '.join(str(cause).split())[:300]}")
        self._record([answer], chunk)
        return []

    def _record(self, answers: list[Answer], chunk: _Chunk) -> None:
        paths = {case.question.key: self.store.trajectory_path(case) for case in chunk.cases}
        latest = sum(answer.wall_time for answer in answers) / len(answers)
        # The first case of a worker also loads the model: the mean forgets.
        self._mean = 0.5 * (self._mean + latest) if self._mean else latest
        for answer in answers:
            if answer.trajectory is not None:
                write_trajectory(paths[answer.key], answer.trajectory)
        for answer in self.store.record(answers):
            self.tally.add(answer, time.monotonic())


def write_trajectory(target: Path, content: bytes) -> None:
    """Write what a worker sent back; ResultFileError if the disk is full."""
    from drillrig_pin.files import write_aside

    try:
        with write_aside(target) as aside:
            aside.write_bytes(content)
    except OSError as error:
        raise ResultFileError(f"cannot be written ({error.strerror})", where=target, todo="Make room.") from None
