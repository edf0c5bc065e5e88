"""What a search for the best design says at its end."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Any

from drillrig_pin.batch.optimum import FILE, STUDY, at_bound, improvement
from drillrig_pin.batch.ranking import short
from drillrig_pin.batch.space import parameters
from drillrig_pin.batch.worker import INVALID
from drillrig_pin.cli.output import number, percent, table
from drillrig_pin.cli.sweep_words import print_counts, print_interrupted
from drillrig_pin.words import in_one_unit, quantity

if TYPE_CHECKING:
    from rich.console import Console

    from drillrig_pin.batch.goal import Trial
    from drillrig_pin.batch.optimizer import Found
    from drillrig_pin.batch.study import Study

#: Starts whose best values differ by less than this share agree.
AGREE = 0.01


def print_optimum(out: Console, study: Study, found: Found, folder: Path, again: str) -> None:
    """The best design beside the default, what it does under every condition, how sure it is, how to run it."""
    print_counts(out, found.tally)
    _print_trials(out, found)
    best = found.best
    if best is None or not best.feasible:
        if found.interrupted:
            print_interrupted(out, again)
        elif best is not None:
            out.print("No design is feasible. The nearest to it:", markup=False, style="red")
            _print_design(out, found, best)
            _print_breaches(out, best)
            out.print(f"Next: wider bounds or softer constraints. Cases: {found.table}", markup=False)
        return
    out.print()
    _print_design(out, found, best)
    out.print()
    if len(found.space.conditions) > 1:
        _print_conditions(out, found, best)
        out.print()
    out.print(f"{'So far: ' if found.interrupted else ''}{_gain(found, best)}", markup=False, style="bold")
    for line in _trust(found, best):
        out.print(line, markup=False)
    if found.interrupted:
        print_interrupted(out, again)
        return
    if found.differences:
        out.print(f"NOT reproduced when run again: {'; '.join(found.differences[:3])}", markup=False, style="red")
    else:
        out.print("Run again, the best design gives the same numbers to the last digit.", markup=False)
    out.print(f"Design: {folder / STUDY}, {folder / FILE}. Every evaluation: {found.table}.", markup=False)
    out.print(f"Next: {_command(study, found, best, folder)}", markup=False, soft_wrap=True)


def _print_trials(out: Console, found: Found) -> None:
    bad = [trial for trial in found.trials if not trial.feasible]
    per = f", each at {len(found.space.conditions)} conditions" if len(found.space.conditions) > 1 else ""
    out.print(f"{len(found.trials)} designs tried{per}; {len(bad)} infeasible.", markup=False)
    reasons: dict[str, tuple[int, Trial, Any]] = {}
    for trial in bad:
        for breach in trial.breaches[:1]:
            void = "not valid" if any(answer.status == INVALID for answer in trial.answers) else "cannot be run"
            key = f"breaks {breach.constraint.text}" if breach.constraint else void
            count = reasons[key][0] if key in reasons else 0
            reasons[key] = (count + 1, *reasons[key][1:]) if count else (1, trial, breach)
    for key, (count, trial, breach) in reasons.items():
        out.print(
            f"{key}: {count} designs, e.g. {_design(trial)}{_where(breach)}: {breach.reason}", markup=False, style="red"
        )


def _print_breaches(out: Console, trial: Trial) -> None:
    for breach in trial.breaches:
        what = f"breaks {breach.constraint.text}: " if breach.constraint else ""
        out.print(f"case {breach.case.index}{_where(breach)}: {what}{breach.reason}", markup=False, style="red")


def _print_design(out: Console, found: Found, best: Trial) -> None:
    """Values searched, beside the default's."""
    ends, rows = at_bound(found.space, best), []
    for item in parameters(found.space, found.asker):
        default = found.default.design[item.name] if found.default else None
        values = (default, best.design[item.name], item.low, item.high)
        note = f"at its {ends[item.name]} bound" if item.name in ends else ""
        cells = in_one_unit(values, item.unit)
        rows.append([short(item.name) + (" a" if item.assumed else ""), note, *cells])
    out.print(table("Design", ("", "", "default", "best", "from", "to"), rows, text=2))
    if any(item.assumed for item in parameters(found.space, found.asker)):
        out.print("a: the model's own value is assumed.", markup=False, style="dim")


