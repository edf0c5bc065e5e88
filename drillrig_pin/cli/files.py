"""Files that commands write: whole or not at all, and refused before the work rather than after it."""

from __future__ import annotations

import os
import stat
from pathlib import Path

from drillrig_pin.errors import ResultFileError
from drillrig_pin.files import behind_links, is_stream, saving
from drillrig_pin.litter import marked


def require_writable(target: Path) -> None:
    """Make sure that ``target`` can be written later.

    Raises:
        ResultFileError: its folder does not exist or cannot be written, its name is too long, its links lead in a
            circle, or it is a folder, a disk or a socket itself.
    """
    if is_stream(target):
        return
    try:
        # A link is followed: what counts is where it leads.
        real = behind_links(target)
        mode = _mode(real)
    except (OSError, ValueError) as error:
        raise ResultFileError(
            f"cannot be written ({_reason(error)})", where=target, todo="Give another name."
        ) from None
    if mode is not None and stat.S_ISDIR(mode):
        raise ResultFileError("is a folder", where=target, todo="Give the name of a file.")
    if mode is not None and not stat.S_ISREG(mode):
        raise ResultFileError("is no file that can be written", where=target, todo="Give the name of a file.")
    folder = str(real.parent)
    if not real.parent.is_dir():
        raise ResultFileError(f"the folder {folder!r} does not exist", where=target, todo="Make it first.")
    probe = real.with_name(marked(f".{real.name}"))
    try:
        os.close(os.open(probe, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o600))
        os.unlink(probe)
    except OSError as error:
        raise ResultFileError(
            f"the folder {folder!r} cannot be written ({_reason(error)})",
            where=target,
            todo="Choose another place with -o.",
        ) from None


def require_folder(folder: Path) -> None:
    """Make ``folder`` unless it is there; ResultFileError if that cannot be."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (OSError, ValueError) as error:
        raise ResultFileError(
            f"the folder cannot be made ({_reason(error)})", where=folder, todo="Choose another place with -o."
        ) from None
    require_writable(folder / "figure.png")


def write_text(target: Path, text: str) -> None:
    """Write a text file as a whole; ResultFileError if it cannot be written."""
    with saving(target, where=target, todo="Check the free space.") as aside:
        aside.write_text(text, encoding="utf-8")


def _mode(path: Path) -> int | None:
    """What a path is; None if nothing is there yet."""
    try:
        return os.lstat(path).st_mode
    except (FileNotFoundError, NotADirectoryError):
        return None


def _reason(error: OSError | ValueError) -> str:
    return getattr(error, "strerror", None) or str(error)
