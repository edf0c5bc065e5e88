"""The best design between the bounds of a study."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from drillrig_pin.cli.batch_options import Folder, Over, Quiet, Scheduler, Seed, StudyName, TimeLimit, Workers
from drillrig_pin.cli.case import Json, Locks, Packages, locking, locks_again
from drillrig_pin.cli.files import require_folder
from drillrig_pin.cli.guard import FAILED
from drillrig_pin.cli.output import console, print_json
from drillrig_pin.cli.signals import interrupted_code
from drillrig_pin.cli.targets import Force, require_targets


def optimize(
    study: StudyName,
    output: Folder,
    minimize: Annotated[
        str | None, typer.Option("--minimize", metavar="METRIC", help="Metric to make small.", show_default=False)
    ] = None,
    maximize: Annotated[
        str | None, typer.Option("--maximize", metavar="METRIC", help="Metric to make great.", show_default=False)
    ] = None,
    over: Over = None,
    constraint: Annotated[
        list[str] | None,
        typer.Option(
            "--constraint",
            metavar="'METRIC >= VALUE'",
            help="Must hold at every hole, e.g. '*.p_min >= 2 bar' (absolute). May be given many times.",
            show_default=False,
        ),
    ] = None,
    starts: Annotated[
        int | None,
        typer.Option(
            "--starts", metavar="N", min=1, help="Searches from the beginning. Default: 2.", show_default=False
        ),
    ] = None,
    budget: Annotated[
        int | None,
        typer.Option("--budget", metavar="N", min=1, help="Designs tried at most. Default: 120.", show_default=False),
    ] = None,
    seed: Seed = None,
    workers: Workers = None,
    scheduler: Scheduler = None,
    time_limit: TimeLimit = 600.0,
    packages: Packages = None,
    lock: Locks = None,
    json: Json = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Search the bounds of a study for the design that shakes least, and run it again.

    Axes with bounds are searched: range, latin_hypercube, sobol. Every design is run at all holes and lists.

    A design that fails or breaks a constraint at one of them is infeasible, and never better than a feasible one.

    Every evaluation is kept; after an interrupt the same command goes on where it stopped.

    The study's section optimize can hold these options.

    Example:  [bold]drillrig optimize best_pin -o pin[/]

    Example:  [bold]drillrig optimize lift_cylinder_pin -o pin --minimize S.z.rms --constraint '*.p_min >= 2 bar'[/]
    """
    from drillrig_pin.batch.optimizer import run_search
    from drillrig_pin.batch.optimum import FILE, STUDY, optimum_document, save_optimum
    from drillrig_pin.batch.store import TABLE
    from drillrig_pin.batch.study import load_study
    from drillrig_pin.cli.optimize_words import print_optimum
    from drillrig_pin.cli.sweep_words import progress, say_first

    given: dict[str, Any] = {
        "minimize": minimize,
        "maximize": maximize,
        "over": over,
        "constraints": constraint or None,
    }
    given |= {"over": over, "starts": starts, "budget": budget, "seed": seed}
    chosen = locking(load_study(study), lock).deciding("optimize", **given)
    require_folder(output)
    require_targets(output, [TABLE, FILE, STUDY], reads=[study], force=force)
    say_first(chosen)
    with progress(quiet=quiet or json) as listener:
        found = run_search(
            chosen, output, workers=workers, scheduler=scheduler, time_limit=time_limit, listener=listener
        )
    if not found.interrupted:
        save_optimum(chosen, found, output)
    if json:
        table = {"table": str(found.table), "interrupted": found.interrupted, "statuses": dict(found.tally.statuses)}
        print_json({**optimum_document(chosen, found), **table})
    elif not quiet:
        print_optimum(console(), chosen, found, output, f"{_again(study, output, given)}{locks_again(lock)}")
    if found.interrupted:
        raise typer.Exit(interrupted_code())
    if found.best is None or not found.best.feasible or found.differences:
        raise typer.Exit(FAILED)


def _again(study: str, output: Path, given: Mapping[str, Any]) -> str:
    """The command that goes on."""
    words = ["drillrig", "optimize", study, "-o", str(output)]
    for name, value in given.items():
        for item in value if isinstance(value, list) else [value]:
            if item is not None:
                words += [f"--{name.removesuffix('s') if name == 'constraints' else name}", str(item)]
    return shlex.join(words)
