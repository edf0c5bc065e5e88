"""The tree of a model as the URDF text that Pinocchio is given: links with their inertia, joints, nothing else.

Its reader drops what it cannot read and tells only the terminal. So it gets clean numbers and no more than it needs.
"""

from __future__ import annotations

import sys
from xml.etree import ElementTree

from drillrig_pin.model.nodes import Node
from drillrig_pin.model.numbers import placement, vector
from drillrig_pin.model.urdf_table import ROBOT, is_used

#: Limit of a joint that has none, as Pinocchio writes it; infinity cannot be handed on to the compiled core as text.
UNLIMITED = sys.float_info.max
INERTIA = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")


def tree_text(root: Node) -> str:
    """URDF of the bare tree.

    A continuous joint is handed over as a revolute one without limits. Pinocchio would keep its angle as cosine and
    sine and so forget whole turns; a spring, a motor's work and a table of results need the angle that counts on.

    Raises:
        ModelError: a number that cannot be read; :func:`drillrig_pin.model.urdfcheck.check_urdf` finds all of them.
    """
    robot = ElementTree.Element("robot", {"name": root.attributes.get("name") or "robot"})
    for link in root.named("link"):
        body = ElementTree.SubElement(robot, "link", {"name": link.attributes.get("name", "")})
        inertial = child(link, "inertial")
        if inertial is not None:
            _inertial(ElementTree.SubElement(body, "inertial"), inertial)
    for joint in root.named("joint"):
        _joint(robot, joint)
    return ElementTree.tostring(robot, encoding="unicode")


def child(node: Node, tag: str) -> Node | None:
    """The first child with this tag, which is the one that counts."""
    return next(node.named(tag), None)


def inertial_numbers(inertial: Node) -> tuple[float, tuple[float, ...]]:
    """Mass [kg] and ixx, ixy, ixz, iyy, iyz, izz [kg m^2] of an <inertial>; zero where nothing is said.

    Raises:
        ModelError: a number that cannot be read.
    """
    mass, tensor = child(inertial, "mass"), child(inertial, "inertia")
    return vector(mass, "value", (0.0,))[0], tuple(vector(tensor, key, (0.0,))[0] for key in INERTIA)


def _inertial(element: ElementTree.Element, inertial: Node) -> None:
    mass, tensor = inertial_numbers(inertial)
    _origin(element, child(inertial, "origin"))
    ElementTree.SubElement(element, "mass", {"value": repr(mass)})
    ElementTree.SubElement(element, "inertia", dict(zip(INERTIA, map(repr, tensor), strict=True)))


def _joint(robot: ElementTree.Element, joint: Node) -> None:
    kind = joint.attributes.get("type", "")
    words = {"name": joint.attributes.get("name", ""), "type": "revolute" if kind == "continuous" else kind}
    element = ElementTree.SubElement(robot, "joint", words)
    _origin(element, child(joint, "origin"))
    for end in ("parent", "child"):
        node = child(joint, end)
        ElementTree.SubElement(element, end, {"link": node.attributes.get("link", "") if node is not None else ""})
    parts = ROBOT.children["joint"].children
    if is_used(parts["axis"], kind):
        ElementTree.SubElement(element, "axis", {"xyz": _words(vector(child(joint, "axis"), "xyz", (1.0, 0.0, 0.0)))})
    if kind == "continuous":
        bounds = {"lower": repr(-UNLIMITED), "upper": repr(UNLIMITED)}
        ElementTree.SubElement(element, "limit", {**bounds, "effort": "0", "velocity": "0"})
    if is_used(parts["limit"], kind):
        limit = child(joint, "limit")
        # What a motor can do is not asked here, and its reader refuses a limit that does not say it.
        bounds = {key: repr(vector(limit, key, (0.0,))[0]) for key in ("lower", "upper")}
        ElementTree.SubElement(element, "limit", {**bounds, "effort": "0", "velocity": "0"})


def _origin(element: ElementTree.Element, origin: Node | None) -> None:
    xyz, rpy = placement(origin)
    ElementTree.SubElement(element, "origin", {"xyz": _words(xyz), "rpy": _words(rpy)})


def _words(values: tuple[float, ...]) -> str:
    return " ".join(map(repr, values))
