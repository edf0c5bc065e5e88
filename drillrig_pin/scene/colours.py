"""Colours of what is not in the model: arrows, traces, ghosts, pressures."""

from __future__ import annotations

import numpy as np

from drillrig_pin.kinematics import Array
from drillrig_pin.scene.shapes import Colour

LOAD: Colour = (0.86, 0.08, 0.24, 1.0)
REACTION: Colour = (0.0, 0.45, 0.20, 1.0)
CYLINDER_FORCE: Colour = (0.45, 0.10, 0.75, 1.0)
STEEL: Colour = (0.82, 0.84, 0.87, 1.0)
SPRING: Colour = (0.10, 0.45, 0.45, 1.0)
ROCK: Colour = (0.55, 0.52, 0.48, 1.0)
HOLE: Colour = (0.06, 0.05, 0.05, 1.0)
BONE: Colour = (0.35, 0.45, 0.55, 1.0)
JOINT: Colour = (0.90, 0.55, 0.10, 1.0)
TRACES: tuple[Colour, ...] = (
    (0.00, 0.35, 0.90, 1.0),
    (0.85, 0.00, 0.55, 1.0),
    (0.00, 0.55, 0.35, 1.0),
    (0.55, 0.35, 0.00, 1.0),
)
GHOSTS: tuple[Colour, ...] = ((0.10, 0.35, 0.95, 0.30), (0.75, 0.10, 0.55, 0.30), (0.05, 0.55, 0.30, 0.30))

#: Low to high, from blue over yellow to red: equal steps look about equal and also read in grey.
SCALE = np.array([[0.19, 0.25, 0.70], [0.25, 0.60, 0.85], [0.55, 0.82, 0.60], [0.98, 0.85, 0.30], [0.90, 0.30, 0.15]])


def pressure_colour(pressure: Array, highest: float) -> Array:
    """Colours (n, 3) of absolute pressures (n) [Pa] on a scale from 0 to ``highest``."""
    place = np.clip(pressure / highest, 0.0, 1.0)
    anchors = np.linspace(0.0, 1.0, len(SCALE))
    return np.stack([np.interp(place, anchors, SCALE[:, k]) for k in range(3)], axis=-1)


def opaque(rgb: Array) -> Colour:
    """A colour of three numbers, not transparent."""
    red, green, blue = map(float, rgb)
    return red, green, blue, 1.0


def web(colour: Colour | Array) -> str:
    """A colour as HTML writes it, without its opacity."""
    return "#" + "".join(f"{round(255 * float(c)):02x}" for c in colour[:3])
