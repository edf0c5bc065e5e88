"""What is wrong or suspicious in the URDF part of a model, all at once, with file and line."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from drillrig_pin.errors import Source, legal_names
from drillrig_pin.model.nodes import Node
from drillrig_pin.model.problem import Problem

JOINT_TYPES = ("fixed", "revolute", "continuous", "prismatic", "floating")
#: Elements that URDF readers know below <robot>; anything else is likely a slip.
ROBOT_CHILDREN = ("link", "joint", "material", "transmission", "gazebo", "mujoco", "drillrig", "ros2_control", "sensor")
#: Relative slack of the triangle inequality: thin rods meet it with equality up to printed digits.
TRIANGLE_SLACK = 1e-3


def check_urdf(root: Node) -> Iterator[Problem]:
    """Yield findings about links, joints, inertias and numbers of the expanded file."""
    links = {node.attributes.get("name", ""): node for node in root.named("link")}
    if not links:
        yield Problem("error", "the model has no link", root.source)
    yield from _duplicates(root)
    for child in root.children:
        if child.tag not in ROBOT_CHILDREN:
            advice = legal_names(child.tag, ROBOT_CHILDREN, "elements")
            yield Problem("warning", f"unknown element <{child.tag}> is ignored", child.source, advice)
    for tag in ("link", "joint"):
        for part in root.named(tag):
            yield from _numbers(part)
    for link in links.values():
        yield from _inertia(link)
    yield from _joints(root, links)


def _duplicates(root: Node) -> Iterator[Problem]:
    for tag in ("link", "joint"):
        seen: dict[str, Source] = {}
        for node in root.named(tag):
            name = node.attributes.get("name", "")
            if not name:
                yield Problem("error", f"a <{tag}> has no name", node.source)
            elif name in seen:
                yield Problem("error", f"{tag} {name!r} is already defined at {seen[name]}", node.source, "Rename one.")
            seen.setdefault(name, node.source)


_NUMERIC = frozenset(("xyz", "rpy", "value", "ixx", "ixy", "ixz", "iyy", "iyz", "izz", "lower", "upper"))
_NUMERIC |= {"effort", "velocity", "radius", "length", "size", "scale", "rgba"}


def _numbers(node: Node) -> Iterator[Problem]:
    for key, text in node.attributes.items():
        if key not in _NUMERIC or (node.tag in ("texture", "param")):
            continue
        for word in text.split():
            try:
                finite = math.isfinite(float(word))
            except ValueError:
                finite = False
            if not finite:
                yield Problem("error", f"<{node.tag}> {key} = {text!r} is not a finite number", node.source)
                break
    for child in node.children:
        yield from _numbers(child)


def _child(node: Node, tag: str) -> Node | None:
    return next(node.named(tag), None)


def _number(node: Node | None, key: str) -> float:
    try:
        return float(node.attributes.get(key, "nan")) if node is not None else math.nan
    except ValueError:
        return math.nan


def _inertia(link: Node) -> Iterator[Problem]:
    name = link.attributes.get("name", "")
    shaped = _child(link, "visual") is not None or _child(link, "collision") is not None
    inertial = _child(link, "inertial")
    if inertial is None:
        return
    mass = _number(_child(inertial, "mass"), "value")
    if mass < 0:
        yield Problem("error", f"link {name!r} has the negative mass {mass:g} kg", inertial.source)
        return
    if mass == 0 and shaped:
        yield Problem("warning", f"link {name!r} has geometry but no mass", inertial.source, "Give it its mass.")
    tensor = _child(inertial, "inertia")
    if tensor is None:
        yield Problem("error", f"link {name!r} has a mass but no <inertia>", inertial.source)
        return
    xx, xy, xz, yy, yz, zz = (_number(tensor, key) for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"))
    matrix = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    if not np.isfinite(matrix).all():
        yield Problem("error", f"link {name!r} has an incomplete inertia tensor", tensor.source)
        return
    small, middle, large = np.linalg.eigvalsh(matrix)
    if small < -TRIANGLE_SLACK * max(large, 1e-300):
        yield Problem(
            "error", f"link {name!r}: a principal moment of inertia is negative ({small:g} kg m^2)", tensor.source
        )
    elif large > (small + middle) * (1 + TRIANGLE_SLACK):
        yield Problem(
            "warning",
            f"link {name!r}: principal moments {small:.4g}, {middle:.4g}, {large:.4g} kg m^2 break the triangle "
            "inequality: no body has them",
            tensor.source,
            "Check the tensor and the axes it is given in.",
        )


def _joints(root: Node, links: dict[str, Node]) -> Iterator[Problem]:
    parents: dict[str, Node] = {}
    for joint in root.named("joint"):
        name, kind = joint.attributes.get("name", ""), joint.attributes.get("type", "")
        if kind not in JOINT_TYPES:
            yield Problem(
                "error", f"joint {name!r} is of type {kind!r}", joint.source, legal_names(kind, JOINT_TYPES, "types")
            )
        if _child(joint, "mimic") is not None:
            yield Problem("error", f"joint {name!r} mimics another", joint.source, "Use a loop or a spring instead.")
        for end in ("parent", "child"):
            node = _child(joint, end)
            link = node.attributes.get("link", "") if node is not None else ""
            if link not in links:
                yield Problem(
                    "error",
                    f"joint {name!r}: no link {link!r} to be its {end}",
                    (node or joint).source,
                    legal_names(link, links, "links"),
                )
            elif end == "child":
                if link in parents:
                    first = parents[link].attributes.get("name")
                    yield Problem(
                        "error",
                        f"link {link!r} is the child of two joints, {first!r} and {name!r}",
                        joint.source,
                        "Close loops with a <loop> element.",
                    )
                parents[link] = joint
        limit = _child(joint, "limit")
        if kind in ("revolute", "prismatic") and limit is None:
            yield Problem("error", f"joint {name!r} has no <limit>", joint.source, "URDF demands one.")
        if limit is not None and _number(limit, "lower") > _number(limit, "upper"):
            yield Problem("error", f"joint {name!r}: the lower limit lies above the upper one", limit.source)
    roots = [name for name in links if name not in parents]
    if len(roots) > 1:
        yield Problem(
            "error",
            f"{len(roots)} links have no parent: {', '.join(map(repr, roots))}",
            root.source,
            "One may be the root.",
        )
    if links and not roots:
        yield Problem("error", "the joints form a ring without a root", root.source, "Close it with a <loop> element.")
    elif len(roots) == 1:
        yield from _rings(links, parents)


def _rings(links: dict[str, Node], parents: dict[str, Node]) -> Iterator[Problem]:
    """Links whose joints lead round in a ring and never to the root: URDF readers drop them without a word."""
    for name in links:
        link, passed = name, {name}
        while link in parents:
            parent = _child(parents[link], "parent")
            link = parent.attributes.get("link", "") if parent is not None else ""
            if link in passed:
                joint = parents[name]
                yield Problem(
                    "error",
                    f"link {name!r} hangs on a ring of joints, not on the root",
                    joint.source,
                    "Close it with a <loop> element.",
                )
                return
            passed.add(link)
