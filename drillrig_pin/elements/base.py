"""The contract of everything that pushes: a coordinate x(q) times a scalar law F(x, x_dot, t).

An :class:`Element` is what the model file says: names, numbers, units. Once the initial state is known it is bound to a
:class:`Law`, which reports force, stored energy and dissipated power, so that any model's energy can be audited:

    F x_dot = -dU/dt - D            for every element that is not a load.

Positive F drives x up: for a line it pushes the two points apart.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any, ClassVar, Protocol, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, field_validator

from drillrig_pin.coordinates import Coordinate
from drillrig_pin.elements.fields import Name, sized
from drillrig_pin.kinematics import Anchor, Array
from drillrig_pin.model.nodes import Node


@dataclasses.dataclass(frozen=True, slots=True)
class Remark:
    """Something to be said about an element; with ``advice`` it is doubtful, and `drillrig check` warns of it."""

    text: str
    advice: str = ""


class Law:
    """A scalar force law. Built-in laws are frozen dataclasses of floats, so many of one class stack into arrays.

    All arguments and results are arrays over the stacked elements (length 1 for a single one).
    """

    stackable: ClassVar[bool] = False

    def force(self, x: Array, xdot: Array, t: float) -> Array:
        """Generalised force F along x [N or N m]."""
        raise NotImplementedError

    def energy(self, x: Array) -> Array:
        """Stored energy U(x) [J]; only its changes mean anything."""
        return np.zeros_like(x)

    def dissipation(self, x: Array, xdot: Array) -> Array:
        """Dissipated power D [W], never negative."""
        return np.zeros_like(x)

    def switches(self, x: Array, xdot: Array) -> Array | None:
        """Functions whose sign change marks a switch of the law; the integrator ends a step there. None: smooth."""
        return None

    def breakpoints(self) -> Array:
        """Times at which the law is not smooth; the integrator ends a step there.

        A law that depends on time and does not say so is looked at a dozen times a millisecond at least. What is
        shorter, a pulse of a tenth of a millisecond, may be stepped over: name its start and its end here.
        """
        return np.zeros(0)

    def jumps(self) -> Array:
        """Those breakpoints at which the force may jump: a step ends just before it, the next begins just behind."""
        return self.breakpoints()

    def frequencies(self) -> Array:
        """Frequencies of a load that varies with time [Hz]; the rows of a run are close enough to show them."""
        return np.zeros(0)

    @classmethod
    def stack(cls, laws: Sequence[Self]) -> Self:
        """One law whose fields are arrays over the given ones."""
        names = [f.name for f in dataclasses.fields(cls)]  # type: ignore[arg-type]
        return cls(**{name: np.array([getattr(law, name) for law in laws]) for name in names})


#: Stiffness that counts as positive [N/m or N m/rad].
STIFFNESS_LEAST = 1e-12


class Resolver(Protocol):
    """Turns the names of a model file into anchors; raises ModelError with the legal names."""

    def point(self, name: str) -> Anchor:
        """The named point."""

    def direction(self, point: str, axis: tuple[float, float, float], frame: str) -> Anchor:
        """A unit direction given in the axes of ``point`` (frame 'body') or of the world (frame 'world')."""

    def joint(self, name: str) -> Coordinate:
        """The coordinate of a joint with one dof."""

    def slides(self, joint: str) -> bool:
        """True if the position of a joint with one dof is a distance."""


class Element(BaseModel):
    """One element of the model file. Subclasses declare attributes as fields; that is also their grammar."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", populate_by_name=True, allow_inf_nan=False, arbitrary_types_allowed=True
    )

    _sized = field_validator("*")(sized)

    tag: ClassVar[str]
    #: True for drilling loads: they do work on the machine, are absent at rest and can be switched off.
    load: ClassVar[bool] = False

    name: Name

    @property
    def holding(self) -> bool:
        """True if its force at rest is not its own but found from static equilibrium."""
        return False

    def fault(self) -> str | None:
        """What makes the numbers impossible together, or None."""
        return None

    def remarks(self) -> list[Remark]:
        """What was decided when it was read: notes of every run."""
        return []

    @classmethod
    def from_node(cls, node: Node) -> Self:
        """Build from a file element; pydantic's ValidationError tells what does not fit."""
        return cls.model_validate(node.attributes)

    def coordinate(self, resolver: Resolver) -> Coordinate:
        """The coordinate the force acts along."""
        raise NotImplementedError

    def bind(self, x0: float, held: float) -> Law:
        """The law once the initial state is known.

        Args:
            x0: initial value of the coordinate [m or rad].
            held: static force the element carries there [N or N m]; 0 unless ``holding``.
        """
        raise NotImplementedError

    def hold_stiffness(self, x0: float) -> float:
        """k = -dF/dx at the start [N/m or N m/rad], by which ``holding`` elements share what balance leaves open.

        Here the slope of the bound law by central differences; override it where it is known.
        """
        h = 1e-6 * max(1e-3, abs(x0))
        law, zero = self.bind(x0, 0.0), np.zeros(1)
        low, high = (float(np.ravel(law.force(np.array([x]), zero, 0.0))[0]) for x in (x0 - h, x0 + h))
        return max((low - high) / (2.0 * h), STIFFNESS_LEAST)


class PluginElement(Element, Law):
    """Base for elements of users: fields, ``coordinate`` and ``force`` in one class."""

    def bind(self, x0: float, held: float) -> Law:
        """The element is its own law; override to remember x0."""
        return self

    @classmethod
    def stack(cls, laws: Sequence[Any]) -> Any:
        """Plugins are evaluated one by one."""
        raise NotImplementedError
