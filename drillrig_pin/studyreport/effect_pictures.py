"""Figures of what every axis does: one for each axis, the tornado chart, indices of a sensitivity study."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from drillrig_pin.report.interactive import plain
from drillrig_pin.studyreport.effects import Effect
from drillrig_pin.studyreport.scales import Figure, axis_scale, layout, metric_scale, told
from drillrig_pin.studyreport.subject import StudySubject
from drillrig_pin.words import reading

#: Height of the figure of an axis, and of a bar [px].
LOW, ROW = 300, 46


def effect_picture(subject: StudySubject, effect: Effect, metric: str) -> Figure:
    axis, scale = effect.axis, metric_scale(subject, metric)
    along = axis_scale(axis)
    stages = effect.stages
    x: list[Any] = [stage.label if axis.words else along.of(stage.at) for stage in stages]
    hover = [
        f"{plain(s.label)}<br>mean {plain(told(scale, s.mean))} ± {plain(told(scale, s.deviation))}"
        f"<br>{plain(told(scale, s.least))} to {plain(told(scale, s.greatest))}, {s.count} cases"
        for s in stages
    ]
    edge = {"type": "scatter", "x": x, "hoverinfo": "skip", "meta": {"ink": "BLUE", "shade": True}}
    line = {"width": 0}
    if axis.words:
        ends = {"mode": "markers", "marker": {"symbol": "line-ew-open", "size": 14}, "meta": {"ink": "GREY"}}
        band = [
            edge | ends | {"y": [scale.of(s.least) for s in stages]},
            edge | ends | {"y": [scale.of(s.greatest) for s in stages]},
        ]
    else:
        band = [
            edge | {"mode": "lines", "line": line, "y": [scale.of(s.least) for s in stages]},
            edge | {"mode": "lines", "line": line, "fill": "tonexty", "y": [scale.of(s.greatest) for s in stages]},
        ]
    mean = {
        "type": "scatter", "mode": "markers" if axis.words else "lines+markers", "x": x,
        "y": [scale.of(s.mean) for s in stages], "meta": {"ink": "BLUE"}, "marker": {"size": 7},
        "hovertext": hover, "hoverinfo": "text",
        "error_y": {"type": "data", "array": [scale.of(s.deviation) for s in stages], "thickness": 1.2, "width": 3},
    }  # fmt: skip
    arranged = layout(along.title, scale.title, hover="closest")
    if axis.words:
        arranged["xaxis"]["type"] = "category"
    elif axis.log:
        arranged["xaxis"]["type"] = "log"
    return {"data": [*band, mean], "layout": arranged | {"showlegend": False}, "height": LOW}


def tornado(subject: StudySubject, effects: Sequence[Effect], metric: str) -> Figure | None:
    if not effects:
        return None
    scale = metric_scale(subject, metric)
    ranked = sorted(effects, key=lambda effect: effect.swing)
    low = [scale.of(effect.lowest.mean) or 0.0 for effect in ranked]
    high = [scale.of(effect.highest.mean) or 0.0 for effect in ranked]
    labels = [plain(effect.axis.label) for effect in ranked]
    sure = [effect.swing > effect.chance for effect in ranked]
    hover = [
        f"{label}: mean from {plain(told(scale, e.lowest.mean))} at {plain(e.lowest.label)} "
        f"to {plain(told(scale, e.highest.mean))} at {plain(e.highest.label)}"
        for label, e in zip(labels, ranked, strict=True)
    ]
    bars = [
        {
            "type": "bar", "orientation": "h", "hoverinfo": "text", "meta": {"ink": ink},
            "y": [labels[i] for i in chosen], "base": [low[i] for i in chosen],
            "x": [high[i] - low[i] for i in chosen], "hovertext": [hover[i] for i in chosen],
        }
        for ink, kind in (("BLUE", True), ("GREY", False))
        if (chosen := [i for i, known in enumerate(sure) if known is kind])
    ]  # fmt: skip
    span = (max(high) - min(low)) or abs(max(high)) or 1.0
    arranged = layout(f"mean of {scale.title}", "", left=20)
    arranged["xaxis"]["range"] = [min(low) - 0.3 * span, max(high) + 0.3 * span]
    arranged["yaxis"] |= {"automargin": True, "type": "category", "showgrid": False}
    arranged["yaxis"] |= {"categoryorder": "array", "categoryarray": labels}
    arranged["barmode"] = "overlay"
    for label, effect, a, b in zip(labels, ranked, low, high, strict=True):
        for x, stage, anchor in ((a, effect.lowest, "right"), (b, effect.highest, "left")):
            arranged["annotations"].append(
                {"x": x, "y": label, "text": plain(_clipped(stage.label)), "xanchor": anchor, "showarrow": False}
            )
    return {"data": bars, "layout": arranged | {"showlegend": False}, "height": 110 + ROW * len(ranked)}


def importance(subject: StudySubject, metric: str) -> Figure | None:
    """Indices of a sensitivity study for this metric, with their confidence."""
    content = subject.importance
    indices = [entry for entry in content.get("indices", ()) if entry.get("metric") == metric]
    if not indices:
        return None
    indices = sorted(indices, key=lambda entry: entry["importance"])
    sobol = content.get("method") == "sobol"
    name, factor = ("", 1.0) if sobol else reading(str(indices[0].get("unit", "")), indices[-1]["importance"] or 1.0)
    labels = [plain(str(entry["parameter"]).removeprefix("model.").removeprefix("scenario.")) for entry in indices]

    def bars(key: str, words: str, ink: str) -> Figure:
        values = [(entry.get(key) or 0.0) * factor for entry in indices]
        sure = [(entry.get(f"{key}_conf") or 0.0) * factor for entry in indices]
        return {
            "type": "bar", "orientation": "h", "y": labels, "x": values, "name": words, "meta": {"ink": ink},
            "error_x": {"type": "data", "array": sure, "thickness": 1.5, "width": 4},
            "hovertemplate": f"%{{y}}: %{{x:.3~g}} ± %{{error_x.array:.2~g}}<extra>{words}</extra>",
        }  # fmt: skip

    if sobol:
        data = [bars("S1", "alone (S1)", "SKY"), bars("ST", "with all it acts together with (ST)", "BLUE")]
        title = "share of the variance"
    else:
        data = [bars("importance", "mean absolute effect", "BLUE")]
        title = f"mean absolute effect over the whole range, μ*{f' [{name}]' if name else ''}"
    arranged = layout(title, "", left=20)
    arranged["yaxis"] |= {"automargin": True, "type": "category", "showgrid": False}
    arranged["margin"]["t"] = 36 if sobol else 16
    return {"data": data, "layout": arranged | {"showlegend": sobol}, "height": 130 + (ROW + 10) * len(indices)}


def _clipped(text: str, most: int = 28) -> str:
    return text if len(text) <= most else text[: most - 1] + "…"
