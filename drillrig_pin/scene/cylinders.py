"""Hydraulic cylinders as barrel and rod between their pins, the two chambers coloured by pressure; springs as coils."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from drillrig_pin.coordinates import Line
from drillrig_pin.elements.cylinder import Cylinder
from drillrig_pin.kinematics import Anchor, Array
from drillrig_pin.rig import Rig
from drillrig_pin.scene.colours import SPRING, STEEL, opaque, pressure_colour
from drillrig_pin.scene.links import part_name
from drillrig_pin.scene.motion import Poses
from drillrig_pin.scene.rotations import settled, turning_z_to, unit
from drillrig_pin.scene.shapes import Ball, Mesh, Part, Path, Round, along_z

#: Outer by inner radius of a barrel, as drawn; the model gives the bore only.
WALL = 1.2
TURNS = 9


def cylinder_parts(
    rig: Rig, cylinder: Cylinder, poses: Poses, paths: list[Path], pressures: tuple[Array, Array], highest: float
) -> Iterator[Part]:
    """One cylinder. Barrel and rod hang on their own pins and point at each other's.

    Args:
        rig: the machine.
        cylinder: the element.
        poses: of the machine.
        paths: of its joints.
        pressures: absolute pressures of chambers A and B, (frames) each [Pa].
        highest: pressure at the upper end of the colour scale [Pa].
    """
    barrel_pin, rod_pin = rig.point(cylinder.start), rig.point(cylinder.end)
    span, length = _span(rig, poses, barrel_pin, rod_pin)
    stroke, retracted = cylinder.stroke, cylinder.length_retracted
    rod_length = retracted - cylinder.dead_length_a
    end = cylinder.dead_length_a + stroke + 0.5 * cylinder.dead_length_b
    piston = float(np.clip(length.mean() - rod_length, 0.1 * end, 0.9 * end))
    radius, rod_radius = WALL * cylinder.bore / 2, cylinder.rod / 2
    name = part_name(cylinder.name)
    barrel = (*paths[barrel_pin.joint], f"{name} barrel")
    position = np.array(barrel_pin.vector)
    yield Part(barrel, position=position, quaternion=_turned(poses, barrel_pin.joint, span))
    for chamber, low, high, pressure in (("A", 0.0, piston, pressures[0]), ("B", piston, end, pressures[1])):
        tint = pressure_colour(pressure, highest)
        yield Part(
            (*barrel, f"chamber {chamber}"),
            Round(radius, high - low),
            along_z(low, high),
            colour=opaque(tint[0]),
            tint=tint,
        )
    collar = 0.04 * end
    gland = Round(1.08 * radius, 1.1 * collar)
    yield Part((*barrel, "gland"), gland, along_z(end - collar, end + 0.1 * collar), colour=STEEL)
    yield Part((*barrel, "eye"), Ball(1.02 * radius), colour=STEEL)
    rod = (*paths[rod_pin.joint], f"{name} rod")
    yield Part(rod, position=np.array(rod_pin.vector), quaternion=_turned(poses, rod_pin.joint, -span))
    yield Part((*rod, "bar"), Round(rod_radius, rod_length), along_z(0, rod_length), colour=STEEL)
    yield Part((*rod, "eye"), Ball(1.5 * rod_radius), colour=STEEL)


def spring_parts(rig: Rig, name: str, line: Line, poses: Poses, paths: list[Path], size: float) -> Iterator[Part]:
    """Anything else that acts along the line between two points, as a coil that stretches."""
    span, length = _span(rig, poses, line.start, line.end)
    stretch = np.stack([np.ones_like(length), np.ones_like(length), length], axis=1)
    yield Part(
        (*paths[line.start.joint], part_name(name)),
        _coil(0.015 * size, 0.003 * size),
        position=np.array(line.start.vector),
        quaternion=_turned(poses, line.start.joint, span),
        scale=settled(stretch),
        colour=SPRING,
    )


def _span(rig: Rig, poses: Poses, start: Anchor, end: Anchor) -> tuple[Array, Array]:
    """World direction (frames, 3) and distance (frames) from one anchor to another."""
    points = poses.world(rig.model, [start, end])
    return unit(points[:, 1] - points[:, 0])


def _turned(poses: Poses, joint: int, direction: Array) -> Array:
    """Quaternions that turn z to world directions, in the frame of a joint."""
    return settled(turning_z_to(np.einsum("fij,fj->fi", poses.rotation(joint), direction)))


def _coil(radius: float, wire: float, around: int = 16, section: int = 6) -> Mesh:
    """A helix of unit length along z from the origin."""
    angle = np.linspace(0, 2 * np.pi * TURNS, around * TURNS + 1)
    ends = np.clip(np.minimum(angle, angle[-1] - angle) / np.pi, 0, 1)
    out = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=1)
    spine = radius * ends[:, None] * out + np.linspace(0, 1, len(angle))[:, None] * (0.0, 0.0, 1.0)
    turn = np.linspace(0, 2 * np.pi, section, endpoint=False)
    up = np.array([0.0, 0.0, 1.0])
    rings = spine[:, None] + wire * (np.cos(turn)[:, None] * out[:, None] + np.sin(turn)[:, None] * up)
    first = np.arange(len(spine) - 1)[:, None] * section
    here, beside = np.arange(section), (np.arange(section) + 1) % section
    quads = np.stack([first + here, first + beside, first + section + beside, first + section + here], axis=-1)
    faces = np.concatenate([quads[..., [0, 1, 2]], quads[..., [0, 2, 3]]]).reshape(-1, 3)
    return Mesh(rings.reshape(-1, 3), faces)
