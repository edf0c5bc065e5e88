"""The locked hydraulic cylinder: two trapped oil volumes, exact logarithmic law ([Tram2023] eqs. (28)-(34))."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np
from pydantic import Field

from drillrig_pin.coordinates import Coordinate, Line
from drillrig_pin.elements.base import Element, Law, Resolver
from drillrig_pin.elements.fields import Name, quantity, reference
from drillrig_pin.kinematics import Array

#: Standard atmosphere [Pa]. The force law takes gauge pressures; limits of the oil are absolute.
ATMOSPHERE = 101_325.0
#: Absolute pressure [Pa] below which a column of oil is taken to tear, where a model does not say: custom, assumed.
VAPOUR_PRESSURE = 1e4


@dataclass(frozen=True, slots=True)
class LockedOil(Law):
    """Both valves shut, no leakage. With u = x - x0 the piston displacement, positive when the rod extends:

        p_A = p_A0 - E0 ln(1 + u / l_A)                    (33)
        p_B = p_B0 - E0 ln(1 - u / l_B)                    (34), chamber B shrinks when the rod extends
        F   = p_A S_A - p_B S_B - k x_dot                  (28)
        U   = -F0 u + E0 S_A ((l_A + u) ln(1 + u/l_A) - u) + E0 S_B ((l_B - u) ln(1 - u/l_B) + u)

    with F0 = p_A0 S_A - p_B0 S_B; U is the exact integral of -F at k = 0.

    Attributes:
        x0: length at which the valves were shut [m].
        E0: bulk modulus of the oil [Pa].
        S_A, S_B: piston and annulus area [m^2].
        l_A, l_B: initial chamber lengths V_0 / S [m].
        p_A0, p_B0: initial pressures [Pa gauge].
        k: viscous friction of the piston [N s/m].
    """

    stackable: ClassVar[bool] = True

    x0: float
    E0: float
    S_A: float
    S_B: float
    l_A: float
    l_B: float
    p_A0: float
    p_B0: float
    k: float

    def strains(self, x: Array) -> tuple[Array, Array]:
        """Logarithmic strains ln(1 + u / l_A) and ln(1 - u / l_B) of the two oil columns."""
        u = x - self.x0
        return np.log1p(u / self.l_A), np.log1p(-u / self.l_B)

    def pressures(self, x: Array, strains: tuple[Array, Array] | None = None) -> tuple[Array, Array]:
        """Chamber pressures p_A, p_B [Pa gauge]; `strains` if they are known already."""
        e_A, e_B = strains or self.strains(x)
        return self.p_A0 - self.E0 * e_A, self.p_B0 - self.E0 * e_B

    def lengths_at(self, pressure: Array) -> tuple[Array, Array]:
        """Lengths x at which p_A, and at which p_B, is a gauge pressure [m]. p_A falls with x, p_B grows with it."""
        with np.errstate(over="ignore"):
            u_A = self.l_A * np.expm1((self.p_A0 - pressure) / self.E0)
            return self.x0 + u_A, self.x0 + self._u_B(pressure)

    def _u_B(self, pressure: Array) -> Array:
        return -self.l_B * np.expm1((self.p_B0 - pressure) / self.E0)

    def force(self, x: Array, xdot: Array, t: float) -> Array:
        """Force that pushes the pins apart [N]."""
        p_A, p_B = self.pressures(x)
        return p_A * self.S_A - p_B * self.S_B - self.k * xdot

    def energy(self, x: Array, strains: tuple[Array, Array] | None = None) -> Array:
        """Elastic energy of the two oil columns, zero at u = 0 [J]; `strains` if they are known already."""
        e_A, e_B = strains or self.strains(x)
        u = x - self.x0
        F0 = self.p_A0 * self.S_A - self.p_B0 * self.S_B
        return -F0 * u + self.E0 * (self.S_A * ((self.l_A + u) * e_A - u) + self._energy_B(u, e_B))

    def _energy_B(self, u: Array, e_B: Array) -> Array:
        return self.S_B * ((self.l_B - u) * e_B + u)

    def dissipation(self, x: Array, xdot: Array) -> Array:
        """Power lost to piston friction k x_dot^2 [W]."""
        return self.k * xdot**2

    def stiffness(self) -> Array:
        """Tangent stiffness E0 (S_A / l_A + S_B / l_B) at u = 0 [N/m]."""
        return self.E0 * (self.S_A / self.l_A + self.S_B / self.l_B)  # type: ignore[return-value]


@dataclass(frozen=True, slots=True)
class LockedOilAsPrinted(LockedOil):
    """Chamber B as the paper prints it, p_B = p_B0 + E0 ln(1 + u / l_B): the same to first order in u."""

    def strains(self, x: Array) -> tuple[Array, Array]:
        """Logarithms ln(1 + u / l_A) and ln(1 + u / l_B) of equations (33) and (34), to the letter."""
        u = x - self.x0
        return np.log1p(u / self.l_A), np.log1p(u / self.l_B)

    def pressures(self, x: Array, strains: tuple[Array, Array] | None = None) -> tuple[Array, Array]:
        """Chamber pressures p_A, p_B [Pa gauge], equations (33) and (34) to the letter."""
        e_A, e_B = strains or self.strains(x)
        return self.p_A0 - self.E0 * e_A, self.p_B0 + self.E0 * e_B

    def _u_B(self, pressure: Array) -> Array:
        return self.l_B * np.expm1((pressure - self.p_B0) / self.E0)

    def _energy_B(self, u: Array, e_B: Array) -> Array:
        return self.S_B * ((self.l_B + u) * e_B - u)


class Cylinder(Element):
    """Hydraulic cylinder locked by check valves, between two points. It pushes them apart with positive force.

    Pin to pin length runs from `length_retracted` to `length_retracted + stroke`, with
    stroke = length_retracted - dead_length_a - dead_length_b. Initial pressures follow from static equilibrium: the
    less loaded chamber holds `precharge`, the other whatever the static force asks for.
    """

    tag: ClassVar[str] = "cylinder"

    start: Name = Field(alias="from", description="point of the barrel's pin", json_schema_extra={"unit": ""})
    end: Name = Field(alias="to", description="point of the rod's pin", json_schema_extra={"unit": ""})
    bore: float = quantity("m", "bore D; piston area S_A = pi D^2 / 4", gt=0)
    rod: float = quantity("m", "rod diameter d; annulus area S_B = pi (D^2 - d^2) / 4", gt=0)
    length_retracted: float = quantity("m", "pin to pin length, fully retracted", gt=0)
    dead_length_a: float = quantity("m", "dead length l1 at the barrel's end", ge=0)
    dead_length_b: float = quantity("m", "dead length l2 at the rod's end", ge=0)
    bulk_modulus: float = quantity("Pa", "bulk modulus E0 of the oil", gt=0)
    friction: float = quantity("N*s/m", "viscous friction k of the piston", default=0.0, ge=0)
    precharge: float = quantity("Pa", "gauge pressure of the less loaded chamber at rest", default=0.0, ge=0)
    relief_pressure: float = quantity("Pa", "gauge pressure above which a run warns", default=21e6, gt=0)
    vapour_pressure: float = quantity(
        "Pa",
        "absolute pressure below which the oil tears and a run is not valid; the default is assumed",
        default=VAPOUR_PRESSURE,
        ge=0,
        lt=ATMOSPHERE,
    )
    law: Literal["geometric", "printed"] = reference(
        "pressure of chamber B: from the geometry, or as printed in the paper", default="geometric"
    )

    @property
    def holding(self) -> bool:
        """Its valves are shut: it carries whatever equilibrium asks for."""
        return True

    @property
    def piston_area(self) -> float:
        """S_A [m^2]."""
        return math.pi * self.bore**2 / 4

    @property
    def annulus_area(self) -> float:
        """S_B [m^2]."""
        return math.pi * (self.bore**2 - self.rod**2) / 4

    @property
    def stroke(self) -> float:
        """Full travel of the piston [m]."""
        return self.length_retracted - self.dead_length_a - self.dead_length_b

    @property
    def length_range(self) -> tuple[float, float]:
        """Shortest and longest pin to pin length [m]."""
        return self.length_retracted, self.length_retracted + self.stroke

    def fault(self) -> str | None:
        """What makes the numbers impossible together, or None."""
        if self.rod >= self.bore:
            return f"the rod ({self.rod:g} m) is not thinner than the bore ({self.bore:g} m)"
        if self.stroke <= 0:
            return "length_retracted leaves no stroke beside the dead lengths"
        return None

    def coordinate(self, resolver: Resolver) -> Coordinate:
        """Pin to pin distance."""
        return Line(resolver.point(self.start), resolver.point(self.end))

    def rest_pressures(self, held: float) -> tuple[float, float]:
        """Gauge pressures p_A0, p_B0 [Pa] that carry the static force ``held`` [N], one chamber at ``precharge``."""
        S_A, S_B, p = self.piston_area, self.annulus_area, self.precharge
        if held >= p * (S_A - S_B):
            return (held + p * S_B) / S_A, p
        return p, (p * S_A - held) / S_B

    def hold_stiffness(self, x0: float) -> float:
        """E0 (S_A / l_A + S_B / l_B) of the oil locked at length x0 [N/m]; chambers of 1 mm at least."""
        l_A = min(max(x0 - self.length_retracted, 1e-3), self.stroke - 1e-3)
        return self.bulk_modulus * (self.piston_area / l_A + self.annulus_area / (self.stroke - l_A))

    def bind(self, x0: float, held: float) -> LockedOil:
        """Shut the valves at length x0 while the cylinder carries ``held``."""
        p_A0, p_B0 = self.rest_pressures(held)
        l_A = x0 - self.length_retracted
        law = LockedOil if self.law == "geometric" else LockedOilAsPrinted
        S_A, S_B = self.piston_area, self.annulus_area
        return law(x0, self.bulk_modulus, S_A, S_B, l_A, self.stroke - l_A, p_A0, p_B0, self.friction)
