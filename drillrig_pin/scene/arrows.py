"""Forces as arrows that grow with them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from drillrig_pin.kinematics import Anchor, Array
from drillrig_pin.scene.motion import Poses
from drillrig_pin.scene.rotations import settled, turning_z_to, unit
from drillrig_pin.scene.shapes import Colour, Part, Path, Round, along_z

#: An arrow of unit length: radius of the shaft, radius and length of the head.
SHAFT, HEAD, HEAD_LENGTH = 0.022, 0.06, 0.2
#: An arrow of no length would have no direction and no normals [m].
LEAST = 1e-4


@dataclass(frozen=True, slots=True)
class Force:
    """A force over the frames.

    Attributes:
        name: what it is.
        at: where it acts.
        vector: in the world, (frames, 3) [N].
        colour: of its arrow.
        arrives: True: the head is at the point; False: the arrow leaves from it.
    """

    name: str
    at: Anchor
    vector: Array
    colour: Colour
    arrives: bool = False


def arrow_parts(force: Force, poses: Poses, paths: list[Path], metres: float) -> Iterator[Part]:
    """The arrow of a force, ``metres`` long per newton."""
    direction, strength = unit(force.vector)
    length = np.maximum(strength * metres, LEAST)
    local = np.einsum("fij,fj->fi", poses.rotation(force.at.joint), direction)
    path = (*paths[force.at.joint], f"arrow {force.name}")
    yield Part(
        path,
        position=np.array(force.at.vector),
        quaternion=settled(turning_z_to(local)),
        scale=settled(np.repeat(length[:, None], 3, axis=1)),
    )
    start, neck, end = (-1.0, -HEAD_LENGTH, 0.0) if force.arrives else (0.0, 1 - HEAD_LENGTH, 1.0)
    yield Part((*path, "shaft"), Round(SHAFT, neck - start), along_z(start, neck), colour=force.colour, on_top=True)
    head = Round(HEAD, HEAD_LENGTH, top=0.0)
    yield Part((*path, "head"), head, along_z(neck, end), colour=force.colour, on_top=True)
