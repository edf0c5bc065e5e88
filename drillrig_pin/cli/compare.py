"""The command that lays runs beside each other."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from drillrig_pin.cli.case import Json
from drillrig_pin.cli.files import require_folder
from drillrig_pin.cli.output import console, number, print_json, table, working
from drillrig_pin.cli.subject import read_subject
from drillrig_pin.cli.targets import Force, require_targets
from drillrig_pin.errors import ResultFileError

if TYPE_CHECKING:
    from rich.console import Console

    from drillrig_pin.analysis.comparison import Change, Comparison
    from drillrig_pin.analysis.differences import Difference

KINDS = ("parameter", "model", "scenario", "software")
#: Rows of a table beyond which only the most important are shown, unless --all is given.
SHOWN = 24


def compare(
    runs: Annotated[
        list[Path], typer.Argument(metavar="RUN", help="Two or more result files; all are held against the first.")
    ],
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FOLDER", help="Draw the figures laid over each other, PNG and SVG."),
    ] = None,
    everything: Annotated[
        bool, typer.Option("--all", help="Also what did not change, and every place of the model.")
    ] = False,
    force: Force = False,
    json: Json = False,
) -> None:
    """Say in what runs differ: which numbers changed by how much, and which parameters were not the same.

    Example:  [bold]drillrig compare run.nc longer.nc -o compared[/]
    """
    from drillrig_pin.analysis.comparison import compare_runs, comparison_document

    if len(runs) < 2:
        todo = "Give two or more, e.g. drillrig compare a.nc b.nc."
        raise ResultFileError("one run cannot be compared", where=runs[0], todo=todo)
    if output is not None:
        require_folder(output)
    subjects = [read_subject(run) for run in runs]
    found = compare_runs([subject.trajectory for subject in subjects])
    names = run_names(runs)
    figures: list[Path] = []
    if output is not None:
        from drillrig_pin.figures.overlay import overlay
        from drillrig_pin.figures.printed import file_names, save_sheets
        from drillrig_pin.figures.registry import sheets_of

        sheets = overlay([(name, sheets_of(subject)) for name, subject in zip(names, subjects, strict=True)])
        require_targets(output, file_names(sheet.name for sheet in sheets), reads=runs, force=force)
        with working("drawing"):
            figures = save_sheets(sheets, output)
    if json:
        document = comparison_document(found, [str(run) for run in runs])
        print_json({**document, "figures": [str(path) for path in figures]})
        return
    out = console()
    for caution in found.cautions:
        out.print(f"note: {caution}.", markup=False, style="yellow", soft_wrap=True)
    _print_differences(out, found, names, everything=everything)
    _print_changes(out, found, names, everything=everything)
    if output is not None:
        out.print(f"{len(figures)} figures in {output}.", markup=False)


def run_names(runs: Sequence[Path]) -> list[str]:
    """A short name for every run: its file's, or its path if two files are called the same."""
    stems = [run.stem for run in runs]
    return stems if len(set(stems)) == len(stems) else [str(run.with_suffix("")) for run in runs]


def _print_differences(out: Console, found: Comparison, names: Sequence[str], *, everything: bool) -> None:
    if not found.differences:
        out.print("The same model, scenario and software.\n")
        return
    by_kind = {kind: [d for d in found.differences if d.kind == kind] for kind in KINDS}
    parameters = by_kind["parameter"]
    same_machine = len(set(found.machines)) == 1
    if not same_machine and not everything:
        parameters = [d for d in parameters if None not in d.values]
    # Places of the model follow from parameters; without such they are the difference themselves.
    places = by_kind["model"] if everything or (same_machine and not parameters) else []
    limit = len(found.differences) if everything else SHOWN
    listed = [*parameters[:limit], *places[:limit], *by_kind["scenario"][:limit], *by_kind["software"]]
    if listed:
        rows = [_difference_cells(difference) for difference in listed]
        out.print(table("What was not the same", ("", "what", *names, "unit"), rows, text=2), "")
    counts = {
        "parameters": len(by_kind["parameter"]) - len(parameters[:limit]),
        "values of the expanded model": len(by_kind["model"]) - len(places[:limit]),
        "scenario fields": len(by_kind["scenario"]) - len(by_kind["scenario"][:limit]),
    }
    hidden = [f"{count} {what}" for what, count in counts.items() if count]
    if hidden:
        out.print(f"Not the same either: {', '.join(hidden)}; see them with --all.\n", markup=False)


def _difference_cells(difference: Difference) -> tuple[str, ...]:
    values = ("–" if value is None else _short(value) for value in difference.values)
    return (difference.kind, _short(difference.name, 60), *values, difference.unit)


def _short(text: str, longest: int = 24) -> str:
    text = " ".join(text.split())
    return text if len(text) <= longest else f"{text[: longest - 1]}…"


def _print_changes(out: Console, found: Comparison, names: Sequence[str], *, everything: bool) -> None:
    rows = [row for row in found.rows if row.changed or everything]
    same = len(found.rows) - len(rows)
    shown = rows if everything else rows[: 2 * SHOWN]
    if shown:
        heads = ["", names[0]]
        for name in names[1:]:
            heads += [name, "change", ""]
        cells = []
        for row in shown:
            unit, factor = _unit([row.reference.value, *(c.value for c in row.changes)], row.reference.unit)
            line = [f"{row.reference.label}{f' [{unit}]' if unit else ''}", number(row.reference.value * factor)]
            for change in row.changes:
                line += _change_cells(change, factor)
            cells.append(line)
        out.print(table("What changed, the most important first", heads, cells), "")
    else:
        out.print("No number changed.", "")
    if len(rows) > len(shown):
        out.print(f"... and {len(rows) - len(shown)} more; see them with --all.", markup=False)
    if same:
        out.print(f"{same} numbers are the same to 0.1 %.", markup=False)
    if found.missing:
        missing = found.missing if everything else found.missing[:6]
        more = f" and {len(found.missing) - len(missing)} more" if len(found.missing) > len(missing) else ""
        out.print(f"Not in all runs: {'; '.join(missing)}{more}.", markup=False)


def _change_cells(change: Change, factor: float) -> list[str]:
    if change.verdict == "same":
        return [number(change.value * factor), "=", ""]
    sign = "+" if change.absolute > 0 else ""
    relative = f"{100 * change.relative:+.1f} %" if change.relative is not None else "from 0"
    word = "" if change.verdict == "other" else change.verdict
    return [number(change.value * factor), f"{sign}{number(change.absolute * factor, 3)} ({relative})", word]


def _unit(values: Sequence[float], unit: str) -> tuple[str, float]:
    from drillrig_pin.words import reading

    return reading(unit, max(abs(value) for value in values))
