"""From result files and folders of studies to the runs they stand for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from drillrig_pin.cli.output import console, working
from drillrig_pin.errors import ResultFileError, ScenarioError

if TYPE_CHECKING:
    from drillrig_pin.batch.table import StudyTable
    from drillrig_pin.trajectory import Trajectory


@dataclass(frozen=True)
class Run:
    """A run, what to call it, and places of the other holes of its study [m]."""

    trajectory: Trajectory
    name: str
    holes: tuple[tuple[float, float, float], ...] = ()


def recalled(paths: Sequence[Path], cases: Sequence[int] | None, *, run_model: bool = False) -> list[Run]:
    """Runs that paths stand for: files, and cases of folders of studies (None: the worst case of each).

    ``run_model``: a case that was not kept may be computed with a xacro file that the study names.

    Raises:
        ResultFileError: a file or folder that cannot be used, no such case, or a case without a run.
        ScenarioError: cases without a folder of a study.
    """
    if cases and not any(path.is_dir() for path in paths):
        raise ScenarioError(
            f"{paths[0]} is no folder of a study", where="--case", todo="Give the folder that drillrig sweep -o made."
        )
    found: list[Run] = []
    for path in paths:
        found += _of_study(path, cases, run_model) if path.is_dir() else [_of_file(path)]
    return found


def _of_file(path: Path) -> Run:
    from drillrig_pin.trajectory import load_trajectory

    return Run(load_trajectory(path), str(path), _holes_around(path))


def _holes_around(path: Path) -> tuple[tuple[float, float, float], ...]:
    """Other holes of the study that kept this file; none if it stands alone or its study cannot be read."""
    from drillrig_pin.batch.again import other_holes, study_around
    from drillrig_pin.batch.table import read_table

    folder = study_around(path)
    if folder is None:
        return ()
    try:
        table = read_table(folder)
        case = next((case for case, kept in table.kept.items() if kept.name == path.name), None)
        return () if case is None else other_holes(table, case)
    except ResultFileError:
        return ()


def _of_study(folder: Path, cases: Sequence[int] | None, run_model: bool) -> list[Run]:
    from drillrig_pin.batch.again import other_holes, recall
    from drillrig_pin.batch.table import read_table

    table = read_table(folder)
    runs = []
    for case in cases or [_worst(table)]:
        with working(f"computing case {case} again" if case not in table.kept else f"reading case {case}"):
            found = recall(table, case, run_model=run_model)
        told = case_words(table, case)
        if found.computed:
            where = f"kept as {found.path}" if found.path else f"not kept, as {folder} cannot be written"
            _say(f"Case {case} ({told}) was computed again and is {where}.")
        elif cases is None:
            _say(f"Case {case} ({told}), from {found.path}.")
        if not found.same:
            _say(
                f"note: model or software have changed since the study ran: case {case} shows what they give now, "
                "the table what they gave then.",
                style="yellow",
            )
        runs.append(Run(found.trajectory, f"case {case}: {told}", other_holes(table, case)))
    return runs


def _worst(table: StudyTable) -> int:
    metric = table.metric()
    worst = table.worst(metric)
    if worst is None:
        raise ResultFileError(
            "no case of the study completed",
            where=table.folder,
            todo="Choose one with --case N to see how far it came.",
        )
    _say(f"Showing the worst case by {metric}; --case N shows another.")
    return worst


def case_words(table: StudyTable, case: int) -> str:
    """What is varied in a case, in words."""
    row = table.row(case)
    shown = (f"{n.removeprefix('model.').removeprefix('scenario.')} {_value(row[n])}" for n in table.inputs)
    return ", ".join(shown) or "nothing varied"


def _value(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _say(sentence: str, style: str | None = None) -> None:
    console(stderr=True).print(sentence, markup=False, style=style, soft_wrap=True)
