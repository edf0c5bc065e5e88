"""Which element of a model file is which class: the built-in ones, and those of installed packages."""

from __future__ import annotations

from functools import lru_cache
from importlib.metadata import entry_points

from drillrig_pin.elements.base import Element
from drillrig_pin.elements.contact import Contact
from drillrig_pin.elements.cylinder import Cylinder
from drillrig_pin.elements.friction import JointFriction
from drillrig_pin.elements.loads import Load
from drillrig_pin.elements.springs import JointSpring, JointTorque, Spring
from drillrig_pin.errors import ModelError

#: Entry point group in which a package offers further elements; the entry's name is the tag.
GROUP = "drillrig_pin.elements"

FORCES: dict[str, type[Element]] = {
    cls.tag: cls for cls in (Cylinder, JointSpring, Spring, Contact, Load, JointTorque, JointFriction)
}


@lru_cache(maxsize=1)
def plugin_tags() -> frozenset[str]:
    """Tags offered by installed packages."""
    return frozenset(entry.name for entry in entry_points(group=GROUP))


def force_class(tag: str) -> type[Element] | None:
    """The element class of a tag, or None; a plugin is imported only when a model names it."""
    if tag in FORCES:
        return FORCES[tag]
    if tag not in plugin_tags():
        return None
    (entry, *_) = entry_points(group=GROUP, name=tag)
    try:
        cls = entry.load()
    except Exception as error:
        # Code of another package: whatever it raises, the model cannot be read with it.
        reason = " ".join(str(error).split()) or type(error).__name__
        raise ModelError(
            f"the element <{tag}> cannot be imported ({reason})",
            where=entry.value,
            todo="Repair or reinstall the package that offers it.",
        ) from None
    if not (isinstance(cls, type) and issubclass(cls, Element)):
        raise ModelError(
            f"the entry point {tag!r} of group {GROUP} is not an Element class",
            where=entry.value,
            todo="Let it name a subclass of drillrig_pin.elements.Element.",
        )
    return cls
