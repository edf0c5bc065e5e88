"""The records of a server: which jobs there are and how they stand, in one SQLite file that outlives the process."""

from __future__ import annotations

import dataclasses
import json
import sqlite3
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from drillrig_pin.service.problems import ServiceError

Kind = Literal["run", "study"]
Status = Literal["queued", "running", "completed", "failed", "cancelled"]
#: Nothing more will happen to a job with one of these.
ENDED = frozenset({"completed", "failed", "cancelled"})

_SCHEMA = """
CREATE TABLE IF NOT EXISTS jobs (
    id TEXT PRIMARY KEY, kind TEXT NOT NULL, status TEXT NOT NULL, name TEXT NOT NULL, model TEXT NOT NULL,
    words TEXT NOT NULL, request TEXT NOT NULL, created REAL NOT NULL, started REAL, finished REAL,
    attempts INTEGER NOT NULL DEFAULT 0, error TEXT, summary TEXT, digest TEXT NOT NULL DEFAULT ''
);
CREATE INDEX IF NOT EXISTS jobs_by_time ON jobs (kind, created DESC, id DESC);
CREATE INDEX IF NOT EXISTS jobs_by_status ON jobs (status);
CREATE TABLE IF NOT EXISTS uploads (
    id TEXT PRIMARY KEY, name TEXT NOT NULL, created REAL NOT NULL, content TEXT NOT NULL, facts TEXT NOT NULL
);
"""


@dataclass(frozen=True, slots=True)
class Job:
    """One job as it is recorded.

    Attributes:
        id: hash of what is asked: an identical request is the same job.
        kind: ``run`` or ``study``.
        status: how it stands.
        name, model: for people.
        words: what a search looks through, lower case.
        request: what was asked, in full.
        created, started, finished: seconds since 1970.
        attempts: how often it was begun.
        error: a problem, if it failed.
        summary: numbers for lists, if it completed.
        digest: SHA-256 of the result file.
    """

    id: str
    kind: Kind
    status: Status
    name: str
    model: str
    words: str
    request: dict[str, Any]
    created: float = field(default_factory=time.time)
    started: float | None = None
    finished: float | None = None
    attempts: int = 0
    error: dict[str, Any] | None = None
    summary: dict[str, Any] | None = None
    digest: str = ""

    @property
    def ended(self) -> bool:
        """True when nothing more will happen to it."""
        return self.status in ENDED


_JSON = ("request", "error", "summary")
_FIELDS = tuple(item.name for item in dataclasses.fields(Job))


class Records:
    """The database. Every method may be called from any thread.

    Raises:
        ServiceError: the disk is full or the file is damaged.
    """

    def __init__(self, path: Path) -> None:
        self._lock = threading.RLock()
        with _told():
            self._base = sqlite3.connect(path, check_same_thread=False, isolation_level=None, timeout=10)
            self._base.execute("PRAGMA journal_mode = WAL")
            self._base.execute("PRAGMA synchronous = FULL")
            self._base.executescript(_SCHEMA)

    def close(self) -> None:
        """Write everything into the one file and let go of it."""
        with self._lock:
            self._base.close()

    def add(self, job: Job) -> None:
        """Record a job; one of the same id is replaced."""
        values = [_stored(name, getattr(job, name)) for name in _FIELDS]
        marks = ", ".join("?" * len(_FIELDS))
        self._write(f"INSERT OR REPLACE INTO jobs ({', '.join(_FIELDS)}) VALUES ({marks})", values)

    def change(self, job: str, **values: Any) -> None:
        """Change some fields of a job."""
        names = ", ".join(f"{name} = ?" for name in values)
        self._write(
            f"UPDATE jobs SET {names} WHERE id = ?", [*(_stored(name, value) for name, value in values.items()), job]
        )

    def remove(self, job: str) -> None:
        """Forget a job."""
        self._write("DELETE FROM jobs WHERE id = ?", [job])

    def job(self, name: str, kind: Kind) -> Job | None:
        """A job by id."""
        rows = self._read("SELECT * FROM jobs WHERE id = ? AND kind = ?", [name, kind])
        return _job(rows[0]) if rows else None

    def jobs(
        self, kind: Kind, *, search: str = "", status: str | None = None, after: str | None = None, limit: int = 50
    ) -> list[Job]:
        """Jobs that hold all words of a search, latest first, after the one with the id ``after``."""
        where: list[str] = ["kind = ?"]
        values: list[Any] = [kind]
        for word in search.lower().split():
            where.append("instr(words, ?) > 0")
            values.append(word)
        if status is not None:
            where.append("status = ?")
            values.append(status)
        if after is not None:
            where.append("(created, id) < (SELECT created, id FROM jobs WHERE id = ?)")
            values.append(after)
        rows = self._read(
            f"SELECT * FROM jobs WHERE {' AND '.join(where)} ORDER BY created DESC, id DESC LIMIT ?", [*values, limit]
        )
        return [_job(row) for row in rows]

    def unfinished(self) -> list[Job]:
        """Jobs to be carried out, in the order they were asked for."""
        rows = self._read("SELECT * FROM jobs WHERE status IN ('queued', 'running') ORDER BY created, id", [])
        return [_job(row) for row in rows]

    def counts(self) -> dict[tuple[str, str], int]:
        """How many jobs there are, by kind and status."""
        rows = self._read("SELECT kind, status, COUNT(*) AS n FROM jobs GROUP BY kind, status", [])
        return {(row["kind"], row["status"]): row["n"] for row in rows}

    def add_upload(self, name: str, label: str, content: str, facts: dict[str, Any]) -> None:
        """Record an uploaded model; the same one again changes nothing."""
        self._write(
            "INSERT OR IGNORE INTO uploads (id, name, created, content, facts) VALUES (?, ?, ?, ?, ?)",
            [name, label, time.time(), content, json.dumps(facts)],
        )

    def upload(self, name: str) -> dict[str, Any] | None:
        """An uploaded model: id, created, content, facts."""
        rows = self._read("SELECT * FROM uploads WHERE id = ?", [name])
        return _upload(rows[0]) if rows else None

    def uploads(self) -> list[dict[str, Any]]:
        """All uploaded models, latest first, without their content."""
        rows = self._read("SELECT id, name, created, '' AS content, facts FROM uploads ORDER BY created DESC, id", [])
        return [_upload(row) for row in rows]

    def remove_upload(self, name: str) -> None:
        """Forget an uploaded model."""
        self._write("DELETE FROM uploads WHERE id = ?", [name])

    def _write(self, statement: str, values: list[Any]) -> None:
        with self._lock, _told():
            self._base.execute(statement, values)

    def _read(self, statement: str, values: list[Any]) -> list[dict[str, Any]]:
        with self._lock, _told():
            cursor = self._base.execute(statement, values)
            names = [column[0] for column in cursor.description]
            return [dict(zip(names, row, strict=True)) for row in cursor.fetchall()]


@contextmanager
def _told() -> Iterator[None]:
    try:
        yield
    except sqlite3.Error as error:
        raise ServiceError(
            507, f"the records cannot be kept ({error})", todo="Make room on the server's disk and try again."
        ) from None


def _stored(name: str, value: Any) -> Any:
    return json.dumps(value) if name in _JSON and value is not None else value


def _job(row: dict[str, Any]) -> Job:
    return Job(**{name: json.loads(row[name]) if name in _JSON and row[name] else row[name] for name in _FIELDS})


def _upload(row: dict[str, Any]) -> dict[str, Any]:
    return {**row, "facts": json.loads(row["facts"])}
