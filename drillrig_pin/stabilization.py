"""Terms that keep f(q) = 0 while only its second derivative is solved for ([Tram2023] eqs. (60)-(63)).

A correction maps (f, f_dot) to what is added to the right-hand side of J a = -J_dot v.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from drillrig_pin.kinematics import Array


class Correction(Protocol):
    """A stabilising term; ``parameters`` tell the compiled core which one and with which numbers."""

    @property
    def parameters(self) -> tuple[int, list[float]]:
        """Kind (0 none, 1 Baumgarte, 2 sliding mode) and three numbers."""

    def __call__(self, f: Array, f_dot: Array) -> Array:
        """What is added to -J_dot v, (m)."""


@dataclass(frozen=True, slots=True)
class NoCorrection:
    """f_ddot = 0: errors of f grow with time squared."""

    parameters = (0, [0.0, 0.0, 0.0])

    def __call__(self, f: Array, f_dot: Array) -> Array:
        """Zero."""
        return np.zeros_like(f)


@dataclass(frozen=True, slots=True)
class Baumgarte:
    """f_ddot + 2 alpha f_dot + beta^2 f = 0 (60); alpha, beta [1/s]; critically damped at alpha = beta."""

    alpha: float
    beta: float

    @property
    def parameters(self) -> tuple[int, list[float]]:
        """alpha, beta."""
        return 1, [self.alpha, self.beta, 0.0]

    def __call__(self, f: Array, f_dot: Array) -> Array:
        """-2 alpha f_dot - beta^2 f."""
        return -(2.0 * self.alpha) * f_dot - self.beta**2 * f


@dataclass(frozen=True, slots=True)
class SlidingMode:
    """s = f_dot + rate f is driven to zero: f_ddot = -rate f_dot - gain tanh(s / width).

    The switching sign(s) of the classical law is smoothed over ``width`` so that the right-hand side stays smooth.

    Attributes:
        rate: decay rate of f on the sliding surface [1/s].
        gain: largest correcting acceleration [m/s^2].
        width: half width of the boundary layer in s [m/s].
    """

    rate: float
    gain: float
    width: float

    @property
    def parameters(self) -> tuple[int, list[float]]:
        """rate, gain, width."""
        return 2, [self.rate, self.gain, self.width]

    def __call__(self, f: Array, f_dot: Array) -> Array:
        """-rate f_dot - gain tanh(s / width)."""
        return -self.rate * f_dot - self.gain * np.tanh((f_dot + self.rate * f) / self.width)


#: alpha = beta [1/s] where nothing else is asked for. A fixed rate keeps the order of every method: one that grows as
#: 1 / step turns the deviations within a step, which shrink with a power of it, into errors of first order. This one
#: decays drift within half a second, and on linkages that turn at 2 to 20 rad/s it costs hardly a step of any method.
RATE = 5.0


def automatic_rate(step: float) -> float:
    """alpha = beta [1/s] for steps of ``step`` [s]: drift decays within ten steps, far from the stability limit."""
    return 0.2 / step


def default_rate(step: float | None) -> float:
    """The automatic alpha = beta [1/s]: ``RATE``, and for a fixed ``step`` [s] no more than it can follow."""
    return RATE if step is None else min(RATE, automatic_rate(step))
