"""Springs with dampers, on a joint or between two points, and the constant joint torque."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from pydantic import Field

from drillrig_pin.coordinates import Coordinate, Line
from drillrig_pin.elements.base import Element, Law, Resolver
from drillrig_pin.elements.fields import InitialOrNumber, Name, TreeName, quantity, reference
from drillrig_pin.kinematics import Array


@dataclass(frozen=True, slots=True)
class SpringDamper(Law):
    """F = F0 - c (x - x0) - k x_dot,  U = -F0 (x - x0) + c (x - x0)^2 / 2,  D = k x_dot^2.

    As M_4 in [Tram2023] eqs. (48)-(49), c is the stiffness and k the damping coefficient.
    """

    stackable: ClassVar[bool] = True

    x0: float
    F0: float
    c: float
    k: float

    def force(self, x: Array, xdot: Array, t: float) -> Array:
        """Restoring force [N or N m]."""
        return self.F0 - self.c * (x - self.x0) - self.k * xdot

    def energy(self, x: Array) -> Array:
        """Elastic energy, zero at x0 [J]."""
        u = x - self.x0
        return (0.5 * self.c * u - self.F0) * u

    def dissipation(self, x: Array, xdot: Array) -> Array:
        """k x_dot^2 [W]."""
        return self.k * xdot**2


@dataclass(frozen=True, slots=True)
class ConstantForce(Law):
    """F = F0, stored as the potential U = -F0 x."""

    stackable: ClassVar[bool] = True

    F0: float

    def force(self, x: Array, xdot: Array, t: float) -> Array:
        """F0 whatever the state."""
        return self.F0 + np.zeros_like(x)

    def energy(self, x: Array) -> Array:
        """-F0 x [J]."""
        return -self.F0 * x


class JointSpring(Element):
    """Spring and damper on one joint, e.g. the coupling moment M_4 of the boom head.

    With `rest="initial"` the spring is relaxed at the initial state except for the static moment that equilibrium asks
    of it (its offset); with a number it is relaxed there.
    """

    tag: ClassVar[str] = "joint_spring"

    joint: TreeName = reference("revolute or prismatic joint")
    stiffness: float = quantity("N*m/rad or N/m", "stiffness c", ge=0)
    damping: float = quantity("N*m*s/rad or N*s/m", "damping k", default=0.0, ge=0)
    rest: InitialOrNumber = quantity("rad or m", "joint position at which it is relaxed", default="initial")

    @property
    def holding(self) -> bool:
        """Whether its static moment is found from equilibrium."""
        return self.rest == "initial" and self.stiffness > 0

    def coordinate(self, resolver: Resolver) -> Coordinate:
        """The joint's own coordinate."""
        return resolver.joint(self.joint)

    def hold_stiffness(self, x0: float) -> float:
        """Of the spring [N/m or N m/rad]."""
        return self.stiffness

    def bind(self, x0: float, held: float) -> SpringDamper:
        """Relaxed at x0 up to the static moment, or at the given position."""
        return SpringDamper(x0 if self.rest == "initial" else float(self.rest), held, self.stiffness, self.damping)


class Spring(Element):
    """Spring and damper between two points. Positive force pushes them apart."""

    tag: ClassVar[str] = "spring"

    start: Name = Field(alias="from", description="first point", json_schema_extra={"unit": ""})
    end: Name = Field(alias="to", description="second point", json_schema_extra={"unit": ""})
    stiffness: float = quantity("N/m", "stiffness c", ge=0)
    damping: float = quantity("N*s/m", "damping k", default=0.0, ge=0)
    rest_length: InitialOrNumber = quantity("m", "length at which it is relaxed", default="initial")

    @property
    def holding(self) -> bool:
        """Whether its static force is found from equilibrium."""
        return self.rest_length == "initial" and self.stiffness > 0

    def coordinate(self, resolver: Resolver) -> Coordinate:
        """Distance of the two points."""
        return Line(resolver.point(self.start), resolver.point(self.end))

    def hold_stiffness(self, x0: float) -> float:
        """Of the spring [N/m or N m/rad]."""
        return self.stiffness

    def bind(self, x0: float, held: float) -> SpringDamper:
        """Relaxed at x0 up to the static force, or at the given length."""
        rest = x0 if self.rest_length == "initial" else float(self.rest_length)
        return SpringDamper(rest, held, self.stiffness, self.damping)


class JointTorque(Element):
    """Constant torque (force on a prismatic joint) that always acts, also at rest: a counterweight, a motor's hold."""

    tag: ClassVar[str] = "joint_torque"

    joint: TreeName = reference("revolute or prismatic joint")
    value: float = quantity("N*m or N", "torque along the joint's axis")

    def coordinate(self, resolver: Resolver) -> Coordinate:
        """The joint's own coordinate."""
        return resolver.joint(self.joint)

    def bind(self, x0: float, held: float) -> ConstantForce:
        """Nothing depends on the initial state."""
        return ConstantForce(self.value)
