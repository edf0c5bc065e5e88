"""Motions that are known in closed form."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from drillrig_pin.kinematics import Array

#: Lengths of the slider-crank and of the four-bar of `rigs` [m].
CRANK, ROD = 0.2, 0.6
BARS = (1.0, 0.35, 0.9, 0.7)
#: Complex-step derivative: no cancellation, so the closed forms below are differentiated to the last digit.
STEP = 1e-30


def derivative(f: Callable[[Array], Array], x: Array) -> Array:
    return np.imag(f(x + 1j * STEP)) / STEP


def crank_motion(theta: Array) -> tuple[Array, Array]:
    """Angle of the rod against the crank and position of the slider, at a crank angle."""
    rod = -np.arcsin(CRANK * np.sin(theta) / ROD)
    return rod - theta, CRANK * np.cos(theta) + ROD * np.cos(rod)


def bar_motion(theta: Array) -> tuple[Array, Array]:
    """Angle of the coupler against the crank and absolute angle of the rocker (Freudenstein), upper branch."""
    ground, crank, coupler, rocker = BARS
    x, y = ground - crank * np.cos(theta), -crank * np.sin(theta)
    # Triangle of crank end, rocker pivot and joint: the diagonal, and the angle at the pivot by the cosine law. The
    # ground is longer than the crank, so x > 0 and the arctangents need no quadrant.
    diagonal = np.sqrt(x * x + y * y)
    inner = np.arccos((diagonal**2 + rocker**2 - coupler**2) / (2 * diagonal * rocker))
    phi = np.pi + np.arctan(y / x) - inner
    px, py = x + rocker * np.cos(phi), y + rocker * np.sin(phi)
    return np.arctan(py / px) - theta, phi
