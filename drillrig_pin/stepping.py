"""What both engines share: settings of a run, where its steps must end, what it cost, how it stops."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from drillrig_pin.errors import Status
from drillrig_pin.kinematics import Array


@dataclass(frozen=True)
class Settings:
    """Method and step control.

    Attributes:
        method: name of the integrator.
        step: step of RK4 [s].
        rtol: relative tolerance.
        atol: absolute tolerance by component of the integrated vector.
        max_step: longest step [s].
        projection: whether accepted steps are put back onto the constraints.
        endless: components whose size says nothing: angles that count on over whole turns. Their error may be
            ``atol`` + ``rtol``, that of one radian, however far they have turned.
    """

    method: str
    step: float
    rtol: float
    atol: Array
    max_step: float
    projection: bool
    endless: tuple[int, ...] = ()

    @property
    def relative(self) -> Array:
        """Relative tolerance by component."""
        relative = np.full(len(self.atol), self.rtol)
        relative[list(self.endless)] = 0.0
        return relative


#: Cause of a run that diverged.
NOT_FINITE = "the state is not a finite number any more"


class StoppedError(Exception):
    """The integration cannot go on; carries the status, the time reached, the cause and the last sound state."""

    def __init__(self, status: Status, time: float, cause: str, state: Array) -> None:
        super().__init__(status, time, cause)
        self.status, self.time, self.cause, self.state = status, time, cause, state


@dataclass
class Counter:
    """What an integration cost."""

    steps: int = 0
    evaluations: int = 0
    switches: int = 0


Flags = npt.NDArray[np.bool_]
#: Times nearer than this are one [s].
SAME = 1e-12

#: A step ends this many roundings before a jump of a force, and the next begins as many behind it.
ROUNDINGS = 4


@dataclass(frozen=True)
class Plan:
    """The rows of a run, decided before it.

    Attributes:
        times: of all rows, increasing (n) [s].
        asked: rows the user asked for (n).
        kept: rows statistics are taken from, the same for every output rate (n).
        ends: where the step to a row ends; at a jump of a force just before it, so that no stage sees the value behind.
        starts: where the next one begins; at a jump just behind it, so that none sees the value before.
        stops: rows at which a step must end; the first and the last do (n).
        breaks: of those, behind which some law goes on otherwise (n).
    """

    times: Array
    asked: Flags
    kept: Flags
    ends: Array
    starts: Array
    stops: Flags
    breaks: Flags

    @property
    def one(self) -> bool:
        """True if the rows asked for are those of the record."""
        return bool(np.array_equal(self.asked, self.kept))


def plan_of(asked: Array, record: Array, breakpoints: Array, jumps: Array, stride: int = 1) -> Plan:
    """Rows at all of these times. Steps end at breakpoints and at every ``stride``-th time of the record (0: at none).

    Times that all but coincide are one row: two would leave a step of rounding size. Of such times that of the record
    counts, so that its rows are the same whatever is asked for.

    Args:
        asked: times of samples, increasing (k) [s].
        record: times of the record, increasing, from the same first time to the same last (l) [s].
        breakpoints: times at which some law is not smooth [s].
        jumps: those of them at which a force jumps; one counts at the last row too.
        stride: how many rows of the record a step may span.
    """
    inner = breakpoints[(breakpoints > record[0]) & (breakpoints <= record[-1] + SAME)]
    times, of_record, of_breaks = _merged(record, inner)
    stops = np.zeros(len(times), bool)
    if stride:
        stops[np.flatnonzero(of_record)[::stride]] = True
    stops |= of_breaks
    stops[[0, -1]] = True
    every, of_old, of_asked = _merged(times, asked)
    stopped, broken = np.zeros(len(every), bool), np.zeros(len(every), bool)
    stopped[of_old], broken[of_old] = stops, of_breaks
    ends, starts = every.copy(), every.copy()
    when = jumps[np.isin(jumps, inner)]
    at = _nearest(every, when)
    margin = ROUNDINGS * np.spacing(np.maximum(when, every[at]))
    ends[at], starts[at] = np.minimum(ends[at], when - margin), np.maximum(starts[at], when + margin)
    return Plan(every, of_asked, of_old, ends, starts, stopped, broken)


def _merged(times: Array, others: Array) -> tuple[Array, Flags, Flags]:
    """Both in order, and which rows are of the one and of the other; where they all but coincide, the first count."""
    nearest = _nearest(times, others)
    apart = np.abs(times[nearest] - others) > SAME + 4 * np.finfo(float).eps * np.abs(others)
    every = np.concatenate([times, others[apart]])
    first, second = np.arange(len(every)) < len(times), np.arange(len(every)) >= len(times)
    second[nearest[~apart]] = True
    if not apart.any():
        return times, first, second
    order = np.argsort(every, kind="stable")
    return every[order], first[order], second[order]


def _nearest(times: Array, others: Array) -> Array:
    """Index of the time next to each of the others."""
    behind = np.clip(np.searchsorted(times, others), 1, len(times) - 1)
    return np.where(times[behind] - others < others - times[behind - 1], behind, behind - 1)
