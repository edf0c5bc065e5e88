"""What a study report says, in words; the template only arranges it."""

from __future__ import annotations

import datetime
import math
import shlex
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from drillrig_pin.analysis.quantities import label_of
from drillrig_pin.analysis.verdict import Level
from drillrig_pin.batch.worker import COMPLETED
from drillrig_pin.figures.face import conclusion
from drillrig_pin.studyreport.effects import effects_of
from drillrig_pin.studyreport.judge import Judgement, bound_words, broken, judge_all
from drillrig_pin.studyreport.subject import StudySubject
from drillrig_pin.trajectory import versions
from drillrig_pin.words import number, quantity

#: Groups of failures listed, and cases named in each.
MOST_REASONS, MOST_NAMED = 60, 12


@dataclass(frozen=True, slots=True)
class Statement:
    """One sentence of the summary, with what it is about and how it is to be taken."""

    level: Level
    title: str
    sentence: str


@dataclass(frozen=True, slots=True)
class Failure:
    """Cases that ended the same way for the same reason."""

    status: str
    reason: str
    cases: tuple[int, ...]
    examples: str


@dataclass(frozen=True)
class StudyContent:
    """Everything on the page but figures and data."""

    subject: StudySubject
    headline: Statement
    statements: tuple[Statement, ...]
    failures: tuple[Failure, ...]
    judgements: Mapping[int, Judgement]
    limits: tuple[str, ...]
    axes: tuple[tuple[str, str, str, str], ...]
    newer: Mapping[str, str]
    made: str

    @property
    def sentences(self) -> tuple[str, ...]:
        """The summary as plain text, the headline first."""
        return (self.headline.sentence, *(statement.sentence for statement in self.statements))


def gather(subject: StudySubject) -> StudyContent:
    """Judge every case and say in words what came out."""
    judgements = judge_all(subject)
    table, now = subject.table, versions()
    return StudyContent(
        subject,
        _headline(subject),
        tuple(_statements(subject, judgements)),
        tuple(_failures(subject)),
        judgements,
        tuple(bound_words(metric, bound, table.units.get(metric, "")) for metric, bound in subject.bounds.items()),
        tuple(_axis_rows(subject)),
        now if now != table.versions else {},
        datetime.datetime.now(datetime.UTC).strftime("%Y-%m-%d %H:%M UTC"),
    )


def case_words(subject: StudySubject, case: int) -> str:
    """What is varied in a case, in words."""
    row = subject.table.row(case)
    told = ((axis, axis.shown(row[axis.name])) for axis in subject.axes)
    return ", ".join(value if axis.name == "hole" else f"{axis.label} {value}" for axis, value in told)


def replay_command(subject: StudySubject) -> str:
    """The command that opens a case in replay, up to its number."""
    return f"drillrig replay {shlex.quote(str(subject.table.folder))} --case"


def _headline(subject: StudySubject) -> Statement:
    table, metric = subject.table, subject.metric
    ranked = table.ranked(metric)
    if not ranked:
        return Statement(Level.BAD, "No result", f"None of the {len(table)} cases completed; the reasons stand below.")
    if subject.face is not None and subject.face.drilled:
        return Statement(Level.NOTE, "The face", conclusion(subject.face))
    worst, best, unit = ranked[0], ranked[-1], table.units.get(metric, "")
    label = label_of(metric, unit)
    high, low = (quantity(table.row(case)[metric], unit) for case in (worst, best))
    if worst == best:
        return Statement(Level.NOTE, "One case", f"{label}: {high}.")
    sentence = f"{label}: best {low} at {_at(subject, best)}, worst {high} at {_at(subject, worst)}."
    return Statement(Level.NOTE, "Best and worst", sentence)


def _at(subject: StudySubject, case: int) -> str:
    words = case_words(subject, case)
    return f"{words} (case {case})" if words else f"case {case}"


