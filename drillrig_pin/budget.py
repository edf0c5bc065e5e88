"""Processor time a run may take: one that would clearly take longer is stopped early, not when it is spent."""

from __future__ import annotations

import time

from drillrig_pin.errors import DrillrigError
from drillrig_pin.words import number

#: Parts of the budget spent before a run is judged by how far it came: one that would take longer than its budget, ...
PATIENCE = 1 / 180
#: ... and one that would take so many times as long.
HOPELESS, LITTLE_PATIENCE = 100.0, 1 / 1800
#: Judged again behind so many times the time of the last look: a slow start is forgiven once the run goes faster.
AGAIN = 1.25


class OverspentError(DrillrigError):
    """A run takes, or would take, more processor time than it may."""


class Budget:
    """Watches the processor time of this thread over one run.

    Args:
        limit: what the run may take [s]; None: any time.
        duration: simulated time of the run [s].
    """

    def __init__(self, limit: float | None, duration: float) -> None:
        self._limit, self._duration = limit, duration
        self._started = time.thread_time()
        self._looked = (0.0, 0.0)
        self._next = 0.0 if limit is None else limit * LITTLE_PATIENCE

    def spend(self, t: float) -> None:
        """Take in the simulated time reached [s].

        Raises:
            OverspentError: with what was spent and what the run would take.
        """
        if self._limit is None:
            return
        spent = time.thread_time() - self._started
        if spent < self._next:
            return
        before, reached = self._looked
        # By the whole way and by the last part of it: what is expected is the better of both.
        whole = spent * self._duration / t if t > 0 else float("inf")
        rest = (self._duration - t) * (spent - before) / (t - reached) if t > reached else float("inf")
        expected = min(whole, spent + rest)
        hopeless = expected > HOPELESS * self._limit
        if spent > self._limit or hopeless or (spent > PATIENCE * self._limit and expected > self._limit):
            told = "" if expected == float("inf") else f"; the whole run would take {number(expected, 2)} s"
            raise OverspentError(
                f"{number(spent, 2)} s of processor time led to t = {t:.4g} s of {self._duration:g} s{told}"
            )
        self._looked, self._next = (spent, t), spent * AGAIN
