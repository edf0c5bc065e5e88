"""Commands about result files: figures and other formats."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from drillrig_pin.cli.case import Json
from drillrig_pin.cli.files import require_folder, require_writable
from drillrig_pin.cli.output import console, print_json
from drillrig_pin.errors import ResultFileError

RunFile = Annotated[Path, typer.Argument(metavar="RUN", help="Result file of drillrig run, e.g. run.nc.")]


def plot(
    run: RunFile,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FOLDER", help="Where the figures go. Default: RUN_figures beside it."),
    ] = None,
    json: Json = False,
) -> None:
    """Draw the figures of a run as PNG files: joints, survey point, spectra, cylinders, reaction, trust.

    What a run does not have (no cylinders, nothing held) is left out.

    Example:  [bold]drillrig plot run.nc -o figures[/]
    """
    from drillrig_pin.plots import save_figures
    from drillrig_pin.trajectory import load_trajectory

    trajectory = load_trajectory(run)
    if len(trajectory.time) < 2:
        raise ResultFileError("the run holds fewer than two samples", where=run, todo="There is nothing to draw.")
    folder = output if output is not None else run.with_name(f"{run.stem}_figures")
    require_folder(folder)
    written = save_figures(trajectory, folder)
    if json:
        print_json({"run": str(run), "figures": [str(path) for path in written]})
        return
    console().print(f"{len(written)} figures in {folder}: {', '.join(path.name for path in written)}", markup=False)


def export(
    run: RunFile,
    csv: Annotated[Path | None, typer.Option("--csv", metavar="FILE", help="Write one wide table.")] = None,
    mat: Annotated[Path | None, typer.Option("--mat", metavar="FILE", help="Write a MATLAB 5 file.")] = None,
    json: Json = False,
) -> None:
    """Write a run as CSV or MATLAB file. (A result file is NetCDF-4, which many tools open as it is.)

    Example:  [bold]drillrig export run.nc --csv run.csv --mat run.mat[/]
    """
    from drillrig_pin.trajectory import load_trajectory

    targets = [target for target in (csv, mat) if target is not None]
    if not targets:
        raise ResultFileError("no format to export to", where="drillrig export", todo="Give --csv FILE or --mat FILE.")
    for target in targets:
        require_writable(target)
    trajectory = load_trajectory(run)
    if csv is not None:
        trajectory.to_csv(csv)
    if mat is not None:
        trajectory.to_mat(mat)
    if json:
        print_json({"run": str(run), "written": [str(target) for target in targets]})
        return
    console().print(f"{' and '.join(map(str, targets))} written ({len(trajectory.time)} samples).", markup=False)
