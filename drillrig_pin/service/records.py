"""The records of a server: which jobs there are and how they stand, in one SQLite file that outlives the process."""

from __future__ import annotations

import contextlib
import dataclasses
import json
import threading
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from drillrig_pin.service.database import Database
from drillrig_pin.service.job import FIELDS, NotReadableError, job_of, not_readable, stored, upload_of
from drillrig_pin.service.job import Job as Job
from drillrig_pin.service.job import Kind as Kind
from drillrig_pin.service.problems import ServiceError

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
_LATER = {
    "jobs": {
        "digest": "TEXT NOT NULL DEFAULT ''",
        "reached": "INTEGER NOT NULL DEFAULT 0",
        "beside": "TEXT",
    }
}


class Records:
    """The database. Every method may be called from any thread.

    What is told with :meth:`keep` and :meth:`forget` holds at once, for everybody who reads, and is recorded as soon as
    the disk takes it. A record that cannot be read is set apart: it hides no other one.

    Attributes:
        trouble: why something is not recorded yet; empty: all is.
        apart: of what kind a record is and why it cannot be read, by id.

    Raises:
        ResultFileError: the file cannot be used.
        ServiceError (of most methods): it cannot be read or written at the moment.
    """

    def __init__(self, path: Path) -> None:
        self._lock = threading.RLock()
        self._kept: dict[str, dict[str, Any]] = {}
        self._forgotten: set[str] = set()
        self.trouble = ""
        self.apart: dict[str, tuple[str, str]] = {}
        self._base = Database(path, _SCHEMA, _LATER)
        self._sound(self._base.read("SELECT * FROM jobs", []))

    def close(self) -> None:
        """Record what is left, write everything into the one file and let go of it."""
        self.settle()
        self._base.close()

    def add(self, job: Job) -> None:
        """Record a job; one of the same id is replaced. ServiceError: it is not recorded, and the other one stands."""
        with self._lock:
            try:
                before = self.job(job.id, job.kind)
            except NotReadableError:
                before = None
            values = {name: getattr(job, name) for name in FIELDS}
            marks = ", ".join("?" * len(FIELDS))
            row = [stored(name, value) for name, value in values.items()]
            try:
                self._base.write(f"INSERT OR REPLACE INTO jobs ({', '.join(FIELDS)}) VALUES ({marks})", row)
            except ServiceError:
                self._take_back(job, before)
                raise
            self._kept.pop(job.id, None)
            self._forgotten = self._forgotten - {job.id}
            self._trust(job.id)

    def _take_back(self, job: Job, before: Job | None) -> None:
        """A disk may take what it says that it refuses: whoever was refused must not find it there."""
        with contextlib.suppress(ServiceError):
            if self.job(job.id, job.kind) not in (None, before):
                if before is None:
                    self.forget(job.id)
                else:
                    self.keep(job.id, **{name: getattr(before, name) for name in FIELDS})

    def change(self, job: str, **values: Any) -> None:
        """Change some fields of a job, on the disk or not at all."""
        with self._lock:
            self._update(job, {**self._kept.get(job, {}), **values})
            self._kept.pop(job, None)

    def keep(self, job: str, **values: Any) -> bool:
        """Change some fields of a job, if need be for the time being in memory; gives whether they are recorded."""
        with self._lock:
            values = {**self._kept.get(job, {}), **values}
            if self.settle() and self._done(lambda: self._update(job, values)):
                return True
            self._kept[job] = values
            return False

    def add_beside(self, job: str, kind: Kind, name: str, digest: str) -> bool:
        """Remember the SHA-256 of a file beside the result of a job; gives whether it is recorded."""
        with self._lock:
            known = self.job(job, kind)
            return known is None or self.keep(job, beside={**(known.beside or {}), name: digest})

    def forget(self, job: str) -> bool:
        """Forget a job, if need be for the time being in memory; gives whether that is recorded."""
        with self._lock:
            self._kept.pop(job, None)
            self._trust(job)
            if self.settle() and self._done(lambda: self._delete(job)):
                return True
            # What others look through at this moment is not changed, but replaced.
            self._forgotten = {*self._forgotten, job}
            return False

    def settle(self) -> bool:
        """Record what is kept in memory; False if that cannot be done yet, see ``trouble``."""
        with self._lock:
            return self._done(self._settle)

    def _settle(self) -> None:
        for job in list(self._forgotten):
            self._delete(job)
            self._forgotten = self._forgotten - {job}
        for job, values in list(self._kept.items()):
            self._update(job, values)
            del self._kept[job]

    def _done(self, write: Callable[[], None]) -> bool:
        """Whether something could be written."""
        try:
            write()
        except ServiceError as error:
            self.trouble = error.what
            return False
        self.trouble = ""
        return True

    @property
    def unrecorded(self) -> int:
        """Of how many jobs a change is kept in memory."""
        return len(self._kept) + len(self._forgotten)

    def job(self, name: str, kind: Kind) -> Job | None:
        """A job by id. NotReadableError, 404: its record is damaged."""
        # What is kept is taken first: meanwhile it may be recorded, but not lost.
        kept, forgotten = self._kept.get(name), name in self._forgotten
        rows = self._base.read("SELECT * FROM jobs WHERE id = ? AND kind = ?", [name, kind])
        if forgotten or not rows:
            return None
        found = self._sound(rows)
        if not found:
            raise not_readable(kind)
        return dataclasses.replace(found[0], **kept) if kept else found[0]

    def jobs(
        self, kind: Kind, *, search: str = "", status: str | None = None, after: str | None = None, limit: int = 50
    ) -> list[Job]:
        """Jobs that hold all words of a search, latest first, after the one with the id ``after``."""
        kept, forgotten = dict(self._kept), self._forgotten
        where: list[str] = ["kind = ?"]
        values: list[Any] = [kind]
        for word in search.lower().split():
            where.append("instr(words, ?) > 0")
            values.append(word)
        if status is not None:
            # How those stand of which something is kept is seen below.
            where.append(f"(status = ? OR id IN ({', '.join('?' * len(kept))}))")
            values += [status, *kept]
        if after is not None:
            where.append("(created, id) < (SELECT created, id FROM jobs WHERE id = ?)")
            values.append(after)
        more = len(kept) + len(forgotten) + len(self.apart)
        rows = self._base.read(
            f"SELECT * FROM jobs WHERE {' AND '.join(where)} ORDER BY created DESC, id DESC LIMIT ?",
            [*values, limit + more],
        )
        found = (dataclasses.replace(job, **kept.get(job.id, {})) for job in self._sound(rows))
        wanted = [job for job in found if job.id not in forgotten and status in (None, job.status)]
        return wanted[:limit]

    def unfinished(self) -> list[Job]:
        """Jobs to be carried out, in the order they were asked for."""
        rows = self._base.read("SELECT * FROM jobs WHERE status IN ('queued', 'running') ORDER BY created, id", [])
        return self._sound(rows)

    def ended_since(self, moment: float) -> bool:
        """Whether any job came to its end after a moment [s since 1970]."""
        ended = "status IN ('completed', 'failed') AND finished > ?"
        return bool(self._base.read(f"SELECT 1 FROM jobs WHERE {ended} LIMIT 1", [moment]))

    def set_apart(self, job: str, kind: str, why: str) -> NotReadableError:
        """Leave a record out from now on; gives what to say of it."""
        self.apart = {**self.apart, job: (kind, why)}
        return not_readable(kind)

    def named_apart(self, kind: Kind) -> list[str]:
        """Ids of the jobs of a kind whose records are set apart."""
        return [number for number, (of, _) in self.apart.items() if of == kind]

    def add_upload(self, name: str, label: str, content: str, facts: dict[str, Any]) -> None:
        """Record an uploaded model; one of the same id is replaced."""
        self._base.write(
            "INSERT OR REPLACE INTO uploads (id, name, created, content, facts) VALUES (?, ?, ?, ?, ?)",
            [name, label, time.time(), content, json.dumps(facts)],
        )
        self._trust(name)

    def upload(self, name: str) -> dict[str, Any] | None:
        """An uploaded model: id, created, content, facts."""
        found = self._uploads(self._base.read("SELECT * FROM uploads WHERE id = ?", [name]))
        return found[0] if found else None

    def uploads(self) -> list[dict[str, Any]]:
        """All uploaded models, latest first, without their content."""
        columns = "id, name, created, '' AS content, facts"
        return self._uploads(self._base.read(f"SELECT {columns} FROM uploads ORDER BY created DESC, id", []))

    def remove_upload(self, name: str) -> None:
        """Forget an uploaded model."""
        self._base.write("DELETE FROM uploads WHERE id = ?", [name])
        self._trust(name)

    def _trust(self, name: str) -> None:
        self.apart = {number: why for number, why in self.apart.items() if number != name}

    def _delete(self, job: str) -> None:
        self._base.write("DELETE FROM jobs WHERE id = ?", [job])

    def _update(self, job: str, values: Mapping[str, Any]) -> None:
        names = ", ".join(f"{name} = ?" for name in values)
        found = [stored(name, value) for name, value in values.items()]
        self._base.write(f"UPDATE jobs SET {names} WHERE id = ?", [*found, job])

    def _sound(self, rows: list[dict[str, Any]]) -> list[Job]:
        """Of some rows those that can be read; the others are set apart."""
        found = []
        for row in rows:
            number = str(row["id"])
            try:
                if number not in self.apart:
                    found.append(job_of(row))
            except (ValueError, TypeError, RecursionError) as error:
                self.set_apart(number, str(row["kind"]), str(error)[:120])
        return found

    def _uploads(self, rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
        found = []
        for row in rows:
            try:
                found.append(upload_of(row))
            except (ValueError, TypeError, RecursionError) as error:
                self.set_apart(str(row["id"]), "upload", str(error)[:120])
        return found
