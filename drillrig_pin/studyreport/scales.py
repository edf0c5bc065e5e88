"""How quantities are read in figures, and what all figures of a study have in common."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from drillrig_pin.analysis.quantities import label_of
from drillrig_pin.batch.face import worse_is_lower
from drillrig_pin.report.interactive import plain
from drillrig_pin.studyreport.subject import StudyAxis, StudySubject, finite
from drillrig_pin.words import number, reading

#: Light to dark, so that it also reads in grey.
RAMP = ["#fff3b2", "#fed976", "#feb24c", "#fd8d3c", "#f4502f", "#d0121f", "#8f0026"]

Figure = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Scale:
    """How a quantity is read: its name, the unit people read it in, and the factor from SI."""

    label: str
    unit: str
    factor: float

    @property
    def title(self) -> str:
        """For an axis."""
        return plain(f"{self.label} [{self.unit}]" if self.unit else self.label)

    def of(self, value: Any) -> float | None:
        """A value to be drawn: six digits, None for what is no number."""
        known = finite(value)
        return None if known is None else float(f"{known * self.factor:.6g}")


def metric_scale(subject: StudySubject, metric: str) -> Scale:
    """How a metric is read, in one unit for all cases."""
    unit = subject.table.units.get(metric, "")
    size = max(
        (abs(v) for value in subject.table.columns.get(metric, ()) if (v := finite(value)) is not None), default=0
    )
    name, factor = reading(unit, size or 1.0)
    return Scale(label_of(metric, unit), "" if name == "1" else name, factor)


def axis_scale(axis: StudyAxis) -> Scale:
    """How the values of an axis are read."""
    return Scale(axis.label, axis.unit, axis.factor)


def layout(x: str, y: str, *, left: int = 66, right: int = 14, hover: str = "closest") -> Figure:
    """A figure's layout with the titles of its axes; the page adds fonts and colours."""
    return {
        "xaxis": {"title": {"text": x, "standoff": 6}, "anchor": "y", "exponentformat": "power"},
        "yaxis": {"title": {"text": y, "standoff": 4}, "anchor": "x", "exponentformat": "power"},
        "margin": {"l": left, "r": right, "t": 34, "b": 52},
        "shapes": [],
        "annotations": [],
        "hovermode": hover,
    }


def ramp(metric: str) -> list[list[Any]]:
    """Colours from good to bad."""
    colours = RAMP[::-1] if worse_is_lower(metric) else RAMP
    return [[i / (len(colours) - 1), colour] for i, colour in enumerate(colours)]


def colour_bar(scale: Scale) -> Figure:
    """The key to the colours."""
    return {"title": {"text": plain(scale.unit), "side": "top"}, "thickness": 14, "outlinewidth": 0}


def told(scale: Scale, value: float) -> str:
    """A value in SI as people read it."""
    return f"{number(value * scale.factor, 3)} {scale.unit}".rstrip()
