"""The machine's tree: one part per joint that carries its links, drawn with their own shapes or as a skeleton."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pinocchio as pin

from drillrig_pin.kinematics import Array
from drillrig_pin.rig import Rig
from drillrig_pin.scene.colours import BONE, JOINT
from drillrig_pin.scene.motion import Poses
from drillrig_pin.scene.rotations import quaternions, settled, turning_z_to
from drillrig_pin.scene.shapes import Ball, Part, Path, Round, along_z
from drillrig_pin.scene.visuals import Visual
from drillrig_pin.tree_data import make_data

#: Bones and joints of a skeleton as parts of the machine's size.
BONE_RADIUS = 0.008
JOINT_RADIUS = 0.014


def part_name(name: str) -> str:
    """A name as one step of a path."""
    return name.replace("/", "|") or "unnamed"


def machine_size(rig: Rig) -> float:
    """Diagonal of the box around joints, points and centres of mass at the zero position [m]."""
    model = rig.model
    data = make_data(model)
    pin.forwardKinematics(model, data, pin.neutral(model))
    ends = [data.oMi[joint].translation for joint in range(model.njoints)]
    ends += [data.oMi[joint].act(model.inertias[joint].lever) for joint in range(1, model.njoints)]
    ends += [data.oMi[anchor.joint].act(np.array(anchor.vector)) for anchor in map(rig.point, rig.points)]
    return float(np.linalg.norm(np.ptp(np.array(ends), axis=0)))


def joint_paths(rig: Rig, root: Path) -> list[Path]:
    """Path of every joint of the model, parents first; joint 0 is the world."""
    model = rig.model
    paths: list[Path] = [root]
    for joint in range(1, model.njoints):
        paths.append((*paths[model.parents[joint]], part_name(model.names[joint])))
    return paths


def joint_parts(rig: Rig, poses: Poses, paths: list[Path]) -> Iterator[Part]:
    """The moving frames: every joint in the frame of its parent."""
    for joint in range(1, rig.model.njoints):
        parent = rig.model.parents[joint]
        into_parent = poses.rotation(parent)
        position = np.einsum("fij,fj->fi", into_parent, poses.origin(joint) - poses.origin(parent))
        rotation = into_parent @ poses.rotation(joint).transpose(0, 2, 1)
        yield Part(paths[joint], position=settled(position), quaternion=settled(quaternions(rotation)))


def link_parts(
    rig: Rig, visuals: dict[str, list[Visual]], paths: list[Path], *, moving: bool = False
) -> Iterator[Part]:
    """Every link's shapes, fixed to the joint that carries it; with ``moving`` without those fixed to the world."""
    for frame in rig.model.frames:
        if frame.type != pin.FrameType.BODY or (moving and not frame.parentJoint):
            continue
        for number, visual in enumerate(visuals.get(frame.name, ())):
            yield Part(
                (*paths[frame.parentJoint], f"link {part_name(frame.name)}", str(number)),
                visual.shape,
                frame.placement.homogeneous @ visual.placement,
                colour=visual.colour,
            )


def skeleton_parts(rig: Rig, paths: list[Path], size: float) -> Iterator[Part]:
    """For a model without shapes: bones from every joint to the joints, centres of mass and points it carries.

    Args:
        rig: the machine.
        paths: of its joints.
        size: of the machine [m].
    """
    model = rig.model
    for joint in range(model.njoints):
        if joint:
            yield Part((*paths[joint], "joint"), Ball(JOINT_RADIUS * size), colour=JOINT)
        ends = [
            model.jointPlacements[child].translation
            for child in range(1, model.njoints)
            if model.parents[child] == joint
        ]
        ends += [np.array(anchor.vector) for anchor in map(rig.point, rig.points) if anchor.joint == joint]
        if joint and model.inertias[joint].mass > 0:
            ends.append(model.inertias[joint].lever)
        for number, end in enumerate(ends):
            yield from _bone((*paths[joint], f"bone {number}"), end, size)


def _bone(path: Path, end: Array, size: float) -> Iterator[Part]:
    length = float(np.linalg.norm(end))
    if length < 1e-6:
        return
    quaternion = turning_z_to(end[None] / length)[0]
    yield Part(path, Round(BONE_RADIUS * size, length), along_z(0, length), quaternion=quaternion, colour=BONE)
    yield Part((*path, "end"), Ball(BONE_RADIUS * size), along_z(length, length), colour=BONE)
