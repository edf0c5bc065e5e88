"""Terms that keep f(q) = 0 while only its second derivative is solved for ([Tram2023] eqs. (60)-(63)).

A correction maps (f, f_dot) to what is added to the right-hand side of J a = -J_dot v.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from drillrig_pin.kinematics import Array

Correction = Callable[[Array, Array], Array]


def no_correction(f: Array, f_dot: Array) -> Array:
    """f_ddot = 0: errors of f grow with time squared."""
    return np.zeros_like(f)


def baumgarte(alpha: float, beta: float) -> Correction:
    """f_ddot + 2 alpha f_dot + beta^2 f = 0 (60); alpha, beta [1/s]; critically damped at alpha = beta."""
    a, b = 2.0 * alpha, beta**2
    return lambda f, f_dot: -a * f_dot - b * f


def sliding_mode(rate: float, gain: float, width: float) -> Correction:
    """s = f_dot + rate f is driven to zero: f_ddot = -rate f_dot - gain tanh(s / width).

    The switching sign(s) of the classical law is smoothed over ``width`` so that the right-hand side stays smooth.

    Args:
        rate: decay rate of f on the sliding surface [1/s].
        gain: largest correcting acceleration [m/s^2].
        width: half width of the boundary layer in s [m/s].
    """
    return lambda f, f_dot: -rate * f_dot - gain * np.tanh((f_dot + rate * f) / width)


def automatic_rate(step: float) -> float:
    """alpha = beta [1/s] for steps of ``step`` [s]: drift decays within ten steps, far from the stability limit."""
    return 0.2 / step
