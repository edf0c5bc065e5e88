"""Where the camera may stand: named directions to look from, and what must be in the picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drillrig_pin.kinematics import Array
from drillrig_pin.scene.shapes import Part, Path, Trace, corners

#: Frames looked at to find the box a motion fills.
LOOKED_AT = 4


@dataclass(frozen=True, slots=True)
class View:
    """Direction from the machine to the camera, and the box that fills the picture, low and high corner [m]."""

    toward_camera: tuple[float, float, float]
    low: tuple[float, float, float]
    high: tuple[float, float, float]


def named_views(forward: Array, tip: Array | None, low: Array, high: Array) -> dict[str, View]:
    """The views of a machine that works in the horizontal direction ``forward``, z up.

    Args:
        forward: unit vector.
        tip: what the view `tip` looks at; None: the farthest end forward.
        low, high: corners of the box around the whole machine.
    """
    up = np.array([0.0, 0.0, 1.0])
    left = np.cross(up, forward)
    directions = {
        "overview": -0.62 * left + 0.42 * up + 0.52 * forward * -1,
        "side": -left,
        # A camera exactly above has no "up"; a hair off, it has.
        "top": up - 1e-3 * left,
        "front": forward,
    }
    views = {name: _view(direction, low, high) for name, direction in directions.items()}
    if tip is None:
        middle = (low + high) / 2
        tip = middle + forward * float(np.abs(forward) @ (high - low)) / 2
    reach = 0.09 * float(np.linalg.norm(high - low))
    views["tip"] = _view(-0.75 * left - 0.6 * forward + 0.45 * up, tip - reach, tip + reach)
    return views


def _view(direction: Array, low: Array, high: Array) -> View:
    x, y, z = (direction / np.linalg.norm(direction)).tolist()
    return View((x, y, z), tuple(low.tolist()), tuple(high.tolist()))


def surrounding_box(parts: Sequence[Part]) -> tuple[Array, Array]:
    """Low and high corner of everything at some of the frames, traces and arrows left out."""
    count = max((len(rows) for part in parts for rows in (part.position, part.quaternion) if rows.ndim == 2), default=1)
    points = []
    for frame in sorted(set(np.linspace(0, count - 1, LOOKED_AT).astype(int).tolist())):
        world: dict[Path, Array] = {}
        for part in parts:
            # Steps of a path that are no parts of their own only group what is below them.
            parent = next((part.path[:n] for n in range(len(part.path) - 1, 0, -1) if part.path[:n] in world), ())
            placement = world.get(parent, np.eye(4)) @ placement_of(part, frame)
            world[part.path] = placement
            if part.shape is not None and not isinstance(part.shape, Trace) and not part.on_top:
                points.append(corners(part.shape, placement @ part.placement))
    if not points:
        return np.full(3, -1.0), np.full(3, 1.0)
    every = np.concatenate(points)
    return every.min(axis=0), every.max(axis=0)


def placement_of(part: Part, frame: int = 0) -> Array:
    """Placement of a part in its parent at one frame, (4, 4)."""
    position, quaternion, scale = (
        rows[frame] if rows.ndim == 2 else rows for rows in (part.position, part.quaternion, part.scale)
    )
    placement = np.eye(4)
    placement[:3, :3] = matrix(quaternion) * scale
    placement[:3, 3] = position
    return placement


def matrix(quaternion: Array) -> Array:
    """Rotation matrix (3, 3) of a unit quaternion (x, y, z, w)."""
    x, y, z, w = quaternion
    skew = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    found: Array = np.eye(3) + 2 * w * skew + 2 * skew @ skew
    return found
