"""How much memory there is, asked before a run rather than found out in the middle of it."""

from __future__ import annotations

import math
from pathlib import Path

#: Files of Linux: memory of the machine, and of the container the process runs in (bound, in use).
MACHINE = Path("/proc/meminfo")
CONTAINERS = (
    (Path("/sys/fs/cgroup/memory.max"), Path("/sys/fs/cgroup/memory.current")),
    (Path("/sys/fs/cgroup/memory/memory.limit_in_bytes"), Path("/sys/fs/cgroup/memory/memory.usage_in_bytes")),
)


def available_memory() -> float:
    """Memory a process may still take without pushing others out [bytes]; infinite where nobody says."""
    return min([_of_machine(), *(_of_container(bound, used) for bound, used in CONTAINERS)])


def _of_machine() -> float:
    for line in _text(MACHINE).splitlines():
        name, _, value = line.partition(":")
        if name == "MemAvailable":
            return 1024.0 * float(value.split()[0])
    return math.inf


def _of_container(bound: Path, used: Path) -> float:
    try:
        return max(0.0, float(_text(bound)) - float(_text(used)))
    except ValueError:
        return math.inf  # no such file, or no bound: "max"


def _text(path: Path) -> str:
    try:
        return path.read_text()
    except OSError:
        return ""
