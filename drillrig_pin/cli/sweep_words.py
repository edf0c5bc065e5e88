"""What a study shows while it runs and when it has ended."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from drillrig_pin.cli.output import number, table
from drillrig_pin.words import quantity

if TYPE_CHECKING:
    from rich.console import Console

    from drillrig_pin.batch.cases import Case
    from drillrig_pin.batch.runner import Finished
    from drillrig_pin.batch.session import Listener
    from drillrig_pin.batch.study import Study
    from drillrig_pin.batch.summary import Tally
    from drillrig_pin.rig import Rig


@contextmanager
def progress(*, quiet: bool) -> Iterator[Listener | None]:
    """A bar on stderr, if that is a terminal: cases done, rate, time left, failures, the worst and best so far."""
    if quiet or not sys.stderr.isatty():
        yield None
        return
    from rich.progress import BarColumn, Progress, TextColumn

    from drillrig_pin.cli.output import console

    columns = (BarColumn(20), TextColumn("{task.description}"))
    with Progress(*columns, console=console(stderr=True), transient=True) as bar:
        task = bar.add_task("starting workers", total=None)

        def listen(tally: Tally) -> None:
            bar.update(task, total=tally.total, completed=tally.done, description=standing(tally))

        yield listen


def say_first(study: Study) -> None:
    """Before a study runs: which joints its base scenario locks, which of its axes cannot change anything.

    Raises:
        ScenarioError, ModelError: what it locks cannot be locked.
    """
    from drillrig_pin.batch.idle import idle_axes
    from drillrig_pin.cli.case import read_rig
    from drillrig_pin.cli.output import console
    from drillrig_pin.fitting import locked_words

    # Another model may have other joints; each case says what is wrong with its own.
    one = study.base.lock and "scenario.model" not in study.names
    locked = [f"{words} (in the base scenario)" for words in locked_words(read_rig(study.base))] if one else []
    for words in (*locked, *idle_axes(study)):
        console(stderr=True).print(f"note: {words}.", markup=False, style="yellow", soft_wrap=True)


def standing(tally: Tally) -> str:
    """One line about a study under way."""
    words = [f"{tally.done} of {tally.total} cases"]
    rate = tally.rate(time.monotonic())
    if tally.since_start:
        left = (tally.total - tally.done) / rate
        words.append(f"{number(rate, 2)}/s, {_duration(left)} left" if tally.done < tally.total else "saving")
    if tally.failures:
        words.append(f"[red]{tally.failures} failed[/]")
    if tally.note:
        words.append(tally.note)
    elif tally.best is not None and tally.worst is not None:
        best, worst = quantity(tally.best[1], tally.unit), quantity(tally.worst[1], tally.unit)
        words.append(f"{tally.metric} {best} to {worst}")
    return " · ".join(words)


def print_end(out: Console, finished: Finished, again: str) -> None:
    """What came out, what failed and why, where it is, what to do next."""
    tally = finished.tally
    print_counts(out, tally)
    if tally.best is not None and tally.worst is not None and tally.best != tally.worst:
        rows = [
            [word, str(case.index), quantity(value, tally.unit), inputs(case)]
            for word, (case, value) in (("best", tally.best), ("worst", tally.worst))
        ]
        out.print(table(f"{tally.metric}", ("", "case", "value", "with"), rows, text=4))
    print_failures(out, tally)
    if finished.kept:
        out.print(f"{len(finished.kept)} trajectories in {next(iter(finished.kept.values())).parent}.", markup=False)
    if finished.interrupted:
        print_interrupted(out, again)
    else:
        folder = finished.table.parent
        out.print(
            f"Table: {finished.table}. Next: drillrig sweep-report {folder}, drillrig replay {folder}", markup=False
        )


def print_counts(out: Console, tally: Tally) -> None:
    """How many cases there are, how many of them are new, how long it took."""
    news = f"{tally.done - tally.before} now, {tally.before} before" if tally.before else ""
    took = _duration(time.monotonic() - tally.started)
    out.print(f"{tally.done} of {tally.total} cases recorded{f' ({news})' if news else ''} in {took}.", markup=False)
    for doubt in doubts(tally):
        out.print(f"warning: {doubt}", markup=False, style="yellow", soft_wrap=True)


def doubts(tally: Tally) -> Iterator[str]:
    """What keeps the numbers of completed cases from being what they are called."""
    if tally.unsteady:
        todo = f"; run them at least {number(math.ceil(tally.needed), 3)} s" if tally.needed else ""
        yield (
            f"{tally.unsteady} of {tally.statuses['completed']} completed cases are not steady yet, their numbers hold "
            f"part of the start{todo} (column window.steady)"
        )
    if tally.unseen:
        yield (
            f"{tally.unseen} cases have too few rows to show their loads (column window.sampled): raise "
            "scenario.output_rate"
        )


def print_failures(out: Console, tally: Tally) -> None:
    """Of every way to fail the number of cases, and one of them with its reason."""
    for status, count in sorted(tally.statuses.items()):
        if status in tally.reasons:
            case, reason = tally.reasons[status]
            out.print(
                f"{status}: {count}, e.g. case {case.index} ({inputs(case)}): {reason}", markup=False, style="red"
            )


def print_interrupted(out: Console, again: str) -> None:
    """How to go on."""
    out.print(f"Interrupted; what is recorded is safe. To go on: {again}", markup=False, style="yellow")


def inputs(case: Case) -> str:
    """What is varied in a case, in words."""
    shown = (f"{n.removeprefix('model.').removeprefix('scenario.')} {_value(v)}" for n, v in case.inputs.items())
    return ", ".join(shown)


def print_poses(out: Console, study: Study, rig: Rig, again: str, found: dict[str, Any]) -> None:
    """Joint positions for every hole; ``again``: the command that shows them."""
    from drillrig_pin.batch.holes import UnreachableError
    from drillrig_pin.fitting import locked_words

    assert study.holes is not None
    rows, notes = [], []
    for name, item in found.items():
        assumed = "assumed" if study.holes.places[name].source.startswith("assumed") else ""
        if isinstance(item, UnreachableError):
            rows.append([name, assumed, *_place(study.holes.places[name].at), *["–"] * len(rig.joints)])
            notes.append(f"{name} is out of reach: {item}")
        else:
            rows.append([name, assumed, *_place(item.tip), *(_position(rig, j, item.positions[j]) for j in rig.joints)])
    out.print(table(f"{study.text or study.name}", ("hole", "", "x m", "y m", "z m", *rig.joints), rows, text=2))
    for words in locked_words(rig):
        out.print(f"note: {words}", markup=False, soft_wrap=True)
    for note in notes:
        out.print(note, markup=False, style="red")
    out.print(f"Next: {again} -o holes, to drill them and see where the machine shakes most", markup=False)


def print_holes(out: Console, study: Study, finished: Finished) -> None:
    """One line for every row of the table: how much it shakes, and the cylinder nearest to its limits."""
    import pyarrow.parquet

    rows = []
    for row in pyarrow.parquet.read_table(finished.table).to_pylist():
        cells = [str(row["hole"]), "assumed" if row["hole.assumed"] else "", row["status"]]
        high = _greatest(row, ".p_max")
        low = _greatest(row, ".p_min", -1.0)
        cells.append(quantity(row.get(finished.tally.metric), finished.tally.unit))
        cells += [f"{found[0]} {quantity(found[1], 'Pa')}" if found else "–" for found in (high, low)]
        rows.append(cells)
    columns = ("hole", "", "status", finished.tally.metric or "–", "highest pressure", "lowest pressure (absolute)")
    out.print(table(study.text or study.name, columns, rows, text=3))


def _greatest(row: dict[str, Any], ending: str, sign: float = 1.0) -> tuple[str, float] | None:
    found = {name.removesuffix(ending): v for name, v in row.items() if name.endswith(ending) and v is not None}
    return max(found.items(), key=lambda item: sign * item[1]) if found else None


def _place(at: tuple[float, float, float] | None) -> list[str]:
    return [f"{x:.3f}" for x in at] if at else ["–"] * 3


def _position(rig: Rig, joint: str, value: float | list[float]) -> str:
    if isinstance(value, list):
        return "–"
    slides = "P" in rig.model.joints[rig.model.getJointId(joint)].shortname()
    return f"{value:.3f} m" if slides else f"{math.degrees(value):.1f}°"


def _value(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _duration(seconds: float) -> str:
    if seconds < 100:
        return f"{seconds:.1f} s" if seconds < 10 else f"{seconds:.0f} s"
    minutes = seconds / 60
    return f"{minutes:.0f} min" if minutes < 100 else f"{minutes / 60:.1f} h"
