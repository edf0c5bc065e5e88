"""The report: one HTML page that needs nothing else, neither network nor this package."""

from __future__ import annotations

import json
from collections.abc import Mapping
from importlib.resources import files
from typing import Any

from drillrig_pin.figures.sheet import Sheet
from drillrig_pin.replay.page import animation_page
from drillrig_pin.report.content import Content, curve_table, filters, span
from drillrig_pin.report.interactive import BUCKETS, interactive
from drillrig_pin.scene.options import ReplayOptions

TEMPLATES = "drillrig_pin.report.templates"


def report_page(content: Content, sheets: list[Sheet]) -> str:
    """The report of a run as one HTML document.

    Args:
        content: what it says, see :func:`drillrig_pin.report.content.gather`.
        sheets: its figures.

    Everything that comes from the model is escaped, and the page forbids itself every request (a content security
    policy that the browser enforces).
    """
    figures = {sheet.name: interactive(sheet) for sheet in sheets}
    words = {
        "c": content,
        "m": content.metrics,
        "run": content.trajectory,
        "sheets": sheets,
        "tables": {sheet.name: curve_table(sheet) for sheet in sheets},
        "buckets": BUCKETS,
        "samples": len(content.trajectory.time),
        "animation": animation_page([content.trajectory], ReplayOptions()),
        "data": _script_json(figures),
        "style": _text("report.css"),
        "script": _text("report.js"),
        "library": files("plotly").joinpath("package_data", "plotly.min.js").read_text(encoding="utf-8"),
    }
    page: str = _environment().get_template("report.html").render(words)
    return page


def _environment() -> Any:
    from jinja2 import Environment, FunctionLoader, StrictUndefined

    environment = Environment(
        loader=FunctionLoader(_text), autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters |= filters()
    environment.globals["span"] = span
    return environment


def _text(name: str) -> str:
    return files(TEMPLATES).joinpath(name).read_text(encoding="utf-8")


def _script_json(document: Mapping[str, Any]) -> str:
    """JSON that may stand inside a script element: no tag can begin in it."""
    text = json.dumps(document, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029")
