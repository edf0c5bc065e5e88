"""What a sensitivity study says at its end."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from drillrig_pin.batch.importance import FILE
from drillrig_pin.batch.ranking import short
from drillrig_pin.cli.output import number, table
from drillrig_pin.cli.sweep_words import print_counts, print_failures
from drillrig_pin.words import in_one_unit, quantity

if TYPE_CHECKING:
    from rich.console import Console

    from drillrig_pin.batch.importance import Index, Parameter, Sensitivity
    from drillrig_pin.batch.runner import Finished

#: Width of the longest bar.
BAR = 8


def print_sensitivity(out: Console, result: Sensitivity, finished: Finished, again: str, more: str) -> None:
    """Counts, failures, the ranking of the metric in question, whether to trust it, where it is, what comes next."""
    print_counts(out, finished.tally)
    out.print(plan_in_words(result), markup=False)
    print_failures(out, finished.tally)
    about = next(item for item in result.metrics if item.metric == result.metric)
    if result.failed:
        out.print(_left_out(result, about.blocks), markup=False, style="red")
    worst = f", {result.over} of {result.conditions}" if result.over else ""
    least, mean, greatest = (quantity(v, about.unit) for v in (about.least, about.mean, about.greatest))
    title = f"{result.metric}{worst}: {least} to {greatest} over the designs looked at, mean {mean}"
    indices = result.of(result.metric)
    known = {parameter.name: parameter for parameter in result.parameters}
    rows = [_row(index, known[index.parameter], indices[0].importance) for index in indices]
    columns: tuple[str, ...] = ("", "parameter", "", "from", "to")
    if result.method == "morris":
        columns += ("effect µ*", "± 95 %", "µ", "σ/µ*")
    else:
        columns += ("total ST", "± 95 %", "alone S1", "± 95 %")
    out.print()
    out.print(table(title, columns, rows, text=3))
    out.print()
    out.print(about.verdict, markup=False)
    if result.method == "morris":
        note = "µ*: mean change over the whole range; µ: with its sign; σ/µ* above 0.5: it depends on the others."
    else:
        note = "ST: share of the variance that would go if the parameter were known; S1: what it does alone."
    out.print(note, markup=False, style="dim")
    if any(parameter.assumed for parameter in result.parameters):
        out.print("a: the model's own value is assumed.", markup=False, style="dim")
    others = len(result.metrics) - 1
    told = f" of this and {others} other metrics" if others else ""
    out.print(f"Indices{told}: {finished.table.parent / FILE}. Cases: {finished.table}.", markup=False)
    if about.advised is not None:
        option = "trajectories" if result.method == "morris" else "samples"
        out.print(
            f"Next: {again}{more} --{option} {about.advised}, which keeps the cases there are",
            markup=False,
            soft_wrap=True,
        )
    elif result.method == "morris" and len(indices) > 1:
        out.print(f"Next: {again}_sobol --method sobol, for shares of the variance", markup=False, soft_wrap=True)
    else:
        out.print(
            f"Next: {again.replace(' sensitivity ', ' optimize ', 1)}_best, for the best design",
            markup=False,
            soft_wrap=True,
        )


def plan_in_words(result: Sensitivity) -> str:
    """What the cases are made of."""
    names = len(result.parameters)
    if result.method == "morris":
        text = f"{result.blocks} Morris trajectories of {names + 1} designs"
    else:
        text = f"{result.blocks} Sobol samples of {names + 2} designs"
    return f"{text}, each run under {result.conditions} conditions." if result.conditions > 1 else f"{text}."


def _left_out(result: Sensitivity, used: int) -> str:
    text = f"{result.failed} of {result.designs} designs have no number"
    if used < result.blocks:
        text += f"; the {result.blocks - used} trajectories they belong to are left out, {used} remain"
        text += ". The indices hold for the part of the ranges that can be run"
    return f"{text}."


def _row(index: Index, parameter: Parameter, greatest: float) -> list[str]:
    bar = "█" * max(0, round(BAR * index.importance / greatest)) if greatest > 0 else ""
    name = short(index.parameter) + (" a" if parameter.assumed else "")
    bounds = in_one_unit((parameter.low, parameter.high), parameter.unit)
    cells = [str(index.rank), name, bar, *bounds]
    if index.mu_star is not None and index.mu is not None and index.sigma is not None:
        effects = (index.mu_star, index.mu_star_conf, index.mu)
        share = index.sigma / index.mu_star if index.mu_star else math.nan
        return [*cells, *(quantity(value, index.unit) for value in effects), number(share, 2)]
    shares = (index.ST, index.ST_conf, index.S1, index.S1_conf)
    return [*cells, *("–" if value is None else f"{value:.2f}" for value in shares)]
