"""Sheets as documents for plotly.js: zoom, hover, legend toggles. Colours are left to the page and its themes."""

from __future__ import annotations

import base64
import math
from typing import Any

import numpy as np

from drillrig_pin.figures.sheet import Curve, Level, Panel, Sheet
from drillrig_pin.figures.thin import thin, thin_path
from drillrig_pin.kinematics import Array

#: Curves are reduced to the least and greatest sample of each of so many stretches.
BUCKETS = 2000
#: Heights [px]: of a panel alone, of one of several, between panels, above them, of a legend, below them.
ALONE, EACH, BETWEEN, HEAD, LEGEND, FOOT = 320, 150, 42, 34, 26, 46


def interactive(sheet: Sheet) -> dict[str, Any]:
    """One sheet as ``{"data": traces, "layout": layout, "height": px}``.

    Curves have at most 2 ``BUCKETS`` + 2 points as 32-bit floats; ``meta.ink`` names their colour.
    """
    count = len(sheet.panels)
    gap = BETWEEN + (0 if sheet.shared else 24)
    inner = ALONE if count == 1 else count * EACH + (count - 1) * gap
    hover = "closest" if any(panel.square for panel in sheet.panels) else "x"
    layout: dict[str, Any] = {"shapes": [], "annotations": [], "hovermode": hover}
    traces: list[dict[str, Any]] = []
    named: set[str] = set()
    for i, panel in enumerate(sheet.panels):
        suffix = "" if i == 0 else str(i + 1)
        top = 1.0 - i * (EACH + gap) / inner if count > 1 else 1.0
        bottom = max(0.0, top - EACH / inner) if count > 1 else 0.0
        layout[f"xaxis{suffix}"] = _x_axis(sheet, panel, i, count)
        layout[f"yaxis{suffix}"] = _y_axis(panel, (bottom, top), suffix)
        if count > 1:
            layout["annotations"].append(_words(panel.title, top, "left", 0.0))
        if panel.note:
            # Beside the title, or inside a panel that has its legend there.
            inside = {"yanchor": "top", "bgcolor": "paper"} if len(panel.curves) > 1 else {}
            layout["annotations"].append(_words(panel.note, top, "right", 1.0) | inside)
        for curve in panel.curves:
            shown = len(panel.curves) > 1 and curve.name not in named
            traces.append(_trace(curve, panel, suffix, shown=shown))
            named |= {curve.name} if shown else set()
        _add_shapes(layout, panel, suffix)
    # The legend stands above the panels, and the buttons of plotly.js above the legend.
    head = HEAD + (LEGEND if named else 0)
    layout["margin"] = {"l": 66, "r": 12, "t": head, "b": FOOT}
    return {"data": traces, "layout": layout, "height": inner + head + FOOT}


def _x_axis(sheet: Sheet, panel: Panel, index: int, count: int) -> dict[str, Any]:
    last = index == count - 1 or not sheet.shared
    axis: dict[str, Any] = {"anchor": "y" if index == 0 else f"y{index + 1}", "showticklabels": last}
    if last:
        axis["title"] = {"text": panel.x_label, "standoff": 6}
    if index > 0 and sheet.shared:
        axis["matches"] = "x"
    if panel.x_range is not None:
        axis["range"] = list(panel.x_range)
    return axis


def _y_axis(panel: Panel, domain: tuple[float, float], suffix: str) -> dict[str, Any]:
    axis: dict[str, Any] = {
        "domain": list(domain),
        "anchor": f"x{suffix}",
        "title": {"text": panel.y_label, "standoff": 4},
        "nticks": 5,
    }
    if panel.square:
        axis |= {"scaleanchor": f"x{suffix}", "scaleratio": 1}
    values = np.concatenate([curve.y for curve in panel.curves]) if panel.curves else np.zeros(0)
    values = values[np.isfinite(values)]
    if panel.levels and len(values):
        values = np.append(values, [level.value for level in panel.levels])
        room = 0.16 * float(np.ptp(values)) or 1.0
        axis["range"] = [float(values.min()) - room, float(values.max()) + room]
    elif panel.note and len(panel.curves) > 1 and len(values):
        span = float(np.ptp(values)) or 1.0
        axis["range"] = [float(values.min()) - 0.05 * span, float(values.max()) + 0.4 * span]
    if panel.log:
        axis |= {"type": "log", "exponentformat": "power", "range": _decades(values[values > 0], panel.floor)}
        axis["dtick"] = max(1, math.ceil((axis["range"][1] - axis["range"][0]) / 5 - 0.1))
        del axis["nticks"]
    return axis


