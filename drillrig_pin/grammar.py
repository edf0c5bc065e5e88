"""The grammar of the extension elements as a page, written from the element classes themselves."""

from __future__ import annotations

import inspect
import typing
from collections.abc import Iterable
from typing import Any

from pydantic import BaseModel
from pydantic_core import PydanticUndefined

from drillrig_pin.constraints import CONSTRAINTS
from drillrig_pin.declarations import DECLARATIONS, PoseJoint
from drillrig_pin.elements.loads import LAWS, Term
from drillrig_pin.elements.problems import attribute_names
from drillrig_pin.elements.registry import FORCES, GROUP
from drillrig_pin.model.urdf_table import ACTS_ELSEWHERE, ROBOT, Element, Use

INTRODUCTION = f"""\
# Grammar of the model file

A model is a URDF file. What URDF has no words for stands in one or more `<drillrig>` blocks directly below `<robot>`;
other readers (Pinocchio, yourdfpy, MuJoCo) skip them. All numbers are SI and radians, vectors are separated by spaces.
A `.xacro` file may compute them; the expanded file is complete by itself.

Names of elements begin with a letter of any script or `_` and go on with letters, digits and `_ . - / :`. Links, joints
and the robot may have any name.

This page is written by `python scripts/write_grammar.py` from the classes that read the elements.

A tag that is not listed here is looked up among the entry points `{GROUP}` of installed packages,
so a package can bring further force elements; `README.md` shows one.
"""


URDF = """\
## What of URDF is read

An element or attribute that is not in this table is a warning of `drillrig check` with its line. Numbers are finite
decimal numbers separated by spaces. `read`: acts on the motion, a fault is an error. `drawn`: looks only, a fault is a
warning. `ignored`: known, and without effect here.
"""


def grammar_page() -> str:
    """The whole page in Markdown."""
    parts = [INTRODUCTION, "## Declarations\n", *_sections({**DECLARATIONS}.values())]
    parts += ["Inside `<pose>`:\n", _section(PoseJoint)]
    parts += ["## Forces\n", *_sections(FORCES.values())]
    parts += ["Inside `<load>`, exactly one of:\n", *_sections(LAWS.values())]
    parts += ["Inside `<harmonics>`:\n", _section(Term), "## Constraints\n", *_sections(CONSTRAINTS.values())]
    return "\n".join([*parts, *_urdf_section()]).rstrip() + "\n"


def _sections(classes: Iterable[type[BaseModel]]) -> list[str]:
    return [_section(cls) for cls in classes]


def _section(cls: type[BaseModel]) -> str:
    tag = getattr(cls, "tag", "")
    lines = [f"### `<{tag}>`\n", inspect.cleandoc(cls.__doc__ or ""), ""]
    lines += ["| attribute | unit | range | default | meaning |", "|---|---|---|---|---|"]
    for name, field in attribute_names(cls).items():
        extra = field.json_schema_extra or {}
        default = "required" if field.default is PydanticUndefined else _shown(field.default)
        meaning = field.description or "name, unique in the model"
        cells = (f"`{name}`", extra.get("unit", ""), _range(field), default, meaning)
        lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    origin = f"`{cls.__module__}.{cls.__name__}`"
    return "\n".join([*lines, "", f"Class {origin}.\n"])


def _range(field: Any) -> str:
    words = [a for a in _literals(field.annotation) if isinstance(a, str)]
    if words:
        return ", ".join(f"`{word}`" for word in words) + (" or a number" if words in (["initial"], ["auto"]) else "")
    signs = {"ge": ">=", "gt": ">", "le": "<=", "lt": "<"}
    bounds = [f"{sign} {getattr(m, key):g}" for m in field.metadata for key, sign in signs.items() if hasattr(m, key)]
    return ", ".join(bounds)


def _literals(annotation: Any) -> list[Any]:
    if typing.get_origin(annotation) is typing.Literal:
        return list(typing.get_args(annotation))
    found: list[Any] = []
    for part in typing.get_args(annotation):
        found += _literals(part)
    return found


def _shown(value: Any) -> str:
    if isinstance(value, bool):
        value = str(value).lower()
    if isinstance(value, tuple):
        value = " ".join(f"{v:g}" if isinstance(v, float) else str(v) for v in value)
    if isinstance(value, float):
        value = f"{value:g}"
    return f"`{value}`" if value != "" else "none"


def _urdf_section() -> list[str]:
    """What of URDF is read, from the table that the checker uses."""
    rows = ["| element | attribute | becomes | meaning, unit; default |", "|---|---|---|---|"]
    words = {Use.READ: "read", Use.LOOKS: "drawn", Use.IGNORED: "ignored"}

    def walk(path: str, element: Element) -> None:
        where = f"`{path}`"
        only = f" ({', '.join(element.joints)} joints; in others ignored)" if element.joints else ""
        inside = "; what stands inside is not looked at" if element.open and element.use is Use.IGNORED else ""
        rows.append(f"| {where} | | {words[element.use]} | {element.text}{only}{inside} |")
        for name, attribute in element.attributes.items():
            needed = "; required" if attribute.required else ""
            rows.append(f"| {where} | `{name}` | {words[attribute.use]} | {attribute.text}{needed} |")
        for tag, child in element.children.items():
            walk(f"{path}/{tag}", child)

    walk("robot", ROBOT)
    named = ", ".join(f"`{tag}`" for tag in ACTS_ELSEWHERE)
    return [URDF, *rows, "", f"In `gazebo` and `mujoco` blocks `check` names what acts on the motion there: {named}.\n"]
