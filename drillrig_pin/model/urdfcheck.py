"""What is wrong or suspicious in the URDF part of a model, all at once, with file and line."""

from __future__ import annotations

from collections.abc import Iterator

from drillrig_pin.errors import Source, legal_names
from drillrig_pin.model.inertias import check_inertias
from drillrig_pin.model.nodes import Node
from drillrig_pin.model.numbers import numbers
from drillrig_pin.model.problem import Problem
from drillrig_pin.model.tablecheck import check_table
from drillrig_pin.model.tree_text import child
from drillrig_pin.model.urdf_table import JOINT_TYPES, ROBOT, is_used

#: What to write instead of joints that URDF, or another program, has and that are not simulated.
INSTEAD = {
    "planar": "Write two prismatic joints and a revolute one in a row, with links without mass between them.",
    "ball": "Write three revolute joints in a row, with links without mass between them.",
    "spherical": "Write three revolute joints in a row, with links without mass between them.",
    "universal": "Write two revolute joints in a row, with a link without mass between them.",
}

#: Of an axis whose numbers are smaller than this nothing is left when they are squared.
SHORTEST = 1e-100


def check_urdf(root: Node) -> Iterator[Problem]:
    """Yield findings about links, joints, inertias and numbers of the expanded file."""
    links = {node.attributes.get("name", ""): node for node in root.named("link")}
    if not links:
        yield Problem("error", "the model has no link", root.source)
    if not root.attributes.get("name"):
        yield Problem("warning", "the <robot> has no name and is called 'robot'", root.source, "Give it a name.")
    yield from _duplicates(root)
    yield from check_table(root)
    yield from _materials(root)
    yield from check_inertias(root)
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


def _joints(root: Node, links: dict[str, Node]) -> Iterator[Problem]:
    parents: dict[str, Node] = {}
    for joint in root.named("joint"):
        name, kind = joint.attributes.get("name", ""), joint.attributes.get("type", "")
        if kind not in JOINT_TYPES:
            advice = f"{INSTEAD.get(kind, '')} {legal_names(kind, JOINT_TYPES, 'types')}".strip()
            yield Problem("error", f"joint {name!r} is of type {kind!r}", joint.source, advice)
        for end in ("parent", "child"):
            node = child(joint, end)
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
        limit = child(joint, "limit")
        if kind in ("revolute", "prismatic") and limit is None:
            yield Problem("error", f"joint {name!r} has no <limit>", joint.source, "URDF demands one.")
        if limit is not None and kind in ("revolute", "prismatic") and _bounds(limit)[0] > _bounds(limit)[1]:
            yield Problem("error", f"joint {name!r}: the lower limit lies above the upper one", limit.source)
        axis = child(joint, "axis")
        if axis is not None and is_used(ROBOT.children["joint"].children["axis"], kind):
            xyz = numbers(axis.attributes.get("xyz", ""))
            if xyz and max(map(abs, xyz)) < SHORTEST:
                yield Problem(
                    "error",
                    f"joint {name!r}: its axis {axis.attributes['xyz']!r} has no direction",
                    axis.source,
                    "Write e.g. 0 0 1 for the z axis of the joint's frame.",
                )
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


def _bounds(limit: Node) -> tuple[float, float]:
    """Lower and upper; zero where nothing, or nothing readable, is said."""
    low, high = (numbers(limit.attributes.get(key, "")) or (0.0,) for key in ("lower", "upper"))
    return low[0], high[0]


def _materials(root: Node) -> Iterator[Problem]:
    """Materials that are defined twice with different colours; equal ones are what two parts of one macro write."""
    colours: dict[str, tuple[str, Source]] = {}
    for material in root.named("material"):
        colour, name = _colour(material), material.attributes.get("name", "")
        first, where = colours.setdefault(name, (colour, material.source))
        if first != colour:
            yield Problem(
                "warning",
                f"material {name!r} has another colour at {where}, the last one is drawn",
                material.source,
                "Rename one.",
            )


def _colour(material: Node) -> str:
    colour = child(material, "color")
    return " ".join(map(str, numbers(colour.attributes.get("rgba", "")) or ())) if colour is not None else ""


def _rings(links: dict[str, Node], parents: dict[str, Node]) -> Iterator[Problem]:
    """Links whose joints lead round in a ring and never to the root: URDF readers drop them without a word."""
    for name in links:
        link, passed = name, {name}
        while link in parents:
            parent = child(parents[link], "parent")
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
