"""Files that are kept and served: written whole, and known by the SHA-256 of what was written."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from drillrig_pin.files import saving

RESULT = "run.nc"
METRICS = "metrics.json"
#: What to do when a file does not fit; where it lies is nothing to tell a client.
ROOM = "Make room on the server's disk."


def sha256_of(path: Path) -> str:
    """The SHA-256 of a file, read a little at a time. OSError: it cannot be read."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def kept(target: Path, function: Callable[..., Any], *arguments: Any) -> str:
    """Have a function write a file; gives its SHA-256."""
    target.parent.mkdir(exist_ok=True)
    function(*arguments)
    return sha256_of(target)


def write_metrics(document: Mapping[str, Any], target: Path) -> str:
    """Write the numbers of a run; gives the SHA-256.

    Raises:
        ResultFileError: there is no room.
    """
    content = json.dumps(document, ensure_ascii=False, allow_nan=False).encode()
    with saving(target, where=None, todo=ROOM) as aside:
        aside.write_bytes(content)
    return hashlib.sha256(content).hexdigest()


def write_text(target: Path, text: str) -> None:
    """Write a page.

    Raises:
        ResultFileError: there is no room.
    """
    with saving(target, where=None, todo=ROOM) as aside:
        aside.write_text(text, encoding="utf-8")
