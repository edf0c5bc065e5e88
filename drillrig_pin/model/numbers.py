"""Numbers of a URDF file: what counts as one, and the placement an <origin> says."""

from __future__ import annotations

import math
import re

import numpy as np

from drillrig_pin.errors import ModelError
from drillrig_pin.model.nodes import Node

#: As programs in other languages read it: no digit grouping, no digits of other scripts, no words.
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)


def numbers(text: str) -> tuple[float, ...] | None:
    """The finite numbers of an attribute, separated by white space; None if a word is none."""
    words = text.split()
    if not all(_NUMBER.fullmatch(word) for word in words):
        return None
    values = tuple(map(float, words))
    return values if all(map(math.isfinite, values)) else None


def vector(node: Node | None, key: str, default: tuple[float, ...]) -> tuple[float, ...]:
    """An attribute of as many numbers as ``default`` has; that where there is no such attribute or it is empty.

    Raises:
        ModelError: it holds anything else.
    """
    text = node.attributes.get(key, "") if node is not None else ""
    if node is None or not text.strip():
        return default
    values = numbers(text)
    if values is None or len(values) != len(default):
        many = f"{len(default)} numbers" if len(default) > 1 else "one number"
        raise ModelError(f"<{node.tag}> {key} = {text!r} is not {many}", where=node.source)
    return values


def placement(origin: Node | None) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Position [m] and roll, pitch, yaw [rad] of an <origin>; zero without one.

    A quaternion ``quat_xyzw`` may stand instead of ``rpy``.

    Raises:
        ModelError: a wrong number of numbers, both ways to turn it, or a quaternion whose length is not about 1.
    """
    zero = (0.0, 0.0, 0.0)
    xyz, rpy = vector(origin, "xyz", zero), vector(origin, "rpy", zero)
    if origin is None or not origin.attributes.get("quat_xyzw", "").strip():
        return xyz, rpy
    if origin.attributes.get("rpy", "").strip():
        raise ModelError("<origin> is turned twice, by rpy and by quat_xyzw", where=origin.source, todo="Keep one.")
    quaternion = np.array(vector(origin, "quat_xyzw", (0.0, 0.0, 0.0, 1.0)))
    length = float(np.linalg.norm(quaternion))
    if not 0.9 < length < 1.1:
        what = f"<origin> quat_xyzw has the length {length:.3g} and not 1"
        raise ModelError(what, where=origin.source, todo="Without rotation: 0 0 0 1.")
    x, y, z, w = (float(part) for part in quaternion / length)
    # R = Rz(yaw) Ry(pitch) Rx(roll), read off the matrix of the quaternion.
    up = 2 * (x * z - w * y)
    if abs(up) > 1 - 1e-12:
        # The nose points straight up or down: only the sum or difference of roll and yaw counts.
        return xyz, (0.0, math.copysign(math.pi / 2, -up), math.atan2(2 * (w * z - x * y), 1 - 2 * (x * x + z * z)))
    roll = math.atan2(2 * (y * z + w * x), 1 - 2 * (x * x + y * y))
    yaw = math.atan2(2 * (x * y + w * z), 1 - 2 * (y * y + z * z))
    return xyz, (roll, -math.asin(up), yaw)
