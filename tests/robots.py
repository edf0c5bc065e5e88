"""Robots nobody made for this package: those of example-robot-data."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from importlib.metadata import distribution


def robot_text(name: str) -> str:
    """URDF text of a file of example-robot-data, e.g. ``ur5_robot.urdf``."""
    (path,) = (file for file in distribution("example-robot-data").files or () if file.name == name)
    return path.read_text()


def floating(text: str) -> str:
    """The robot on a floating joint in the world."""
    root = ET.fromstring(text)
    children = {joint.find("child").get("link") for joint in root.findall("joint")}
    (base,) = (link.get("name") for link in root.findall("link") if link.get("name") not in children)
    ET.SubElement(root, "link", name="world")
    joint = ET.SubElement(root, "joint", name="flight", type="floating")
    ET.SubElement(joint, "parent", link="world")
    ET.SubElement(joint, "child", link=base)
    return ET.tostring(root, encoding="unicode")
