"""Numbers as people read them: significant digits, and the units a designer thinks in."""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any


def number(value: float | None, digits: int = 4) -> str:
    """A number with significant digits, without exponents where they can be helped; a dash for None."""
    if value is None:
        return "–"
    if not math.isfinite(value):
        return str(value)
    if value == 0:
        return "0"
    size = math.floor(math.log10(abs(value)))
    if -4 <= size < 6:
        return f"{value:.{max(0, digits - 1 - size)}f}"
    return f"{value:.{digits - 1}e}"


def decimals(value: float | None, places: int) -> str:
    """A number with fixed decimals, so that a column lines up; a dash for None."""
    return "–" if value is None else f"{value:.{places}f}"


def percent(share: float) -> str:
    """A share of 1 as percent."""
    return f"{100 * share:.1f} %"


#: From SI to what people read: unit, factor, and the least magnitude in SI it suits, largest first.
READ: dict[str, tuple[tuple[str, float, float], ...]] = {
    "m": (("m", 1.0, 0.5), ("mm", 1e3, 1e-4), ("µm", 1e6, 0.0)),
    "rad": (("°", 180 / math.pi, 0.0),),
    "Pa": (("bar", 1e-5, 0.0),),
    "N": (("kN", 1e-3, 1e3), ("N", 1.0, 0.0)),
    "N m": (("kN m", 1e-3, 1e3), ("N m", 1.0, 0.0)),
    "1": (("%", 100.0, 0.0),),
}


def reading(unit: str, size: float) -> tuple[str, float]:
    """Unit and factor in which people read a quantity of this size, given in SI; other units stay as they are."""
    for name, factor, least in READ.get(unit, ()):
        if abs(size) >= least:
            return name, factor
    return unit, 1.0


#: More units people write: factor from SI and unit of SI.
WRITTEN = {
    "deg": (180 / math.pi, "rad"),
    "mrad": (1e3, "rad"),
    "cm": (1e2, "m"),
    "um": (1e6, "m"),
    "kPa": (1e-3, "Pa"),
    "MPa": (1e-6, "Pa"),
    "kNm": (1e-3, "N m"),
    "Nm": (1.0, "N m"),
    "Hz": (1.0, "Hz"),
}


def si(text: str) -> tuple[float, str]:
    """A number with or without unit in SI, e.g. ``2 bar`` as ``(2e5, "Pa")``; the unit is empty where none is written.

    Raises:
        ValueError: no number, or a unit nobody reads here.
    """
    match = re.fullmatch(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*", text)
    if match is None or not math.isfinite(float(match[1])):
        raise ValueError(f"{text!r} is not a number with a unit")
    value, unit = float(match[1]), match[2]
    known = {name: (factor, base) for base, ways in READ.items() for name, factor, _ in ways}
    known |= {base: (1.0, base) for base in READ} | WRITTEN | {"": (1.0, "")}
    if unit not in known:
        raise ValueError(f"{text!r}: there is no unit {unit!r}; units are {', '.join(name for name in known if name)}")
    factor, base = known[unit]
    # Twelve digits: 2.5 bar are 250000 Pa.
    return float(f"{value / factor:.12g}"), base


def quantity(value: float | None, unit: str, digits: int = 3) -> str:
    """A value given in SI with the unit people read it in, e.g. ``0.0123 m`` as ``12.3 mm``; a dash for None.

    Pressures are absolute: one below zero is none, and marked as the tension that the oil's law would need.
    """
    if value is None:
        return "–"
    name, factor = reading(unit, value if value else 1.0)
    space = "" if name == "°" else " "
    return f"{number(value * factor, digits)}{space}{name}".rstrip() + (TENSION if unit == "Pa" and value < 0 else "")


#: Stands behind a pressure below zero.
TENSION = " (tension)"


def absolute(pressure: float, digits: int = 3) -> str:
    """An absolute pressure [Pa] within a sentence, e.g. ``13.7 bar absolute``; below zero marked as tension."""
    name, factor = reading("Pa", pressure)
    return f"{number(pressure * factor, digits)} {name} absolute{TENSION if pressure < 0 else ''}"


def in_one_unit(values: Sequence[float | None], unit: str) -> list[str]:
    """Values given in SI as people read them, all in the unit that suits the largest; a dash for None."""
    name, factor = reading(unit, max((abs(value) for value in values if value is not None), default=1.0) or 1.0)
    return ["–" if value is None else f"{value * factor:.6g} {name}".rstrip() for value in values]


def listed(names: Sequence[str], most: int = 8) -> str:
    """Names in quotes; of a long list the first few and how many more there are."""
    shown = ", ".join(map(repr, names[:most]))
    return shown if len(names) <= most else f"{shown} and {len(names) - most} more"


def measure_name(name: str) -> str:
    """A limit's name in words: ``toe_6m`` is the toe offset at 6 m."""
    words = {"angle": "Angle error of the feed", "collar": "Collar offset", "shake": "Vibration across the hole"}
    return words.get(name) or f"Toe offset at {name.removeprefix('toe_').removesuffix('m')} m"


def plain(value: Any) -> Any:
    """Dataclasses, tuples and numpy numbers as what JSON knows; NaN and infinity, which it lacks, become None."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {field.name: plain(getattr(value, field.name)) for field in dataclasses.fields(value)}
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, str) or value is None or isinstance(value, bool | int):
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if hasattr(value, "tolist"):
        return plain(value.tolist())
    if isinstance(value, Iterable):
        return [plain(item) for item in value]
    return str(value)
