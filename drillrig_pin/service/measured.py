"""The numbers of a run as one JSON document: values with unit, limit and verdict, and what they mean in sentences."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from fnmatch import fnmatchcase
from typing import Any

import numpy as np

from drillrig_pin.analysis.fatigue import cylinder_rainflow
from drillrig_pin.analysis.forces import GAS_RELEASE
from drillrig_pin.analysis.hole_quality import hole_quality
from drillrig_pin.analysis.limits import Limit, limited_depths, read_limits
from drillrig_pin.analysis.metrics import Metrics, measure
from drillrig_pin.analysis.quantities import Quantity, quantities
from drillrig_pin.analysis.verdict import NEAR, Level, findings, headline
from drillrig_pin.figures.subject import subject_of
from drillrig_pin.model.modelfile import read_model_text
from drillrig_pin.report.content import cards
from drillrig_pin.report.provenance import asks_the_same, command
from drillrig_pin.trajectory import Trajectory
from drillrig_pin.words import plain


def measured_document(trajectory: Trajectory) -> dict[str, Any]:
    """Everything a page or a script wants to know of a run without reading its samples. SI units, pressures absolute.

    A run of fewer than two samples has its outcome and notes only.
    """
    outcome = trajectory.outcome
    parameters = read_model_text(trajectory.model).parameters().values()
    document: dict[str, Any] = {
        "units": "SI; pressures absolute; RMS about the mean",
        "content_hash": trajectory.content_hash,
        "outcome": {
            "name": outcome.status.name,
            "completed": outcome.completed,
            "time": outcome.time,
            "steps": outcome.steps,
            "cause": outcome.cause,
            "advice": outcome.status.advice,
            "valid_until": outcome.valid_until,
            "doubt": outcome.doubt,
        },
        "engine": trajectory.engine,
        "method": trajectory.method,
        "samples": len(trajectory.time),
        "cost": trajectory.cost,
        "notes": trajectory.notes,
        "command": command(trajectory) if asks_the_same(trajectory) else None,
        "parameters": len(parameters),
        "assumed": sum(row.assumed for row in parameters),
        "valid": True,
        "invalid": (),
        "warnings": (),
        "verdict": None,
        "findings": (),
        "cards": (),
        "quantities": (),
    }
    if len(trajectory.time) >= 2:
        # The last samples of a run that diverged may be too large to be squared.
        with np.errstate(all="ignore"):
            document |= _numbers(trajectory)
    found: dict[str, Any] = plain(document)
    return found


def _numbers(trajectory: Trajectory) -> dict[str, Any]:
    limits = read_limits()
    subject = subject_of(trajectory, limits=limits)
    metrics, window = measure(trajectory), subject.window
    quality = hole_quality(window.record, subject.design, window.rows, limited_depths(limits), None)
    found = findings(metrics, subject.design, quality, limits, trajectory.outcome)
    level, sentence = headline(found)
    counts = cylinder_rainflow(window.record, window.rows)
    return {
        "start_up": metrics.start_up,
        "steadiness": metrics.steadiness,
        "sampling": metrics.sampling,
        "stored": metrics.stored,
        "valid": not metrics.invalid,
        "invalid": metrics.invalid,
        "warnings": metrics.warnings,
        "verdict": {"level": level.value, "sentence": sentence},
        "findings": [
            {"level": item.level.value, "title": item.title, "sentence": item.sentence, "advice": item.advice}
            for item in found
        ],
        "cards": cards(metrics, quality, limits),
        "quantities": list(_judged(quantities(metrics, quality, counts), metrics, limits)),
    }


def _judged(found: Mapping[str, Quantity], metrics: Metrics, limits: Mapping[str, Limit]) -> Iterator[dict[str, Any]]:
    """Every number with the limit it is held to, if there is one."""
    bounds: dict[str, tuple[float, bool]] = {
        f"hole.{name}.worst": (limit.value, limit.assumed) for name, limit in limits.items()
    }
    for cylinder in metrics.cylinders:
        if cylinder.relief is not None:
            bounds[f"{cylinder.cylinder}.p_max"] = (cylinder.relief, False)
        bounds[f"{cylinder.cylinder}.p_min"] = (GAS_RELEASE, False)
    for key, item in found.items():
        bound, assumed = bounds.get(key, (None, False))
        yield {
            "key": key,
            "label": item.label,
            "group": item.group,
            "value": item.value,
            "unit": item.unit,
            "better": item.better,
            "limit": bound,
            "limit_assumed": assumed,
            "verdict": None if bound is None else _verdict(item, bound).value,
        }


def _verdict(item: Quantity, bound: float) -> Level:
    if item.better == "higher":
        return Level.GOOD if item.value >= bound else Level.BAD
    if not item.value <= bound:
        return Level.BAD
    return Level.NEAR if item.value > NEAR * bound else Level.GOOD


def summary(trajectory: Trajectory, document: Mapping[str, Any]) -> dict[str, Any]:
    """What a list of runs shows of one."""
    return {
        "content_hash": document["content_hash"],
        "outcome": document["outcome"],
        "verdict": document["verdict"],
        "cards": document["cards"],
        "numbers": _telling(document["quantities"]),
        "samples": document["samples"],
        "solve_time": trajectory.cost["wall_time"],
    }


def _telling(found: Sequence[Mapping[str, Any]]) -> dict[str, dict[str, Any]]:
    """A few numbers that most runs have, by key: hole, motion, pressure. For lists, whatever the reader's language."""
    chosen: dict[str, Mapping[str, Any]] = {}
    for pattern in ("hole.toe_6m.worst", "*.across.rms"):
        chosen |= {item["key"]: item for item in found if fnmatchcase(item["key"], pattern)}
    pressures = [item for item in found if item["key"].endswith(".p_max")]
    if pressures:
        chosen["highest.p_max"] = max(pressures, key=lambda item: item["value"])
    moved = max((item for item in found if item["group"] == "joints"), key=lambda item: item["value"], default=None)
    if not chosen and moved is not None:
        chosen[moved["key"]] = moved
    return {key: {"value": item["value"], "unit": item["unit"]} for key, item in chosen.items()}
