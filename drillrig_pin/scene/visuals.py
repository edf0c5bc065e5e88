"""The shapes a model file gives its links."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from drillrig_pin.errors import ModelError
from drillrig_pin.kinematics import Array
from drillrig_pin.model.nodes import Node
from drillrig_pin.scene.meshes import load_mesh
from drillrig_pin.scene.shapes import Ball, Box, Colour, Round, Shape

GREY: Colour = (0.75, 0.76, 0.78, 1.0)


@dataclass(frozen=True, slots=True)
class Visual:
    """One shape of a link: placement in the link's frame (4, 4) and colour."""

    shape: Shape
    placement: Array
    colour: Colour


def link_visuals(robot: Node, folders: tuple[str, ...] = ()) -> tuple[dict[str, list[Visual]], list[str]]:
    """Visuals of every link that has any, by link name, and what could not be drawn, in words.

    Args:
        robot: the root element of the expanded model.
        folders: where to look for meshes first.
    """
    colours = {node.attributes.get("name", ""): _rgba(node) for node in robot.named("material")}
    for link in robot.named("link"):
        for visual in link.named("visual"):
            for material in visual.named("material"):
                colours[material.attributes.get("name", "")] = _rgba(material) or colours.get(
                    material.attributes.get("name", "")
                )
    found: dict[str, list[Visual]] = {}
    notes: list[str] = []
    for link in robot.named("link"):
        name = link.attributes.get("name", "")
        for visual in link.named("visual"):
            try:
                shape, scale = _shape(visual, folders)
            except (ModelError, ValueError) as error:
                what = error.what if isinstance(error, ModelError) else "a number is missing"
                notes.append(f"link {name!r}: a shape is not drawn, {what}")
                continue
            if shape is not None:
                found.setdefault(name, []).append(Visual(shape, _placement(visual, scale), _colour(visual, colours)))
    return found, notes


def _shape(visual: Node, folders: tuple[str, ...]) -> tuple[Shape | None, Array]:
    whole = np.ones(3)
    for geometry in visual.named("geometry"):
        for node in geometry.children:
            if node.tag in _SIMPLE:
                return _SIMPLE[node.tag](node), whole
            if node.tag == "mesh":
                scale = _floats(node, "scale", "1 1 1")
                return load_mesh(node.attributes.get("filename", ""), folders), scale
    return None, whole


def _placement(visual: Node, scale: Array) -> Array:
    placement = np.eye(4)
    for origin in visual.named("origin"):
        placement[:3, :3] = pin.rpy.rpyToMatrix(_floats(origin, "rpy", "0 0 0"))
        placement[:3, 3] = _floats(origin, "xyz", "0 0 0")
    placement[:3, :3] *= scale
    return placement


def _colour(visual: Node, colours: dict[str, Colour | None]) -> Colour:
    for material in visual.named("material"):
        return _rgba(material) or colours.get(material.attributes.get("name", "")) or GREY
    return GREY


def _rgba(material: Node) -> Colour | None:
    for node in material.named("color"):
        red, green, blue, opacity = np.clip(_floats(node, "rgba", "0.75 0.76 0.78 1"), 0.0, 1.0)[:4]
        return float(red), float(green), float(blue), float(opacity)
    return None


def _floats(node: Node, key: str, default: str) -> Array:
    return np.array([float(word) for word in node.attributes.get(key, default).split()])


def _number(node: Node, key: str) -> float:
    return float(node.attributes.get(key, ""))


def _box(node: Node) -> Box:
    x, y, z = _floats(node, "size", "")
    return Box((float(x), float(y), float(z)))


_SIMPLE: dict[str, Callable[[Node], Shape]] = {
    "box": _box,
    "cylinder": lambda node: Round(_number(node, "radius"), _number(node, "length")),
    "capsule": lambda node: Round(_number(node, "radius"), _number(node, "length") + 2 * _number(node, "radius")),
    "sphere": lambda node: Ball(_number(node, "radius")),
}


def named_links(robot: Node) -> Iterator[str]:
    """Names of all links, in file order."""
    return (link.attributes.get("name", "") for link in robot.named("link"))
