"""The shapes a model file gives its links. A fault of looks stops nothing: it is noted, and the rest is drawn."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pinocchio as pin

from drillrig_pin.errors import ModelError, Source, shown
from drillrig_pin.kinematics import Array
from drillrig_pin.model.nodes import Node
from drillrig_pin.scene.meshes import MissingMeshError, diagonal, load_mesh
from drillrig_pin.scene.shapes import Ball, Box, Colour, Mesh, Round, Shape

GREY: Colour = (0.75, 0.76, 0.78, 1.0)
#: No part of a machine is larger [m]; beyond, viewers draw nothing sensible.
LARGEST = 1e6
#: A mesh so many times larger or smaller than the machine is in another unit: one in millimetres is a thousand times
#: its part, and parts are a tenth of a machine or so.
HUGE, TINY = 30.0, 1 / 3000
WORDS = {1: "one number", 2: "two numbers", 3: "three numbers", 4: "four numbers"}


@dataclass(frozen=True, slots=True)
class Visual:
    """One shape of a link: placement in the link's frame (4, 4) and colour."""

    shape: Shape
    placement: Array
    colour: Colour


@dataclass(frozen=True, slots=True)
class Fault:
    """Something about the looks of a link that is not as its file means it.

    Attributes:
        link: name of the link.
        what: what is wrong, in words.
        source: file and line.
        todo: what to do.
        drawn: whether the shape is drawn all the same.
        mesh: name of a mesh that was not found; empty: something else.
    """

    link: str
    what: str
    source: Source
    todo: str = ""
    drawn: bool = False
    mesh: str = ""

    def __str__(self) -> str:
        return f"link {self.link!r}: {'' if self.drawn else 'a shape is not drawn, '}{self.what}"


def link_visuals(
    robot: Node, folder: Path | None = None, size: float | None = None
) -> tuple[dict[str, list[Visual]], list[Fault]]:
    """Visuals of every link that has any, by link name, and what is not drawn as it is meant.

    Args:
        robot: the root element of the expanded model.
        folder: where relative names of meshes count from; None: not known.
        size: of the machine [m], to tell meshes in another unit; None: not looked at.
    """
    near = [folder] if folder is not None else []
    found: dict[str, list[Visual]] = {}
    faults: list[Fault] = []
    colours = _named_colours(robot, faults)
    for link in robot.named("link"):
        name = link.attributes.get("name", "")
        for visual in link.named("visual"):
            try:
                shapes, scale = _shapes(visual, near)
                placement = _placement(visual, scale)
                _require_size(shapes, scale, size)
            except MissingMeshError as error:
                mesh = next(iter(_geometry(visual))).attributes.get("filename", "")
                faults.append(Fault(name, error.what, _where(error, visual), error.todo, mesh=mesh))
                continue
            except ModelError as error:
                faults.append(Fault(name, error.what, _where(error, visual), error.todo))
                continue
            colour = _colour(visual, colours, name, faults)
            found.setdefault(name, []).extend(Visual(shape, placement, colour or own or GREY) for shape, own in shapes)
    return found, faults


def notes_of(faults: Sequence[Fault]) -> list[str]:
    """Faults in words, the meshes that are not found in one note."""
    missing = [fault for fault in faults if fault.mesh]
    notes = [str(fault) for fault in faults if not fault.mesh]
    if missing:
        names = list(dict.fromkeys(fault.mesh for fault in missing))
        listed = ", ".join(map(repr, names[:3])) + (f" and {len(names) - 3} more" if len(names) > 3 else "")
        looked = missing[0].what.partition("; ")[2]
        count = "a mesh is" if len(missing) == 1 else f"{len(missing)} meshes are"
        links = ", ".join(repr(name) for name in dict.fromkeys(fault.link for fault in missing))
        notes.append(f"{count} not found here and not drawn: {listed} of link {links}; {looked}. {missing[0].todo}")
    return notes


def _where(error: ModelError, node: Node) -> Source:
    return error.where if isinstance(error.where, Source) else node.source


def _geometry(visual: Node) -> Iterator[Node]:
    return (node for geometry in visual.named("geometry") for node in geometry.children)


def _shapes(visual: Node, near: list[Path]) -> tuple[list[tuple[Shape, Colour | None]], Array]:
    whole = np.ones(3)
    nodes = list(_geometry(visual))
    if not nodes:
        raise ModelError("it has no geometry", where=visual.source)
    node = nodes[0]
    if node.tag in _SIMPLE:
        return [(_SIMPLE[node.tag](node), None)], whole
    if node.tag != "mesh":
        known = ", ".join((*_SIMPLE, "mesh"))
        raise ModelError(f"there is no geometry <{node.tag}>", where=node.source, todo=f"Known: {known}.")
    scale = _vector(node, "scale", 3, "1 1 1")
    if not scale.all():
        raise ModelError("the scale of its mesh is zero", where=node.source)
    try:
        return list(load_mesh(node.attributes.get("filename", ""), near)), scale
    except ModelError as error:
        error.where = node.source
        raise


def _require_size(shapes: list[tuple[Shape, Colour | None]], scale: Array, size: float | None) -> None:
    meshes = [shape for shape, _ in shapes if isinstance(shape, Mesh)]
    if not meshes or not size:
        return
    longest = max(diagonal(mesh, scale) for mesh in meshes)
    if longest > HUGE * size:
        todo = 'A mesh in millimetres needs scale="0.001 0.001 0.001".'
        raise ModelError(f"its mesh is {longest:.3g} m long, the machine {size:.3g} m", todo=todo)
    if longest < TINY * size:
        todo = "A mesh in metres needs no scale."
        raise ModelError(f"its mesh is {longest:.3g} m long, the machine {size:.3g} m", todo=todo)


