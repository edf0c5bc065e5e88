"""Which forces of a run are drawn: loads, the reaction of the face, cylinder forces; each as a vector in the world."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from drillrig_pin.constraints import Hold
from drillrig_pin.coordinates import Slide
from drillrig_pin.elements.base import Element
from drillrig_pin.elements.contact import Contact
from drillrig_pin.elements.cylinder import Cylinder
from drillrig_pin.elements.fields import AXIS
from drillrig_pin.kinematics import Anchor, Array
from drillrig_pin.rig import Rig
from drillrig_pin.scene.arrows import Force
from drillrig_pin.scene.colours import CYLINDER_FORCE, LOAD, REACTION
from drillrig_pin.scene.motion import Poses
from drillrig_pin.scene.rotations import unit
from drillrig_pin.scene.timing import resampled
from drillrig_pin.trajectory import Trajectory


class Recorded:
    """Columns of a run at the times of the frames."""

    def __init__(self, trajectory: Trajectory, shown: slice, frames: Array) -> None:
        self.trajectory = trajectory
        self._shown, self._frames = shown, frames

    def has(self, dim: str, name: str) -> bool:
        """True if the run recorded it."""
        return name in self.trajectory.labels[dim]

    def of(self, variable: str, *names: str) -> Array:
        """One column, (frames, ...); what is not finite is drawn as nothing."""
        values = np.nan_to_num(self.trajectory.of(variable, *names)[self._shown], posinf=0.0, neginf=0.0)
        return resampled(self.trajectory.time[self._shown], values, self._frames)


def load_forces(rig: Rig, elements: list[Element], poses: Poses, recorded: Recorded) -> Iterator[Force]:
    """Loads that push at a point."""
    for element in elements:
        if not (element.load and recorded.has("load", element.name)):
            continue
        coordinate = element.coordinate(rig)
        if isinstance(coordinate, Slide):
            direction = poses.world(rig.model, [coordinate.direction])[:, 0]
            value = recorded.of("load_value", element.name)
            yield Force(element.name, coordinate.point, direction * value[:, None], LOAD)


def reaction_forces(rig: Rig, elements: list[Element], poses: Poses, recorded: Recorded) -> Iterator[Force]:
    """What holds and contacts do to the machine, one force per point: reactions on its axes and that of the contact."""
    acting: dict[Anchor, tuple[list[str], Array]] = {}

    def add(name: str, at: Anchor, vector: Array) -> None:
        names, total = acting.get(at, ([], np.zeros(3)))
        acting[at] = ([*names, name], total + vector)

    for constraint in rig.constraints:
        if isinstance(constraint, Hold):
            for row in constraint.rows(rig):
                if recorded.has("constraint", row.name):
                    axis = np.array(AXIS[row.name.rpartition(".")[2]])
                    add(constraint.name, rig.point(constraint.point), recorded.of("reaction", row.name)[:, None] * axis)
    for element in elements:
        if isinstance(element, Contact) and recorded.has("element", element.name):
            force = recorded.of("element_force", element.name)[:, None] * np.array(element.axis)
            add(element.name, rig.point(element.point), force)
    for at, (names, vector) in acting.items():
        yield Force("reaction " + " ".join(dict.fromkeys(names)), at, vector, REACTION, arrives=True)


def cylinder_forces(rig: Rig, elements: list[Element], poses: Poses, recorded: Recorded) -> Iterator[Force]:
    """What every cylinder does to the link on its rod."""
    for element in elements:
        if isinstance(element, Cylinder) and recorded.has("cylinder", element.name):
            pins = poses.world(rig.model, [rig.point(element.start), rig.point(element.end)])
            direction, _ = unit(pins[:, 1] - pins[:, 0])
            force = recorded.of("cylinder_force", element.name)[:, None] * direction
            yield Force(element.name, rig.point(element.end), force, CYLINDER_FORCE)
