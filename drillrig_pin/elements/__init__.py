"""Force elements: one contract (:mod:`~drillrig_pin.elements.base`), one file per family of laws."""

from drillrig_pin.coordinates import JointCoordinate, Line, Slide, Turn
from drillrig_pin.elements.base import Element, Law, PluginElement, Resolver
from drillrig_pin.elements.fields import Direction, Name, quantity, reference

__all__ = [
    "Direction",
    "Element",
    "JointCoordinate",
    "Law",
    "Line",
    "Name",
    "PluginElement",
    "Resolver",
    "Slide",
    "Turn",
    "quantity",
    "reference",
]
