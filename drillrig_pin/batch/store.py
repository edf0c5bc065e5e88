"""The folder of a study: a journal in which every case is recorded once, and the table made of it."""

from __future__ import annotations

import dataclasses
import json
import math
import os
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import TypeAdapter

from drillrig_pin.batch.cases import Case, Plan
from drillrig_pin.batch.idle import idle_axes
from drillrig_pin.batch.worker import TRIED_AGAIN, Answer
from drillrig_pin.errors import ResultFileError
from drillrig_pin.files import lock_folder, saving
from drillrig_pin.litter import remove_litter
from drillrig_pin.trajectory import versions

if TYPE_CHECKING:
    import pyarrow

JOURNAL = "journal"
TRAJECTORIES = "trajectories"
TABLE = "results.parquet"
FORMAT = "drillrig study 1"
#: Longer lines no case has; one that is cut is damaged.
MAX_LINE = 10_000_000


class Store:
    """A folder that one command at a time may write.

    Every group of answers becomes one file of the journal, written aside and renamed, so that it is there as a whole or
    not at all. The table is made of the journal and can be made again at any time.

    Raises:
        ResultFileError: the folder cannot be used, or another command works in it.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.journal = folder / JOURNAL
        try:
            self.journal.mkdir(parents=True, exist_ok=True)
            lock = lock_folder(folder)
        except OSError as error:
            raise ResultFileError(
                f"the folder cannot be made ({error.strerror})", where=folder, todo="Choose another place with -o."
            ) from None
        if lock is None:
            raise ResultFileError(
                "another command is working in this folder",
                where=folder,
                todo="Wait for it, or give another with -o.",
            )
        self._lock = lock
        for place in (folder, self.journal, folder / TRAJECTORIES):
            # The lock is held: what a command on another machine left is no longer waited for.
            remove_litter(place, alone=True)
        self.done: set[str] = {answer.key for answer in self.settled()}
        self._files = len(list(self.journal.glob("*.jsonl")))

    def prepare_table(self) -> None:
        """Load what writes the table, while others compute."""
        import pyarrow.parquet  # noqa: F401

    def close(self) -> None:
        """Let others in."""
        self._lock.close()

    def record(self, answers: Iterable[Answer]) -> list[Answer]:
        """Record answers that are not there yet, all or none of them; gives those.

        Raises:
            ResultFileError: the disk is full, or the folder went away.
        """
        new = {answer.key: answer for answer in answers if answer.key not in self.done}
        if not new:
            return []
        self._files += 1
        target = self.journal / f"{self._files:06d}-{next(iter(new))[:8]}.jsonl"
        with saving(target, where=target, todo=self._safe) as aside, aside.open("w") as stream:
            for answer in new.values():
                fields = {k: v for k, v in dataclasses.asdict(answer).items() if k != "trajectory"}
                stream.write(json.dumps(fields) + "\n")
            stream.flush()
            os.fsync(stream.fileno())
        self.done |= set(new)
        return list(new.values())

    def settled(self) -> Iterator[Answer]:
        """What no later command computes again: all but cases that ran out of time or took their worker with them."""
        return (answer for answer in self.answers() if answer.status not in TRIED_AGAIN)

    def answers(self) -> Iterator[Answer]:
        """Everything recorded, of this study and of earlier ones in the folder; of one key the last one counts."""
        return recorded(self.folder)

    def trajectory_path(self, case: Case) -> Path:
        """Where the trajectory of a case is kept."""
        return self.folder / TRAJECTORIES / f"case_{case.index:05d}_{case.question.key[:8]}.nc"

    def write_table(self, plan: Plan) -> Path:
        """Write the table of all cases of the plan that are recorded, in the order of the plan.

        Raises:
            ResultFileError: it cannot be written.
        """
        import pyarrow.parquet

        table = table_so_far(self.folder, plan)
        table = table.replace_schema_metadata(table.schema.metadata | {"idle": json.dumps(idle_axes(plan.study))})
        target = self.folder / TABLE
        with saving(target, where=target, todo=self._safe) as aside:
            pyarrow.parquet.write_table(table, aside)
        return target

    def unwritable(self, target: object, what: str) -> ResultFileError:
        """What to say when something cannot be written: what is recorded is safe."""
        return ResultFileError(what, where=target, todo=self._safe)

    @property
    def _safe(self) -> str:
        return f"{len(self.done)} cases are safe. Make room, then the same command goes on from there."


def recorded(folder: Path) -> Iterator[Answer]:
    """Everything the journal in a folder holds, whoever writes it at this moment.

    Raises:
        ResultFileError: the journal is damaged.
    """
    rows = TypeAdapter(Answer)
    for path in sorted((folder / JOURNAL).glob("*.jsonl")):
        try:
            if not path.is_file():
                raise OSError("it is no regular file")
            with path.open("rb") as stream:
                while line := stream.readline(MAX_LINE):
                    yield rows.validate_json(line, strict=True)
        except (OSError, ValueError) as error:
            raise ResultFileError(
                f"the journal is damaged ({' '.join(str(error).split())[:200]})",
                where=path,
                todo="Remove this file; its cases will be computed again.",
            ) from None


def table_so_far(folder: Path, plan: Plan) -> pyarrow.Table:
    """The table of those cases of a plan that are recorded in a folder, in the order of the plan."""
    wanted = {case.question.key for case in plan.cases}
    return _table(plan, {answer.key: answer for answer in recorded(folder) if answer.key in wanted})


def _table(plan: Plan, found: dict[str, Answer]) -> pyarrow.Table:
    """One row a case: number, inputs, metrics, status, times, hashes; units and study in the metadata."""
    import pyarrow

    rows = [(case, found[case.question.key]) for case in plan.cases if case.question.key in found]
    columns: dict[str, list[Any]] = {"case": [case.index for case, _ in rows]}
    for name in _union(case.tags for case, _ in rows):
        columns[name] = [case.tags.get(name) for case, _ in rows]
    units: dict[str, str] = {}
    for name in plan.study.names:
        columns[name] = _even([case.inputs[name] for case, _ in rows])
    if plan.study.holes is not None:
        holes = [case.question.hole for case, _ in rows]
        for i, axis in enumerate("xyz"):
            columns[f"hole.{axis}"] = [hole.at[i] if hole and hole.at else None for hole in holes]
            units[f"hole.{axis}"] = "m"
        columns["hole.assumed"] = [hole is not None and hole.source.startswith("assumed") for hole in holes]
    for name in _union(answer.found for _, answer in rows):
        columns[f"position.{name}"] = [answer.found.get(name) for _, answer in rows]
    metrics = _union(answer.metrics for _, answer in rows)
    for name in metrics:
        values = (answer.metrics.get(name) for _, answer in rows)
        columns[name] = [value if value is not None and math.isfinite(value) else None for value in values]
    for name in _union(answer.window for _, answer in rows):
        columns.setdefault(name, [answer.window.get(name) for _, answer in rows])
    for _, answer in rows:
        units |= answer.units
    for name in ("status", "reason", "solve_time", "wall_time", "content_hash"):
        columns[name] = [getattr(answer, name) for _, answer in rows]
    columns["key"] = [answer.key for _, answer in rows]
    units |= {"solve_time": "s", "wall_time": "s"}
    about = {
        "format": FORMAT,
        "purpose": plan.purpose,
        "study": plan.study.model_dump_json(),
        "scenario": plan.base.model_dump_json(),
        "units": json.dumps(units),
        "metrics": json.dumps(metrics),
        "versions": json.dumps(versions()),
        "cases": str(len(plan.cases)),
        "model": plan.text,
    }
    return pyarrow.table(columns).replace_schema_metadata(about)


def _even(values: list[Any]) -> list[Any]:
    """Values of one kind: numbers as floats, anything mixed as words."""
    if all(isinstance(value, int | float) and not isinstance(value, bool) for value in values):
        return [float(value) for value in values]
    if all(isinstance(value, str) for value in values) or all(isinstance(value, bool) for value in values):
        return values
    return [value if isinstance(value, str) else json.dumps(value) for value in values]


def _union(found: Iterable[Mapping[str, Any]]) -> list[str]:
    """Names in order of their first appearance."""
    return list(dict.fromkeys(name for item in found for name in item))
