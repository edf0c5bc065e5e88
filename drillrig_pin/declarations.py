"""Extension elements that exert no force: gravity, named points, poses, the parameter table."""

from __future__ import annotations

from typing import Annotated, ClassVar, Self

from pydantic import BaseModel, BeforeValidator, ConfigDict, field_validator

from drillrig_pin.elements.fields import Name, TreeName, Vector, quantity, reference, sized, split
from drillrig_pin.errors import ModelError
from drillrig_pin.model.nodes import Node


class Declaration(BaseModel):
    """Base: attributes as fields, no force."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    _sized = field_validator("*")(sized)

    tag: ClassVar[str]

    @classmethod
    def from_node(cls, node: Node) -> Self:
        """Build from a file element."""
        return cls.model_validate(node.attributes)


class Gravity(Declaration):
    """Gravitational acceleration of the world; (0, 0, -9.81) where the file says nothing."""

    tag: ClassVar[str] = "gravity"

    xyz: Vector = quantity("m/s^2", "acceleration in world axes")


class Point(Declaration):
    """A named point, with axes, on a link. Tracked points are reported over time; pins usually are not."""

    tag: ClassVar[str] = "point"

    name: Name
    link: TreeName = reference("link that carries it")
    xyz: Vector = quantity("m", "position in the link's frame", default=(0.0, 0.0, 0.0))
    rpy: Vector = quantity("rad", "axes: roll, pitch, yaw in the link's frame", default=(0.0, 0.0, 0.0))
    track: bool = reference("true: reported over time", default=True)


class PoseJoint(Declaration):
    """Position of one joint in a pose."""

    tag: ClassVar[str] = "joint"

    name: TreeName
    position: Annotated[tuple[float, ...], BeforeValidator(split)] = quantity(
        "rad or m", "position; for a floating joint x y z qx qy qz qw", min_length=1, max_length=7
    )


class Pose(Declaration):
    """A named configuration; joints it does not name are at zero. Holds `<joint name position/>` children."""

    tag: ClassVar[str] = "pose"

    name: Name
    joints: tuple[PoseJoint, ...] = ()

    @classmethod
    def from_node(cls, node: Node) -> Self:
        """Joints come from the children."""
        wrong = next((child for child in node.children if child.tag != "joint"), None)
        if wrong is not None:
            raise ModelError(f"<{wrong.tag}> does not belong in a pose", where=wrong.source, todo="Legal: joint.")
        return cls.model_validate({**node.attributes, "joints": tuple(map(PoseJoint.from_node, node.children))})


class Lock(Declaration):
    """Joints that do not move in this study, as wheels. They stay where `position` or the first pose puts them.

    A locked joint has no coordinate, no friction and no limit; results name it in a note.
    """

    tag: ClassVar[str] = "lock"

    joints: Annotated[tuple[str, ...], BeforeValidator(split)] = reference(
        "names or regular expressions of whole names, e.g. `wheel_.* outrigger_pin`", min_length=1
    )
    position: float | None = quantity("rad or m", "where they stand; none: in the first pose, or zero", default=None)


class ParameterRow(Declaration):
    """One row of the parameter table that the expanded file carries: where every number comes from."""

    tag: ClassVar[str] = "parameter"

    name: Name
    value: str = reference("value in force")
    default: str = reference("value if the user gives none", default="")
    unit: str = reference("unit", default="")
    source: str = reference("`paper: ...`, `derived: ...` or `assumed: ...`", default="")
    text: str = reference("meaning", default="")


DECLARATIONS: dict[str, type[Declaration]] = {cls.tag: cls for cls in (Gravity, Point, Pose, Lock, ParameterRow)}
