"""All engines that can be had here."""

from __future__ import annotations

import importlib
from subprocess import SubprocessError

from drillrig_pin.errors import EngineError
from peers.problem import Engine, Problem

#: Module and class of every engine, this package first.
ENGINES = {
    "core": ("ours", "Core"),
    "python": ("ours", "Python"),
    "mujoco": ("mujoco", "Mujoco"),
    "exudyn": ("exudyn", "Exudyn"),
    "scipy": ("scipy", "Scipy"),
    "drake": ("drake", "Drake"),
}


def bound(problem: Problem, wanted: list[str] | None = None) -> tuple[dict[str, Engine], dict[str, str]]:
    """Engines ready to run, by key, and why the others are not."""
    ready: dict[str, Engine] = {}
    missing: dict[str, str] = {}
    for key, (module, name) in ENGINES.items():
        if wanted is not None and key not in wanted:
            continue
        try:
            ready[key] = getattr(importlib.import_module(f"peers.{module}"), name)(problem)
        except (ImportError, OSError, SubprocessError, EngineError) as error:
            missing[key] = f"{type(error).__name__}: {error}"
    return ready, missing
