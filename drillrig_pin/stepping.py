"""What both engines share: settings of a run, where its steps must end, what it cost, how it stops."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from drillrig_pin.errors import Status
from drillrig_pin.kinematics import Array


@dataclass(frozen=True)
class Settings:
    """Method and step control; ``atol`` may differ by component."""

    method: str
    step: float
    rtol: float
    atol: Array
    max_step: float
    projection: bool


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


def stops_of(samples: Array, breakpoints: Array) -> tuple[Array, Flags, Flags]:
    """Times at which a step must end, which of them are samples, and behind which some law goes on otherwise.

    A breakpoint that all but coincides with a sample is taken for the sample: it would leave a step of rounding size.
    """
    inner = breakpoints[(breakpoints > samples[0]) & (breakpoints < samples[-1])]
    behind = np.searchsorted(samples, inner)
    distance = np.minimum(samples[behind] - inner, inner - samples[behind - 1])
    apart = distance > 1e-12
    stops = np.concatenate([samples, inner[apart]])
    breaks = np.arange(len(stops)) >= len(samples)
    close = behind[~apart]
    breaks[np.where(samples[close] - inner[~apart] <= 1e-12, close, close - 1)] = True
    order = np.argsort(stops, kind="stable")
    return stops[order], order < len(samples), breaks[order]
