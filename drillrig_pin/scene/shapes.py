"""The few shapes everything is drawn with, and a part: a shape that stands or moves in the frame of another part."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from drillrig_pin.kinematics import Array

Colour = tuple[float, float, float, float]
Path = tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Box:
    """Edges along x, y, z [m], middle at the origin."""

    size: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Round:
    """Round bar along z, middle at the origin; with ``top`` unequal to ``radius`` a cone [m]."""

    radius: float
    length: float
    top: float | None = None


@dataclass(frozen=True, slots=True)
class Ball:
    """Sphere about the origin [m]."""

    radius: float


@dataclass(frozen=True, slots=True)
class Mesh:
    """Triangles: vertices (n, 3) [m], faces (m, 3). ``one_sided``: seen only from where they run anticlockwise."""

    vertices: Array
    faces: npt.NDArray[np.integer[Any]]
    one_sided: bool = False


@dataclass(frozen=True, slots=True)
class Trace:
    """Path of a point, (frames, 3) [m]: the whole drawn faintly, the last frames up to now strongly."""

    points: Array


Shape = Box | Round | Ball | Mesh | Trace

STILL = np.zeros(3)
UPRIGHT = np.array([0.0, 0.0, 0.0, 1.0])
FULL = np.ones(3)


@dataclass(frozen=True, slots=True)
class Part:
    """A named place in the scene, with or without a shape.

    ``position``, ``quaternion`` (x, y, z, w), ``scale`` and ``tint`` are one row for what stands still, or one row per
    frame for what moves.

    Attributes:
        path: names from the root of the scene; the parent, if drawn, carries this part along.
        shape: what is drawn there.
        placement: 4 x 4 placement of the shape in the part.
        position: (3) or (frames, 3), in the parent's frame [m].
        quaternion: (4) or (frames, 4).
        scale: (3) or (frames, 3), along the part's axes.
        colour: red, green, blue, opacity, 0 to 1.
        tint: (frames, 3), a colour that changes; None: it does not.
        on_top: drawn over whatever stands in front of it.
    """

    path: Path
    shape: Shape | None = None
    placement: Array = field(default_factory=lambda: np.eye(4))
    position: Array = field(default_factory=lambda: STILL)
    quaternion: Array = field(default_factory=lambda: UPRIGHT)
    scale: Array = field(default_factory=lambda: FULL)
    colour: Colour = (0.7, 0.7, 0.7, 1.0)
    tint: Array | None = None
    on_top: bool = False


def along_z(start: float, end: float) -> Array:
    """Placement that puts the middle of a shape between two heights on z."""
    placement = np.eye(4)
    placement[2, 3] = (start + end) / 2
    return placement


def corners(shape: Shape, placement: Array) -> Array:
    """Corners of the box around a shape, in the frame of its part, (8, 3)."""
    low, high = _extent(shape)
    signs = np.array([[(i >> k) & 1 for k in range(3)] for i in range(8)])
    return np.asarray(np.where(signs, high, low) @ placement[:3, :3].T + placement[:3, 3])


def _extent(shape: Shape) -> tuple[Array, Array]:
    if isinstance(shape, Mesh):
        return shape.vertices.min(axis=0), shape.vertices.max(axis=0)
    if isinstance(shape, Trace):
        return shape.points.min(axis=0), shape.points.max(axis=0)
    if isinstance(shape, Box):
        half = np.array(shape.size) / 2
    elif isinstance(shape, Round):
        widest = max(shape.radius, shape.top or 0.0)
        half = np.array([widest, widest, shape.length / 2])
    else:
        half = np.full(3, shape.radius)
    return -half, half
