"""The tip on the rock: spring and damper along the drilling axis ([Tram2023] eqs. (23)-(27))."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from drillrig_pin.coordinates import Coordinate, Slide
from drillrig_pin.elements.base import Element, Law, Resolver
from drillrig_pin.elements.fields import Direction, Name, quantity, reference
from drillrig_pin.kinematics import Array, world_direction, world_point


@dataclass(frozen=True, slots=True)
class BilateralContact(Law):
    """F = -(N0 + c u + k u_dot), u = x - x0: the paper's law (27) with a static pressing force N0 added.

    It also pulls; the report says for how long it did.
    """

    stackable: ClassVar[bool] = True

    x0: float
    N0: float
    c: float
    k: float

    def force(self, x: Array, xdot: Array, t: float) -> Array:
        """Force on the tip along the drilling axis [N]; negative: the face pushes the tip back."""
        return -(self.N0 + self.c * (x - self.x0) + self.k * xdot)

    def energy(self, x: Array) -> Array:
        """N0 u + c u^2 / 2 [J]."""
        u = x - self.x0
        return (self.N0 + 0.5 * self.c * u) * u

    def dissipation(self, x: Array, xdot: Array) -> Array:
        """k x_dot^2 [W]."""
        return self.k * xdot**2


@dataclass(frozen=True, slots=True)
class UnilateralContact(BilateralContact):
    """The same law while the tip touches and pushes, nothing otherwise.

    With the penetration d = u + N0 / c:  F = -max(0, c d + k d_dot) if d > 0, else 0;  U = c d^2 / 2 for d > 0.
    What the clipped damper does not give back is dissipated: D = N d_dot - c d d_dot with N = -F.
    """

    def force(self, x: Array, xdot: Array, t: float) -> Array:
        """Force on the tip along the drilling axis [N], never positive."""
        depth = x - self.x0 + self.N0 / self.c
        return np.where(depth > 0, -np.maximum(0.0, self.c * depth + self.k * xdot), 0.0)

    def energy(self, x: Array) -> Array:
        """Elastic energy of the pressed rock [J]."""
        depth = np.maximum(0.0, x - self.x0 + self.N0 / self.c)
        return 0.5 * self.c * depth**2

    def dissipation(self, x: Array, xdot: Array) -> Array:
        """Power that is not stored [W]."""
        depth = np.maximum(0.0, x - self.x0 + self.N0 / self.c)
        return -(self.force(x, xdot, 0.0) + self.c * depth) * xdot

    def switches(self, x: Array, xdot: Array) -> Array:
        """Touching (d = 0) and letting go (c d + k d_dot = 0)."""
        depth = x - self.x0 + self.N0 / self.c
        return np.concatenate([depth, self.c * depth + self.k * xdot])


class Contact(Element):
    """Rock under a point, one-dimensional along a world axis that points into the rock.

    Force on the point = -axis (preload + stiffness (x - x0) + damping x_dot), x = axis . p, x0 its initial value.
    """

    tag: ClassVar[str] = "contact"

    point: Name = reference("point that touches the rock")
    axis: Direction = quantity("-", "world axis into the rock", default=(1.0, 0.0, 0.0))
    stiffness: float = quantity("N/m", "stiffness c_D of rock and foot", gt=0)
    damping: float = quantity("N*s/m", "damping k_D", default=0.0, ge=0)
    preload: float = quantity("N", "force with which the point is pressed on at rest", default=0.0, ge=0)
    mode: Literal["bilateral", "unilateral"] = reference(
        "bilateral: also pulls, as in the paper; unilateral: the point may lift off", default="bilateral"
    )

    def coordinate(self, resolver: Resolver) -> Coordinate:
        """Position of the point along the axis."""
        return Slide(resolver.point(self.point), world_direction(self.axis), world_point())

    def bind(self, x0: float, held: float) -> BilateralContact:
        """Pressed on with the preload at x0."""
        law = BilateralContact if self.mode == "bilateral" else UnilateralContact
        return law(x0, self.preload, self.stiffness, self.damping)
