"""What a command may write over: never what it reads, unasked only files of its own kind, others with --force."""

from __future__ import annotations

import mmap
import os
import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from drillrig_pin.cli.files import require_writable
from drillrig_pin.errors import ResultFileError
from drillrig_pin.files import is_stream

if TYPE_CHECKING:
    from rich.console import Console

Force = Annotated[
    bool, typer.Option("--force", help="Replace a file that is there and was not written by this program.")
]

#: Where a mark is looked for in files whose head does not carry it [bytes].
_HEAD = 4096
#: How files of this package begin, and what must stand in them; in the head only where the flag says so.
_MARKS: dict[str, tuple[bytes, bytes, bool]] = {
    "result": (rb"\x89HDF\r\n", rb"drillrig trajectory", False),
    "png": (rb"\x89PNG\r\n", rb"Software\x00drillrig-pin", True),
    "page": (rb"<!(?i:doctype) html", rb'<meta name="generator" content="drillrig', True),
    "svg": (rb"<\?xml[^>]*>\s*<!DOCTYPE svg", rb"drillrig-pin", True),
    "csv": (rb"time \[s\],", rb",v\.[^,\n]*,(.*,)?a\.[^,\n]*,", True),
    "mat": (rb"MATLAB 5\.0 MAT-file", rb"content_hash", False),
    "film": (rb"....ftyp", rb"drillrig-pin", False),
    "parquet": (rb"PAR1", rb"drillrig study", False),
    "json": (rb"\{\s*\"format\": \"drillrig ", rb"", True),
    "yaml": (rb"# Best design of the study ", rb"", True),
}


def written_here(path: Path, kind: str) -> bool:
    """Whether this package wrote a file, as a ``kind`` of ``_MARKS``, by what stands in it; its name says nothing."""
    if kind not in _MARKS:
        return False
    start, pattern, in_head = _MARKS[kind]
    try:
        with path.open("rb") as stream:
            head = stream.read(_HEAD)
            if re.match(start, head, re.DOTALL) is None:
                return False
            if in_head:
                return re.search(pattern, head) is not None
            with mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as content:
                return re.search(pattern, content) is not None
    except (OSError, ValueError):
        return False


def require_target(target: Path, kind: str, *, reads: Iterable[Path | str | None] = (), force: bool = False) -> bool:
    """Make sure that ``target`` can be written and that nothing is lost by it; True if a file will be replaced.

    Args:
        target: the file to write.
        kind: what it will be, of ``_MARKS``. Only what this package wrote as the same kind is replaced unasked: a page
            takes the place of a page, never that of another run's result.
        reads: what the command reads; a path that is no file is passed over.
        force: whether a file that is not of this package may be replaced.

    Raises:
        ResultFileError: it is one of the files that are read (also by another name: a link, another case); it is there
            and was not written by this package as the same kind; it is write-protected; :func:`require_writable`.
    """
    require_unread(target, reads)
    require_writable(target)
    if is_stream(target) or not target.exists():
        return False
    if not os.access(target, os.W_OK):
        raise ResultFileError("is write-protected", where=target, todo="Choose another name.")
    if not (force or target.stat().st_size == 0 or written_here(target, kind)):
        raise ResultFileError(
            f"is there already and is no {kind} that this program wrote",
            where=target,
            todo="Choose another name, or replace it with --force.",
        )
    return True


def require_unread(target: Path, reads: Iterable[Path | str | None]) -> None:
    """ResultFileError if ``target`` is one of the files that are read."""
    for read in reads:
        if read is not None and _same(target, Path(read)):
            other = "" if str(read) == str(target) else f", as {read}"
            raise ResultFileError(
                f"is read by this command{other}: writing would destroy it", where=target, todo="Choose another name."
            )


def require_apart(*targets: Path | None) -> None:
    """ResultFileError if two files to write are one."""
    given = [target for target in targets if target is not None]
    for i, target in enumerate(given):
        for other in given[:i]:
            if os.path.realpath(other) == os.path.realpath(target) or _same(other, target):
                raise ResultFileError("is given twice as a file to write", where=target, todo="Give two names.")


def require_targets(folder: Path, names: Iterable[str], *, reads: Iterable[Path | str | None], force: bool) -> None:
    """:func:`require_target` for files that a command writes into a folder."""
    reads = list(reads)
    for name in names:
        if is_stream(folder / name):
            todo = "Choose another folder."
            raise ResultFileError("is no file that can be replaced", where=folder / name, todo=todo)
        require_target(folder / name, Path(name).suffix.removeprefix("."), reads=reads, force=force)


def free_name(target: Path) -> Path:
    """``target``, or the next of run-2.nc, run-3.nc, ... that is not there; taken, so that no other command takes it.

    Raises:
        ResultFileError: the folder cannot be written.
    """
    for path in _names(target):
        try:
            os.close(os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
        except FileExistsError:
            continue
        except OSError as error:
            raise ResultFileError(f"cannot be written ({error.strerror})", where=path) from None
        return path
    raise AssertionError("numbers do not end")


def console_beside(*targets: Path | None) -> Console:
    """Where to say what was written: on stderr if a target is a stream, which words would spoil."""
    from drillrig_pin.cli.output import console

    return console(stderr=any(target is not None and is_stream(target) for target in targets))


def _names(target: Path) -> Iterator[Path]:
    yield target
    number = 2
    while True:
        yield target.with_name(f"{target.stem}-{number}{target.suffix}")
        number += 1


def _same(one: Path, other: Path) -> bool:
    try:
        return os.path.samefile(one, other)
    except (OSError, ValueError):
        return False
