"""Read a study's folder back: its table, and what the study was about."""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from functools import cached_property
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

from drillrig_pin.batch.axes import GridAxis, ListAxis, ZipAxis
from drillrig_pin.batch.parquet import read_bounded
from drillrig_pin.batch.store import FORMAT, TABLE, TRAJECTORIES
from drillrig_pin.batch.study import Study
from drillrig_pin.batch.worker import COMPLETED
from drillrig_pin.errors import DrillrigError, ResultFileError, legal_names
from drillrig_pin.scenario import Scenario

#: Columns that are neither inputs nor metrics although they have a unit.
OTHERS = ("hole.x", "hole.y", "hole.z", "solve_time", "wall_time")


@dataclass(frozen=True)
class StudyTable:
    """A study's table.

    Attributes:
        folder: where it lies.
        study, base: the study, and the scenario its cases start from.
        columns: all columns by name, in the order of the table; a missing number is None.
        units: units of the metrics and of some other columns.
        versions: of the software that computed it.
        total: cases the study has; more than rows if it was interrupted.
        idle: a sentence for every axis that cannot change a result, see :mod:`drillrig_pin.batch.idle`.
        model: expanded text of the base scenario's model; empty in tables of earlier versions.
    """

    folder: Path
    study: Study = field(repr=False)
    base: Scenario = field(repr=False)
    columns: dict[str, list[Any]] = field(repr=False)
    units: dict[str, str] = field(repr=False)
    versions: dict[str, str] = field(repr=False)
    total: int
    idle: tuple[str, ...] = ()
    model: str = field(default="", repr=False)

    def __len__(self) -> int:
        """Rows there are."""
        return len(self.columns["case"])

    @property
    def cases(self) -> list[int]:
        """Number of the case of every row."""
        return self.columns["case"]

    @cached_property
    def inputs(self) -> tuple[str, ...]:
        """What is varied: ``model.X``, ``scenario.Y`` and ``hole``, as far as the table has it."""
        return tuple(name for name in self.study.names if name in self.columns)

    @cached_property
    def metrics(self) -> tuple[str, ...]:
        """What was measured, in the order of the table."""
        others = (*self.inputs, *OTHERS)
        return tuple(name for name in self.columns if name in self.units and name not in others)

    @cached_property
    def statuses(self) -> Counter[str]:
        """How many rows ended how."""
        return Counter(self.columns["status"])

    @cached_property
    def given(self) -> dict[str, dict[Any, Any]]:
        """Values of the axes by name, under what the table shows for them: it holds whole numbers as floats."""
        known: dict[str, dict[Any, Any]] = {name: {} for name in self.inputs}
        for axis in self.study.axes:
            for name, value in _listed(axis):
                if name in known:
                    known[name][value if isinstance(value, int | float | str) else json.dumps(value)] = value
        return known

    @property
    def completed(self) -> int:
        """Rows of cases that ran to their end."""
        return self.statuses[COMPLETED]

    @cached_property
    def kept(self) -> dict[int, Path]:
        """Trajectories in the folder, by case."""
        if not (self.folder / TRAJECTORIES).is_dir():
            return {}
        return {case: path for case in self.cases if (path := self.trajectory_path(case)).is_file()}

    def row(self, case: int) -> dict[str, Any]:
        """One row by the number of its case; ResultFileError if there is none."""
        try:
            return self._all[self._rows[case]]
        except KeyError:
            raise ResultFileError(
                f"has no case {case}", where=self.folder / TABLE, todo=f"Cases go from 0 to {self.total - 1}."
            ) from None

    def trajectory_path(self, case: int) -> Path:
        """Where the trajectory of a case lies, if it was kept."""
        return self.folder / TRAJECTORIES / f"case_{case:05d}_{self.columns['key'][self._rows[case]][:8]}.nc"

    def metric(self, asked: str | None = None) -> str:
        """The metric asked for, by name or pattern, else the one that tells the study's worst case.

        Raises:
            ResultFileError: no metric is called so.
        """
        if asked is not None:
            found = next((name for name in self.metrics if fnmatchcase(name, asked)), None)
            if found is None:
                todo = legal_names(asked, self.metrics, "metrics") if self.metrics else "No case completed."
                raise ResultFileError(f"has no metric {asked!r}", where=self.folder / TABLE, todo=todo)
            return found
        pattern = self.study.worst or self.study.metrics[0]
        known = (name for name in self.metrics if fnmatchcase(name, pattern))
        return next(known, self.metrics[0] if self.metrics else "")

    def worst(self, metric: str) -> int | None:
        """Case with the worst value of a metric among the completed ones; None if none has it."""
        ranked = self.ranked(metric)
        return ranked[0] if ranked else None

    def ranked(self, metric: str) -> list[int]:
        """Completed cases that have a metric, worst first."""
        sign = 1.0 if metric.endswith("p_min") else -1.0
        known = [(sign * value, case) for case, value in self.values(metric)]
        return [case for _, case in sorted(known)]

    def values(self, metric: str) -> Iterator[tuple[int, float]]:
        """Case and value of the completed rows that have a metric."""
        for case, value, status in zip(self.cases, self.columns.get(metric, ()), self.columns["status"], strict=False):
            if value is not None and status == COMPLETED:
                yield case, value

    @cached_property
    def _all(self) -> list[dict[str, Any]]:
        return [dict(zip(self.columns, row, strict=True)) for row in zip(*self.columns.values(), strict=True)]

    @cached_property
    def _rows(self) -> dict[int, int]:
        return {case: i for i, case in enumerate(self.cases)}


