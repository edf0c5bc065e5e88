"""What is made of a result or a model when somebody asks for it: figures, pages, tables, findings. Runs in a worker."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from drillrig_pin.errors import DrillrigError, ModelError, ResultFileError
from drillrig_pin.files import saving
from drillrig_pin.service.bounds import bounded
from drillrig_pin.service.kept import ROOM, write_metrics, write_text
from drillrig_pin.service.problems import ServiceError, problem_of
from drillrig_pin.service.settings import Limits
from drillrig_pin.trajectory import Trajectory, load_trajectory
from drillrig_pin.words import plain

#: How an error begins that says a file is to blame.
DAMAGED = "not readable"


@dataclass(frozen=True, slots=True)
class Made:
    """What a worker made, or the problem it met; ``damaged`` if the result file is to blame."""

    value: Any = None
    problem: dict[str, Any] | None = None
    damaged: bool = False


def guarded(limits: Limits, function: Callable[..., Any], *arguments: Any) -> Made:
    """Call a function of this module; errors come back as problems, which travel between processes."""
    try:
        with bounded(min(limits.job_memory, limits.made_memory), limits.output):
            return Made(function(*arguments))
    except MemoryError:
        error = ModelError("this needs more memory than the server grants", todo="Ask for less at once.")
        return Made(problem=problem_of(error).model_dump())
    except OSError as error:
        full = ServiceError(507, f"it cannot be made ({error.strerror or error})", todo=ROOM)
        return Made(problem=problem_of(full).model_dump())
    except DrillrigError as error:
        told = isinstance(error, ResultFileError)
        status = 507 if told and "cannot be written" in error.what else None
        return Made(problem=problem_of(error, status).model_dump(), damaged=told and DAMAGED in error.what)


def metrics(run: Path, target: Path) -> None:
    """The numbers of the run as one document."""
    from drillrig_pin.service.measured import measured_document

    write_metrics(measured_document(load_trajectory(run)), target)


def csv(run: Path, target: Path) -> None:
    """The run as one table."""
    load_trajectory(run).to_csv(target)


def mat(run: Path, target: Path) -> None:
    """The run as a MATLAB 5 file."""
    load_trajectory(run).to_mat(target)


def figure_list(run: Path) -> list[dict[str, str]]:
    """Name, title and caption of every figure the run has."""
    from drillrig_pin.figures.registry import sheets_of

    return [{"name": sheet.name, "title": sheet.title, "caption": sheet.caption} for sheet in sheets_of(_subject(run))]


def figure(run: Path, name: str, form: str, folder: Path) -> str:
    """Draw one figure; gives the name of its file."""
    from drillrig_pin.figures.printed import save_sheets
    from drillrig_pin.figures.registry import sheets_of

    subject = _subject(run)
    try:
        sheets = sheets_of(subject, [name])
    except ResultFileError as error:
        raise ServiceError(404, error.what, todo=error.todo) from None
    folder.mkdir(exist_ok=True)
    written = save_sheets(sheets, folder, [form])
    return written[0].name


def figure_file(run: Path, name: str, form: str, target: Path) -> None:
    """Draw one figure into a file."""
    drawn = target.with_name(figure(run, name, form, target.parent))
    if drawn != target:
        drawn.replace(target)


def report(run: Path, target: Path) -> None:
    """The report of the run as one page."""
    from drillrig_pin.figures.registry import sheets_of
    from drillrig_pin.report.content import gather
    from drillrig_pin.report.page import report_page

    subject = _subject(run)
    write_text(target, report_page(gather(subject), sheets_of(subject)))


def replay(runs: list[Path], target: Path) -> None:
    """The machine in motion as one page; a second run is shown as its ghost."""
    from drillrig_pin.replay.page import animation_page

    write_text(target, animation_page([load_trajectory(run) for run in runs]))


def motion(run: Path, target: Path) -> None:
    """The machine in one run's motion as one page."""
    replay([run], target)


def compare(runs: list[Path], names: list[str]) -> dict[str, Any]:
    """What differs between runs, in the words of ``drillrig compare --json``."""
    from drillrig_pin.analysis.comparison import compare_runs, comparison_document

    found = compare_runs([_trajectory(run) for run in runs])
    document: dict[str, Any] = plain(comparison_document(found, names))
    return document