def _statements(subject: StudySubject, judgements: Mapping[int, Judgement]) -> Iterator[Statement]:
    table, metric = subject.table, subject.metric
    unit = table.units.get(metric, "")
    ranked = table.ranked(metric)
    if subject.face is not None and subject.face.several and len(ranked) > 1:
        high, low = table.row(ranked[0])[metric], table.row(ranked[-1])[metric]
        ratio = f", {high / low:.2g} times as much" if low > 0 and high > 1.05 * low else ""
        sentence = (
            f"{label_of(metric, unit)}: best {quantity(low, unit)} in {_at(subject, ranked[-1])}, "
            f"worst {quantity(high, unit)} in {_at(subject, ranked[0])}{ratio}."
        )
        yield Statement(Level.NOTE, "Best and worst", sentence)
    yield from _without_effect(subject)
    yield from _what_matters(subject)
    yield from _limits(subject, judgements)
    yield _completeness(subject)
    yield from _doubts(subject)
    yield from _assumptions(subject)
    yield from _noise(subject)


def _without_effect(subject: StudySubject) -> Iterator[Statement]:
    """Axes that no result can depend on: what is seen along them comes from something else."""
    if subject.table.idle:
        yield Statement(Level.NEAR, "Without effect", f"{'; '.join(subject.table.idle)}.")


def _what_matters(subject: StudySubject) -> Iterator[Statement]:
    effects = sorted(effects_of(subject, subject.metric), key=lambda effect: -effect.swing)
    chance = [effect.axis.label for effect in effects if effect.swing <= effect.chance]
    effects = [effect for effect in effects if effect.swing > effect.chance]
    content = subject.importance
    verdict = next((m.get("verdict") for m in content.get("metrics", ()) if m.get("metric") == subject.metric), None)
    if verdict:
        yield Statement(Level.NOTE, "What matters", str(verdict))
    if len(subject.axes) < 2 or not effects:
        return
    unit, first = subject.table.units.get(subject.metric, ""), effects[0]
    sentence = (
        f"{first.axis.label} moves the mean of the metric most, from {quantity(first.lowest.mean, unit)} at "
        f"{first.lowest.label} to {quantity(first.highest.mean, unit)} at {first.highest.label}"
    )
    others = [f"{effect.axis.label} by {quantity(effect.swing, unit)}" for effect in effects[1:4]]
    sentence += f"; {', '.join(others)}." if others else "."
    if chance:
        sentence += f" What {', '.join(chance)} {'do' if len(chance) > 1 else 'does'} cannot be told from chance."
    yield Statement(Level.NOTE, "Along the axes", sentence)


def _limits(subject: StudySubject, judgements: Mapping[int, Judgement]) -> Iterator[Statement]:
    table = subject.table
    completed = [case for case in table.cases if table.row(case)["status"] == COMPLETED]
    if not completed or not subject.bounds:
        return
    bad = [case for case in completed if judgements[case].level is Level.BAD]
    if not bad:
        near = [case for case in completed if judgements[case].level is Level.NEAR]
        often = Counter(metric for case in near for metric in judgements[case].metrics).most_common(3)
        told = ", ".join(label_of(metric, table.units.get(metric, "")) for metric, _ in often)
        extra = f"; {len(near)} of {len(completed)} come near one ({told})" if near else ""
        sentence = f"Every completed case keeps all limits{extra}."
        yield Statement(Level.NEAR if near else Level.GOOD, "Limits", sentence)
        return
    reasons = []
    for metric, count, worst, value in broken(subject, judgements)[:4]:
        unit, bound = table.units.get(metric, ""), subject.bounds[metric]
        side = "least" if bound.least else "greatest"
        reasons.append(
            f"{label_of(metric, unit)} in {count} (worst {quantity(value, unit)} in case {worst}, {side} allowed "
            f"{quantity(bound.value, unit)})"
        )
    more = len(broken(subject, judgements)) - len(reasons)
    tail = f"; {more} more limits" if more > 0 else ""
    sentence = f"{len(bad)} of {len(completed)} completed cases break a limit: {'; '.join(reasons)}{tail}."
    yield Statement(Level.BAD, "Limits", sentence)


