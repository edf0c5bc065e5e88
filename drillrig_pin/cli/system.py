"""What the operating system refuses, in sentences: it is no bug of this program."""

from __future__ import annotations

import errno
import os
import re
import resource

#: What is asked of whoever runs the command, by what was refused.
ADVICE = {
    errno.ENOSPC: "Make room on the disk.",
    errno.EDQUOT: "Your share of the disk is used up: make room.",
    errno.EFBIG: "Files of this size are not allowed here (ulimit -f).",
    errno.EMFILE: "Allow more open files (ulimit -n).",
    errno.ENFILE: "The machine has no open files left.",
    errno.EAGAIN: "Allow more processes (ulimit -u), or wait for others to end.",
    errno.ENOMEM: "Free memory, or allow more (ulimit -v).",
    errno.EACCES: "Check who may read and write there.",
    errno.EROFS: "Choose a place that can be written.",
    errno.EIO: "Look at the disk.",
    errno.ENAMETOOLONG: "Give a shorter name.",
    errno.ELOOP: "Look where its links lead.",
}
#: Words of libraries about what the system refused to their loader and to their threads.
_LOADER = re.compile(r"failed to map segment|cannot (?:allocate|open shared object|create shared)|Too many open files")
_THREADS = re.compile(r"can't (?:start|allocate) (?:new )?(?:thread|lock)|Resource temporarily unavailable")


def refusal(error: BaseException) -> str:
    """A sentence about an error that the system caused; empty if it did not."""
    if isinstance(error, OSError) and error.errno == errno.ENOENT and not _has_folder():
        return "the folder this command was started in is gone. Change to another one."
    if isinstance(error, OSError) and error.errno:
        # The name and the reason; the rest of its text is for programmers.
        place = f"{_name(error.filename)}: " if error.filename is not None else ""
        reason = error.strerror or os.strerror(error.errno)
        return f"{place}{reason}. {ADVICE.get(error.errno, 'Check the path.')}"
    words = " ".join(str(error).split())
    if isinstance(error, ImportError) and _LOADER.search(words):
        return f"a library cannot be loaded ({words[:200]}).{_bounds()} Free memory, or allow more (ulimit -v, -n)."
    if isinstance(error, RuntimeError) and _THREADS.search(words):
        return f"no thread or process can be started ({words[:200]}). {ADVICE[errno.EAGAIN]}"
    return ""


def about_memory(error: MemoryError) -> str:
    """A sentence about memory that there is not, with how much was asked for where that is known."""
    words = " ".join(str(error).split())
    asked = re.search(r"[Uu]nable to allocate ([\d.]+ ?[KMGTP]?i?B)", words)
    what = f"{asked[1]} more were asked for" if asked else "more was asked for than there is"
    return (
        f"not enough memory: {what}.{_bounds()} Ask for less (a shorter duration, a lower output_rate), or allow more."
    )


def _bounds() -> str:
    """What the process may have and has, if it is bounded."""
    bound, _ = resource.getrlimit(resource.RLIMIT_AS)
    if bound == resource.RLIM_INFINITY:
        return ""
    try:
        with open("/proc/self/statm", encoding="ascii") as stream:
            used = int(stream.read().split()[0]) * resource.getpagesize()
    except (OSError, ValueError):
        return f" The process may take {bound / 1e6:.0f} MB (ulimit -v)."
    return f" The process may take {bound / 1e6:.0f} MB (ulimit -v) and has {used / 1e6:.0f} MB."


def _has_folder() -> bool:
    try:
        os.getcwd()
    except OSError:
        return False
    return True


def _name(path: object) -> str:
    text = os.fsdecode(path) if isinstance(path, bytes) else str(path)
    return text if len(text) <= 120 else f"{text[:60]}...{text[-60:]}"
