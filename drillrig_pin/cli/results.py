"""Commands about result files: figures and other formats."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from drillrig_pin.cli.case import Json
from drillrig_pin.cli.files import require_folder, write_text
from drillrig_pin.cli.output import console, print_json, working
from drillrig_pin.cli.subject import (
    HoleDirection,
    LimitSettings,
    LimitsFile,
    MeasuredAxis,
    MeasuredFile,
    MeasuredShift,
    MeasuredUnit,
    RunFile,
    comparison_words,
    cut_sheets,
    judged_by,
    measured_beside,
    read_subject,
    require_comparison,
)
from drillrig_pin.cli.targets import Force, console_beside, require_apart, require_target, require_targets
from drillrig_pin.errors import ResultFileError, legal_names

if TYPE_CHECKING:
    from drillrig_pin.analysis.measured import Comparison


def plot(
    run: RunFile,
    figure: Annotated[
        list[str] | None,
        typer.Option(
            "--figure",
            "-f",
            metavar="NAME",
            help="Only this figure, or one panel of it (joints.boom_lift). May be given many times.",
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FOLDER", help="Where the figures go. Default: RUN_figures beside it."),
    ] = None,
    limit: LimitSettings = None,
    limits: LimitsFile = None,
    hole_direction: HoleDirection = None,
    measured: MeasuredFile = None,
    measured_unit: MeasuredUnit = None,
    measured_axis: MeasuredAxis = "z",
    shift: MeasuredShift = None,
    window: Annotated[
        tuple[float, float] | None,
        typer.Option("--window", metavar="FROM TO", help="Only this part of the run, in seconds, to see single blows."),
    ] = None,
    form: Annotated[
        list[str] | None, typer.Option("--format", metavar="png|svg", help="File format. Default: both.")
    ] = None,
    force: Force = False,
    json: Json = False,
) -> None:
    """Draw the figures of a run, ready for print: PNG and SVG, one column wide.

    Motion: joints, survey, path, hole, and measured with --measured.

    Spectra: survey_spectrum, joint_spectra.

    Forces: loads, pressures, cylinder_forces, rainflow, reaction.

    Trust: constraints, energy.

    What a run does not have (no cylinders, nothing held) is left out.

    Example:  [bold]drillrig plot run.nc -o figures[/]

    Example:  [bold]drillrig plot run.nc --figure survey --figure loads --window 9.5 10[/]

    Example:  [bold]drillrig plot run.nc --figure survey.z --figure measured --measured hole_9.csv[/]
    """
    from drillrig_pin.figures.motion import compared
    from drillrig_pin.figures.printed import FORMATS, file_names, save_sheets
    from drillrig_pin.figures.registry import sheets_of

    formats = form or list(FORMATS)
    for word in formats:
        if word not in FORMATS:
            raise ResultFileError(f"no format {word!r}", where="--format", todo=legal_names(word, FORMATS, "formats"))
    beside = measured_beside(measured, measured_unit, measured_axis, shift)
    subject = read_subject(run, **judged_by(limit, limits, hole_direction), **beside)
    sheets = sheets_of(subject, figure)
    beside_run = compared(subject)
    if window is not None:
        sheets = cut_sheets(sheets, *window)
    if measured is not None and figure is None:
        require_comparison(sheets, measured)
    folder = output if output is not None else run.with_name(f"{run.stem}_figures")
    require_folder(folder)
    names = file_names((sheet.name for sheet in sheets), dict.fromkeys(formats))
    require_targets(folder, names, reads=(run, measured, limits), force=force)
    with working("drawing"):
        written = save_sheets(sheets, folder, dict.fromkeys(formats))
    if json:
        print_json({"run": str(run), "figures": [str(path) for path in written], **_comparison(beside_run)})
        return
    out = console()
    out.print(f"{len(sheets)} figures in {folder}{os.sep}, as {' and '.join(dict.fromkeys(formats))}:", markup=False)
    for sheet in sheets:
        out.print(f"  {sheet.name:<18} {sheet.title}", markup=False)
    for line in comparison_words(beside_run) if beside_run is not None else ():
        out.print(line, markup=False, soft_wrap=True)


def report(
    run: RunFile,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FILE.html", help="Default: RUN_report.html beside it."),
    ] = None,
    limit: LimitSettings = None,
    limits: LimitsFile = None,
    hole_direction: HoleDirection = None,
    measured: MeasuredFile = None,
    measured_unit: MeasuredUnit = None,
    measured_axis: MeasuredAxis = "z",
    shift: MeasuredShift = None,
    force: Force = False,
    json: Json = False,
) -> None:
    """Write a run as one page for readers who never saw the code: verdict, numbers, animation, figures, sources.

    The page opens in any browser without network, prints, and asks nothing of the machine it is read on.

    Limits: angle, collar, toe_3m (any depth), shake.

    Example:  [bold]drillrig report run.nc -o report.html --limit toe_6m=100mm --limit angle=0.5deg[/]
    """
    from drillrig_pin.analysis.verdict import Level
    from drillrig_pin.figures.motion import compared
    from drillrig_pin.figures.registry import sheets_of
    from drillrig_pin.report.content import gather
    from drillrig_pin.report.page import report_page

    target = output if output is not None else run.with_name(f"{run.stem}_report.html")
    replaced = require_target(target, "page", reads=(run, measured, limits), force=force)
    beside = measured_beside(measured, measured_unit, measured_axis, shift)
    subject = read_subject(run, **judged_by(limit, limits, hole_direction), **beside)
    sheets = sheets_of(subject)
    beside_run = compared(subject)
    if measured is not None:
        require_comparison(sheets, measured)
    content = gather(subject)
    with working("writing the report"):
        page = report_page(content, sheets)
        write_text(target, page)
    size = len(page.encode())
    if json:
        print_json(
            {
                "run": str(run),
                "report": str(target),
                "bytes": size,
                "verdict": {"level": content.verdict[0].name, "sentence": content.verdict[1]},
                "findings": [
                    {"level": f.level.name, "title": f.title, "sentence": f.sentence, "advice": f.advice}
                    for f in content.findings
                ],
                "hole_quality": content.quality,
                "limits": dict(content.limits),
                "rainflow": content.counts,
                **_comparison(beside_run),
            }
        )
        return
    out = console_beside(target)
    out.print(content.verdict[1], markup=False, style="bold")
    for finding in content.findings:
        if finding.level in (Level.BAD, Level.NEAR):
            out.print(f"  {finding.title}: {finding.sentence} {finding.advice}", markup=False)
    for line in comparison_words(beside_run) if beside_run is not None else ():
        out.print(line, markup=False, soft_wrap=True)
    word = "replaced" if replaced else "written"
    out.print(f"{target} {word} ({size / 1e6:.1f} MB). Open it in a browser.", markup=False)


def _comparison(found: Comparison | None) -> dict[str, object]:
    return {} if found is None else {"measured": found.numbers()}


def export(
    run: RunFile,
    csv: Annotated[Path | None, typer.Option("--csv", metavar="FILE", help="Write one wide table.")] = None,
    mat: Annotated[Path | None, typer.Option("--mat", metavar="FILE", help="Write a MATLAB 5 file.")] = None,
    force: Force = False,
    json: Json = False,
) -> None:
    """Write a run as CSV or MATLAB file. (A result file is NetCDF-4, which many tools open as it is.)

    Example:  [bold]drillrig export run.nc --csv run.csv --mat run.mat[/]
    """
    from drillrig_pin.trajectory import load_trajectory

    targets = [target for target in (csv, mat) if target is not None]
    if not targets:
        raise ResultFileError("no format to export to", where="drillrig export", todo="Give --csv FILE or --mat FILE.")
    require_apart(*targets)
    kinds = {"csv": csv, "mat": mat}
    replaced = [
        target
        for kind, target in kinds.items()
        if target is not None and require_target(target, kind, reads=(run,), force=force)
    ]
    trajectory = load_trajectory(run)
    if csv is not None:
        trajectory.to_csv(csv)
    if mat is not None:
        trajectory.to_mat(mat)
    from drillrig_pin.analysis.sampling import stored_sampling

    sampling = stored_sampling(trajectory)
    if json:
        print_json({"run": str(run), "written": [str(target) for target in targets], "sampling": sampling})
        return
    told = " and ".join(f"{target}{' (replaced)' if target in replaced else ''}" for target in targets)
    console_beside(*targets).print(f"{told} written ({len(trajectory.time)} samples).", markup=False)
    if not sampling.enough:
        console(stderr=True).print(f"warning: {sampling.words}", markup=False, style="yellow", soft_wrap=True)
