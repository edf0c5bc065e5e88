"""The page itself: one HTML document that needs nothing else."""

from __future__ import annotations

import base64
from collections.abc import Mapping

from drillrig_pin.analysis.quantities import label_of
from drillrig_pin.escaping import script_json
from drillrig_pin.report.page import assets, environment, template_text
from drillrig_pin.studyreport.content import StudyContent, replay_command
from drillrig_pin.studyreport.pictures import pictures
from drillrig_pin.studyreport.ranking import cases_data, metric_choices, rerun_command

TEMPLATES = "drillrig_pin.studyreport.templates"


def study_page(
    content: StudyContent, picture: str = "", caption: str = "", links: Mapping[int, Mapping[str, str]] | None = None
) -> str:
    """The report of a study as one HTML document.

    Args:
        content: what it says, see :func:`drillrig_pin.studyreport.content.gather`.
        picture: SVG of the rock face; empty for a study without holes.
        caption: how to read it.
        links: addresses by case and words, see :func:`drillrig_pin.studyreport.ranking.cases_data`.

    Everything that comes from model and study is escaped, and the page forbids itself every request.
    """
    subject = content.subject
    table = subject.table
    figures = {metric: pictures(subject, metric) for metric in table.metrics}
    data = {
        "metric": subject.metric,
        "replay": replay_command(subject),
        "run": rerun_command(subject),
        "figures": figures,
        **cases_data(content, links or {}),
    }
    words = {
        "c": content,
        "s": subject,
        "table": table,
        "names": list(dict.fromkeys(name for found in figures.values() for name in found)),
        "metric_label": label_of(subject.metric, table.units.get(subject.metric, "")),
        "choices": metric_choices(subject),
        "picture": base64.b64encode(picture.encode()).decode(),
        "caption": caption,
        "data": script_json(data),
        "script": template_text("study.js", TEMPLATES),
        **assets(),
        "own_style": template_text("study.css", TEMPLATES),
    }
    page: str = environment(TEMPLATES).get_template("study.html").render(words)
    return page
