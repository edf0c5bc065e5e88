"""A folder and the workers that answer cases into it: cases go out in chunks, answers are recorded, workers may die."""

from __future__ import annotations

import dataclasses
import queue
import time
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from drillrig_pin.batch.asked import no_such_metric, unmatched
from drillrig_pin.batch.cases import Case, Plan, Question
from drillrig_pin.batch.pools import ClusterPool, DiedError, LocalPool, Pool, TimeOutError, outcome_of
from drillrig_pin.batch.store import Store
from drillrig_pin.batch.study import Study
from drillrig_pin.batch.summary import Tally
from drillrig_pin.batch.worker import (
    COMPLETED,
    FAILED,
    TIME_LIMIT,
    WORKER_DIED,
    Answer,
    Order,
    UnsavedError,
    solve,
    warm,
)
from drillrig_pin.files import saving

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

Listener = Callable[[Tally], None]


@dataclass(slots=True)
class _Chunk:
    cases: list[Case]
    attempts: int = 0


class Session:
    """One command at work in one folder. Its workers stay between calls, so that cases may depend on earlier answers.

    Args:
        study: the study, or its unfolded plan: what the workers load while the cases are planned here.
        folder: where journal and table go.
        workers: processes on this machine; None: one a core.
        scheduler: address of a Dask scheduler to use instead.
        time_limit: of a case [s]; None: no limit.
        listener: called after every chunk and a few times a second with the tally.
        remember: keep all answers of the plan in ``answers``, by key, those recorded earlier included.

    Raises:
        ResultFileError: the folder cannot be used.
        BatchError: the scheduler cannot be reached.
    """

    def __init__(
        self,
        study: Study | Plan,
        folder: str | Path,
        *,
        workers: int | None = None,
        scheduler: str | None = None,
        time_limit: float | None = TIME_LIMIT_DEFAULT,
        listener: Listener | None = None,
        remember: bool = False,
    ) -> None:
        self.store = Store(Path(folder))
        self.time_limit, self.listener = time_limit, listener
        self.answers: dict[str, Answer] = {}
        self._remember = remember
        self._mean = 0.0
        try:
            self.pool: Pool = ClusterPool(scheduler) if scheduler else _started(study, workers)
        except BaseException:
            self.store.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, way: TracebackType | None
    ) -> None:
        self.pool.close()
        self.store.close()

    def start(self, plan: Plan) -> Tally:
        """Take a plan over, whose cases may grow by :meth:`extend`; gives the tally of what is recorded of it."""
        self.plan = plan
        self.order = Order(
            plan.base.model_dump(), plan.fingerprint, plan.study.all_metrics(), plan.study.holes, self.time_limit
        )
        if self._remember:
            self.answers = {answer.key: answer for answer in self.store.settled()}
        self.tally = Tally(plan, self.answers.values() if self._remember else self.store.settled())
        self._prepared = self._matched = False
        return self.tally

    def extend(self, cases: Sequence[Case]) -> list[Answer]:
        """Add cases to the plan and answer those nobody has answered; gives all their answers (if remembered)."""
        self.plan.cases.extend(cases)
        known = {case.question.key for case in cases} & self.answers.keys()
        self.tally.plan_more(cases, [self.answers[key] for key in known])
        self.answer(cases)
        return [self.answers[case.question.key] for case in cases if case.question.key in self.answers]

    def answer(self, cases: Iterable[Case], *, keeping: bool = False) -> None:
        """Answer and record those of these cases that are not recorded yet.

        Raises:
            ScenarioError: the study asks for a metric that its runs do not have.
        """
        self._work(_in_order_of_models(case for case in cases if case.question.key not in self.store.done), keeping)
        self._require_matched(ended=True)

    def keep(self, wanted: list[Case]) -> dict[int, Path]:
        """Make sure that the trajectories of these cases are there; runs give the same numbers every time."""
        paths = {case.index: self.store.trajectory_path(case) for case in wanted}
        self._work([case for case in wanted if not paths[case.index].exists()], keeping=True)
        return {index: path for index, path in paths.items() if path.exists()}

    def again(self, plan: Plan) -> list[Answer]:
        """Solve the cases of another plan of the same models once more, and record nothing."""
        order = Order(
            plan.base.model_dump(), plan.fingerprint, plan.study.all_metrics(), plan.study.holes, self.time_limit
        )
        return self._solved(order, [case.question for case in plan.cases])

    def _solved(self, order: Order, questions: list[Question]) -> list[Answer]:
        sent = [self.pool.submit(self._hard_limit(1), solve, order, [question]) for question in questions]
        found: list[Answer] = []
        for future, question in zip(sent, questions, strict=True):
            while not future.done():
                self.pool.require_alive()
                time.sleep(0.02)
            answers, cause = outcome_of(future)
            found += answers if cause is None else [Answer(question.key, FAILED, str(cause))]
        return found

    def _require_matched(self, *, ended: bool) -> None:
        """ScenarioError if the study asks for what no run has."""
        missing = unmatched(self.plan.study, self.tally.names, ended=ended)
        if missing is None or self.tally.completed is None:
            return
        # Measured was what the study asks for; for names that come near, one run is asked for all it has.
        order = dataclasses.replace(self.order, metrics=("*",))
        (answer,) = self._solved(order, [self.tally.completed.question])
        raise no_such_metric(self.plan.study, *missing, answer.metrics or self.tally.names)

    def write_table(self) -> Path:
        """Write the table of everything recorded of the plan."""
        return self.store.write_table(self.plan)

    def _work(self, todo: list[Case], keeping: bool) -> None:
        """Answer and record all of these cases, and save their trajectories if wanted."""
        done: queue.SimpleQueue[Any] = queue.SimpleQueue()
        if keeping and todo:
            self.store.trajectory_path(todo[0]).parent.mkdir(exist_ok=True)
        waiting, again = deque(todo), deque[_Chunk]()
        flying: dict[Any, _Chunk] = {}
        while waiting or again or flying:
            while (waiting or again) and len(flying) < 2 * self.pool.workers:
                chunk = again.popleft() if again else self._chunk(waiting, keeping)
                future = self._send(chunk, keeping)
                flying[future] = chunk
                future.add_done_callback(done.put)
            if not self._prepared and self.tally.since_start:
                self.store.prepare_table()
                self._prepared = True
            try:
                future = done.get(timeout=0.2)
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

    def _send(self, chunk: _Chunk, keeping: bool) -> Any:
        questions = [case.question for case in chunk.cases]
        targets = {}
        if keeping:
            paths = {case.question.key: self.store.trajectory_path(case) for case in chunk.cases}
            targets = {key: str(path.absolute()) if self.pool.local else "" for key, path in paths.items()}
        return self.pool.submit(self._hard_limit(len(questions)), solve, self.order, questions, targets)

    def _hard_limit(self, cases: int) -> float | None:
        """The worker watches the time of each case; this is for one that hangs so badly that it cannot."""
        return None if self.time_limit is None else self.time_limit + GRACE + 4 * self._mean * cases

    def _receive(self, future: Any, chunk: _Chunk, keeping: bool) -> list[_Chunk]:
        """Record what came back; gives what has to be sent again."""
        answers, cause = outcome_of(future)
        if cause is None:
            self._record(answers, chunk)
            return []
        self.pool.require_alive()
        if isinstance(cause, UnsavedError):
            raise self.store.unwritable(cause.where, cause.what)
        if len(chunk.cases) > 1:
            # One of them did it; alone, it will be known which.
            return [_Chunk([case]) for case in chunk.cases]
        key, attempts = chunk.cases[0].question.key, chunk.attempts + 1
        if isinstance(cause, DiedError) and attempts < ATTEMPTS:
            return [_Chunk(chunk.cases, attempts)]
        if isinstance(cause, TimeOutError):
            answer = Answer(key, TIME_LIMIT, f"did not answer within {self.time_limit or 0:g} s and was stopped")
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
            if self._remember:
                self.answers[answer.key] = answer
        if not self._matched and any(answer.status == COMPLETED for answer in answers):
            self._require_matched(ended=False)
            self._matched = True


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


def write_trajectory(target: Path, content: bytes) -> None:
    """Write what a worker sent back; ResultFileError if the disk is full."""
    with saving(target, where=target, todo="Make room.") as aside:
        aside.write_bytes(content)
