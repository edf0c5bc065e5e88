"""Friction in a joint: viscous, dry, or both; also what URDF's own <dynamics> says."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from drillrig_pin.coordinates import Coordinate
from drillrig_pin.elements.base import Element, Law, Remark, Resolver
from drillrig_pin.elements.fields import TreeName, quantity, reference
from drillrig_pin.errors import ModelError
from drillrig_pin.kinematics import Array
from drillrig_pin.model.nodes import Node
from drillrig_pin.model.numbers import vector
from drillrig_pin.model.tree_text import child

#: Speed below which dry friction is smoothed [rad/s or m/s] where the model gives none. Assumed.
CREEP = 1e-3


@dataclass(frozen=True, slots=True)
class FrictionLaw(Law):
    """F = -k x_dot - F_c tanh(x_dot / w),  D = k x_dot^2 + F_c x_dot tanh(x_dot / w).

    Coulomb's F_c sign(x_dot), made smooth over the speed w: nothing sticks, it creeps at less than about w.
    """

    stackable: ClassVar[bool] = True

    k: float
    F_c: float
    w: float

    def force(self, x: Array, xdot: Array, t: float) -> Array:
        """Against the motion [N or N m]."""
        return -self.k * xdot - self.F_c * np.tanh(xdot / self.w)

    def dissipation(self, x: Array, xdot: Array) -> Array:
        """-F x_dot [W]."""
        return (self.k * xdot + self.F_c * np.tanh(xdot / self.w)) * xdot


class JointFriction(Element):
    """Friction in a joint, F = -damping v - friction tanh(v / creep): viscous and dry, the latter smoothed around rest.

    It carries nothing at rest: under a load below `friction` the joint creeps, slower than about `creep`. URDF's
    `<dynamics damping="..." friction="..."/>` in a joint is read as this element, named after the joint, with the
    default `creep`.
    """

    tag: ClassVar[str] = "joint_friction"

    joint: TreeName = reference("revolute, continuous or prismatic joint")
    damping: float = quantity("N*m*s/rad or N*s/m", "viscous", default=0.0, ge=0)
    friction: float = quantity("N*m or N", "dry (Coulomb)", default=0.0, ge=0)
    creep: float = quantity("rad/s or m/s", "speed over which the dry part is smoothed; assumed", default=CREEP, gt=0)

    def remarks(self) -> list[Remark]:
        """That dry friction is smoothed."""
        if self.friction == 0:
            return []
        words = (
            f"{self.name}: dry friction of {self.friction:g} N or N m is smoothed: it creeps below "
            f"{self.creep:g} rad/s or m/s instead of sticking"
        )
        return [Remark(words + (" (assumed)" if self.creep == CREEP else ""))]

    def coordinate(self, resolver: Resolver) -> Coordinate:
        """The joint's own coordinate."""
        return resolver.joint(self.joint)

    def bind(self, x0: float, held: float) -> FrictionLaw:
        """Nothing depends on the initial state."""
        return FrictionLaw(self.damping, self.friction, self.creep)


def friction_of_joints(root: Node) -> Iterator[tuple[JointFriction, Node]]:
    """What the <dynamics> of every joint with one dof says, with its node; nothing for numbers that are all zero.

    Raises:
        ModelError: a negative coefficient.
    """
    for joint in root.named("joint"):
        node, name = child(joint, "dynamics"), joint.attributes.get("name", "")
        if node is None or joint.attributes.get("type") not in ("revolute", "continuous", "prismatic"):
            continue
        damping, friction = (vector(node, key, (0.0,))[0] for key in ("damping", "friction"))
        if min(damping, friction) < 0:
            raise ModelError(
                f"joint {name!r}: <dynamics> has a negative coefficient", where=node.source, todo="Friction brakes."
            )
        if damping or friction:
            # Any name that URDF allows a joint is legal here.
            yield (
                JointFriction.model_construct(
                    name=f"{name}.friction", joint=name, damping=damping, friction=friction, creep=CREEP
                ),
                node,
            )