def _listed(axis: Any) -> Iterator[tuple[str, Any]]:
    """Names and values that an axis lists one by one; those of ranges and samples are floats, as in the table."""
    columns: dict[str, Any] = {axis.name: axis.list} if isinstance(axis, ListAxis) else {}
    columns |= axis.zip if isinstance(axis, ZipAxis) else axis.grid if isinstance(axis, GridAxis) else {}
    for name, values in columns.items():
        if isinstance(values, list):
            yield from ((name, value) for value in values)


def is_study(path: Path) -> bool:
    """Whether a folder holds a study's table."""
    return (path / TABLE).is_file()


def read_table(folder: str | Path) -> StudyTable:
    """Read the table of a study's folder.

    Raises:
        ResultFileError: no folder of a study, damaged, or of another format.
    """
    folder = Path(folder)
    path = folder / TABLE
    if not path.is_file():
        raise ResultFileError(
            "is not the folder of a study",
            where=folder,
            todo=f"Give one that holds {TABLE}, as drillrig sweep -o makes it.",
        )
    import pyarrow

    try:
        table = read_bounded(path)
        about = {key.decode(): value.decode() for key, value in (table.schema.metadata or {}).items()}
        if about.get("format") != FORMAT:
            raise ValueError(f"its format is {about.get('format', 'unknown')}, not {FORMAT}")
        return StudyTable(
            folder,
            Study(**json.loads(about["study"])),
            Scenario(**json.loads(about["scenario"])),
            _columns(table),
            TypeAdapter(dict[str, str]).validate_json(about["units"]),
            TypeAdapter(dict[str, str]).validate_json(about["versions"]),
            int(about["cases"]),
            tuple(map(str, json.loads(about.get("idle", "[]")))),
            about.get("model", ""),
        )
    except (OSError, ValueError, TypeError, KeyError, RecursionError, DrillrigError, pyarrow.ArrowException) as error:
        reason = " ".join(str(error).split())[:200]
        raise ResultFileError(
            f"is not a table that can be read here ({reason})",
            where=path,
            todo="Run the study again into another folder.",
        ) from None


def _columns(table: Any) -> dict[str, list[Any]]:
    """The columns, if those that every study has are there and of their kind; ValueError otherwise."""
    columns: dict[str, list[Any]] = table.to_pydict()
    if len(columns) != table.num_columns:
        raise ValueError("two columns have one name")
    for name, kind in {"case": int, "status": str, "reason": str, "content_hash": str, "key": str}.items():
        if not all(isinstance(value, kind) for value in columns[name]):
            raise ValueError(f"the column {name} holds something else")
    # A part of it becomes the name of a file.
    if not all(re.fullmatch(r"[0-9a-f]{8,64}", key) for key in columns["key"]):
        raise ValueError("the column key holds something else")
    return columns
