"""Where the shipped models and scenarios live, files of which no half is ever seen, folders that one process has."""

from __future__ import annotations

import contextlib
import errno
import fcntl
import os
import shutil
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import TextIO

from drillrig_pin.errors import ResultFileError
from drillrig_pin.litter import marked, remove_litter, temporary_folder

MODEL_SUFFIXES = (".urdf.xacro", ".xacro", ".urdf")


def shipped_folder() -> Path:
    """The ``urdf`` folder: inside an installed package, or at the top level of a checkout."""
    package = Path(__file__).resolve().parent
    inside = package / "urdf"
    return inside if inside.is_dir() else package.parent / "urdf"


def shipped_models() -> dict[str, Path]:
    """Shipped models by name, e.g. ``mkz49``."""
    return {path.name.removesuffix(".urdf.xacro"): path for path in sorted(shipped_folder().glob("*.urdf.xacro"))}


def shipped_scenarios() -> dict[str, Path]:
    """Shipped scenarios by name, e.g. ``hole_9``."""
    return {path.stem: path for path in sorted((shipped_folder() / "scenarios").glob("*.yaml"))}


def shipped_studies() -> dict[str, Path]:
    """Shipped studies by name, e.g. ``nine_holes``: inside an installed package, or under scripts in a checkout."""
    package = Path(__file__).resolve().parent
    inside = package / "studies"
    folder = inside if inside.is_dir() else package.parent / "scripts" / "studies"
    return {path.stem: path for path in sorted(folder.glob("*.yaml"))}


def is_stream(target: Path) -> bool:
    """Whether a path is something to write into, not a file to replace: a FIFO, a terminal, an open descriptor."""
    try:
        mode = os.stat(target).st_mode
    except (OSError, ValueError):
        return False
    return stat.S_ISFIFO(mode) or stat.S_ISCHR(mode) or _descriptor(target) is not None


@contextlib.contextmanager
def write_aside(target: Path) -> Iterator[Path]:
    """Give a temporary path beside ``target``; rename it onto ``target`` if the block succeeds, else remove it.

    A link is followed: the file it leads to is replaced, and keeps its permissions and, where that is allowed, its
    owner. Other names of that file (hard links) keep what they had. What is there and no regular file is never
    replaced: a stream (see :func:`is_stream`) is written into at the end. What killed processes left of earlier
    attempts is removed.

    Raises:
        OSError: among others if the target is a folder, a disk or a socket, or its links lead in a circle.
    """
    target = Path(target)
    if is_stream(target):
        with temporary_folder() as folder:
            aside = folder / "content"
            aside.touch()
            yield aside
            _pour(aside, target)
        return
    target = behind_links(target)
    before = _regular(target)
    remove_litter(target.parent, f".{target.name}")
    aside = target.with_name(marked(f".{target.name}"))
    # A new file has the permissions that any new file gets; one that replaces another is nobody else's until then.
    os.close(os.open(aside, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666 if before is None else 0o600))
    try:
        yield aside
        if before is not None:
            _dress(aside, before)
        aside.replace(target)
    finally:
        # A disk that failed may refuse this as well; the next command removes it.
        with contextlib.suppress(OSError):
            aside.unlink()


def behind_links(target: Path) -> Path:
    """The path that links lead to. OSError if they lead in a circle."""
    try:
        os.stat(target)
    except OSError as error:
        if error.errno == errno.ELOOP:
            raise
    return Path(os.path.realpath(target))


def _regular(target: Path) -> os.stat_result | None:
    """What is known of the file that is to be replaced; None if there is none. OSError if it is no regular file."""
    try:
        found = os.lstat(target)
    except FileNotFoundError:
        return None
    if stat.S_ISDIR(found.st_mode):
        raise OSError(errno.EISDIR, "it is a folder")
    if not stat.S_ISREG(found.st_mode):
        raise OSError(errno.EINVAL, "it is no regular file")
    return found


def _dress(aside: Path, before: os.stat_result) -> None:
    """Give a new file the permissions and, where that is allowed, the owner of the one it replaces."""
    own = os.stat(aside)
    if (own.st_uid, own.st_gid) != (before.st_uid, before.st_gid):
        # Only the superuser may give files away, others to a group of theirs.
        for user in (before.st_uid, -1):
            with contextlib.suppress(OSError):
                os.chown(aside, user, before.st_gid)
                break
    aside.chmod(stat.S_IMODE(before.st_mode))


def _pour(source: Path, target: Path) -> None:
    """Write a file's content into a stream."""
    number = _descriptor(target)
    # A descriptor of this process is written where it stands; opened by its path, a file behind it would be cut.
    with source.open("rb") as read, os.fdopen(os.dup(number), "wb") if number is not None else target.open("wb") as out:
        shutil.copyfileobj(read, out)


def _descriptor(target: Path) -> int | None:
    """The descriptor of this process that a path such as ``/dev/stdout`` or ``/dev/fd/3`` stands for."""
    path = os.fspath(target)
    for _ in range(8):
        folder, name = os.path.split(os.path.abspath(path))
        if os.path.realpath(folder) == f"/proc/{os.getpid()}/fd" and name.isdecimal():
            return int(name)
        if not os.path.islink(path):
            return None
        path = os.path.join(folder, os.readlink(path))
    return None


@contextlib.contextmanager
def saving(target: Path, *, where: object, todo: str = "") -> Iterator[Path]:
    """:func:`write_aside` that says in one sentence why a result cannot be written.

    Raises:
        ResultFileError: the disk is full, or the folder is gone or not writable; with ``where`` and ``todo``.
    """
    try:
        with write_aside(target) as aside:
            yield aside
    except OSError as error:
        raise ResultFileError(f"cannot be written ({error.strerror or error})", where=where, todo=todo) from None


def lock_folder(folder: Path) -> TextIO | None:
    """The lock of a folder, held until it is closed or the process ends, however it ends; None if another holds it.

    Raises:
        OSError: there is no such folder, or nothing can be written in it.
    """
    lock = (folder / ".lock").open("w")
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        lock.close()
        return None
    return lock
