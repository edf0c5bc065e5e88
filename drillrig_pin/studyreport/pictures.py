"""Figures of a study as documents for plotly.js; the page colours them by its theme and draws those of one metric."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Any

from drillrig_pin.batch.face import Face, face_of
from drillrig_pin.batch.worker import COMPLETED
from drillrig_pin.report.interactive import plain
from drillrig_pin.studyreport.effect_pictures import effect_picture, importance, tornado
from drillrig_pin.studyreport.effects import effects_of, is_grid
from drillrig_pin.studyreport.scales import Figure, Scale, axis_scale, colour_bar, layout, metric_scale, ramp, told
from drillrig_pin.studyreport.subject import StudyAxis, StudySubject
from drillrig_pin.words import number, quantity


def pictures(subject: StudySubject, metric: str) -> dict[str, Figure]:
    """All figures of one metric by name; those a study of this shape does not have are missing."""
    found: dict[str, Figure | None] = {
        "face": _face(subject, metric),
        "response": _response(subject, metric),
        "plane": _plane(subject, metric),
    }
    if len(subject.axes) > 1:
        effects = effects_of(subject, metric)
        found["tornado"] = tornado(subject, effects, metric)
        found |= {f"effect.{effect.axis.name}": effect_picture(subject, effect, metric) for effect in effects}
    found["importance"] = importance(subject, metric)
    return {name: figure for name, figure in found.items() if figure is not None}


def _face(subject: StudySubject, metric: str) -> Figure | None:
    face = face_of(subject.table, metric, subject.file, subject.places) if subject.face else None
    if face is None:
        return None
    scale = metric_scale(subject, metric)
    drilled = [hole for hole in face.holes if hole.value is not None]
    others = [hole for hole in face.holes if hole.value is None]
    size = _disc(face)
    words = len(face.holes) <= 40

    def told(hole: Any) -> str:
        at = ", ".join(f"{x:.3f}" for x in hole.place)
        assumed = "<br>position assumed" if hole.assumed else ""
        return f"<b>{plain(hole.name)}</b> (case {hole.case})<br>at ({at}) m{assumed}"

    def value(hole: Any) -> str:
        text = f"<br>{plain(scale.label)}: {plain(quantity(hole.value, face.unit))}"
        if face.several and hole.spread:
            low, high = (quantity(v, face.unit) for v in hole.spread)
            text += f" (worst of {plain(low)} to {plain(high)})"
        if hole.shares:
            name, share = next(iter(hole.shares.items()))
            text += f"<br>most of the vibration from {plain(name)}: {100 * share:.0f} %"
        return text

    traces: list[Figure] = [
        {
            "type": "scatter", "mode": "markers+text" if words else "markers", "name": "drilled",
            "x": [round(h.right, 6) for h in drilled], "y": [round(h.up, 6) for h in drilled],
            "text": [f"{plain(h.name)}{'*' if h.assumed else ''}<br>{_short(scale.of(h.value))}" for h in drilled],
            "textposition": "bottom center", "customdata": [h.case for h in drilled],
            "hovertext": [told(h) + value(h) for h in drilled], "hoverinfo": "text",
            "marker": {
                "size": size, "color": [scale.of(h.value) for h in drilled], "colorscale": ramp(metric),
                "showscale": len(drilled) > 1, "colorbar": colour_bar(scale), "line": {"width": 1, "color": "#555"},
            },
        },
    ]  # fmt: skip
    if others:
        traces.append(
            {
                "type": "scatter", "mode": "markers+text" if words else "markers", "name": "no result",
                "x": [round(h.right, 6) for h in others], "y": [round(h.up, 6) for h in others],
                "text": [
                    f"{plain(h.name)}{'*' if h.assumed else ''}<br>{'no result' if h.reachable else 'out of reach'}"
                    for h in others
                ],
                "textposition": "bottom center", "customdata": [h.case for h in others],
                "hovertext": [told(h) + "<br>" + _wrapped(h.reason) for h in others], "hoverinfo": "text",
                "meta": {"ink": "GREY"}, "marker": {"size": 0.7 * size, "symbol": "x-open", "line": {"width": 2}},
            }
        )  # fmt: skip
    rights, ups = [h.right for h in face.holes], [h.up for h in face.holes]
    room = 0.35 * max(max(rights) - min(rights), max(ups) - min(ups), 0.5)
    arranged = layout(
        "to the right, seen from the machine [m]", "up [m]", right=90 if len(drilled) > 1 else 20, hover="closest"
    )
    arranged["xaxis"] |= {"range": [min(rights) - room, max(rights) + room], "constrain": "domain"}
    arranged["yaxis"] |= {
        "range": [min(ups) - 1.1 * room, max(ups) + 0.7 * room],
        "scaleanchor": "x",
        "constrain": "domain",
    }
    return {"data": traces, "layout": arranged | {"showlegend": False}, "height": 600}


def _disc(face: Face) -> float:
    """Diameter of a hole [px] that leaves room for two lines between neighbours."""
    places = [(hole.right, hole.up) for hole in face.holes]
    extent = max(max(p[i] for p in places) - min(p[i] for p in places) for i in (0, 1)) or 1.0
    apart = [math.dist(a, b) for a, b in itertools.combinations(places, 2)]
    spacing = min((d for d in apart if d > 1e-6), default=extent)
    return min(58.0, max(7.0, 0.6 * spacing / extent * 300))


def _response(subject: StudySubject, metric: str) -> Figure | None:
    """The metric over the only axis of a study."""
    if len(subject.axes) != 1:
        return None
    axis, table, scale = subject.axes[0], subject.table, metric_scale(subject, metric)
    along = axis_scale(axis)
    rows = [
        (table.columns[axis.name][i], scale.of(value), table.cases[i], status == COMPLETED)
        for i, (value, status) in enumerate(zip(table.columns[metric], table.columns["status"], strict=True))
    ]
    if not axis.words:
        rows.sort(key=lambda row: float(row[0]))
    drawn = [row for row in rows if row[3] and row[1] is not None]
    gone = [row for row in rows if not row[3] or row[1] is None]
    kind = {"type": "bar"} if axis.words else {"type": "scatter", "mode": "lines+markers", "marker": {"size": 5}}
    x = [str(row[0]) if axis.words else along.of(row[0]) for row in drawn]
    unit = f" {plain(scale.unit)}" if scale.unit else ""
    traces: list[Figure] = [
        kind
        | {
            "x": x, "y": [row[1] for row in drawn], "customdata": [row[2] for row in drawn], "meta": {"ink": "BLUE"},
            "hovertemplate": f"%{{x}}: %{{y:.4~g}}{unit}<br>case %{{customdata}}<extra></extra>",
        }
    ]  # fmt: skip
    if gone:
        traces.append(
            {
                "type": "scatter", "mode": "markers", "x": [str(r[0]) if axis.words else along.of(r[0]) for r in gone],
                "y": [0.0] * len(gone), "yaxis": "y", "customdata": [row[2] for row in gone],
                "marker": {"symbol": "x", "size": 8}, "meta": {"ink": "VERMILION"},
                "hovertemplate": "%{x}: no result<br>case %{customdata}<extra></extra>",
            }
        )  # fmt: skip
        low = min((row[1] for row in drawn if row[1] is not None), default=0.0)
        traces[1]["y"] = [low] * len(gone)
    arranged = layout(along.title, scale.title, hover="closest")
    if axis.log:
        arranged["xaxis"]["type"] = "log"
    if axis.words:
        arranged["xaxis"]["type"] = "category"
    _bound_line(arranged, subject, metric, scale, [row[1] for row in drawn if row[1] is not None])
    worst = next((row for row in drawn if row[2] == table.worst(metric)), None)
    if worst is not None and not axis.words and not axis.log and len(drawn) > 2:
        text = f"{plain(axis.shown(worst[0]))}: {plain(told(scale, (worst[1] or 0.0) / scale.factor))}"
        arranged["annotations"].append({"x": along.of(worst[0]), "y": worst[1], "text": text, "ay": -26, "ax": 30})
    return {"data": traces, "layout": arranged | {"showlegend": False}, "height": 400}


def _plane(subject: StudySubject, metric: str) -> Figure | None:
    """The metric over two axes: cells of a grid, else points."""
    if len(subject.axes) != 2:
        return None
    first, second = subject.axes
    # The axis with words, or with more values, lies along x.
    across, along = (
        (first, second) if first.words or (first.count >= second.count and not second.words) else (second, first)
    )
    table, scale = subject.table, metric_scale(subject, metric)
    rows = [
        (table.columns[across.name][i], table.columns[along.name][i], scale.of(value), table.cases[i])
        for i, (value, status) in enumerate(zip(table.columns[metric], table.columns["status"], strict=True))
        if status == COMPLETED
    ]
    scales = axis_scale(across), axis_scale(along)
    unit = f" {plain(scale.unit)}" if scale.unit else ""
    arranged = layout(scales[0].title, scales[1].title, right=90, hover="closest")
    if is_grid(subject):
        ends = [_ordered(table.columns[axis.name], axis) for axis in (across, along)]
        place = [{value: i for i, value in enumerate(values)} for values in ends]
        z: list[list[float | None]] = [[None] * len(ends[0]) for _ in ends[1]]
        cases: list[list[int | None]] = [[None] * len(ends[0]) for _ in ends[1]]
        for x, y, value, case in rows:
            z[place[1][y]][place[0][x]], cases[place[1][y]][place[0][x]] = value, case
        few = len(ends[0]) * len(ends[1]) <= 120
        trace: Figure = {
            "type": "heatmap", "z": z, "customdata": cases, "colorscale": ramp(metric), "colorbar": colour_bar(scale),
            "x": [across.shown(value) for value in ends[0]], "y": [along.shown(value) for value in ends[1]],
            "xgap": 1, "ygap": 1, "hoverongaps": False,
            "hovertemplate": f"%{{x}}, %{{y}}: %{{z:.4~g}}{unit}<br>case %{{customdata}}<extra></extra>",
            **({"texttemplate": "%{z:.3~g}"} if few else {}),
        }  # fmt: skip
        arranged["yaxis"]["automargin"] = True
        arranged["xaxis"] |= {"type": "category", "title": {"text": plain(across.label)}, "showgrid": False}
        arranged["yaxis"] |= {
            "type": "category",
            "title": {"text": plain(along.label)},
            "showgrid": False,
            "automargin": True,
        }
    else:
        trace = {
            "type": "scatter", "mode": "markers", "customdata": [row[3] for row in rows],
            "x": [scales[0].of(row[0]) if not across.words else str(row[0]) for row in rows],
            "y": [scales[1].of(row[1]) if not along.words else str(row[1]) for row in rows],
            "marker": {
                "size": 9, "color": [row[2] for row in rows], "colorscale": ramp(metric), "showscale": True,
                "colorbar": colour_bar(scale), "line": {"width": 0.5, "color": "#555"},
            },
            "hovertemplate": f"%{{x}}, %{{y}}: %{{marker.color:.4~g}}{unit}<br>case %{{customdata}}<extra></extra>",
        }  # fmt: skip
        for name, axis in (("xaxis", across), ("yaxis", along)):
            if axis.log:
                arranged[name]["type"] = "log"
    return {"data": [trace], "layout": arranged | {"showlegend": False}, "height": 460}


def _ordered(values: Sequence[Any], axis: StudyAxis) -> list[Any]:
    distinct = list(dict.fromkeys(values))
    return distinct if axis.words else sorted(distinct)


def _bound_line(arranged: Figure, subject: StudySubject, metric: str, scale: Scale, values: Sequence[float]) -> None:
    """The metric's limit, where it is near enough to be seen with the values."""
    bound = subject.bounds.get(metric)
    at = scale.of(bound.value) if bound else None
    if bound is None or at is None or not values or at > 3 * max(values) or at < min(values) - 2 * abs(max(values)):
        return
    side = "at least" if bound.least else "limit"
    arranged["shapes"].append(
        {
            "type": "line", "xref": "x domain", "yref": "y", "x0": 0, "x1": 1, "y0": at, "y1": at,
            "line": {"width": 1, "dash": "dash", "color": "VERMILION"},
            "label": {"text": f"{side} {number(at, 3)} {plain(scale.unit)}", "textposition": "start"},
        }
    )  # fmt: skip


def _short(value: float | None) -> str:
    return "" if value is None else number(value, 3)


def _wrapped(text: str) -> str:
    import textwrap

    return "<br>".join(plain(line) for line in textwrap.wrap(text, 60))
