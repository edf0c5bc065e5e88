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

#: A step ends this many roundings before a jump of a force, and the next begins as many behind it.
ROUNDINGS = 4


@dataclass(frozen=True)
class Stops:
    """Times at which a step must end, in order; all arrays are one entry a stop.

    Attributes:
        time: the stops [s].
        ends: where the step ends; at a jump of a force just before it, so that no stage sees the value behind.
        starts: where the next one begins; at a jump just behind it, so that none sees the value before.
        samples: which of them are samples.
        breaks: behind which of them some law goes on otherwise.
    """

    time: Array
    ends: Array
    starts: Array
    samples: Flags
    breaks: Flags


def stops_of(samples: Array, breakpoints: Array, jumps: Array) -> Stops:
    """Where the steps of a run end: at its samples and at the breakpoints of its laws, of which some are jumps.

    A breakpoint that all but coincides with a sample is taken for the sample: it would leave a step of rounding size.
    A jump counts at the last sample too.
    """
    within = (breakpoints > samples[0]) & (breakpoints < samples[-1])
    inner = breakpoints[within | (np.isin(breakpoints, jumps) & (np.abs(breakpoints - samples[-1]) <= 1e-12))]
    behind = np.minimum(np.searchsorted(samples, inner), len(samples) - 1)
    distance = np.minimum(np.abs(samples[behind] - inner), inner - samples[behind - 1])
    apart = distance > 1e-12
    stops = np.concatenate([samples, inner[apart]])
    breaks = np.arange(len(stops)) >= len(samples)
    close = behind[~apart]
    taken = np.where(np.abs(samples[close] - inner[~apart]) <= 1e-12, close, close - 1)
    breaks[taken] = True
    ends, starts, jumping = stops.copy(), stops.copy(), set(jumps.tolist())
    for at, when in [*zip(taken, inner[~apart], strict=True), *enumerate(inner[apart], len(samples))]:
        if float(when) in jumping:
            margin = ROUNDINGS * np.spacing(max(when, stops[at]))
            ends[at] = min(ends[at], when - margin)
            starts[at] = max(starts[at], when + margin)
    order = np.argsort(stops, kind="stable")
    return Stops(stops[order], ends[order], starts[order], order < len(samples), breaks[order])
