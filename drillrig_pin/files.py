"""Where the shipped models and scenarios live, files of which no half is ever seen, folders that one process has."""

from __future__ import annotations

import contextlib
import fcntl
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import TextIO

from drillrig_pin.errors import ResultFileError

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


@contextlib.contextmanager
def write_aside(target: Path) -> Iterator[Path]:
    """Give a temporary path beside ``target``; rename it onto ``target`` if the block succeeds, else remove it."""
    target = Path(target)
    descriptor, name = tempfile.mkstemp(prefix=f".{target.name}.", dir=target.parent)
    os.close(descriptor)
    aside = Path(name)
    try:
        yield aside
        umask = os.umask(0)
        os.umask(umask)
        aside.chmod(0o666 & ~umask)
        aside.replace(target)
    finally:
        aside.unlink(missing_ok=True)


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