def _print_conditions(out: Console, found: Found, best: Trial) -> None:
    goal, rows = found.goal, []
    before = found.default.values if found.default else [None] * len(best.values)
    for point, old, new in zip(found.space.conditions, before, best.values, strict=True):
        change = f"{100 * (new - old) / abs(old):+.1f} %" if old and new is not None else "–"
        worst = "worst" if goal.over == "worst" and new == best.value else ""
        rows.append([_condition(point), quantity(old, goal.unit), quantity(new, goal.unit), change, worst])
    value = found.default.value if found.default else None
    change = f"{100 * (best.value - value) / abs(value):+.1f} %" if value and best.value is not None else "–"
    rows.append([goal.over, quantity(value, goal.unit), quantity(best.value, goal.unit), change, ""])
    out.print(table(goal.metric, ("", "default", "best", "change", ""), rows))


def _gain(found: Found, best: Trial) -> str:
    goal = found.goal
    over = f", {goal.over} of {len(found.space.conditions)}" if len(found.space.conditions) > 1 else ""
    told = f"{goal.metric}{over}: {quantity(best.value, goal.unit, 4)}"
    default = found.default
    if default is None:
        return f"{told}; the model does not tell its default design."
    if not default.feasible:
        return f"{told}; the default design is infeasible: {default.breaches[0].reason}"
    if default.design == best.design:
        return f"{told}: nothing better than the default design was found."
    share = improvement(found)
    gain = f", {percent(share)} better" if share is not None else ""
    outside = "" if found.space.inside(default.design) else " (outside the bounds)"
    return f"{told}{gain} than the default's {quantity(default.value, goal.unit, 4)}{outside}."


def _trust(found: Found, best: Trial) -> list[str]:
    """Bounds that are hit, and whether the starts agree."""
    lines = []
    for name, end in at_bound(found.space, best).items():
        lines.append(f"{short(name)} is at its {end} bound: a wider one may give more.")
    values = [start.value for start in found.starts if start.value is not None]
    if len(values) < 2 or best.value is None:
        return lines
    spread = (max(values) - min(values)) / abs(best.value) if best.value else 0.0
    told = ", ".join(quantity(value, found.goal.unit, 4) for value in values)
    if spread <= AGREE:
        lines.append(f"The starts agree: {told}.")
    else:
        lines.append(f"The starts disagree by {percent(spread)} ({told}): a larger --budget may find better.")
    return lines


def _command(study: Study, found: Found, best: Trial, folder: Path) -> str:
    """The command that runs the design."""
    if found.space.conditions != [{}] or not isinstance(study.scenario, str):
        return shlex.join(["drillrig", "sweep", str(folder / STUDY), "-o", str(folder / "best"), "--keep", "all"])
    changes = {**study.set, **best.design}
    settings = [word for name, value in changes.items() for word in ("--set", f"{name}={value}")]
    model = [study.model] if study.model is not None else []
    return shlex.join(["drillrig", "run", *model, "--scenario", study.scenario, *settings])


def _design(trial: Trial) -> str:
    return ", ".join(f"{short(name)} {number(value)}" for name, value in trial.design.items())


def _where(breach: Any) -> str:
    point = {name: value for name, value in breach.case.inputs.items() if name == "hole"}
    return f" at {_condition(point)}" if point else ""


def _condition(point: dict[str, Any]) -> str:
    """A condition as a row says it: a hole by its name, anything else with what it is."""
    return ", ".join(
        str(v) if n == "hole" else f"{short(n)} {v:.6g}" if isinstance(v, float) else f"{short(n)} {v}"
        for n, v in point.items()
    )
