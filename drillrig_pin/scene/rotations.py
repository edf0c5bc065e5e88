"""Rotations of many frames at once, as quaternions (x, y, z, w)."""

from __future__ import annotations

import numpy as np

from drillrig_pin.kinematics import Array

#: Changes below this [m or -] are rounding: what changes no more stands still.
STILL = 1e-9


def quaternions(rotations: Array) -> Array:
    """Rotation matrices (..., 3, 3) as unit quaternions (..., 4).

    Each is read off the largest of its squared components, 4 c^2 = 1 +- R_xx +- R_yy +- R_zz, which is never small.
    """
    R = rotations.reshape(-1, 3, 3)
    xx, yy, zz = R[:, 0, 0], R[:, 1, 1], R[:, 2, 2]
    squares = np.stack([1 + xx - yy - zz, 1 - xx + yy - zz, 1 - xx - yy + zz, 1 + xx + yy + zz], axis=1)
    xy, yz, zx = R[:, 0, 1] + R[:, 1, 0], R[:, 1, 2] + R[:, 2, 1], R[:, 2, 0] + R[:, 0, 2]
    wx, wy, wz = R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]
    rows = np.array(
        [
            [squares[:, 0], xy, zx, wx],
            [xy, squares[:, 1], yz, wy],
            [zx, yz, squares[:, 2], wz],
            [wx, wy, wz, squares[:, 3]],
        ]
    )
    best = np.argmax(squares, axis=1)
    found = rows[best, :, np.arange(len(R))]
    found /= np.linalg.norm(found, axis=1, keepdims=True)
    return np.asarray(found.reshape(*rotations.shape[:-2], 4))


def turning_z_to(directions: Array) -> Array:
    """Quaternions (n, 4) that turn z onto unit directions (n, 3) the shortest way."""
    x, y, z = directions.T
    found = np.stack([-y, x, np.zeros_like(x), 1 + z], axis=1)
    length = np.linalg.norm(found, axis=1, keepdims=True)
    backwards = length[:, 0] < 1e-9
    found[backwards] = (1.0, 0.0, 0.0, 0.0)
    length[backwards] = 1.0
    return np.asarray(found / length)


def unit(vectors: Array) -> tuple[Array, Array]:
    """Directions (n, 3) and lengths (n) of vectors; z for a vector of no length."""
    length = np.linalg.norm(vectors, axis=-1)
    safe = np.where(length > 0, length, 1.0)
    direction = vectors / safe[..., None]
    direction[length == 0] = (0.0, 0.0, 1.0)
    return direction, length


def settled(rows: Array) -> Array:
    """One row instead of many if nothing changes."""
    if rows.ndim == 2 and float(np.ptp(rows, axis=0).max(initial=0.0)) < STILL:
        return np.asarray(rows[0])
    return rows
