"""Small files of anybody: read as a whole, if they are files and small."""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path


def modest_bytes(path: Path, most: int) -> bytes:
    """The content of a regular file of at most so many bytes.

    Raises:
        OSError: it cannot be read, is larger, or is a device or a pipe, which may never end.
    """
    # Opened without waiting: a pipe that nobody writes to would hold the reader for ever.
    with os.fdopen(os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC), "rb") as stream:
        if not stat.S_ISREG(os.fstat(stream.fileno()).st_mode):
            raise OSError(errno.EINVAL, "it is no regular file")
        content = stream.read(most + 1)
    if len(content) > most:
        raise OSError(errno.EFBIG, f"it is larger than {most / 1e6:.3g} MB")
    return content
