"""Alter every attribute and tag of a URDF file: what the file means, or what `check` says of it, must change.

``python tests/urdf_mutation.py FILE ...`` alters all of them; the suite takes one of each kind.
"""

from __future__ import annotations

import re
import sys
import xml.etree.ElementTree as ET
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np

from drillrig_pin import DrillrigError
from drillrig_pin.check import check_text
from drillrig_pin.model.modelfile import read_model_text
from drillrig_pin.model.urdf_table import ROBOT, Element, Use, is_used
from drillrig_pin.rig import build_rig
from drillrig_pin.scene.shapes import Mesh
from drillrig_pin.scene.visuals import link_visuals


@dataclass(frozen=True)
class Mutation:
    """One change: what was done, and the text that results."""

    what: str
    text: str


def meaning(text: str) -> str:
    """All that a model file says, in words that differ where it says something else; the error of a file refused."""
    try:
        rig = build_rig(read_model_text(text, "rig.urdf"))
    except DrillrigError as error:
        return str(error)
    m = rig.model
    parts: list[Any] = [rig.name, list(m.names), list(m.parents), [j.shortname() for j in m.joints], m.gravity.linear]
    parts += [m.lowerPositionLimit, m.upperPositionLimit, rig.endless]
    parts += [placement.homogeneous for placement in m.jointPlacements]
    parts += [inertia.matrix() for inertia in list(m.inertias)[1:]]
    parts += [(frame.name, frame.parentJoint, frame.placement.homogeneous) for frame in m.frames]
    parts += [rig.points, rig.forces, rig.constraints, rig.poses, rig.file.parameters()]
    visuals, faults = link_visuals(rig.file.root)
    parts += [visuals, [str(fault) for fault in faults]]
    with np.printoptions(precision=17, threshold=sys.maxsize):
        return repr(parts)


def words(text: str) -> list[str]:
    """What check says, without lines."""
    return [problem.message for problem in check_text(text, "rig.urdf")]


def mutations(text: str, every: bool = True, share: int = 1) -> Iterator[Mutation]:
    """Every attribute with another value, every attribute and tag with a letter more, where it should matter.

    Args:
        text: of a URDF file.
        every: all of them; else the first of each kind: same elements around it, same type of joint, same change.
        share: one of so many kinds, chosen by their name.
    """
    root = ET.fromstring(text)
    free = _still(root)
    seen: set[tuple[str, ...]] = set()

    def wanted(*kind: str) -> bool:
        new = kind not in seen and zlib.crc32("|".join(kind).encode()) % share == 0
        seen.add(kind)
        return every or new

    def walk(element: ET.Element, known: Element | None, path: str, kind: str) -> Iterator[Mutation]:
        tag = element.tag
        for name, value in list(element.attrib.items()):
            attribute = known.attributes.get(name) if known is not None else None
            ignored = attribute is not None and attribute.use is Use.IGNORED
            acts = not ignored and not (tag == "material" and name == "name" and len(element))
            if acts and path not in free and wanted(kind, name, "value"):
                element.set(name, _other(value))
                yield Mutation(f"{path}@{name}", ET.tostring(root, encoding="unicode"))
                element.set(name, value)
            if wanted(kind, name, "misspelt"):
                element.attrib.pop(name)
                element.set(name + "z", value)
                yield Mutation(f"{path}@{name}z", ET.tostring(root, encoding="unicode"))
                element.attrib.pop(name + "z")
                element.set(name, value)
        if path != "robot" and wanted(kind, "misspelt"):
            element.tag = tag + "z"
            yield Mutation(f"{path}z", ET.tostring(root, encoding="unicode"))
            element.tag = tag
        joint = element.get("type", "") if tag == "joint" else ""
        for index, child in enumerate(element):
            spec = known.children.get(child.tag) if known is not None else None
            ours = tag == "drillrig" or known is None
            if not ours and spec is None:
                continue  # named already
            if spec is not None and child.tag != "drillrig" and (spec.open or spec.use is Use.IGNORED):
                continue  # for another program
            if spec is not None and joint and not is_used(spec, joint):
                continue
            yield from walk(
                child, spec if child.tag != "drillrig" else None, f"{path}/{child.tag}[{index}]",
                f"{kind}{joint}/{child.tag}",
            )  # fmt: skip

    yield from walk(root, ROBOT, "robot", "robot")


def unnoticed(text: str, every: bool = True, share: int = 1) -> list[str]:
    """Changes that alter neither meaning nor words; arguments as of :func:`mutations`."""
    # Reading meshes takes most of the time and tells nothing here: each name stands for another triangle.
    with patch("drillrig_pin.scene.visuals.load_mesh", _triangle):
        before, said = meaning(text), words(text)
        return [
            mutation.what
            for mutation in mutations(text, every, share)
            if meaning(mutation.text) == before and words(mutation.text) == said
        ]


def _triangle(name: str, _near: list[Path]) -> list[tuple[Mesh, None]]:
    corner = 0.1 + zlib.crc32(name.encode()) / 2**33
    return [(Mesh(np.array([[0, 0, 0], [corner, 0, 0], [0, corner, 0]]), np.array([[0, 1, 2]])), None)]


def _other(value: str) -> str:
    if re.fullmatch(r"([-+]?\.?\d[.\deE+-]*\s*)+", value.strip()):
        # Not all in one ratio, or a direction would only be made longer.
        numbers = value.split()
        numbers[-1] = repr(float(numbers[-1]) * 0.5 + 0.25)
        if len(numbers) > 1:
            numbers[0] = repr(float(numbers[0]) * 0.75 + 0.125)
        return " ".join(numbers)
    return {"true": "false", "false": "true", "revolute": "prismatic", "prismatic": "revolute"}.get(value, value + "x")


def _still(root: ET.Element) -> set[str]:
    """Paths of the inertial numbers of links that do not move, and of where nothing weighs: nothing depends on them."""
    links = {link.get("name"): i for i, link in enumerate(root) if link.tag == "link"}
    joints = [joint for joint in root if joint.tag == "joint"]
    children = {joint.find("child").get("link") for joint in joints}  # type: ignore[union-attr]
    still = set(links) - children
    for _ in joints:
        still |= {
            joint.find("child").get("link")  # type: ignore[union-attr]
            for joint in joints
            if joint.get("type") == "fixed" and joint.find("parent").get("link") in still  # type: ignore[union-attr]
        }
    found = set()
    for name, row in links.items():
        for i, part in enumerate(root[row]):
            mass = part.find("mass") if part.tag == "inertial" else None
            if mass is not None:
                weightless = float(mass.get("value", "1")) == 0.0
                tags = ("origin", "mass", "inertia") if name in still else ("origin",) if weightless else ()
                found |= {f"robot/link[{row}]/inertial[{i}]/{c.tag}[{j}]" for j, c in enumerate(part) if c.tag in tags}
    return found


if __name__ == "__main__":
    for path in sys.argv[1:]:
        for missed in unnoticed(Path(path).read_text()):
            print(f"{path}: {missed}")
