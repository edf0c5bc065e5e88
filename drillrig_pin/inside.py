"""Rows inside a step: twin of _core/rows.cpp.

The sequence of steps does not depend on the times of the rows. What lies inside a step is found from its ends: by the
interpolant of DOP853, which is of order 7, by that of Radau, which errs by what its error control allows, or else by a
shorter step of the same method from where the step began.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from enum import Enum
from typing import Any, Protocol

import numpy as np

from drillrig_pin.kinematics import Array
from drillrig_pin.stepping import Counter, Plan, Settings

#: Deviation from a straight line, over the largest force so far, that asks for a further row; halvings of a step.
FLAT, HALVINGS = 5e-3, 6


class System(Protocol):
    """What can be integrated."""

    def rate(self, t: float, y: Array) -> Array:
        """dy/dt."""

    def project(self, y: Array) -> Array:
        """y put back onto its constraints."""

    def switches(self, y: Array) -> Array:
        """Functions whose sign changes mark a kink."""

    def responses(self) -> Array:
        """Forces of what answers the motion, at the state last evaluated: rows must be close enough to show them."""


class Kind(Enum):
    """What a state handed out by an integration is.

    A planned row at the end of a step, one inside a step, or a further row.
    """

    ROW = 1
    INSIDE = 2
    EXTRA = 3


State = tuple[Kind, float, Array]


class Inside:
    """Hands out the rows of one step after the other.

    Args:
        system: right-hand side; evaluated at every state handed out.
        start: state at the first row, where the system has just been evaluated.
        plan: the rows.
        settings: method and projection.
        counter: counts evaluations.
        switching: True if some law switches: its forces then get as many rows as show them.
        solver: makes an integrator (t, y, bound, first step) of the method.
    """

    def __init__(
        self,
        system: System,
        plan: Plan,
        settings: Settings,
        counter: Counter,
        switching: bool,
        solver: Callable[[float, Array, float, float], Any],
    ) -> None:
        self._system, self._settings, self._counter, self._solver = system, settings, counter, solver
        self._times, self._stops = plan.times.tolist(), plan.stops.tolist()
        self._switching = switching
        self._next = 1
        self._left = system.responses() if switching else np.zeros(0)
        self._largest = np.abs(self._left)

    def rows(self, step: Any, stopped: bool) -> Iterator[State]:
        """Rows before the end of the step ``step`` has just taken, in order of time but for the further ones.

        The system has been evaluated at the end of the step, and is so again behind them.

        Args:
            step: an integrator of SciPy's behind an accepted step.
            stopped: its end is a stop.
        """
        t, y, near = float(step.t), step.y, 1e-9 * (step.t - step.t_old)
        if not (self._switching or self._waits(t + near)):
            return
        curve = step.dense_output() if self._settings.method != "RK4" else None
        while self._waits(t + near):
            self._next += 1
            time = self._times[self._next - 1]
            yield Kind.INSIDE, time, self._look(step, curve, time)
        self._evaluate(t, y)
        if self._switching:
            if not stopped:
                yield Kind.EXTRA, t, self._look(step, curve, t)
            right = self._system.responses()
            self._largest = np.maximum(self._largest, np.abs(right))
            yield from self._refine(step, curve, (float(step.t_old), self._left), (t, right), HALVINGS)
            self._left = right
            self._evaluate(t, y)

    def at_stop(self, time: float, y: Array) -> State:
        """The row at a stop, where the system has just been evaluated."""
        self._next += 1
        if self._switching:
            self._left = self._system.responses()
            self._largest = np.maximum(self._largest, np.abs(self._left))
        return Kind.ROW, time, y

    def _waits(self, t: float) -> bool:
        """True if the next row is due within a step that ends at ``t``."""
        return not self._stops[self._next] and self._times[self._next] <= t

    def _refine(
        self, step: Any, curve: Any, left: tuple[float, Array], right: tuple[float, Array], halvings: int
    ) -> Iterator[State]:
        """Further rows where a straight line between two would miss a force."""
        t = 0.5 * (left[0] + right[0])
        y = self._look(step, curve, t)
        forces = self._system.responses()
        self._largest = np.maximum(self._largest, np.abs(forces))
        if (np.abs(forces - 0.5 * (left[1] + right[1])) <= FLAT * self._largest).all():
            return
        yield Kind.EXTRA, t, y
        if halvings > 1:
            yield from self._refine(step, curve, left, (t, forces), halvings - 1)
            yield from self._refine(step, curve, (t, forces), right, halvings - 1)

    def _look(self, step: Any, curve: Any, t: float) -> Array:
        y = self._state(step, curve, t)
        if self._settings.projection:
            y = self._system.project(y)
        self._evaluate(t, y)
        return y

    def _state(self, step: Any, curve: Any, t: float) -> Array:
        if t >= step.t - 1e-9 * (step.t - step.t_old):
            return np.array(step.y)
        if curve is not None:
            return np.asarray(curve(t))
        aside = self._solver(step.t_old, step.y_old, t, t - step.t_old)
        aside.step()
        self._counter.evaluations += aside.nfev
        return np.asarray(aside.y)

    def _evaluate(self, t: float, y: Array) -> None:
        self._system.rate(t, y)
        self._counter.evaluations += 1
