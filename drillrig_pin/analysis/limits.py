"""Limits a run is judged by. They are the user's; the shipped ones are examples and marked as assumed."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from drillrig_pin.analysis.hole_quality import DEPTHS, toe_name
from drillrig_pin.errors import ScenarioError, legal_names
from drillrig_pin.files import shipped_folder
from drillrig_pin.yamlfile import read_fields, require_fields

#: Units by what is limited. A number without one is refused: nobody who writes 100 means metres.
LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}
ANGLES = {"deg": math.pi / 180, "°": math.pi / 180, "rad": 1.0, "mrad": 1e-3}
NAMES = ("angle", "collar", "shake", *(toe_name(depth) for depth in DEPTHS))
_TOE = re.compile(r"toe_(\d+(?:\.\d+)?)m")
_VALUE = re.compile(r"\s*([-+.\deE]+?)\s*([a-zA-Z°]*)\s*")
#: Units to propose, for lengths and for angles.
_USUAL = (("mm", "m"), ("deg", "rad"))


@dataclass(frozen=True, slots=True)
class Limit:
    """One limit: ``angle`` [rad], ``collar``, ``shake`` or ``toe_6m`` [m], and where the number comes from."""

    name: str
    value: float
    source: str

    @property
    def assumed(self) -> bool:
        """True for a shipped example that the user has not replaced."""
        return self.source.startswith("assumed")


def read_limits(file: Path | None = None, settings: Iterable[str] = ()) -> dict[str, Limit]:
    """Limits by name: those of a file (the shipped examples if none is given), then ``name=value`` settings.

    A value is a number with its unit (``100mm``, ``0.5deg``), or ``none`` to lift the limit. In a file it may also be a
    row of value, unit and source.

    Raises:
        ScenarioError: unreadable, an unknown name, a value without unit or that is no positive length or angle.
    """
    path = file or shipped_folder() / "limits.yaml"
    rows, lines = read_fields(path, "a file of limits")
    require_fields(rows, path, "a file of limits")
    limits: dict[str, Limit] = {}
    for name, entry in rows.items():
        source = lines.file
        if isinstance(entry, dict):
            source = str(entry.get("source", source))
            entry = f"{entry.get('value')}{entry.get('unit', '')}"
        if entry is None:
            todo = "Write a value, or none to lift the limit."
            raise ScenarioError(f"limit {name} has no value", where=lines.at((name,)), todo=todo)
        _put(limits, name, str(entry), source, lines.at((name,)))
    given: dict[str, str] = {}
    for setting in settings:
        name, equals, text = setting.partition("=")
        if given.setdefault(name.strip(), text.strip()) != text.strip():
            words = f"{name.strip()} is given twice, as {given[name.strip()]!r} and {text.strip()!r}"
            raise ScenarioError(words, where="--limit", todo="Give it once.")
        if not (equals and text.strip()):
            todo = "Write NAME=VALUE, e.g. --limit toe_6m=100mm."
            raise ScenarioError(f"{setting!r} does not say which limit to set", where="--limit", todo=todo)
        _put(limits, name.strip(), text, "given with --limit", "--limit")
    return limits


def limited_depths(limits: Mapping[str, Limit]) -> tuple[float, ...]:
    """Depths at which the toe is projected: the usual ones and those that have a limit [m]."""
    found = {float(match.group(1)) for name in limits if (match := _TOE.fullmatch(name))}
    return tuple(sorted({*DEPTHS, *found}))


def _put(limits: dict[str, Limit], name: str, text: str, source: str, where: object) -> None:
    if name not in NAMES and not _TOE.fullmatch(name):
        raise ScenarioError(f"no limit is called {name!r}", where=where, todo=legal_names(name, NAMES, "limits"))
    if text.strip().lower() in ("none", "null", ""):
        limits.pop(name, None)
        return
    units = ANGLES if name == "angle" else LENGTHS
    match = _VALUE.fullmatch(text)
    try:
        value = float(match[1]) * units.get(match[2], math.nan) if match and match[2] else math.nan
        bare = match is not None and not match[2] and float(match[1]) > 0
    except ValueError:
        value, bare = math.nan, False
    if not (math.isfinite(value) and value > 0):
        shown = text.strip()[:40]
        if bare:
            option = "--limit " if where == "--limit" else ""
            ways = " or ".join(
                f"{option}{name}{'=' if option else ': '}{shown}{unit}" for unit in _USUAL[units is ANGLES]
            )
            raise ScenarioError(f"limit {name} = {shown!r} has no unit", where=where, todo=f"Write {ways}.")
        todo = f"Give a positive number with its unit: {', '.join(units)}."
        raise ScenarioError(f"limit {name} = {shown!r} cannot be used", where=where, todo=todo)
    limits[name] = Limit(name, value, source)
