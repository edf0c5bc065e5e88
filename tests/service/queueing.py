"""A queue on its own, a carrier that does what the test says, and a disk that refuses."""

from __future__ import annotations

import contextlib
import sqlite3
from collections.abc import Callable
from pathlib import Path
from typing import Any

from drillrig_pin.batch.pools import BatchError
from drillrig_pin.service.jobs import Jobs
from drillrig_pin.service.records import Job, Records
from drillrig_pin.service.work import Ending


class Work:
    def __init__(self) -> None:
        self.told: dict[str, Any] = {}
        self.stopped = False

    def progress(self) -> float:
        return 0.5

    def stop(self) -> None:
        self.stopped = True


class Carrier:
    """Keeps what it was given until the test ends it."""

    slots = 1

    def __init__(self, reached: dict[str, int] | None = None) -> None:
        self.recorded = reached if reached is not None else {}
        self.ends: dict[str, Callable[[Ending], None]] = {}
        self.works: dict[str, Work] = {}
        self.gone = False

    def start(self, job: Job, ended: Callable[[Ending], None]) -> Work:
        if self.gone:
            raise BatchError("the scheduler went away")
        self.ends[job.id], self.works[job.id] = ended, Work()
        return self.works[job.id]

    def reached(self, job: Job) -> int:
        return self.recorded.get(job.id, 0)

    def close(self) -> None:
        pass


class Disk:
    """Between the records and their file: refuses to write while a code of SQLite's is set."""

    def __init__(self, records: Records) -> None:
        self._base: Any = records._base._writer
        self.code, self.only = 0, ""
        records._base._writer = self  # type: ignore[assignment]

    def execute(self, statement: str, values: list[Any]) -> Any:
        if self.code and self.only in (*values, ""):
            error = sqlite3.OperationalError("refused")
            error.sqlite_errorcode = self.code
            raise error
        return self._base.execute(statement, values)

    def close(self) -> None:
        self._base.close()


class Queue:
    """A queue on a folder, as one server after the other has it."""

    def __init__(self, folder: Path, limit: int = 10, reached: dict[str, int] | None = None) -> None:
        self.path = folder / "records.sqlite"
        self.records, self.carrier = Records(self.path), Carrier(reached)
        self.steps: list[tuple[str, str]] = []
        self.jobs = Jobs(
            self.records, {"run": self.carrier}, limit, lambda step, job: self.steps.append((job.id, step))
        )

    def ask(self, name: str) -> tuple[Job, bool]:
        return self.jobs.submit(Job(name, "run", "queued", name, "m", name, {}))

    def status(self, name: str) -> str:
        job = self.records.job(name, "run")
        assert job is not None
        return job.status

    def job(self, name: str) -> Job:
        found = self.records.job(name, "run")
        assert found is not None
        return found

    def on_disk(self) -> dict[str, str]:
        """How the jobs stand in the file."""
        with contextlib.closing(sqlite3.connect(self.path)) as base:
            return dict(base.execute("SELECT id, status FROM jobs ORDER BY id").fetchall())
