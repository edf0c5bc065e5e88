"""Which parameter of a study matters, and how sure that is."""

from __future__ import annotations

from typing import Annotated

import typer

from drillrig_pin.cli.batch_options import Folder, Over, Quiet, Scheduler, Seed, StudyName, TimeLimit, Workers
from drillrig_pin.cli.case import Json, Locks, Packages, locking, locks_again
from drillrig_pin.cli.files import require_folder
from drillrig_pin.cli.output import console, print_json
from drillrig_pin.cli.signals import interrupted_code
from drillrig_pin.cli.targets import Force, require_targets


def sensitivity(
    study: StudyName,
    output: Folder,
    method: Annotated[
        str | None,
        typer.Option(
            "--method",
            metavar="M",
            help="morris: screening, few runs. sobol: shares of the variance, many. Default: morris.",
            show_default=False,
        ),
    ] = None,
    metric: Annotated[
        str | None,
        typer.Option("--metric", metavar="NAME", help="Metric to tell; the file has all.", show_default=False),
    ] = None,
    trajectories: Annotated[
        int | None,
        typer.Option(
            "--trajectories",
            metavar="N",
            min=2,
            help="Morris: N trajectories of (ranges + 1) designs. Default: 10.",
            show_default=False,
        ),
    ] = None,
    samples: Annotated[
        int | None,
        typer.Option(
            "--samples",
            metavar="N",
            min=2,
            help="Sobol: N samples of (ranges + 2) designs, a power of two. Default: 64.",
            show_default=False,
        ),
    ] = None,
    over: Over = None,
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
    """Rank the ranges of a study by how much they matter, with confidence.

    Axes with bounds are varied: range, latin_hypercube, sobol. Every design is run at all holes and lists.

    The same command with more trajectories or samples keeps the cases there are.

    The study's section sensitivity can hold these options.

    Example:  [bold]drillrig sensitivity oil_and_rock -o matters[/]

    Example:  [bold]drillrig sensitivity oil_and_rock -o matters --method sobol --samples 128[/]
    """
    from drillrig_pin.batch.importance import FILE
    from drillrig_pin.batch.sensitivity import run_sensitivity
    from drillrig_pin.batch.store import TABLE
    from drillrig_pin.batch.study import load_study
    from drillrig_pin.cli.sensitivity_words import print_sensitivity
    from drillrig_pin.cli.sweep_words import print_counts, print_interrupted, progress, say_first

    given = {"method": method, "metric": metric, "over": over, "seed": seed}
    given |= {"trajectories": trajectories, "samples": samples}
    chosen = locking(load_study(study), lock).deciding("sensitivity", **given)
    require_folder(output)
    require_targets(output, [TABLE, FILE], reads=[study], force=force)
    say_first(chosen)
    with progress(quiet=quiet or json) as listener:
        finished, result = run_sensitivity(
            chosen, output, workers=workers, scheduler=scheduler, time_limit=time_limit, listener=listener
        )
    counts = ("trajectories", "samples")
    options = "".join(f" --{name} {value}" for name, value in given.items() if value is not None)
    more = "".join(f" --{n} {value}" for n, value in given.items() if value is not None and n not in counts)
    again = f"drillrig sensitivity {study}{locks_again(lock)} -o {output}"
    if json:
        tally = finished.tally
        document = result.document() if result else {}
        table = {"table": str(finished.table), "cases": tally.total, "recorded": tally.done}
        print_json({**document, **table, "interrupted": finished.interrupted, "statuses": dict(tally.statuses)})
    elif not quiet:
        if result is not None:
            print_sensitivity(console(), result, finished, again, more)
        else:
            print_counts(console(), finished.tally)
            print_interrupted(console(), again + options)
    if finished.interrupted:
        raise typer.Exit(interrupted_code())
