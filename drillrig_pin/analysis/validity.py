"""Whether the numbers of a run may be used at all: one judgement for tables, rankings, verdicts and pages."""

from __future__ import annotations

from drillrig_pin.analysis.trust import Trust, trust
from drillrig_pin.trajectory import Trajectory


def invalid(trajectory: Trajectory, found: Trust | None = None) -> tuple[str, ...]:
    """Why the numbers of a run must not be used, in words; empty for a run that nothing speaks against.

    Args:
        trajectory: a run of at least one sample.
        found: its trust line, if it is known already.

    It left what its laws describe (oil in tension, pressures no cylinder holds), its constraints drift, its energy
    balance does not close, or its positions are wrong. A run that stopped early says so by its status.
    """
    words = (trajectory.outcome.invalid,) if trajectory.outcome.invalid else ()
    return (*words, *(found or trust(trajectory)).doubts)
