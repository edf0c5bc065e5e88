"""Units of the columns of a result whose variable holds angles and distances alike."""

from __future__ import annotations

from functools import lru_cache

from drillrig_pin.model.modelfile import BLOCK
from drillrig_pin.model.nodes import parse_bytes, root_element, take_nodes


def unit_of(unit: str, column: str, model: str) -> str:
    """Unit of one column.

    Args:
        unit: that of its variable; where it reads ``rad or m``, ``N or N*m``, the model decides.
        column: joint, dof or element, e.g. ``boom_swing``.
        model: expanded model text; empty: the column is of no joint, and the unit stays as given.

    Returns:
        ``rad`` or ``m`` where the model tells; both, as given, for elements of a class that is not known here.
    """
    first, _, second = unit.partition(" or ")
    if not second or not model:
        return unit
    if column.rpartition(".")[2] in ("qx", "qy", "qz", "qw"):
        return "1"
    slides = _slides(model).get(column)
    if slides is None:
        return unit
    angular, linear = (first, second) if first.startswith("rad") else (second, first)
    return linear if slides else angular


@lru_cache(maxsize=4)
def _slides(model: str) -> dict[str, bool]:
    """Which joint columns and elements of a model are distances (True) or angles (False); others are missing."""
    root = take_nodes(root_element(parse_bytes(model.encode(), "<model>")))
    found: dict[str, bool] = {}
    for joint in root.named("joint"):
        name, kind = joint.attributes.get("name", ""), joint.attributes.get("type", "")
        if kind == "floating":
            found |= {f"{name}.{part}": True for part in ("x", "y", "z", "vx", "vy", "vz")}
            found |= {f"{name}.{part}": False for part in ("wx", "wy", "wz")}
        else:
            found[name] = kind == "prismatic"
    for block in root.named(BLOCK):
        for element in block.children:
            joint_name = element.attributes.get("joint", "")
            if joint_name in found:
                found[element.attributes.get("name", "")] = found[joint_name]
            elif element.tag in ("spring", "contact"):
                found[element.attributes.get("name", "")] = True
    return found