def check(path: str, text: str, arguments: dict[str, Any], name: str) -> dict[str, Any]:
    """Findings about a model."""
    from drillrig_pin.check import check_document, check_model, check_text

    problems = check_text(text, name) if text else check_model(path, arguments)
    return check_document(name, problems)


def expanded(path: str, arguments: dict[str, Any]) -> str:
    """A model of the library as one plain URDF."""
    from drillrig_pin.model.modelfile import read_model

    return read_model(path, arguments).text


def study_table(table: Path) -> dict[str, Any]:
    """The table of a study as one document: columns, units, which of them are varied, which measured, and the rows."""
    return _table_document(_read(table))


def study_so_far(study: dict[str, Any], folder: Path) -> dict[str, Any]:
    """The same of a study that is under way: the rows there are."""
    from drillrig_pin.batch.cases import unfold
    from drillrig_pin.batch.store import table_so_far
    from drillrig_pin.batch.study import Study

    return _table_document(table_so_far(folder, unfold(Study(**study))))


def _table_document(found: Any) -> dict[str, Any]:
    import json

    about = {key.decode(): value.decode() for key, value in (found.schema.metadata or {}).items()}
    units = json.loads(about["units"])
    inputs = _inputs(json.loads(about["study"]), found.column_names)
    columns = found.column_names
    left_out = {"case", "status", "reason", "solve_time", "wall_time", "content_hash", "key", *inputs}
    rest = {name for name in columns if name.startswith(("position.", "hole."))} - set(units)
    document: dict[str, Any] = plain(
        {
            "columns": columns,
            "units": units,
            "inputs": inputs,
            "metrics": [name for name in columns if name not in left_out | rest and name in units],
            "rows": list(zip(*(found.column(name).to_pylist() for name in columns), strict=True)),
        }
    )
    return document


def _inputs(study: dict[str, Any], columns: list[str]) -> list[str]:
    """What a study varies, in its order."""
    from drillrig_pin.batch.study import Study

    names = Study(**study).names
    return [name for name in names if name in columns]


def study_csv(table: Path, target: Path) -> None:
    """The table of a study as CSV."""
    import pyarrow.csv

    from drillrig_pin.batch.parquet import for_spreadsheets

    found = for_spreadsheets(_read(table))
    with saving(target, where=None, todo=ROOM) as aside:
        pyarrow.csv.write_csv(found, aside)


def study_again(study: dict[str, Any], folder: Path, rows: int, target: Path) -> None:
    """Make the table of a study again of its journal.

    Raises:
        ResultFileError: the journal is not readable, or holds fewer than so many rows.
    """
    import pyarrow.parquet

    from drillrig_pin.batch.cases import unfold
    from drillrig_pin.batch.store import table_so_far
    from drillrig_pin.batch.study import Study

    try:
        found = table_so_far(folder, unfold(Study(**study)))
    except ResultFileError:
        raise ResultFileError(f"the journal is {DAMAGED}") from None
    if len(found) < rows:
        raise ResultFileError(f"{rows - len(found)} cases of the journal are {DAMAGED}")
    with saving(target, where=None, todo=ROOM) as aside:
        pyarrow.parquet.write_table(found, aside)


def _read(table: Path) -> Any:
    import pyarrow.parquet

    try:
        return pyarrow.parquet.read_table(table)
    except (pyarrow.ArrowException, OSError):
        raise ResultFileError(f"the table is {DAMAGED}") from None


def study_report(folder: Path, target: Path) -> None:
    """The report of a study as one page."""
    from drillrig_pin.studyreport.write import write_study_report

    write_study_report(folder, target)


def study_report_of(table: Path, target: Path) -> None:
    """The report of the study a table belongs to."""
    study_report(table.parent, target)


def _subject(run: Path) -> Any:
    from drillrig_pin.analysis.limits import read_limits
    from drillrig_pin.figures.subject import subject_of

    return subject_of(_trajectory(run), limits=read_limits())


def _trajectory(run: Path) -> Trajectory:
    trajectory = load_trajectory(run)
    if len(trajectory.time) < 2:
        why = f"There is nothing to draw. The run ended: {trajectory.outcome}"
        raise ResultFileError("the run holds fewer than two samples", todo=why)
    return trajectory
