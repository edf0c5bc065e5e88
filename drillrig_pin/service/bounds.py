"""Bounds of a process on memory and file size, as the operating system keeps them."""

from __future__ import annotations

import contextlib
import resource
from collections.abc import Iterator


@contextlib.contextmanager
def bounded(memory: int, output: int) -> Iterator[None]:
    """Let the block take ``memory`` bytes on top of what the process has, and write files of ``output`` bytes.

    Zero is no bound. Beyond the first, Python raises MemoryError; beyond the second, writing fails with OSError.
    """
    wanted = []
    if memory:
        wanted.append((resource.RLIMIT_AS, _address_space() + memory))
    if output:
        wanted.append((resource.RLIMIT_FSIZE, output))
    before = [(kind, resource.getrlimit(kind)) for kind, _ in wanted]
    try:
        for kind, bound in wanted:
            lower(kind, bound)
        yield
    finally:
        for kind, limits in before:
            resource.setrlimit(kind, limits)


def lower(kind: int, bound: int) -> None:
    """Bring a soft limit of this process down to ``bound``, unless it is lower."""
    soft, hard = resource.getrlimit(kind)
    known = [value for value in (bound, soft, hard) if value != resource.RLIM_INFINITY]
    resource.setrlimit(kind, (min(known), hard))


def _address_space() -> int:
    with contextlib.suppress(OSError), open("/proc/self/statm") as stream:
        return int(stream.read().split()[0]) * resource.getpagesize()
    return 0
