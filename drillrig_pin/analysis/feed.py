"""Which two points span the feed line: where the drilling force acts, and where the tip touches the rock.

The tip T-E line is looked for in this order: a force that acts on the tip's own body; then, for a feed of several links
(a telescope, a sled on a beam), a force on a body that carries the tip and whose line of action is the line to the tip.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from drillrig_pin.analysis.bodies import Bodies
from drillrig_pin.elements.contact import Contact
from drillrig_pin.elements.loads import Load
from drillrig_pin.errors import DrillrigError
from drillrig_pin.model.modelfile import ModelFile
from drillrig_pin.rig import build_rig
from drillrig_pin.trajectory import Trajectory

#: A force drills if it acts within this angle of the line to the tip, either way [deg]: |cos| of it.
ALONG = float(np.cos(np.radians(15.0)))


def feed_points(
    trajectory: Trajectory, file: ModelFile, contacts: list[Contact], loads: list[Load]
) -> tuple[tuple[str, str] | None, str]:
    """Points of drill and tip, or None and the reason in words; no reason for a machine without contact."""
    bodies = Bodies(file)
    forces = [load for load in loads if load.kind == "force"]
    for contact in contacts:
        for load in forces:
            one = bodies.of(load.point) is not None and bodies.of(load.point) == bodies.of(contact.point)
            if one and load.point != contact.point:
                return (load.point, contact.point), ""
    if not contacts:
        return None, ""
    tip = contacts[0].point
    found = [(apart, load) for load in forces if (apart := bodies.apart(load.point, tip))]
    for _, load in sorted(found, key=lambda item: item[0]):
        if _along(trajectory, file, load, tip):
            return (load.point, tip), ""
    return None, _reason(tip, forces, [load for _, load in found])


def _along(trajectory: Trajectory, file: ModelFile, load: Load, tip: str) -> bool:
    """Whether a force acts along the line to the tip at the start."""
    tracked = trajectory.labels["point"]
    if load.point not in tracked or tip not in tracked or not len(trajectory.time):
        return False
    d = trajectory.of("point_position", tip)[0] - trajectory.of("point_position", load.point)[0]
    axis = np.array(load.axis)
    if load.frame == "body":
        try:
            rig = build_rig(file)
            anchor = rig.direction(load.point, load.axis, "body")
        except DrillrigError:
            return False
        data = rig.model.createData()
        pin.forwardKinematics(rig.model, data, trajectory.q[0])
        axis = data.oMi[anchor.joint].rotation @ np.array(anchor.vector)
    length = float(np.linalg.norm(d) * np.linalg.norm(axis))
    return length > 0 and abs(float(d @ axis)) >= ALONG * length


def _reason(tip: str, forces: list[Load], carrying: list[Load]) -> str:
    if any(load.point == tip for load in forces):
        what = f"the drilling force acts at the tip {tip} itself, and one point spans no line"
    elif carrying:
        names = ", ".join(load.name for load in carrying)
        what = f"no force on a body that carries the tip {tip} acts along a line to it between tracked points ({names})"
    else:
        what = f"no force acts on the body of the tip {tip} or on one that carries it"
    return f"{what}; let the drilling force act at a tracked point of the feed line behind the tip"
