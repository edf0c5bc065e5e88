"""Between which values a number of a model makes sense: a file beside its parameters."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from drillrig_pin.errors import ModelError, ScenarioError
from drillrig_pin.files import MODEL_SUFFIXES
from drillrig_pin.model.nodes import short_path
from drillrig_pin.yamlfile import read_fields


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
        rows = read_fields(path, "a file of ranges")[0]
        found = {key: Range(float(row["low"]), float(row["high"]), str(row["source"])) for key, row in rows.items()}
    except ScenarioError as error:
        raise ModelError(error.what, where=error.where, todo=error.todo) from None
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        reason = " ".join(str(error).split())
        todo = "Write NAME: {low: ..., high: ..., source: ...}."
        raise ModelError(f"the ranges cannot be read ({reason})", where=where, todo=todo) from None
    for key, row in found.items():
        if not (math.isfinite(row.low) and math.isfinite(row.high) and row.low < row.high):
            raise ModelError(f"the range of {key!r} is none: {row.low:g} to {row.high:g}", where=where)
    return found
