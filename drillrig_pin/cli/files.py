"""Files that commands write: whole or not at all, and refused before the work rather than after it."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

from drillrig_pin.errors import ResultFileError
from drillrig_pin.files import is_stream, saving


def require_writable(target: Path) -> None:
    """Make sure that ``target`` can be written later.

    Raises:
        ResultFileError: its folder does not exist or cannot be written, or it is a folder, a disk or a socket itself.
    """
    if target.is_dir():
        raise ResultFileError("is a folder", where=target, todo="Give the name of a file.")
    if is_stream(target):
        return
    if target.exists() and not target.is_file():
        raise ResultFileError("is no file that can be written", where=target, todo="Give the name of a file.")
    # A link is followed: what counts is where it leads.
    target = Path(os.path.realpath(target))
    if not target.parent.is_dir():
        raise ResultFileError(f"the folder {str(target.parent)!r} does not exist", where=target, todo="Make it first.")
    try:
        descriptor, probe = tempfile.mkstemp(prefix=f".{target.name}.", dir=target.parent)
        os.close(descriptor)
        os.unlink(probe)
    except OSError as error:
        raise ResultFileError(
            f"the folder {str(target.parent)!r} cannot be written ({error.strerror})",
            where=target,
            todo="Choose another place with -o.",
        ) from None


def require_folder(folder: Path) -> None:
    """Make ``folder`` unless it is there; ResultFileError if that cannot be."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ResultFileError(
            f"the folder cannot be made ({error.strerror})", where=folder, todo="Choose another place with -o."
        ) from None
    require_writable(folder / "figure.png")


def write_text(target: Path, text: str) -> None:
    """Write a text file as a whole; ResultFileError if it cannot be written."""
    with saving(target, where=target, todo="Check the free space.") as aside:
        aside.write_text(text, encoding="utf-8")
