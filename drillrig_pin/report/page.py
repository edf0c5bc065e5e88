"""The report: one HTML page that needs nothing else, neither network nor this package."""

from __future__ import annotations

from importlib.resources import files
from typing import Any

from drillrig_pin.analysis.forces import reaction_groups
from drillrig_pin.escaping import script_json
from drillrig_pin.figures.sheet import Sheet
from drillrig_pin.replay.page import animation_page
from drillrig_pin.report.content import Content, curve_table, filters, span
from drillrig_pin.report.interactive import BUCKETS, interactive
from drillrig_pin.scene.options import ReplayOptions

TEMPLATES = "drillrig_pin.report.templates"
#: What a page may do: show what it carries, and ask nobody for anything.
POLICY = (
    "default-src 'none'; "
    "script-src 'unsafe-inline' 'unsafe-eval' blob: data:; "
    "style-src 'unsafe-inline'; "
    "img-src data: blob:; "
    "font-src data:; "
    "connect-src data: blob:; "
    "worker-src blob: data:; "
    "frame-src 'self' data: blob:; "
    "base-uri 'none'; "
    "form-action 'none'"
)


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
        "reactions": reaction_groups(content.metrics.reactions),
        "run": content.trajectory,
        "sheets": sheets,
        "tables": {sheet.name: curve_table(sheet) for sheet in sheets},
        "buckets": BUCKETS,
        "samples": len(content.trajectory.time),
        "animation": animation_page([content.trajectory], ReplayOptions()),
        "data": script_json(figures),
        "script": template_text("report.js"),
        **assets(),
    }
    page: str = environment().get_template("report.html").render(words)
    return page


def assets() -> dict[str, str]:
    """What every page with figures carries: ``style``, ``library`` (plotly.js), ``drawing`` (its use in the theme)."""
    return {
        "style": template_text("report.css"),
        "library": files("plotly").joinpath("package_data", "plotly.min.js").read_text(encoding="utf-8"),
        "drawing": template_text("drawing.js"),
    }


def environment(folder: str = TEMPLATES) -> Any:
    """Templates of a folder: everything is escaped, and a name that is not there is an error."""
    from jinja2 import Environment, FunctionLoader, StrictUndefined

    made = Environment(
        loader=FunctionLoader(lambda name: template_text(name, folder)),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    made.filters |= filters()
    made.globals |= {"span": span, "policy": POLICY}
    return made


def template_text(name: str, folder: str = TEMPLATES) -> str:
    """A file of a folder of templates."""
    return files(folder).joinpath(name).read_text(encoding="utf-8")
