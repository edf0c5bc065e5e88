"""Solve cases, wherever they were sent: in a process of this machine or on a cluster."""

from __future__ import annotations

import contextlib
import json
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from functools import lru_cache
from pathlib import Path
from typing import Any

from drillrig_pin.analysis.validity import invalid
from drillrig_pin.batch.cases import Question, model_fingerprint
from drillrig_pin.batch.holes import Aim, UnreachableError, aim_at
from drillrig_pin.batch.measures import WINDOW, measured
from drillrig_pin.beat import listening
from drillrig_pin.errors import DrillrigError, ResultFileError
from drillrig_pin.fitting import fitted
from drillrig_pin.litter import temporary_folder
from drillrig_pin.model.modelfile import read_model
from drillrig_pin.rig import Rig, build_rig
from drillrig_pin.scenario import Scenario
from drillrig_pin.simulation import Case
from drillrig_pin.trajectory import Trajectory

COMPLETED = "completed"
#: It reached its end, but its numbers must not be used; they stand in the table with the reason, and are never ranked.
INVALID = "invalid"
UNREACHABLE = "unreachable"
FAILED = "failed"
TIME_LIMIT = "time limit"
WORKER_DIED = "worker died"
#: These say something about the machine that computed or the limit it was given, not about the case.
TRIED_AGAIN = frozenset({TIME_LIMIT, WORKER_DIED})


@dataclass(frozen=True, slots=True)
class Order:
    """What all cases of a study have in common.

    Attributes:
        base: fields of the base scenario.
        fingerprint: of every model, so that a worker that lives on notices a changed file.
        metrics: names or patterns of what is measured.
        aim: how the machine is aimed at holes.
        time_limit: per case [s]; None: no limit.
    """

    base: dict[str, Any]
    fingerprint: dict[str, str]
    metrics: tuple[str, ...]
    aim: Aim | None = None
    time_limit: float | None = None


@dataclass(slots=True)
class Answer:
    """What became of one case.

    Attributes:
        key: that of the question.
        status: ``completed``, ``invalid``, how the run stopped early, or why there is none.
        reason: in words, empty for a completed run.
        metrics: values in SI by name.
        units: their units.
        window: whether the run is steady (1 or 0), how long it must be to be so [s], rows a period of the fastest load.
        found: joint positions that drill the hole, by joint.
        content_hash: that of the run itself, equal to the one in a result file.
        solve_time: of the integration [s].
        wall_time: of everything done for the case [s].
        trajectory: the run as a file, if it was to be kept and not written by the worker.
    """

    key: str
    status: str = COMPLETED
    reason: str = ""
    metrics: dict[str, float] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)
    window: dict[str, float] = field(default_factory=dict)
    found: dict[str, float] = field(default_factory=dict)
    content_hash: str = ""
    solve_time: float = 0.0
    wall_time: float = 0.0
    trajectory: bytes | None = None


class UnsavedError(ResultFileError):
    """A trajectory cannot be written: the study stops, and the case, which is not at fault, is computed again later."""


class _TooLongError(Exception):
    pass


def warm(model: str | None, arguments: dict[str, Any]) -> None:
    """Load a model ahead of the first case; what is wrong with it is said when a case meets it."""
    if model is not None:
        with contextlib.suppress(Exception):
            rig_of(model, json.dumps(arguments, sort_keys=True), model_fingerprint(model))


def solve(order: Order, questions: Sequence[Question], keep: dict[str, str] | None = None) -> list[Answer]:
    """Answer questions one after the other; whatever goes wrong with one is its answer.

    Args:
        order: what they have in common.
        questions: the cases.
        keep: where to save the trajectory, by key; an empty path sends it back instead.
    """
    return [_answer(order, question, (keep or {}).get(question.key)) for question in questions]


def _answer(order: Order, question: Question, target: str | None) -> Answer:
    started = time.perf_counter()
    answer = Answer(question.key)
    try:
        _run(order, question, answer, started, target)
    except UnsavedError:
        raise
    except UnreachableError as error:
        answer.status, answer.reason = UNREACHABLE, str(error)
    except _TooLongError:
        answer.status, answer.reason = TIME_LIMIT, f"took longer than {order.time_limit:g} s"
    except DrillrigError as error:
        answer.status, answer.reason = FAILED, str(error)
    except Exception as error:
        answer.status, answer.reason = FAILED, f"{type(error).__name__}: {' '.join(str(error).split())[:300]}"
    answer.wall_time = time.perf_counter() - started
    return answer


def _run(order: Order, question: Question, answer: Answer, started: float, target: str | None) -> None:
    changes = question.changes
    scenario = Scenario(**order.base).changed(changes)
    model = scenario.model
    rig = rig_of(model, json.dumps(scenario.arguments, sort_keys=True), order.fingerprint.get(model, ""))
    # Before it is aimed: what is locked stays where it stands.
    rig = fitted(rig, scenario)
    if question.hole is not None:
        aimed = aim_at(rig, question.hole, order.aim)
        scenario = scenario.changed({f"positions.{name}": value for name, value in aimed.positions.items()})
        answer.found = {name: value for name, value in aimed.positions.items() if isinstance(value, float)}

    def watch(_: float) -> None:
        if order.time_limit is not None and time.perf_counter() - started > order.time_limit:
            raise _TooLongError

    with listening(lambda: watch(0.0)):
        case = Case(rig, scenario)
    trajectory = case.run(watch)
    answer.solve_time = trajectory.cost["wall_time"]
    answer.content_hash = trajectory.content_hash
    outcome = trajectory.outcome
    if not outcome.completed:
        answer.status, answer.reason = outcome.status.word, str(outcome)
    if len(trajectory.time) >= 2:
        found = measured(trajectory, (*order.metrics, *WINDOW), rig)
        answer.window = {name: found[name].value for name in WINDOW if name in found}
        asked = {name for pattern in order.metrics for name in found if fnmatchcase(name, pattern)}
        found = {name: quantity for name, quantity in found.items() if name in asked}
        answer.metrics = {name: quantity.value for name, quantity in found.items()}
        answer.units = {name: quantity.unit for name, quantity in found.items()}
        reasons = invalid(trajectory)
        if outcome.completed and reasons:
            answer.status, answer.reason = INVALID, "; ".join(reasons)
    if target is not None:
        try:
            answer.trajectory = _kept(trajectory, target)
        except ResultFileError as error:
            raise UnsavedError(error.what, where=error.where, todo=error.todo) from None


@lru_cache(maxsize=4)
def rig_of(model: str, arguments: str, fingerprint: str) -> Rig:
    """A rig, which never changes; a worker meets the same one many times in a row."""
    return build_rig(read_model(model, json.loads(arguments)))


def _kept(trajectory: Trajectory, target: str) -> bytes | None:
    if target:
        trajectory.save(target)
        return None
    with temporary_folder() as folder:
        path = Path(folder, "run.nc")
        trajectory.save(path)
        return path.read_bytes()
