"""Holonomic constraints f(q) = 0: a point held on world axes, and two frames joined into a loop.

Every row is a :class:`~drillrig_pin.coordinates.Slide` or :class:`~drillrig_pin.coordinates.Angle`, so residual, rate,
Jacobian and bias of all rows come from one evaluation. A hold of the tip on y and z is [Tram2023] eq. (7).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Self

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, field_validator

from drillrig_pin.coordinates import Angle, Gear, JointCoordinate, Slide
from drillrig_pin.elements.base import Resolver
from drillrig_pin.elements.fields import AXIS, Axes, Initial, Name, quantity, reference, sized, split
from drillrig_pin.kinematics import world_direction, world_point
from drillrig_pin.model.nodes import Node
from drillrig_pin.model.numbers import vector
from drillrig_pin.model.tree_text import child


def _target(value: Any) -> Any:
    return value if value == "initial" else split(value)


@dataclass(frozen=True, slots=True)
class Row:
    """One scalar constraint x(q) - target = 0.

    Attributes:
        name: element and axis, e.g. ``face.y``.
        coordinate: x(q).
        target: value held [m or -]; None: the value at the initial state.
        unit: of the residual, ``m``, ``rad`` or ``1``.
        loop: True for a loop, whose reaction is part of equilibrium from the start.
    """

    name: str
    coordinate: Slide | Angle | Gear
    target: float | None
    unit: str
    loop: bool


class Constraint(BaseModel):
    """Base of the constraint elements."""

    model_config = ConfigDict(frozen=True, extra="forbid", populate_by_name=True, allow_inf_nan=False)

    _sized = field_validator("*")(sized)

    tag: ClassVar[str]

    name: Name

    @classmethod
    def from_node(cls, node: Node) -> Self:
        """Build from a file element."""
        return cls.model_validate(node.attributes)

    def fault(self) -> str | None:
        """What makes the attributes impossible together, or None."""
        return None

    def rows(self, resolver: Resolver) -> Iterator[Row]:
        """The scalar rows, in the order of the axes given."""
        raise NotImplementedError


class Hold(Constraint):
    """A point held on chosen world axes. Its reaction is the force of the surroundings on the point, in world axes.

    With `target="initial"` it stays where the initial state puts it; with numbers, one per axis, the machine is first
    assembled so that it lies there.
    """

    tag: ClassVar[str] = "hold"

    point: Name = reference("the point held")
    axes: Axes = reference("world axes it cannot move along, e.g. `y z`", min_length=1)
    target: Annotated[Initial | tuple[float, ...], BeforeValidator(_target)] = quantity(
        "m", "world coordinates, one per axis", default="initial"
    )

    def fault(self) -> str | None:
        """One target per axis."""
        if self.target != "initial" and len(self.target) != len(self.axes):
            return f"{len(self.target)} targets for {len(self.axes)} axes"
        return None

    def rows(self, resolver: Resolver) -> Iterator[Row]:
        """n . p for every axis n."""
        point = resolver.point(self.point)
        for i, axis in enumerate(self.axes):
            target = None if self.target == "initial" else float(self.target[i])
            coordinate = Slide(point, world_direction(AXIS[axis]), world_point())
            yield Row(f"{self.name}.{axis}", coordinate, target, "m", False)


class Loop(Constraint):
    """Two points joined into a closed loop, on chosen axes of the first point's frame.

    Translations: the second point's position in the first one's frame is zero on these axes. Rotations `x y`: the two
    z axes stay parallel (a hinge about z, with three translations); `x y z`: no relative rotation.
    Reactions are forces [N] and moments [N m] on the second point's link, in the first frame's axes.
    """

    tag: ClassVar[str] = "loop"

    start: Name = Field(alias="from", description="first point; its axes are used", json_schema_extra={"unit": ""})
    end: Name = Field(alias="to", description="second point", json_schema_extra={"unit": ""})
    translations: Axes = reference("axes of no relative displacement", default=())
    rotations: Axes = reference("axes of no relative rotation: none, two or three of them", default=())

    def fault(self) -> str | None:
        """Which combinations of axes make a joint."""
        if not self.translations and not self.rotations:
            return "neither translations nor rotations are closed"
        if len(self.rotations) == 1:
            return "a single rotation axis cannot be closed on its own; give none, two or three"
        return None

    def rows(self, resolver: Resolver) -> Iterator[Row]:
        """Translations first, then rotations as scalar products of axes that must stay perpendicular."""
        start, end = resolver.point(self.start), resolver.point(self.end)
        for axis in self.translations:
            direction = resolver.direction(self.start, AXIS[axis], "body")
            yield Row(f"{self.name}.{axis}", Slide(end, direction, start), 0.0, "m", True)
        for axis in self.rotations:
            first, second = _perpendicular(axis, self.rotations)
            base = resolver.direction(self.start, first, "body")
            moving = resolver.direction(self.end, AXIS[second], "body")
            yield Row(f"{self.name}.r{axis}", Angle(base, moving), 0.0, "1", True)


class GearPair(Constraint):
    """One joint follows another: q = ratio q_mimics + offset, as by a parallel linkage, a chain, gears.

    Its reaction is the torque or force on the joint's own axis [N m or N]; on the other joint acts -ratio times it.
    URDF's `<mimic joint multiplier offset/>` is read as this element, named after its joint. Where neither pose nor
    scenario says where the joint stands, it starts where the other one puts it.
    """

    tag: ClassVar[str] = "gear"

    joint: Name = reference("revolute, continuous or prismatic joint that follows")
    mimics: Name = reference("joint that leads")
    ratio: float = quantity("-", "speed of the follower per speed of the leader [rad, m]", default=1.0)
    offset: float = quantity("rad or m", "position of the follower where the leader is at zero", default=0.0)

    def fault(self) -> str | None:
        """Two joints."""
        return "a joint cannot follow itself" if self.joint == self.mimics else None

    def rows(self, resolver: Resolver) -> Iterator[Row]:
        """q_joint - ratio q_mimics = offset."""
        follower, leader = resolver.joint(self.joint), resolver.joint(self.mimics)
        assert isinstance(follower, JointCoordinate)
        assert isinstance(leader, JointCoordinate)
        slides = resolver.slides(self.joint)
        name, unit = (f"{self.name}.slide", "m") if slides else (f"{self.name}.angle", "rad")
        yield Row(name, Gear(follower, leader, self.ratio), self.offset, unit, True)


def _perpendicular(axis: str, closed: tuple[str, ...]) -> tuple[tuple[float, float, float], str]:
    """Direction of the first frame and axis of the second whose scalar product must vanish so that rotation about
    ``axis`` does.

    Their order is such that the product grows when the second frame turns positively about ``axis`` (moving x base =
    axis): the multiplier is then the moment about it.
    """
    cyclic = {"x": ("y", "z"), "y": ("z", "x"), "z": ("x", "y")}
    second, third = cyclic[axis]
    if len(closed) == 2 and third not in closed:
        # A hinge about ``third``: its image must stay perpendicular to ``second``. As x = -(z x y), the sign turns.
        x, y, z = AXIS[second]
        return (-x, -y, -z), third
    return AXIS[third], second


CONSTRAINTS: dict[str, type[Constraint]] = {cls.tag: cls for cls in (Hold, Loop, GearPair)}


def gears_of_mimics(root: Node) -> Iterator[tuple[GearPair, Node]]:
    """What the <mimic> of every joint with one dof says, as a gear named after it, with its node."""
    for joint in root.named("joint"):
        node, name = child(joint, "mimic"), joint.attributes.get("name", "")
        if node is None or joint.attributes.get("type") not in ("revolute", "continuous", "prismatic"):
            continue
        ratio, offset = vector(node, "multiplier", (1.0,))[0], vector(node, "offset", (0.0,))[0]
        # Any names that URDF allows joints are legal here.
        leader = node.attributes.get("joint", "")
        yield (
            GearPair.model_construct(name=f"{name}.mimic", joint=name, mimics=leader, ratio=ratio, offset=offset),
            node,
        )
