"""Temporary files and folders that say whose they are, so that those of dead processes can be removed.

A name ends in ``.PID-START-WHERE-RANDOM``: the process, its start in ticks of the clock since the machine booted, and
the boot and the container it counts in. A process of the same boot and container can be looked up, and a number given
anew to another process has another start. Elsewhere nobody can tell: such a file is left alone for a day.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import re
import secrets
import shutil
import tempfile
import time
from collections.abc import Iterator
from functools import cache
from pathlib import Path

#: Files of processes that cannot be looked up are taken for left behind after this long [s].
DAY = 86_400.0
#: Longest name of a file [bytes].
LONGEST = 255
#: First part of the names of temporary folders.
FOLDER = "drillrig"
_MARK = re.compile(r"\.(\d+)-(\d+)-([0-9a-f]{8})-[0-9a-f]{8}")


def marked(stem: str) -> str:
    """A name that begins with ``stem`` and that no other file has."""
    pid = os.getpid()
    mark = f".{pid}-{_start(pid) or 0}-{_where()}-{secrets.token_hex(4)}"
    return f"{_short(stem)}{mark}"


def remove_litter(folder: Path, stem: str = "", *, alone: bool = False) -> None:
    """Remove what dead processes left in a folder under names of :func:`marked`.

    Args:
        folder: where to look; one that cannot be read is passed over.
        stem: only names made of this one; empty: any.
        alone: nobody else may write in the folder now: what cannot be looked up goes without waiting for a day.
    """
    with contextlib.suppress(OSError), os.scandir(folder) as entries:
        for entry in list(entries):
            found = _MARK.search(entry.name)
            if found is None or found.end() != len(entry.name):
                continue
            if stem and entry.name[: found.start()] != _short(stem):
                continue
            # Another process may be removing it, or it belongs to somebody else.
            with contextlib.suppress(OSError):
                if not _alive(found, entry, alone):
                    _remove(entry)


@contextlib.contextmanager
def temporary_folder() -> Iterator[Path]:
    """A folder among the temporary ones, removed at the end of the block, or by a later process if this one is killed.

    Raises:
        OSError: no folder can be made.
    """
    place = Path(tempfile.gettempdir())
    remove_litter(place, FOLDER)
    folder = place / marked(FOLDER)
    folder.mkdir(mode=0o700)
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _remove(entry: os.DirEntry[str]) -> None:
    if entry.is_dir(follow_symlinks=False):
        shutil.rmtree(entry.path, ignore_errors=True)
    else:
        os.unlink(entry.path)


def _alive(mark: re.Match[str], entry: os.DirEntry[str], alone: bool) -> bool:
    pid, start, where = int(mark[1]), int(mark[2]), mark[3]
    if where == _where() and start:
        return _start(pid) == start
    return not alone and time.time() - entry.stat(follow_symlinks=False).st_mtime < DAY


def _short(stem: str) -> str:
    """A stem that leaves room for the mark."""
    room = LONGEST - 64
    raw = os.fsencode(stem)
    return stem if len(raw) <= room else f".{hashlib.sha256(raw).hexdigest()[:32]}"


def _start(pid: int) -> int | None:
    """When a process started [ticks since boot]; None if there is none, or it is dead but for its parent."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_bytes().rpartition(b")")[2].split()
    except OSError:
        return None
    return None if fields[0] in (b"Z", b"X") else int(fields[19])


@cache
def _where() -> str:
    """The boot of the machine and the container, in eight letters: where a number of a process means something."""
    told = [os.uname().nodename]
    with contextlib.suppress(OSError):
        told.append(Path("/proc/sys/kernel/random/boot_id").read_text())
    with contextlib.suppress(OSError):
        told.append(os.readlink("/proc/self/ns/pid"))
    return hashlib.sha256("\n".join(told).encode()).hexdigest()[:8]
