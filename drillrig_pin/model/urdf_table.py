"""What of URDF is read: every element and attribute, and what becomes of it. The one place that says so.

The checker names whatever is not listed here with its line, ``urdf/GRAMMAR.md`` prints it, tests alter every row of it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum


class Use(Enum):
    """What becomes of an element or attribute."""

    READ = "read"
    LOOKS = "looks"
    IGNORED = "ignored"


@dataclass(frozen=True, slots=True)
class Attribute:
    """One attribute.

    Attributes:
        count: how many finite numbers it holds; 0: it is text.
        required: its element says nothing without it.
        use: read, drawn only, or ignored.
        text: meaning, unit, what holds without it.
    """

    text: str
    count: int = 0
    required: bool = False
    use: Use = Use.READ


@dataclass(frozen=True, slots=True)
class Element:
    """One element.

    Attributes:
        text: meaning.
        attributes: by name.
        children: by tag.
        many: may stand more than once in its parent.
        use: read, drawn only, or ignored.
        open: written for another program: what stands inside is not looked at.
        joints: types of joints it acts on; empty: all.
    """

    text: str
    attributes: Mapping[str, Attribute] = field(default_factory=dict)
    children: Mapping[str, Element] = field(default_factory=dict)
    many: bool = False
    use: Use = Use.READ
    open: bool = False
    joints: tuple[str, ...] = ()


#: Types of joints that are simulated.
JOINT_TYPES = ("fixed", "revolute", "continuous", "prismatic", "floating")
_ONE_DOF = ("revolute", "continuous", "prismatic")


def _number(text: str, required: bool = False, use: Use = Use.READ) -> Attribute:
    return Attribute(text, 1, required, use)


def _origin(of: str, use: Use = Use.READ) -> Element:
    attributes = {
        "xyz": Attribute("position [m]; 0 0 0", 3, use=use),
        "rpy": Attribute("roll, pitch, yaw about fixed axes [rad]; 0 0 0", 3, use=use),
        "quat_xyzw": Attribute("quaternion x y z w instead of `rpy`", 4, use=use),
    }
    return Element(of, attributes, use=use)


def _geometry(use: Use) -> Element:
    def number(text: str) -> Attribute:
        return _number(text, True, use)

    shapes = {
        "box": Element("box", {"size": Attribute("edges [m]", 3, True, use)}, use=use),
        "cylinder": Element("cylinder along z", {"radius": number("[m]"), "length": number("[m]")}, use=use),
        "sphere": Element("sphere", {"radius": number("[m]")}, use=use),
        "capsule": Element(
            "cylinder along z with round ends", {"radius": number("[m]"), "length": number("[m]")}, use=use
        ),
        "mesh": Element(
            "mesh file (STL, DAE, OBJ)",
            {
                "filename": Attribute("path, `package://NAME/PATH` or `file://PATH`", 0, True, use),
                "scale": Attribute("factors along x, y, z; 1 1 1", 3, False, use),
            },
            use=use,
        ),
    }
    return Element("one shape", {"name": Attribute("not used", use=Use.IGNORED)}, shapes, use=use)


def _material(many: bool, use: Use) -> Element:
    children = {
        "color": Element("colour", {"rgba": Attribute("red, green, blue, opacity, 0 to 1", 4, True, use)}, use=use),
        "texture": Element("picture on the surface: not drawn", use=Use.IGNORED, open=True),
    }
    return Element("colour by name", {"name": Attribute("name", use=use)}, children, many, use)


_MASS = {
    "origin": _origin("centre of mass and axes of the inertia in the link's frame"),
    "mass": Element("mass", {"value": _number("[kg]", True)}),
    "inertia": Element(
        "inertia about the centre of mass",
        {key: _number("[kg m^2]", True) for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")},
    ),
}
_VISUAL = Element(
    "shape that is drawn; its size is compared with the inertia",
    {"name": Attribute("not used", use=Use.IGNORED)},
    {
        "origin": _origin("placement in the link's frame", Use.LOOKS),
        "geometry": _geometry(Use.LOOKS),
        "material": _material(False, Use.LOOKS),
    },
    True,
    Use.LOOKS,
)
_COLLISION = Element(
    "not simulated: links pass through each other; its size is compared with the inertia where nothing is drawn",
    many=True,
    use=Use.IGNORED,
    open=True,
)
_LINK = Element(
    "a body",
    {"name": Attribute("name", required=True), "type": Attribute("not used", use=Use.IGNORED)},
    {
        "inertial": Element("mass and inertia; a link without weighs nothing", children=_MASS),
        "visual": _VISUAL,
        "collision": _COLLISION,
        "contact": Element("contact of other simulators: not simulated", use=Use.IGNORED, open=True),
        "self_collision_checking": Element("not simulated", use=Use.IGNORED, open=True),
        "self_filter": Element("for cameras", use=Use.IGNORED, open=True),
    },
    True,
)
_JOINT = Element(
    "a joint between two links",
    {"name": Attribute("name", required=True), "type": Attribute(f"one of {', '.join(JOINT_TYPES)}", required=True)},
    {
        "origin": _origin("frame of the joint and of its child in the parent's frame"),
        "parent": Element("link that carries it", {"link": Attribute("name", required=True)}),
        "child": Element("link that it moves", {"link": Attribute("name", required=True)}),
        "axis": Element(
            "axis in the joint's frame; its length does not matter",
            {"xyz": Attribute("direction; 1 0 0", 3, True)},
            joints=_ONE_DOF,
        ),
        "limit": Element(
            "range of the joint, which `check` holds poses against",
            {
                "lower": _number("[rad or m]; 0"),
                "upper": _number("[rad or m]; 0"),
                "effort": _number("of a motor: not used", use=Use.IGNORED),
                "velocity": _number("of a motor: not used", use=Use.IGNORED),
                "acceleration": _number("of a motor: not used", use=Use.IGNORED),
                "deceleration": _number("of a motor: not used", use=Use.IGNORED),
                "jerk": _number("of a motor: not used", use=Use.IGNORED),
            },
            joints=("revolute", "prismatic"),
        ),
        "dynamics": Element(
            "friction in the joint: acts as a `<joint_friction>` named after it",
            {
                "damping": _number("viscous [N m s/rad or N s/m]; 0"),
                "friction": _number("dry [N m or N]; 0"),
            },
            joints=_ONE_DOF,
        ),
        "mimic": Element(
            "position follows that of another joint: acts as a `<gear>` named after it",
            {
                "joint": Attribute("the other joint", required=True),
                "multiplier": _number("1"),
                "offset": _number("[rad or m]; 0"),
            },
            joints=_ONE_DOF,
        ),
        "calibration": Element("of a real robot's sensors", use=Use.IGNORED, open=True),
        "safety_controller": Element("of a real robot's controller", use=Use.IGNORED, open=True),
    },
    True,
)


def _other(program: str) -> Element:
    return Element(f"for {program}", many=True, use=Use.IGNORED, open=True)


ROBOT = Element(
    "the model",
    {"name": Attribute("name; `robot`"), "version": Attribute("version of URDF: not used", use=Use.IGNORED)},
    {
        "link": _LINK,
        "joint": _JOINT,
        "material": _material(True, Use.LOOKS),
        "drillrig": Element("extension elements, described above", many=True, open=True),
        "transmission": _other("motor controllers"),
        "ros2_control": _other("motor controllers"),
        "gazebo": _other("Gazebo"),
        "mujoco": _other("MuJoCo"),
        "sensor": _other("sensors"),
    },
)

#: What in blocks for other programs acts on the motion there, and what does the same here.
ACTS_ELSEWHERE = {
    "joint": "Close a loop with a <loop> element in a <drillrig> block.",
    "loop": "Write it into a <drillrig> block below <robot>.",
    "loop_joint": "Write a <loop> into a <drillrig> block.",
    "springStiffness": "Write a <joint_spring> into a <drillrig> block.",
    "springReference": "Write rest= of a <joint_spring> in a <drillrig> block.",
    "dampingFactor": "Write <dynamics damping=...> into the joint.",
    "turnGravityOff": "All links have weight here.",
    "gravity": "Write <gravity xyz=...> into a <drillrig> block; it holds for all links.",
    "equality": "Write a <loop> into a <drillrig> block.",
}


def is_used(element: Element, joint_type: str) -> bool:
    """Whether an element inside a joint of this type acts on it."""
    return not element.joints or joint_type in element.joints
