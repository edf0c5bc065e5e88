"""What a study report speaks of, read once: table, model, axes with their units, limits, sensitivity."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from drillrig_pin.analysis.design import relief_pressures
from drillrig_pin.analysis.forces import GAS_RELEASE
from drillrig_pin.analysis.limits import Limit, read_limits
from drillrig_pin.batch.again import Vector, base_model, hole_places
from drillrig_pin.batch.axes import GridAxis, LatinHypercubeAxis, RangeAxis, SobolAxis, Span, ZipAxis
from drillrig_pin.batch.face import Face, face_of
from drillrig_pin.batch.importance import FILE, load_sensitivity
from drillrig_pin.batch.table import StudyTable, read_table
from drillrig_pin.elements.cylinder import ATMOSPHERE
from drillrig_pin.model.modelfile import ModelFile, Parameter
from drillrig_pin.report.provenance import meanings
from drillrig_pin.scenario import Scenario
from drillrig_pin.words import reading

#: An axis over more than this ratio is read by its logarithm.
WIDE = 100.0


@dataclass(frozen=True, slots=True)
class StudyAxis:
    """Something that is varied.

    Attributes:
        name: as in the study and in the table.
        label: without ``model.`` or ``scenario.``, and with what is varied together with it.
        unit, factor: in which people read its values, and the factor from the model's own; empty and 1 if unknown.
        text: what it means.
        log: spaced by its logarithm.
        words: its values are words, such as names of holes.
        count: how many different values the table has.
        source: of the model's number, e.g. ``assumed: ...``.
    """

    name: str
    label: str
    unit: str
    factor: float
    text: str
    log: bool
    words: bool
    count: int
    source: str = ""

    def shown(self, value: Any) -> str:
        """One of its values as people read it."""
        if self.words or not isinstance(value, int | float):
            return str(value)
        scaled = value * self.factor
        return f"{scaled:.5g} {self.unit}".rstrip()


@dataclass(frozen=True, slots=True)
class Bound:
    """A limit of one metric [SI]: a greatest value, or a least one, and where the number comes from."""

    value: float
    least: bool
    source: str
    assumed: bool


@dataclass(frozen=True)
class StudySubject:
    """A study with everything needed to judge it.

    Attributes:
        table: the table.
        metric: the metric looked at first.
        file: model of the base scenario; None if it cannot be read any more.
        axes: what is varied, one for every independent axis.
        bounds: limits by metric.
        face: the rock face of a study with holes.
        places: of the holes in the world [m].
        importance: indices of a sensitivity study, as its file holds them; empty without one.
    """

    table: StudyTable
    metric: str
    file: ModelFile | None
    axes: tuple[StudyAxis, ...]
    bounds: Mapping[str, Bound]
    face: Face | None
    places: Mapping[str, Vector]
    importance: Mapping[str, Any]

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Numbers of the base model."""
        return tuple(self.file.parameters().values()) if self.file else ()

    @property
    def assumed(self) -> tuple[Parameter, ...]:
        """Those that no source prints."""
        return tuple(row for row in self.parameters if row.assumed)


def read_subject(
    folder: str | Path, metric: str | None = None, limits: Mapping[str, Limit] | None = None
) -> StudySubject:
    """Read a study's folder.

    Args:
        folder: as ``drillrig sweep -o`` makes it.
        metric: the metric looked at first; None: the one that tells the study's worst case.
        limits: to judge cases by; None: the shipped examples.

    Raises:
        ResultFileError: no folder of a study, or no such metric.
    """
    table = read_table(folder)
    chosen = table.metric(metric)
    file = base_model(table)
    places = hole_places(table, file)
    return StudySubject(
        table,
        chosen,
        file,
        axes_of(table, file),
        bounds_of(table, read_limits() if limits is None else limits, file),
        face_of(table, chosen, file, places),
        places,
        _importance(table.folder),
    )


def axes_of(table: StudyTable, file: ModelFile | None) -> tuple[StudyAxis, ...]:
    """What is varied and takes more than one value; names that change together are one axis, called by the first."""
    parameters = file.parameters() if file else {}
    fields = meanings(Scenario)
    together = {name: list(axis.zip) for axis in table.study.axes if isinstance(axis, ZipAxis) for name in axis.zip}
    found = []
    for name in table.inputs:
        group = together.get(name, [name])
        values = table.columns[name]
        if name != group[0] or (len(set(values)) < 2 and len(table.inputs) > 1):
            continue
        short = name.removeprefix("model.").removeprefix("scenario.")
        row = parameters.get(short) if name.startswith("model.") else None
        partners = [other.removeprefix("model.").removeprefix("scenario.") for other in group[1:]]
        words = any(not isinstance(value, int | float) or isinstance(value, bool) for value in values)
        size = 0.0 if words else max(abs(value) for value in values)
        unit, factor = reading(row.unit, size or 1.0) if row and row.unit != "1" else ("", 1.0)
        found.append(
            StudyAxis(
                name,
                f"{short} (with {', '.join(partners)})" if partners else short,
                unit,
                factor,
                row.text if row else "" if name == "hole" else fields.get(short, ""),
                not words and (_log_scaled(table, name) or (min(values) > 0 and max(values) >= WIDE * min(values))),
                words,
                len(set(values)),
                row.source if row else "",
            )
        )
    return tuple(found)


def _log_scaled(table: StudyTable, name: str) -> bool:
    for axis in table.study.axes:
        scale = None
        if isinstance(axis, RangeAxis) and axis.name == name:
            scale = axis.range.scale
        elif isinstance(axis, GridAxis | ZipAxis):
            span = (axis.grid if isinstance(axis, GridAxis) else axis.zip).get(name)
            scale = span.scale if isinstance(span, Span) else None
        elif isinstance(axis, LatinHypercubeAxis | SobolAxis):
            sampling = axis.latin_hypercube if isinstance(axis, LatinHypercubeAxis) else axis.sobol
            scale = sampling.bounds[name].scale if name in sampling.bounds else None
        if scale is not None:
            return scale == "log"
    return False


def bounds_of(table: StudyTable, limits: Mapping[str, Limit], file: ModelFile | None) -> dict[str, Bound]:
    """Limits by metric: those of hole quality, relief valves, gas release, a tip that stays on the rock."""
    relief = relief_pressures(file) if file else {}
    found: dict[str, Bound] = {}
    for metric in table.metrics:
        subject, _, last = metric.rpartition(".")
        limit = limits.get(subject.removeprefix("hole."))
        if last == "worst" and limit is not None:
            found[metric] = Bound(limit.value, False, limit.source, limit.assumed)
        elif last == "p_max" and subject in relief:
            found[metric] = Bound(relief[subject] + ATMOSPHERE, False, "relief valve of the model", False)
        elif last == "p_min":
            found[metric] = Bound(GAS_RELEASE, True, "oil releases its air below", False)
        elif last == "tension":
            found[metric] = Bound(0.0, False, "a real tip lifts off the rock", False)
    return found


def _importance(folder: Path) -> dict[str, Any]:
    return load_sensitivity(folder).document() if (folder / FILE).exists() else {}


def finite(value: Any) -> float | None:
    """A number that can be drawn, else None."""
    return float(value) if isinstance(value, int | float) and math.isfinite(value) else None
