"""From the words of a command line to a run that can be drawn, with a measurement beside it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from drillrig_pin.errors import ResultFileError, ScenarioError
from drillrig_pin.words import percent

if TYPE_CHECKING:
    from drillrig_pin.analysis.measured import Comparison
    from drillrig_pin.figures.sheet import Sheet
    from drillrig_pin.figures.subject import Subject

RunFile = Annotated[Path, typer.Argument(metavar="RUN", help="Result file of drillrig run, e.g. run.nc.")]
MeasuredFile = Annotated[
    Path | None,
    typer.Option(
        "--measured",
        metavar="FILE.csv",
        help="Measured displacement of the survey point: columns time, value; header such as 'time \\[s], S_z \\[mm]'.",
    ),
]
MeasuredUnit = Annotated[
    str | None,
    typer.Option("--measured-unit", metavar="UNIT", help="Its unit, if the header does not say: m, cm, mm, um."),
]
MeasuredAxis = Annotated[
    str, typer.Option("--measured-axis", metavar="x|y|z", help="World axis the measurement is along.")
]
MeasuredShift = Annotated[
    float | None,
    typer.Option(
        "--shift",
        metavar="S",
        help="Add these seconds to its times. Default: where it fits the run best, which is said.",
    ),
]
LimitSettings = Annotated[
    list[str] | None,
    typer.Option("--limit", metavar="NAME=VALUE", help="A limit to judge by, e.g. toe_6m=100mm. May be repeated."),
]
LimitsFile = Annotated[
    Path | None,
    typer.Option("--limits", metavar="FILE.yaml", help="File of limits. Default: examples, marked as assumed."),
]
HoleDirection = Annotated[
    str | None,
    typer.Option(
        "--hole-direction",
        metavar="'X Y Z'",
        help="World direction the hole is meant to have. Default: that of the feed at the start.",
    ),
]


def read_subject(run: Path, **options: Any) -> Subject:
    """Load a run of at least two samples; ``options`` are fields of the subject beside it.

    Raises:
        ResultFileError: the file cannot be used, or the run is too short.
    """
    from drillrig_pin.figures.subject import subject_of
    from drillrig_pin.trajectory import load_trajectory

    trajectory = load_trajectory(run)
    if len(trajectory.time) < 2:
        why = f"There is nothing to draw. The run ended: {trajectory.outcome}"
        raise ResultFileError("the run holds fewer than two samples", where=run, todo=why)
    return subject_of(trajectory, **options)


def measured_beside(file: Path | None, unit: str | None, axis: str, shift: float | None) -> dict[str, Any]:
    """The measurement of a command line as options of a subject.

    Raises:
        ResultFileError: the file cannot be used, a unit without a file, or no such axis.
    """
    from drillrig_pin.analysis.measured import read_measurement
    from drillrig_pin.errors import legal_names
    from drillrig_pin.trajectory import AXES

    if axis not in AXES:
        raise ResultFileError(f"no axis {axis!r}", where="--measured-axis", todo=legal_names(axis, AXES, "axes"))
    if unit is not None and file is None:
        raise ResultFileError("there is no measurement", where="--measured-unit", todo="Give --measured FILE.csv.")
    if shift is not None and file is None:
        raise ResultFileError("there is no measurement", where="--shift", todo="Give --measured FILE.csv.")
    if shift is not None and not math.isfinite(shift):
        raise ResultFileError(f"{shift} is no time", where="--shift", todo="Give seconds.")
    measurement = read_measurement(file, unit) if file is not None else None
    return {"measurement": measurement, "measured_axis": axis, "measured_shift": shift}


def comparison_words(found: Comparison) -> list[str]:
    """A comparison with a measurement as lines for people."""
    errors = (
        f"Against the measurement: RMS error {percent(found.rms_error)}, peak error {100 * found.peak_error:+.1f} %, "
        f"correlation {found.correlation:.3f}, shift {found.shift:+.4g} s; {len(found.time)} samples."
    )
    return [errors, *(f"note: {note}" for note in found.notes)]


def judged_by(settings: Sequence[str] | None, file: Path | None, direction: str | None) -> dict[str, Any]:
    """Limits and direction of the hole of a command line as options of a subject; ScenarioError if not usable."""
    from drillrig_pin.analysis.limits import read_limits

    return {"limits": read_limits(file, settings or ()), "hole": _direction(direction)}


def _direction(text: str | None) -> tuple[float, float, float] | None:
    if text is None:
        return None
    try:
        x, y, z = (float(word) for word in text.replace(",", " ").split())
    except ValueError:
        x = y = z = math.nan
    if not (math.isfinite(x + y + z) and (x or y or z)):
        todo = "Give three numbers, x y z of the world, e.g. --hole-direction '1 0 -0.1'."
        raise ScenarioError(f"{text!r} is no direction", where="--hole-direction", todo=todo)
    return x, y, z


def require_comparison(sheets: Iterable[Sheet], measured: Path) -> None:
    """A measurement that was given and cannot be shown is an error, not a figure less."""
    if not any(sheet.name == "measured" for sheet in sheets):
        raise ResultFileError(
            "cannot be compared with the run",
            where=measured,
            todo="It needs a tracked point that moves, and half of the shorter signal in common with it.",
        )


def cut_sheets(sheets: Iterable[Sheet], start: float, end: float) -> list[Sheet]:
    """The sheets between two times [s]; ResultFileError if nothing is left of one."""
    cut = []
    for sheet in sheets:
        part = sheet.between(start, end)
        if not part.panels:
            todo = "Give two times within it, the earlier one first."
            raise ResultFileError(
                f"figure {sheet.name!r} has nothing from {start:g} to {end:g} s", where="--window", todo=todo
            )
        cut.append(part)
    return cut
