"""What a number of a model reaches: the model is expanded once more with the number changed a little, and compared.

That says which links, joints and elements a number enters, not how much it matters there: an element it enters may be
idle in a given run. A number that enters nothing, or only what is drawn, cannot change any result.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from drillrig_pin.errors import ModelError
from drillrig_pin.model.modelfile import BLOCK, ModelFile, read_model
from drillrig_pin.model.nodes import Node

#: Relative change of a number, and the change of a zero.
STEP = 1e-3
#: Tags in a link that are drawn and do nothing else here.
DRAWN = ("visual", "collision")
#: What carries words about the model, not the model.
ABOUT = ("parameter",)


@dataclass(frozen=True, slots=True)
class Reach:
    """What a number enters.

    Attributes:
        acts: links, joints and elements whose numbers follow it, in words.
        idle: what follows it and moves nothing: drawings, points that no element uses or that shift along the line of
            action of their load. What is reported of a tracked point follows all the same.
        known: False if the model could not be expanded with the number changed.
    """

    acts: tuple[str, ...] = ()
    idle: tuple[str, ...] = ()
    known: bool = True

    def __str__(self) -> str:
        if not self.known:
            return "not known"
        if self.acts:
            return _few(self.acts)
        return f"nothing that acts: {_few(self.idle)}" if self.idle else "nothing"

    @property
    def none(self) -> bool:
        """True if changing the number cannot change a result."""
        return self.known and not self.acts


def reach(file: ModelFile, name: str, model: str, arguments: Mapping[str, Any] | None = None) -> Reach:
    """What the number ``name`` of a model enters.

    Args:
        file: the model, expanded with ``arguments``.
        name: one of its numbers.
        model: its path or name.
        arguments: those it was expanded with.
    """
    try:
        value = float(file.parameters()[name].value)
    except (KeyError, ValueError):
        return Reach(known=False)
    for step in (STEP, -STEP):
        changed = value * (1 + step) if value else step
        if not math.isfinite(changed):
            continue
        try:
            other = read_model(model, {**(arguments or {}), name: changed})
        except ModelError:
            continue
        return compare(file, other)
    return Reach(known=False)


def compare(file: ModelFile, other: ModelFile) -> Reach:
    """What differs between two expansions of one model."""
    acts: dict[str, None] = {}
    idle: dict[str, None] = {}
    for one, two in _pairs(file.root, other.root):
        for words, does in _differences(one, two, file):
            (acts if does else idle)[words] = None
    return Reach(tuple(acts), tuple(idle))


def _pairs(one: Node, two: Node) -> Iterator[tuple[Node | None, Node | None]]:
    """Parts of two machines that belong together: by tag and name, extension elements too."""
    first, second = _parts(one), _parts(two)
    for key in dict.fromkeys([*first, *second]):
        yield first.get(key), second.get(key)


def _parts(root: Node) -> dict[tuple[str, str, int], Node]:
    found: dict[tuple[str, str, int], Node] = {}
    for node in root.children:
        for part in node.children if node.tag == BLOCK else (node,):
            if part.tag in ABOUT:
                continue
            place = 0
            while (key := (part.tag, part.attributes.get("name", ""), place)) in found:
                place += 1
            found[key] = part
    return found


def _differences(one: Node | None, two: Node | None, file: ModelFile) -> Iterator[tuple[str, bool]]:
    node = one or two
    if node is None or (one is not None and two is not None and _content(one) == _content(two)):
        return
    label = f"{node.tag} {node.attributes['name']}" if "name" in node.attributes else node.tag
    if node.tag == "material":
        yield f"drawing of {label}", False
    elif node.tag == "link" and one is not None and two is not None:
        if _drawn(one) != _drawn(two):
            yield f"drawing of {node.attributes.get('name', '')}", False
        if _content(one, DRAWN) != _content(two, DRAWN):
            name = node.attributes.get("name", "")
            still = name in _standing(file)
            yield f"inertia of {name}{', which stands still' if still else ''}", not still
    elif node.tag == "point" and one is not None and two is not None:
        users = [user for user in _users(node.attributes.get("name", ""), file) if not _indifferent(user, one, two)]
        yield (label, True) if users else (f"{label}, where no force feels it", False)
    else:
        yield label, True


def _standing(file: ModelFile) -> set[str]:
    """Links that no joint moves: the root and what is fixed to it."""
    ends = [
        (joint.attributes.get("type"), _end(joint, "parent"), _end(joint, "child"))
        for joint in file.root.named("joint")
    ]
    found = {node.attributes.get("name", "") for node in file.root.named("link")} - {child for _, _, child in ends}
    for _ in ends:
        found |= {child for kind, parent, child in ends if kind == "fixed" and parent in found}
    return found


def _end(joint: Node, tag: str) -> str:
    return next((end.attributes.get("link", "") for end in joint.named(tag)), "")


def _users(point: str, file: ModelFile) -> list[Node]:
    """Elements that name a point."""
    return [
        element
        for element in file.elements()
        if element.tag not in (*ABOUT, "point")
        and any(point in value.split() for key, value in element.attributes.items() if key != "name")
    ]


def _indifferent(user: Node, one: Node, two: Node) -> bool:
    """Whether a load does not feel its point move from ``one`` to ``two``: a torque, or a force along the way."""
    rest = ("xyz",)
    if user.tag != "load" or _without(one, rest) != _without(two, rest):
        return False
    if user.attributes.get("kind") == "torque":
        return True
    turned = any(float(word) for word in one.attributes.get("rpy", "0").split())
    if turned or user.attributes.get("frame", "body") != "body":
        return False
    before, after, axis = (
        np.array([float(word) for word in text.split()])
        for text in (one.attributes.get("xyz", ""), two.attributes.get("xyz", ""), user.attributes.get("axis", ""))
    )
    way = after - before
    return bool(np.linalg.norm(np.cross(way, axis)) <= 1e-12 * np.linalg.norm(way) * np.linalg.norm(axis))


def _without(node: Node, keys: tuple[str, ...]) -> dict[str, str]:
    return {key: value for key, value in node.attributes.items() if key not in keys}


def _content(node: Node, without: tuple[str, ...] = ()) -> tuple[Any, ...]:
    inner = tuple(_content(child) for child in node.children if child.tag not in without)
    return (node.tag, tuple(sorted(node.attributes.items())), node.text, inner)


def _drawn(node: Node) -> tuple[Any, ...]:
    return tuple(_content(child) for child in node.children if child.tag in DRAWN)


def _few(words: tuple[str, ...]) -> str:
    return ", ".join(words[:4]) + (f" and {len(words) - 4} more" if len(words) > 4 else "")
