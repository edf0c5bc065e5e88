"""The motion of a scene in a few bytes, for the page to make an animation of Meshcat's viewer of it.

A track is one property of one node over all frames. Each of its components is kept as 16 bit steps over the range it
covers, as differences between frames, so that a page of a ten second run stays small:

    value(i) = low + step * sum_{j <= i} delta(j),   deltas modulo 2^16.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from drillrig_pin.kinematics import Array
from drillrig_pin.replay.objects import node_path
from drillrig_pin.scene.shapes import Part

STEPS = 65_535


@dataclass(frozen=True, slots=True)
class Track:
    """One property over time.

    Attributes:
        path: node of the viewer.
        name: property, as three.js names it.
        kind: type of its values, as three.js names it.
        values: (frames, components).
    """

    path: str
    name: str
    kind: str
    values: Array


def tracks(parts: list[Part]) -> Iterator[Track]:
    """Everything that moves."""
    for part in parts:
        path = node_path(part)
        if part.position.ndim == 2:
            yield Track(path, ".position", "vector", part.position)
        if part.quaternion.ndim == 2:
            yield Track(path, ".quaternion", "quaternion", _continuous(part.quaternion))
        if part.scale.ndim == 2:
            yield Track(path, ".scale", "vector", part.scale)
        if part.tint is not None:
            yield Track(path + "/<object>", ".material.color", "color", part.tint)


def packed(parts: list[Part], frames: Array) -> bytes:
    """Header as JSON (its length first, 4 bytes), then the differences of all components, 16 bit each."""
    heads, bodies = [], []
    for track in tracks(parts):
        low = track.values.min(axis=0)
        step = np.ptp(track.values, axis=0) / STEPS
        whole = np.round((track.values - low) / np.where(step > 0, step, 1.0)).astype(np.int64)
        deltas = np.diff(whole, axis=0, prepend=np.zeros((1, whole.shape[1]), dtype=np.int64))
        bodies.append((deltas.T & 0xFFFF).astype("<u2").tobytes())
        heads.append(
            {
                "path": track.path,
                "name": track.name,
                "type": track.kind,
                "low": [float(f"{value:.9g}") for value in low],
                "step": [float(f"{value:.9g}") for value in step],
            }
        )
    header = {"frames": len(frames), "start": float(frames[0]), "end": float(frames[-1]), "tracks": heads}
    head = json.dumps(header, separators=(",", ":")).encode()
    head += b" " * (-len(head) % 4)
    return len(head).to_bytes(4, "little") + head + b"".join(bodies)


def _continuous(quaternions: Array) -> Array:
    """The same rotations without jumps from q to -q, which 16 bits could not follow."""
    sign = np.where(np.einsum("ij,ij->i", quaternions[1:], quaternions[:-1]) < 0, -1.0, 1.0)
    return np.asarray(quaternions * np.concatenate([[1.0], np.cumprod(sign)])[:, None])