def _decades(values: Array, floor: float | None) -> list[float]:
    """Exponents at both ends of a logarithmic axis: whole decades around the values, or from the floor up."""
    high = float(values.max()) if len(values) else 1.0
    if floor is not None and floor > 0:
        return [math.log10(floor), math.log10(max(high, 10 * floor)) + 0.3]
    low = float(values.min()) if len(values) else 0.1
    return [float(math.floor(math.log10(low))), float(math.ceil(math.log10(high) + 1e-9))]


def _trace(curve: Curve, panel: Panel, suffix: str, *, shown: bool) -> dict[str, Any]:
    unit = panel.y_label.partition("[")[2].rstrip("]") or panel.y_label
    trace: dict[str, Any] = {
        "name": plain(curve.name),
        "legendgroup": curve.name,
        "showlegend": shown,
        "xaxis": f"x{suffix}",
        "yaxis": f"y{suffix}",
        "meta": {"ink": curve.ink.name},
        "hovertemplate": f"%{{y:.4~g}} {plain(unit)}<extra>{plain(curve.name)}</extra>",
    }
    if panel.bars:
        return trace | {"type": "bar", "x": _packed(curve.x), "y": _packed(curve.y)}
    x, y = thin_path(curve.x, curve.y) if curve.path else thin(curve.x, curve.y, BUCKETS)
    line = {"width": 1.2, "dash": "dash" if curve.dashed else "solid"}
    return trace | {"type": "scatter", "mode": "lines", "line": line, "x": _packed(x), "y": _packed(y)}


def _add_shapes(layout: dict[str, Any], panel: Panel, suffix: str) -> None:
    x, y = f"x{suffix}", f"y{suffix}"
    for band in panel.bands:
        layout["shapes"].append(
            {
                "type": "rect", "xref": x, "yref": f"{y} domain", "x0": band.low, "x1": band.high, "y0": 0, "y1": 1,
                "line": {"width": 0}, "layer": "below", "opacity": 0.14, "fillcolor": band.ink.name,
            }
        )  # fmt: skip
    for mark in panel.marks:
        layout["shapes"].append(
            {
                "type": "line", "xref": x, "yref": f"{y} domain", "x0": mark.x, "x1": mark.x, "y0": 0, "y1": 1,
                "line": {"width": 1, "dash": "dot", "color": "GREY"},
                "label": {"text": plain(mark.name), "textposition": "end", "textangle": 0, "yanchor": "bottom"},
            }
        )  # fmt: skip
    for level in panel.levels:
        layout["shapes"].append(
            {
                "type": "line", "xref": f"{x} domain", "yref": y,
                "x0": 0, "x1": 1, "y0": level.value, "y1": level.value,
                "line": {"width": 1, "dash": "dash", "color": "INK"},
                "label": {"text": plain(level.name), "textposition": "start", "yanchor": _side(level, panel)},
            }
        )  # fmt: skip


def _side(level: Level, panel: Panel) -> str:
    """The name of an upper limit stands above its line, that of a lower one below it."""
    return "bottom" if panel.is_upper(level) else "top"


def _words(text: str, top: float, anchor: str, x: float) -> dict[str, Any]:
    return {
        "text": plain(text), "xref": "paper", "yref": "paper", "showarrow": False, "align": anchor,
        "x": x, "y": top, "xanchor": anchor, "yanchor": "bottom",
    }  # fmt: skip


def plain(text: str) -> str:
    """Words of a model as words: plotly.js reads a few HTML tags and % in texts."""
    for mark, name in (("&", "&amp;"), ("<", "&lt;"), (">", "&gt;")):
        text = text.replace(mark, name)
    return text.replace("%{", "% {").replace("\n", "<br>")


def _packed(values: Array) -> dict[str, str]:
    """Numbers as plotly.js takes them in bytes: 32-bit floats, which the eye cannot tell from 64."""
    return {"dtype": "f4", "bdata": base64.b64encode(values.astype("<f4").tobytes()).decode()}
