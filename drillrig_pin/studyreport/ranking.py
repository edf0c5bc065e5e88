"""The cases as data of the page: columns in the units people read, verdicts, and how each case is run again."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from typing import Any

from drillrig_pin.analysis.quantities import MEANINGS, label_of, meaning_of
from drillrig_pin.batch.again import changes_of
from drillrig_pin.batch.face import worse_is_lower
from drillrig_pin.batch.table import StudyTable
from drillrig_pin.report.provenance import command_of, setting
from drillrig_pin.studyreport.content import StudyContent
from drillrig_pin.studyreport.scales import axis_scale, metric_scale
from drillrig_pin.studyreport.subject import StudySubject, finite
from drillrig_pin.words import quantity

#: Rows the page holds; of a larger study the worst ones.
MOST = 5000


def cases_data(content: StudyContent, links: Mapping[int, Mapping[str, str]]) -> dict[str, Any]:
    """Everything the page knows about cases.

    Args:
        content: the report.
        links: addresses by case and words, e.g. ``{3: {"animation": "cases/3.html"}}``.
    """
    subject = content.subject
    table = subject.table
    chosen = _chosen(subject)
    rows = [table.row(case) for case in chosen]
    columns = [*_inputs(subject, rows), *_extremes(subject, rows), *_metrics(subject, rows)]
    return {
        "cases": chosen,
        "columns": columns,
        "status": [row["status"] for row in rows],
        "reason": [row["reason"] or "" for row in rows],
        "level": [content.judgements[case].level.name for case in chosen],
        "over": [list(content.judgements[case].metrics) for case in chosen],
        "assumed": [bool(row.get("hole.assumed")) for row in rows],
        "settings": _settings(table, chosen),
        "links": [dict(links.get(case, {})) for case in chosen],
        "left_out": len(table) - len(chosen),
    }


def rerun_command(subject: StudySubject) -> str:
    """The command line of the base scenario; what a case has otherwise is added to it."""
    study, base = subject.table.study, subject.table.base
    if not isinstance(study.scenario, str):
        return command_of(base, base.arguments)
    words = ["drillrig run", *([shlex.quote(study.model)] if study.model else []), "--scenario"]
    return " ".join([*words, shlex.quote(study.scenario), *(setting(n, v) for n, v in study.set.items())])


def _chosen(subject: StudySubject) -> list[int]:
    """Cases on the page, in their order: all, or the worst ones and as many without a result as still fit."""
    table = subject.table
    if len(table) <= MOST:
        return list(table.cases)
    ranked = table.ranked(subject.metric)
    known = set(ranked)
    others = [case for case in table.cases if case not in known]
    return sorted([*ranked[: max(MOST - len(others), MOST // 2)], *others][:MOST])


def _inputs(subject: StudySubject, rows: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    found = []
    for axis in subject.axes:
        scale = axis_scale(axis)
        values = [str(row[axis.name]) if axis.words else scale.of(row[axis.name]) for row in rows]
        found.append({"key": axis.name, "label": axis.label, "unit": scale.unit, "kind": "input", "values": values})
    return found


def _metrics(subject: StudySubject, rows: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    found = []
    for metric in subject.table.metrics:
        scale = metric_scale(subject, metric)
        meaning = meaning_of(metric)
        column: dict[str, Any] = {
            "key": metric,
            "label": scale.label,
            "unit": scale.unit,
            "kind": "metric",
            "better": meaning.better if meaning else "lower",
            "values": [scale.of(row[metric]) for row in rows],
        }
        bound = subject.bounds.get(metric)
        if bound is not None:
            unit = subject.table.units.get(metric, "")
            side = "≥" if bound.least else "≤"
            column["limit"] = scale.of(bound.value)
            column["least"] = bound.least
            column["limit_words"] = f"{side} {quantity(bound.value, unit)}{' (assumed)' if bound.assumed else ''}"
            column["limit_source"] = bound.source
        found.append(column)
    return found


def _extremes(subject: StudySubject, rows: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Of metrics that every cylinder has: the worst value in a case, and whose it is."""
    found = []
    for ending, words in (("p_max", "highest pressure"), ("p_min", "lowest pressure"), ("share", "greatest share")):
        names = [metric for metric in subject.table.metrics if metric.endswith(f".{ending}")]
        if len(names) < 2:
            continue
        scale = metric_scale(subject, names[0])
        choose = min if worse_is_lower(names[0]) else max
        values, whose = [], []
        for row in rows:
            known = {name: value for name in names if (value := finite(row[name])) is not None}
            name = choose(known, key=lambda name: known[name]) if known else ""
            values.append(scale.of(known[name]) if name else None)
            whose.append(name.rpartition(".")[0])
        column = {"key": f"*.{ending}", "label": words, "unit": scale.unit, "kind": "extreme", "values": values}
        found.append(column | {"whose": whose, "better": MEANINGS[ending].better})
    return found


def _settings(table: StudyTable, cases: Sequence[int]) -> list[str]:
    """What every case adds to the command line of the base scenario; empty where that cannot be said in words."""
    positions = [name for name in table.columns if name.startswith("position.")]
    found = []
    for case in cases:
        row = table.row(case)
        words = [
            setting(f"model.{n.removeprefix('arguments.')}" if n.startswith("arguments.") else f"scenario.{n}", value)
            for n, value in changes_of(table, case).items()
        ]
        words += [
            setting(f"scenario.positions.{n.removeprefix('position.')}", row[n])
            for n in positions
            if row[n] is not None
        ]
        reachable = "hole" not in table.inputs or any(row[n] is not None for n in positions)
        found.append(" ".join(words) if reachable else "")
    return found


def metric_choices(subject: StudySubject) -> list[tuple[str, list[tuple[str, str]]]]:
    """Metrics to choose from, in groups: key and words."""
    groups: dict[str, list[tuple[str, str]]] = {}
    for metric in subject.table.metrics:
        meaning = meaning_of(metric)
        group = meaning.group if meaning else "others"
        groups.setdefault(group, []).append((metric, label_of(metric, subject.table.units.get(metric, ""))))
    return list(groups.items())