def _placement(visual: Node, scale: Array) -> Array:
    placement = np.eye(4)
    for origin in visual.named("origin"):
        placement[:3, 3] = _vector(origin, "xyz", 3, "0 0 0")
        placement[:3, :3] = pin.rpy.rpyToMatrix(_vector(origin, "rpy", 3, "0 0 0"))
        if "quat_xyzw" in origin.attributes:
            if "rpy" in origin.attributes:
                raise ModelError("its origin is turned twice, by rpy and by quat_xyzw", where=origin.source)
            quaternion = _vector(origin, "quat_xyzw", 4, "")
            length = float(np.linalg.norm(quaternion))
            if not 0.9 < length < 1.1:
                raise ModelError(f"its quaternion has the length {length:.3g}", where=origin.source, todo="It is 1.")
            placement[:3, :3] = pin.Quaternion(quaternion / length).toRotationMatrix()
    placement[:3, :3] *= scale
    return placement


def _named_colours(robot: Node, faults: list[Fault]) -> dict[str, Colour]:
    """Colours that materials give by name, at the top of the file or in some link."""
    colours: dict[str, Colour] = {}
    inside = [
        (link.attributes.get("name", ""), material)
        for link in robot.named("link")
        for visual in link.named("visual")
        for material in visual.named("material")
    ]
    for _, material in [*(("", node) for node in robot.named("material")), *inside]:
        colour, wrong = _rgba(material)
        if colour is not None or wrong:
            colours[material.attributes.get("name", "")] = colour or GREY
    for node in robot.named("material"):
        colour, wrong = _rgba(node)
        if wrong:
            name = node.attributes.get("name", "")
            users = [link for link, material in inside if material.attributes.get("name", "") == name]
            faults += [Fault(user, wrong, node.source, "Four numbers from 0 to 1.", drawn=True) for user in users]
    return colours


def _colour(visual: Node, colours: dict[str, Colour], link: str, faults: list[Fault]) -> Colour | None:
    for material in visual.named("material"):
        colour, wrong = _rgba(material)
        if wrong:
            faults.append(Fault(link, wrong, material.source, "Four numbers from 0 to 1.", drawn=True))
        name = material.attributes.get("name", "")
        if colour is None and name and name not in colours and not wrong and not any(material.named("texture")):
            what = f"no material {name!r} says its colour; it is drawn grey"
            faults.append(Fault(link, what, material.source, drawn=True))
        return colour or colours.get(name)
    return None


def _rgba(material: Node) -> tuple[Colour | None, str]:
    """Colour of a material, if it says one, and what is wrong with it."""
    for node in material.named("color"):
        text = node.attributes.get("rgba", "")
        try:
            values = [float(word) for word in text.split()]
        except ValueError:
            values = []
        if len(values) not in (3, 4) or not all(map(math.isfinite, values)):
            return None, f"rgba = {shown(text)} is no colour; it is drawn grey"
        red, green, blue, opacity = (min(max(value, 0.0), 1.0) for value in (*values, 1.0)[:4])
        colour = (red, green, blue, opacity)
        if len(values) == 3:
            return colour, f"rgba = {shown(text)} has three numbers; it is drawn opaque"
        if max(values) > 1.0 or min(values) < 0.0:
            return colour, f"rgba = {shown(text)} leaves 0 to 1; it is drawn as {' '.join(f'{c:g}' for c in colour)}"
        return colour, ""
    return None, ""


def _vector(node: Node, key: str, count: int, default: str) -> Array:
    """Numbers of an attribute; ModelError with its line if they are not as many, or are none."""
    text = node.attributes.get(key, default)
    if key == "rpy" and not text.strip():
        # As in joints and inertias: what exporters write for "no rotation".
        text = default
    try:
        values = [float(word) for word in text.split()]
    except ValueError:
        values = [math.nan]
    if not all(math.isfinite(value) and abs(value) <= LARGEST for value in values):
        raise ModelError(f"<{node.tag}> {key} = {shown(text)} is not {WORDS[count]}", where=node.source)
    if len(values) != count:
        given = WORDS.get(len(values), f"{len(values)} numbers")
        raise ModelError(
            f"<{node.tag}> {key} = {shown(text)} has {given}, not {WORDS[count].split()[0]}", where=node.source
        )
    return np.array(values)


def _length(node: Node, key: str) -> float:
    value = float(_vector(node, key, 1, "")[0])
    if value <= 0:
        raise ModelError(f"<{node.tag}> {key} = {value:g} is no length", where=node.source)
    return value


def _box(node: Node) -> Box:
    x, y, z = (float(edge) for edge in _vector(node, "size", 3, ""))
    if min(x, y, z) <= 0:
        raise ModelError(f"<box> size = {x:g} {y:g} {z:g} holds no volume", where=node.source)
    return Box((x, y, z))


_SIMPLE: dict[str, Callable[[Node], Shape]] = {
    "box": _box,
    "cylinder": lambda node: Round(_length(node, "radius"), _length(node, "length")),
    "capsule": lambda node: Round(_length(node, "radius"), _length(node, "length") + 2 * _length(node, "radius")),
    "sphere": lambda node: Ball(_length(node, "radius")),
}
