"""Between which values a number of a model makes sense: a file beside its parameters."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import yaml

from drillrig_pin.errors import ModelError
from drillrig_pin.files import MODEL_SUFFIXES
from drillrig_pin.model.nodes import short_path


@dataclass(frozen=True, slots=True)
class Range:
    """Least and greatest sensible value, in the unit of the parameter, and where they come from."""

    low: float
    high: float
    source: str


def read_ranges(model: Path) -> dict[str, Range]:
    """Ranges by parameter, of ``params/NAME.ranges.yaml`` beside a model file; empty if there is no such file.

    A range advises; a value outside is computed all the same.

    Raises:
        ModelError: the file cannot be read, or a range is none.
    """
    name = next((model.name.removesuffix(suffix) for suffix in MODEL_SUFFIXES if model.name.endswith(suffix)), "")
    path = model.parent / "params" / f"{name}.ranges.yaml"
    if not path.is_file():
        return {}
    where = short_path(path)
    try:
        rows = yaml.safe_load(path.read_text(encoding="utf-8")) or {}
        found = {key: Range(float(row["low"]), float(row["high"]), str(row["source"])) for key, row in rows.items()}
    except (OSError, yaml.YAMLError, UnicodeDecodeError, KeyError, TypeError, ValueError, AttributeError) as error:
        reason = " ".join(str(error).split())
        todo = "Write NAME: {low: ..., high: ..., source: ...}."
        raise ModelError(f"the ranges cannot be read ({reason})", where=where, todo=todo) from None
    for key, row in found.items():
        if not (math.isfinite(row.low) and math.isfinite(row.high) and row.low < row.high):
            raise ModelError(f"the range of {key!r} is none: {row.low:g} to {row.high:g}", where=where)
    return found
