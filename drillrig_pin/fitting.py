"""Where a scenario meets its rig: the start it asks for, and the joints it locks there."""

from __future__ import annotations

import re

from drillrig_pin.constraints import Loop
from drillrig_pin.declarations import Lock
from drillrig_pin.elements.cylinder import Cylinder
from drillrig_pin.elements.springs import Spring
from drillrig_pin.errors import ModelError, ScenarioError, Source
from drillrig_pin.kinematics import Array
from drillrig_pin.locks import matching
from drillrig_pin.model.modelfile import with_elements
from drillrig_pin.model.nodes import Node
from drillrig_pin.rig import Rig, build_rig
from drillrig_pin.scenario import Scenario


def fitted(rig: Rig, scenario: Scenario) -> Rig:
    """The rig as a scenario has it: joints that ``scenario.lock`` names stand where its pose and positions put them.

    Every lock is written into the model with its position, so that a result that keeps the model keeps the locks. A rig
    that has them already is given back as it is; one without locks too.

    Raises:
        ScenarioError: a pattern that is none or fits no joint, or a joint without exactly one dof.
        ModelError: an element needs a joint that is locked, or nothing is left that moves.
    """
    names = [*rig.joints, *rig.locked]
    chosen: set[str] = set()
    for pattern in scenario.lock:
        try:
            chosen |= set(matching(pattern, names))
        except ModelError as error:
            raise ScenarioError(f"scenario.lock: {error.what}", todo=error.todo) from None
    new = [name for name in rig.joints if name in chosen]
    if not new:
        return rig
    q, nodes = start_configuration(rig, scenario), []
    for name in new:
        joint = rig.model.joints[rig.model.getJointId(name)]
        if joint.nv != 1:
            raise ScenarioError(
                f"scenario.lock: joint {name!r} has more than one dof", todo="Make it a fixed joint of the model."
            )
        attributes = {"joints": _pattern(name), "position": repr(float(q[joint.idx_q]))}
        nodes.append(Node(Lock.tag, attributes, source=Source("scenario.lock")))
    # A study asks for the same locks thousands of times; only the last ones are kept.
    made: dict[str, Rig] = rig.once("fitted", dict)
    key = str([node.attributes for node in nodes])
    locked = made.get(key)
    if locked is None:
        added = [element for element in rig.forces if element.name not in rig.sources]
        locked = build_rig(with_elements(rig.file, nodes), added)
        made.clear()
        made[key] = locked
    return locked


def start_configuration(rig: Rig, scenario: Scenario) -> Array:
    """q in which a scenario starts, before assembly: its pose (else the model's first, else zero) and positions.

    Raises:
        ScenarioError: unknown pose or joint, or a wrong number of values for a joint.
    """
    pose = scenario.pose
    if pose is None and rig.poses:
        pose = next(iter(rig.poses))
    return rig.configuration(pose, scenario.positions)


def locked_words(rig: Rig) -> list[str]:
    """Which joints are locked, where they stand and which elements that leaves idle, as a note; none without locks."""
    stand = ", ".join(f"{name} at {at:g} {'m' if name in rig.sliding else 'rad'}" for name, at in rig.locked.items())
    ended = [item for item in (*rig.forces, *rig.constraints) if isinstance(item, Cylinder | Spring | Loop)]
    still = [item.name for item in ended if rig.point(item.start).joint == rig.point(item.end).joint]
    idle = f"; idle, with both ends on one body: {', '.join(still)}" if still else ""
    return [f"locked joints: {stand}{idle}"] if stand else []


def _pattern(name: str) -> str:
    """A regular expression without spaces that means this name alone."""
    return re.sub(r"\\?\s", r"\\s", re.escape(name))
