"""Time in tests: how long to wait at most, and what a process has computed, which a busy machine does not change."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

#: Until something that does not come is given up [s]. No test says how long anything takes, on whatever machine.
PATIENCE = 300.0


def processor_time(pid: int) -> float:
    """Processor time of a process, its own and the system's for it [s]."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def wait_for(condition: Callable[[], Any]) -> None:
    """Until a condition holds; AssertionError if it never does."""
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end, "it did not happen"
        time.sleep(0.05)
