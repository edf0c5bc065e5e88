"""One case of a finished study, brought back: its trajectory from the folder, or by asking the same question again.

A study's folder may come from anybody. What it says of its model is taken from the text it keeps; a xacro file that it
names is evaluated only where the caller says so.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from drillrig_pin.batch.cases import Question, model_fingerprint
from drillrig_pin.batch.holes import aim_at
from drillrig_pin.batch.store import TRAJECTORIES
from drillrig_pin.batch.study import field_change
from drillrig_pin.batch.table import StudyTable, is_study
from drillrig_pin.batch.worker import Order, solve
from drillrig_pin.errors import DrillrigError, ResultFileError
from drillrig_pin.litter import temporary_folder
from drillrig_pin.model.foreign import is_data, is_program
from drillrig_pin.model.modelfile import ModelFile, read_model, read_model_text
from drillrig_pin.rig import build_rig
from drillrig_pin.trajectory import Trajectory, load_trajectory

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Recalled:
    """A case brought back.

    Attributes:
        trajectory: its run.
        path: where that lies now; None if the folder cannot be written.
        computed: it was not kept and has been computed again.
        same: it answers the same question with the same software as the row in the table.
    """

    trajectory: Trajectory
    path: Path | None
    computed: bool
    same: bool


def changes_of(table: StudyTable, case: int) -> dict[str, Any]:
    """Fields of the base scenario that a case has otherwise, with values of the kinds the study gave them."""
    row, known = table.row(case), table.given
    return dict(field_change(n, known[n].get(row[n], row[n])) for n in table.inputs if n != "hole")


def recall(table: StudyTable, case: int, *, keep: bool = True, run_model: bool = False) -> Recalled:
    """The run of a case. One that was not kept is computed again and kept from then on, where the folder allows.

    Args:
        table: the study.
        case: its number.
        keep: save a run that was computed again beside those the study kept.
        run_model: evaluate a xacro file that the study names and that is not shipped, if the case must be computed.

    Raises:
        ResultFileError: no such case; it cannot be run, with the reason; its model is a program nobody said to run.
    """
    row, path = table.row(case), table.trajectory_path(case)
    if path.is_file():
        found = load_trajectory(path)
        return Recalled(found, path, False, _same(found, row))
    if not run_model:
        _require_data(table, case)
    # A link in somebody's folder may lead out of it: nothing is written through it.
    keep = keep and not (path.is_symlink() or path.parent.is_symlink())
    with temporary_folder() as folder:
        target = Path(folder, "run.nc")
        if keep:
            try:
                path.parent.mkdir(exist_ok=True)
                target = path
            except OSError:
                keep = False
        trajectory = _computed(table, row, target)
        if trajectory is None and keep:
            keep, target = False, Path(folder, "run.nc")
            trajectory = _computed(table, row, target)
        assert trajectory is not None
        return Recalled(trajectory, path if keep else None, True, _same(trajectory, row))


def _require_data(table: StudyTable, case: int) -> None:
    model = _model_of(table, case)
    if is_program(model):
        raise ResultFileError(
            f"case {case} was not kept, and to compute it again the program {model!r} must run, which the study names",
            where=table.folder,
            todo="If you trust that file, say so: drillrig replay --run-model, in Python recall(run_model=True).",
        )


def _model_of(table: StudyTable, case: int) -> str:
    return table.base.changed(changes_of(table, case)).model


def _computed(table: StudyTable, row: dict[str, Any], target: Path) -> Trajectory | None:
    """Run a case as its worker did; None if the target cannot be written."""
    changes = changes_of(table, row["case"])
    holes = table.study.holes
    hole = holes.places[row["hole"]] if holes and "hole" in table.inputs else None
    model = _model_of(table, row["case"])
    order = Order(table.base.model_dump(), {model: model_fingerprint(model)}, (), holes)
    answer = solve(order, [Question(row["key"], changes, hole)], {row["key"]: str(target)})[0]
    if target.is_file():
        return load_trajectory(target)
    if "cannot be written" in answer.reason:
        return None
    raise ResultFileError(
        f"case {row['case']} has no run: {answer.reason or answer.status}",
        where=table.folder,
        todo="Choose another case.",
    )


def _same(trajectory: Trajectory, row: dict[str, Any]) -> bool:
    return bool(trajectory.content_hash == row["content_hash"])


def study_around(run: Path) -> Path | None:
    """Folder of the study a kept trajectory belongs to; None for a run that stands alone."""
    folder = run.absolute().parent
    return folder.parent if folder.name == TRAJECTORIES and is_study(folder.parent) else None


def base_model(table: StudyTable) -> ModelFile | None:
    """Model of the base scenario as the study found it; None if the table keeps none that can be read.

    Tables of earlier versions keep none: then the model they name is read, if it is shipped or plain URDF.
    """
    try:
        if table.model:
            return read_model_text(table.model, "the model in the study")
        return read_model(table.base.model, table.base.arguments) if is_data(table.base.model) else None
    except DrillrigError:
        return None


def hole_places(table: StudyTable, file: ModelFile | None = None) -> dict[str, Vector]:
    """Where the holes of a study are in the world [m]; for one given by its pose, where the base model's tip stands.

    A pose is left out if there is no model, see :func:`base_model`. ``file``: that model, if it has been read already.
    """
    holes = table.study.holes
    if holes is None:
        return {}
    found: dict[str, Vector] = {}
    rig = None
    for name, hole in holes.places.items():
        if hole.at is not None:
            found[name] = hole.at
            continue
        try:
            file = file or base_model(table)
            if file is None:
                continue
            rig = rig or build_rig(file)
            found[name] = aim_at(rig, hole, holes).tip
        except DrillrigError:
            continue
    return found


def other_holes(table: StudyTable, case: int) -> tuple[Vector, ...]:
    """Places of the study's holes but the one this case drills."""
    if "hole" not in table.inputs:
        return ()
    own = table.row(case)["hole"]
    return tuple(place for name, place in hole_places(table).items() if name != own)
