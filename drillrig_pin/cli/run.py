"""The main command: simulate a case, keep the result, say what it means."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from drillrig_pin.cli.case import (
    Json,
    Locks,
    OptionalModelName,
    Packages,
    ScenarioName,
    Settings,
    read_rig,
    read_scenario,
)
from drillrig_pin.cli.files import require_writable
from drillrig_pin.cli.guard import NOT_VALID, STOPPED_EARLY
from drillrig_pin.cli.output import console, print_json
from drillrig_pin.cli.signals import asked_to_end, holding, interrupted_code
from drillrig_pin.cli.targets import Force, console_beside, free_name, require_target

if TYPE_CHECKING:
    from drillrig_pin.analysis.metrics import Metrics
    from drillrig_pin.rig import Rig
    from drillrig_pin.simulation import Progress
    from drillrig_pin.trajectory import Trajectory

#: Result file of a run without -o.
DEFAULT = Path("run.nc")


def run(
    model: OptionalModelName = None,
    scenario: ScenarioName = None,
    settings: Settings = None,
    packages: Packages = None,
    lock: Locks = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            metavar="FILE",
            help="Result file (NetCDF-4). Default: run.nc, or run-2.nc, run-3.nc ... if that is there.",
        ),
    ] = None,
    force: Force = False,
    json: Json = False,
    estimate: Annotated[
        bool | None,
        typer.Option(
            "--estimate/--no-estimate",
            help="Estimate the error by solving a second time, tighter. Default: yes in the compiled core.",
            show_default=False,
        ),
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="No progress bar and no tables.")] = False,
) -> None:
    """Simulate a case, save it to one file and print what a designer reads first.

    A result that -o names is replaced once the new one is complete; another file only with --force; without -o nothing
    is replaced. Ctrl-C stops the run and keeps what it has.

    Example:  [bold]drillrig run[/]

    Example:  [bold]drillrig run mkz49 --set model.boom_length=2.1 --set scenario.duration=5 -o longer.nc[/]
    """
    require_writable(output or DEFAULT)
    case = read_scenario(model, scenario, settings, lock)
    rig = read_rig(case)
    replaced = output is not None and require_target(output, "result", reads=(scenario, *rig.file.files), force=force)
    from drillrig_pin.accuracy import estimate_error
    from drillrig_pin.simulation import simulate

    with _progress(case.duration, shown=not quiet and sys.stderr.isatty()) as tick:
        trajectory = simulate(rig, case, progress=tick)
        if estimate or (estimate is None and trajectory.engine == "core"):
            # The run itself is complete: asked to end now, it is saved without an estimate.
            with suppress(KeyboardInterrupt):
                trajectory = estimate_error(rig, trajectory)
    with holding():
        target = output if output is not None else free_name(DEFAULT)
        trajectory.save(target)
    metrics = _measured(trajectory, rig)
    if json:
        print_json(_document(trajectory, metrics, rig, target))
    else:
        # Without -o the last result stays, and the reader must not take it for this one.
        fate = "replaced" if replaced else f"{DEFAULT} is left as it is" if output is None and target != DEFAULT else ""
        _report(trajectory, metrics, rig, target, fate=fate, quiet=quiet)
    _leave(trajectory, metrics)


def _measured(trajectory: Trajectory, rig: Rig) -> Metrics | None:
    """Metrics of a run that has anything to measure."""
    import numpy as np

    from drillrig_pin.analysis.design import design_of
    from drillrig_pin.analysis.metrics import measure

    if len(trajectory.time) < 2:
        return None
    # The last samples of a run that diverged may be too large to be squared.
    with np.errstate(all="ignore"):
        return measure(trajectory, design_of(trajectory, rig.file))


def _leave(trajectory: Trajectory, metrics: Metrics | None) -> None:
    from drillrig_pin.errors import Status

    if trajectory.outcome.status is Status.INTERRUPTED or asked_to_end():
        raise typer.Exit(interrupted_code())
    if not trajectory.outcome.completed:
        raise typer.Exit(STOPPED_EARLY)
    if metrics is not None and metrics.invalid:
        raise typer.Exit(NOT_VALID)


def _document(trajectory: Trajectory, metrics: Metrics | None, rig: Rig, output: Path) -> dict[str, Any]:
    outcome = trajectory.outcome
    return {
        "scenario": trajectory.scenario.name,
        "model": rig.file.path,
        "arguments": trajectory.arguments,
        "output": str(output),
        "content_hash": trajectory.content_hash,
        "status": {
            "name": outcome.status.name,
            "completed": outcome.completed,
            "time": outcome.time,
            "steps": outcome.steps,
            "cause": outcome.cause,
            "advice": outcome.status.advice,
            "valid_until": outcome.valid_until,
            "doubt": outcome.doubt,
        },
        "units": "SI; pressures absolute; RMS about the mean",
        "metrics": metrics,
        "notes": trajectory.notes,
        "assumed_parameters": [row.name for row in rig.file.parameters().values() if row.assumed],
    }


def _report(trajectory: Trajectory, metrics: Metrics | None, rig: Rig, output: Path, *, fate: str, quiet: bool) -> None:
    outcome = trajectory.outcome
    out = console_beside(output)
    if not quiet:
        from drillrig_pin.cli.summary import print_summary

        out.print(
            f"[bold]{trajectory.scenario.name}[/]: {rig.file.path}, {trajectory.time[-1]:g} s"
            if len(trajectory.time)
            else ""
        )
        if metrics is not None:
            print_summary(out, metrics)
        for note in trajectory.notes:
            out.print(f"note: {note}", markup=False)
        assumed = sum(row.assumed for row in rig.file.parameters().values())
        if assumed:
            out.print(
                f"{assumed} numbers of this model are assumed, printed in no source: "
                f"drillrig params {trajectory.scenario.model} --assumed",
                markup=False,
            )
    if metrics is not None and metrics.invalid and outcome.completed:
        words = f"not to be used: {'; '.join(metrics.invalid)}."
        console(stderr=True).print(words, markup=False, style="red", soft_wrap=True)
    if outcome.completed:
        if not quiet:
            words = f"Saved to {output}{f' ({fate})' if fate else ''}."
            out.print(f"{words} Next: drillrig plot {output}, drillrig report {output}", markup=False)
        return
    kept = f"{len(trajectory.time)} samples are kept in {output}"
    console(stderr=True).print(f"stopped early: {outcome} {kept}.", markup=False, style="red", soft_wrap=True)


@contextmanager
def _progress(duration: float, *, shown: bool) -> Iterator[Progress | None]:
    """A bar on stderr that takes the simulated time."""
    if not shown:
        yield None
        return
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("simulating"), BarColumn(), TextColumn("{task.completed:.2f} of {task.total:g} s"))
    with Progress(*columns, TimeRemainingColumn(), console=console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=duration)
        yield lambda t: bar.update(task, completed=t)
