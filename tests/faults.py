"""A disk that fails at the n-th thing asked of it, for n = 1, 2, 3, ... until a whole pass meets no fault.

    for fault in every_fault(folder, errno.ENOSPC):
        with fault:
            ...  # the work; it may raise

Counted is what this process asks of files in one folder: opening one for writing, writing, closing, syncing, renaming,
making a folder. A write that fails has written its first half. Work in other processes is not met.
"""

from __future__ import annotations

import builtins
import io
import os
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Any
from unittest import mock

#: More things are asked by no piece of work here: the search has run away.
MOST = 2000


class Fault:
    """A context in which the n-th thing asked of files in ``folder`` fails.

    Args:
        folder: only files within it count.
        number: which one fails, from 1 on; 0: none, they are only counted.
        error: number of the OSError.
        lasting: everything that follows fails as well, as on a disk that is full and stays so.

    Attributes:
        asked: what was asked so far, in words.
        struck: the one that failed, in words; empty if none did.
    """

    def __init__(self, folder: Path, number: int, error: int, *, lasting: bool = False) -> None:
        self._folder = os.path.realpath(folder)
        self._number, self._error, self._lasting = number, error, lasting
        self._real: dict[str, Any] = {}
        self._patches = ExitStack()
        self.asked: list[str] = []
        self.struck = ""

    def __enter__(self) -> Fault:
        for module, name in ((os, "open"), (os, "fsync"), (os, "replace"), (os, "rename"), (os, "mkdir")):
            self._real[name] = getattr(module, name)
        self._real["file"] = io.open
        for module, name, stand_in in (
            (builtins, "open", self._file),
            (io, "open", self._file),
            (os, "open", self._descriptor),
            (os, "fsync", self._fsync),
            (os, "replace", self._renaming("replace")),
            (os, "rename", self._renaming("rename")),
            (os, "mkdir", self._mkdir),
        ):
            self._patches.enter_context(mock.patch.object(module, name, stand_in))
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, way: TracebackType | None
    ) -> None:
        self._patches.close()

    def ask(self, what: str, path: object) -> None:
        """Count one thing; OSError if it is the one."""
        self.asked.append(f"{what} {os.path.basename(os.fspath(path))}")  # type: ignore[call-overload]
        number = len(self.asked)
        if number == self._number or (self._lasting and 0 < self._number < number):
            self.struck = self.struck or self.asked[-1]
            raise OSError(self._error, os.strerror(self._error), path)

    def within(self, path: object) -> bool:
        """Whether a path is one of those that count."""
        if isinstance(path, int):
            try:
                path = os.readlink(f"/proc/self/fd/{path}")
            except OSError:
                return False
        place = os.path.realpath(os.fsdecode(path))  # type: ignore[arg-type]
        return place == self._folder or place.startswith(self._folder + os.sep)

    def _file(self, path: Any, mode: str = "r", *rest: Any, **options: Any) -> Any:
        if not set(mode) & set("wax+") or not self.within(path):
            return self._real["file"](path, mode, *rest, **options)
        if not isinstance(path, int):
            self.ask("open", path)
        return _File(self._real["file"](path, mode, *rest, **options), self, path)

    def _descriptor(self, path: Any, flags: int, *rest: Any, **options: Any) -> Any:
        if flags & (os.O_WRONLY | os.O_RDWR | os.O_CREAT) and self.within(path):
            self.ask("open", path)
        return self._real["open"](path, flags, *rest, **options)

    def _fsync(self, number: int) -> None:
        if self.within(number):
            self.ask("fsync", os.readlink(f"/proc/self/fd/{number}"))
        self._real["fsync"](number)

    def _renaming(self, name: str) -> Any:
        def renamed(source: Any, target: Any, **options: Any) -> None:
            if self.within(target):
                self.ask("rename", target)
            self._real[name](source, target, **options)

        return renamed

    def _mkdir(self, path: Any, *rest: Any, **options: Any) -> None:
        if self.within(path) and not os.path.isdir(path):
            self.ask("mkdir", path)
        self._real["mkdir"](path, *rest, **options)


class _File:
    """An open file all of whose writes are asked for."""

    def __init__(self, file: Any, fault: Fault, path: Any) -> None:
        self._file, self._fault, self._path = file, fault, str(path)
        self._written = False

    def write(self, content: Any) -> Any:
        self._written = True
        try:
            self._fault.ask("write", self._path)
        except OSError:
            self._file.write(content[: len(content) // 2])
            raise
        return self._file.write(content)

    def writelines(self, lines: Any) -> None:
        for line in lines:
            self.write(line)

    def close(self) -> None:
        if self._file.closed:
            return
        try:
            # Only what was written can be lost in closing.
            if self._written:
                self._fault.ask("close", self._path)
        finally:
            self._file.close()

    def __enter__(self) -> _File:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __iter__(self) -> Iterator[Any]:
        return iter(self._file)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._file, name)


def every_fault(folder: Path, error: int, *, lasting: bool = False, first: int = 1, step: int = 1) -> Iterator[Fault]:
    """Faults one after the other, until a pass ends without meeting one.

    ``first`` and ``step`` choose some of them, where all would take too long.
    """
    for number in range(first, MOST, step):
        fault = Fault(folder, number, error, lasting=lasting)
        yield fault
        if not fault.struck:
            return
    raise AssertionError(f"more than {MOST} things were asked")
