"""The rock: a face across the drilling direction with the hole in it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from drillrig_pin.kinematics import Array
from drillrig_pin.scene.colours import HOLE, ROCK
from drillrig_pin.scene.rotations import turning_z_to
from drillrig_pin.scene.shapes import Mesh, Part, Path, Round, along_z

#: Half the edge of the face, radius and depth of the hole, as parts of the machine's size: no model gives them.
HALF, RADIUS, DEPTH = 0.22, 0.02, 0.02
SEGMENTS = 64


def face_parts(path: Path, point: Array, axis: Array, size: float, holes: Sequence[Array] = ()) -> Iterator[Part]:
    """A square of rock around a point with the hole there, and other holes of the same face as dark discs.

    Args:
        path: of the face.
        point: where the machine touches it, (3) [m].
        axis: unit direction into the rock.
        size: of the machine [m].
        holes: points of the world where other holes are.
    """
    across = [np.asarray(hole) - point - axis * (axis @ (np.asarray(hole) - point)) for hole in holes]
    radius = RADIUS * size
    half = max([HALF * size, *(float(np.abs(offset).max()) + 4 * radius for offset in across)])
    quaternion = turning_z_to(axis[None])[0]
    yield Part(path, _face(half, radius), position=point, quaternion=quaternion, colour=ROCK)
    yield Part((*path, "hole"), _wall(radius, DEPTH * size), colour=HOLE)
    for number, offset in enumerate(across):
        disc = Round(radius, 0.1 * radius)
        yield Part((path[0], f"other hole {number}"), disc, position=point + offset, quaternion=quaternion, colour=HOLE)
    yield Part((*path, "ground"), Round(radius, 0.002 * size), along_z(DEPTH * size, DEPTH * size), colour=HOLE)


def _face(half: float, radius: float) -> Mesh:
    """Square with a round hole, seen from below z only: the camera may look at the machine through the rock."""
    angle = np.linspace(0, 2 * np.pi, SEGMENTS, endpoint=False)
    circle = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=1)
    square = circle / np.abs(circle[:, :2]).max(axis=1, keepdims=True)
    inner = np.arange(SEGMENTS)
    following = (inner + 1) % SEGMENTS
    outer, beyond = inner + SEGMENTS, following + SEGMENTS
    faces = np.concatenate([np.stack([inner, beyond, outer], 1), np.stack([inner, following, beyond], 1)])
    return Mesh(np.concatenate([radius * circle, half * square]), faces, one_sided=True)


def _wall(radius: float, depth: float) -> Mesh:
    """Inside of the hole."""
    angle = np.linspace(0, 2 * np.pi, SEGMENTS, endpoint=False)
    circle = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros_like(angle)], axis=1)
    front = np.arange(SEGMENTS)
    following = (front + 1) % SEGMENTS
    back, beyond = front + SEGMENTS, following + SEGMENTS
    faces = np.concatenate([np.stack([front, back, beyond], 1), np.stack([front, beyond, following], 1)])
    return Mesh(np.concatenate([circle, circle + np.array([0.0, 0.0, depth])]), faces, one_sided=True)
