"""One SQLite file: looked over when it is opened, written so that it survives; what goes wrong is told in words."""

from __future__ import annotations

import sqlite3
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from drillrig_pin.errors import ResultFileError
from drillrig_pin.service.problems import ServiceError

#: Until a file that another program holds is given up [s]. Nobody waits longer: what must be written is kept.
BUSY = 2.0
_ROOM = "Make room on the server's disk and try again."
_DAMAGED = "Put a copy of the records back, or move them away: what is asked for again is computed again."
#: By SQLite's primary result code: HTTP status, what is the matter, what to do.
_REASONS: Mapping[int, tuple[int, str, str]] = {
    sqlite3.SQLITE_FULL: (507, "the disk is full", _ROOM),
    sqlite3.SQLITE_READONLY: (507, "they may only be read", "Let the server write into its data folder."),
    sqlite3.SQLITE_IOERR: (507, "the disk failed", "Look after the server's disk and try again."),
    sqlite3.SQLITE_CANTOPEN: (507, "the file cannot be opened", "Look after the server's data folder."),
    sqlite3.SQLITE_BUSY: (503, "another program holds them", "Close that program, or try again."),
    sqlite3.SQLITE_LOCKED: (503, "another program holds them", "Close that program, or try again."),
    sqlite3.SQLITE_NOMEM: (503, "memory ran out", "Try again."),
    sqlite3.SQLITE_CORRUPT: (503, "the file is damaged", _DAMAGED),
    sqlite3.SQLITE_NOTADB: (503, "the file is damaged", _DAMAGED),
}


class Database:
    """The file. Every method may be called from any thread; who reads does not wait for who writes.

    Args:
        path: of the file.
        schema: what makes its tables.
        later: declarations of columns that tables of earlier versions lack, by table and name.

    Raises:
        ResultFileError: it cannot be opened, or is damaged.
    """

    def __init__(self, path: Path, schema: str, later: Mapping[str, Mapping[str, str]]) -> None:
        self._writing, self._reading = threading.RLock(), threading.RLock()
        _require_not_cut(path)
        try:
            self._writer = _connected(path)
            with _told("opened"):
                self._writer.execute("PRAGMA journal_mode = WAL")
                self._writer.execute("PRAGMA synchronous = FULL")
                (found,) = self._writer.execute("PRAGMA quick_check(1)").fetchone()
                if found != "ok":
                    raise _damaged(path, found)
                self._writer.executescript(schema)
                self._extend(later)
            self._reader = _connected(path)
        except ServiceError as error:
            # Nobody can be served without records: this is for whoever starts the server.
            raise ResultFileError(error.what, where=path, todo=error.todo) from None

    def _extend(self, later: Mapping[str, Mapping[str, str]]) -> None:
        for table, columns in later.items():
            there = {row[1] for row in self._writer.execute(f"PRAGMA table_info({table})")}
            for name in columns.keys() - there:
                self._writer.execute(f"ALTER TABLE {table} ADD COLUMN {name} {columns[name]}")

    def write(self, statement: str, values: list[Any]) -> None:
        """Carry out a statement; it is on the disk when this returns. ServiceError: it is not carried out."""
        with self._writing, _told("kept"):
            self._writer.execute(statement, values)

    def read(self, statement: str, values: list[Any]) -> list[dict[str, Any]]:
        """All rows a statement finds, by column. ServiceError: they cannot be read."""
        with self._reading, _told("read"):
            cursor = self._reader.execute(statement, values)
            names = [column[0] for column in cursor.description]
            return [dict(zip(names, row, strict=True)) for row in cursor.fetchall()]

    def close(self) -> None:
        """Let go of the file."""
        for lock, base in ((self._reading, self._reader), (self._writing, self._writer)):
            with lock, suppress(sqlite3.Error):
                base.close()


def _connected(path: Path) -> sqlite3.Connection:
    with _told("opened"):
        base = sqlite3.connect(path, check_same_thread=False, isolation_level=None, timeout=BUSY)
        # What is no text is no reason to fail: whoever reads the row sees that it is damaged.
        base.text_factory = lambda content: content.decode("utf-8", "replace")
        return base


def _require_not_cut(path: Path) -> None:
    """An empty file with results beside it was a full one: to go on with it would forget them without a word."""
    wal = path.with_name(f"{path.name}-wal")
    if path.is_file() and not path.stat().st_size and not (wal.exists() and wal.stat().st_size):
        beside = (path.parent / name for name in ("runs", "studies"))
        if any(folder.is_dir() and any(folder.iterdir()) for folder in beside):
            raise _damaged(path, "it is empty")


def _damaged(path: Path, found: str) -> ResultFileError:
    # The first finding, without the lines that lead to it.
    why = " ".join(found.split())[:120]
    return ResultFileError(f"the records are damaged ({why})", where=path, todo=_DAMAGED)


@contextmanager
def _told(verb: str) -> Iterator[None]:
    try:
        yield
    except (sqlite3.Error, MemoryError) as error:
        code = sqlite3.SQLITE_NOMEM if isinstance(error, MemoryError) else getattr(error, "sqlite_errorcode", 0)
        status, why, todo = _REASONS.get(code & 0xFF, (507, "the database refuses", "Tell the server's operator."))
        known = f" ({error})" if str(error) else ""
        raise ServiceError(
            status, f"the records cannot be {verb}: {why}{known}", todo=todo, headers={"Retry-After": "5"}
        ) from None