def _completeness(subject: StudySubject) -> Statement:
    table = subject.table
    parts = [f"{count} {status}" for status, count in table.statuses.most_common()]
    sentence = f"{len(table)} of {table.total} cases are recorded: {', '.join(parts)}."
    if len(table) < table.total:
        return Statement(
            Level.BAD, "Unfinished", f"{sentence} The command that ran the study goes on where it stopped."
        )
    failed = len(table) - table.completed
    return Statement(Level.NEAR if failed else Level.GOOD, "Cases", sentence)


def _doubts(subject: StudySubject) -> Iterator[Statement]:
    """Cases whose numbers are not those of a steady motion."""
    table = subject.table
    settled = zip(table.columns.get("window.steady", ()), table.columns["status"], strict=False)
    unsteady = sum(value == 0 and status == COMPLETED for value, status in settled)
    if unsteady:
        needed = max((value for value in table.columns.get("window.needed", ()) if value), default=0.0)
        todo = f" Run them at least {number(math.ceil(needed), 3)} s." if needed else ""
        yield Statement(
            Level.NEAR,
            "Not steady yet",
            f"{unsteady} of {table.completed} completed cases have not settled: their peaks, RMS and load cycles hold "
            f"part of the start, and so does their ranking.{todo}",
        )


def _assumptions(subject: StudySubject) -> Iterator[Statement]:
    holes = subject.table.study.holes
    places = [hole.source.startswith("assumed") for hole in holes.places.values()] if holes else []
    told = []
    if subject.parameters:
        told.append(f"{len(subject.assumed)} of {len(subject.parameters)} numbers of the model")
        told.extend(
            f"the usual value of {axis.label}, which is varied here"
            for axis in subject.axes
            if _is_assumed(axis.source)
        )
    if any(places):
        told.append(f"{sum(places)} of {len(places)} hole positions")
    if told:
        rests = " The ranking rests on them." if subject.table.completed > 1 else ""
        yield Statement(Level.NOTE, "Assumed", f"No source prints {'; '.join(told)}.{rests}")


def _is_assumed(source: str) -> bool:
    return source.startswith("assumed")


def _noise(subject: StudySubject) -> Iterator[Statement]:
    """Runs that may not be believed."""
    from drillrig_pin.analysis.trust import WORST_ERROR
    from drillrig_pin.balance import WORST_ENERGY

    table = subject.table
    doubtful = [
        case
        for case in table.cases
        if (table.row(case).get("trust.error") or 0.0) > WORST_ERROR
        or (table.row(case).get("trust.energy") or 0.0) > WORST_ENERGY
    ]
    if doubtful:
        named = ", ".join(str(case) for case in doubtful[:MOST_NAMED])
        yield Statement(
            Level.BAD,
            "Accuracy",
            f"{len(doubtful)} cases drift off their constraints or lose energy and should not be used: {named}.",
        )


def _failures(subject: StudySubject) -> Iterator[Failure]:
    table = subject.table
    groups: dict[tuple[str, str], list[int]] = {}
    for case in table.cases:
        row = table.row(case)
        if row["status"] != COMPLETED:
            groups.setdefault((row["status"], row["reason"] or ""), []).append(case)
    for (status, reason), cases in sorted(groups.items(), key=lambda item: -len(item[1]))[:MOST_REASONS]:
        named = [
            f"{case} ({words})" if (words := case_words(subject, case)) else str(case) for case in cases[:MOST_NAMED]
        ]
        more = f" and {len(cases) - MOST_NAMED} more" if len(cases) > MOST_NAMED else ""
        yield Failure(status, reason, tuple(cases), ", ".join(named) + more)


def _axis_rows(subject: StudySubject) -> Iterator[tuple[str, str, str, str]]:
    """Name, range, meaning and source of every axis."""
    for axis in subject.axes:
        values = subject.table.columns[axis.name]
        if axis.words:
            distinct = list(dict.fromkeys(str(value) for value in values))
            extent = ", ".join(distinct[:12]) + (f" and {len(distinct) - 12} more" if len(distinct) > 12 else "")
        else:
            extent = f"{axis.shown(min(values))} to {axis.shown(max(values))}, {axis.count} values"
        yield axis.label, extent, axis.text, axis.source
