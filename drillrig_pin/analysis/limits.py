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
from drillrig_pin.yamlfile import read_fields

#: Units by what is limited; the first one is meant where none is written.
LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}
ANGLES = {"deg": math.pi / 180, "°": math.pi / 180, "rad": 1.0, "mrad": 1e-3}
NAMES = ("angle", "collar", "shake", *(toe_name(depth) for depth in DEPTHS))
_TOE = re.compile(r"toe_(\d+(?:\.\d+)?)m")


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

    A value is a number with or without unit (``0.1``, ``100mm``, ``0.5deg``; metres and degrees are meant without), or
    ``none`` to lift the limit. In a file it may also be a row of value, unit and source.

    Raises:
        ScenarioError: unreadable, an unknown name, a value that is no positive length or angle.
    """
    path = file or shipped_folder() / "limits.yaml"
    rows, lines = read_fields(path, "a file of limits")
    limits: dict[str, Limit] = {}
    for name, entry in rows.items():
        source = lines.file
        if isinstance(entry, dict):
            source = str(entry.get("source", source))
            entry = f"{entry.get('value')}{entry.get('unit', '')}"
        _put(limits, name, str(entry), source, lines.at((name,)))
    for setting in settings:
        name, equals, text = setting.partition("=")
        if not equals:
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
    match = re.fullmatch(r"\s*([-+.\deE]+?)\s*([a-zA-Z°]*)\s*", text)
    try:
        value = float(match.group(1)) * units[match.group(2) or next(iter(units))] if match else math.nan
    except (ValueError, KeyError):
        value = math.nan
    if not (math.isfinite(value) and value > 0):
        todo = f"Give a positive number, in {' or '.join(units)}; without unit {next(iter(units))} is meant."
        raise ScenarioError(f"limit {name} = {text.strip()[:40]!r} cannot be used", where=where, todo=todo)
    limits[name] = Limit(name, value, source)
