"""Many cases at once: carry out a study, or look at the holes a machine can drill."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from drillrig_pin.cli.batch_options import Folder, Keep, Quiet, Scheduler, StudyName, TimeLimit, Workers
from drillrig_pin.cli.case import Json, Locks, ModelSettings, Packages, locking, locks_again, model_arguments
from drillrig_pin.cli.files import require_folder
from drillrig_pin.cli.guard import FAILED
from drillrig_pin.cli.output import console, print_json
from drillrig_pin.cli.signals import interrupted_code
from drillrig_pin.cli.targets import Force, require_targets

if TYPE_CHECKING:
    from drillrig_pin.batch.runner import Finished
    from drillrig_pin.batch.study import Study


def sweep(
    study: StudyName,
    output: Folder,
    workers: Workers = None,
    scheduler: Scheduler = None,
    keep: Keep = "none",
    time_limit: TimeLimit = 600.0,
    packages: Packages = None,
    lock: Locks = None,
    json: Json = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Run every case of a study and collect one table, a row per case.

    The folder remembers what is done: after Ctrl-C, a crash or a power cut the same command goes on where it stopped.
    A case that fails becomes a row that says why.

    Shipped studies: nine_holes, percussion_frequency, lift_cylinder_pin, oil_and_rock, best_pin.

    Example:  [bold]drillrig sweep percussion_frequency -o resonance[/]

    Example:  [bold]drillrig sweep my_study.yaml -o results --workers 8 --keep worst:10[/]
    """
    from drillrig_pin.batch.study import load_study

    chosen = locking(load_study(study), lock)
    finished = _carried_out(
        chosen, output, workers, scheduler, keep, time_limit, reads=[study], force=force, quiet=quiet or json
    )
    if json:
        print_json(_document(finished))
    elif not quiet:
        from drillrig_pin.cli.sweep_words import print_end

        print_end(console(), finished, f"drillrig sweep {study}{locks_again(lock)} -o {output}")
    _leave(finished)


def holes(
    study: Annotated[
        str, typer.Argument(metavar="STUDY", help="Study with holes: path of a .yaml, or name of a shipped one.")
    ] = "nine_holes",
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="DIR", help="Drill them too, results into this folder.")
    ] = None,
    settings: ModelSettings = None,
    packages: Packages = None,
    lock: Locks = None,
    workers: Workers = None,
    scheduler: Scheduler = None,
    keep: Keep = "none",
    time_limit: TimeLimit = 600.0,
    json: Json = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Show the pose that drills each hole of the face; with -o also how the machine shakes there.

    The feed stands along the drilling direction, joints and cylinders stay within their limits. A hole out of reach is
    listed with the limit it hits.

    Example:  [bold]drillrig holes[/]

    Example:  [bold]drillrig holes --set model.boom_length=2.1 -o holes_longer[/]
    """
    from drillrig_pin.batch.study import load_study
    from drillrig_pin.errors import ScenarioError

    arguments = {f"model.{name}": value for name, value in model_arguments(settings).items()}
    chosen = locking(load_study(study), lock)
    if chosen.holes is None:
        raise ScenarioError("the study has no holes", where=study, todo="Give one with a holes axis, e.g. nine_holes.")
    if arguments:
        chosen = chosen.changed(arguments)
    changed = "".join(f" --set {shlex.quote(setting)}" for setting in settings or ())
    again = f"drillrig holes {study}{changed}{locks_again(lock)}"
    if output is None:
        _show_poses(chosen, again, json=json, quiet=quiet)
        return
    finished = _carried_out(
        chosen, output, workers, scheduler, keep, time_limit, reads=[study], force=force, quiet=quiet or json
    )
    if json:
        print_json(_document(finished))
    elif not quiet:
        from drillrig_pin.cli.sweep_words import print_end, print_holes

        print_holes(console(), chosen, finished)
        print_end(console(), finished, f"{again} -o {output}")
    _leave(finished)


def _carried_out(
    study: Study,
    output: Path,
    workers: int | None,
    scheduler: str | None,
    keep: str,
    time_limit: float,
    *,
    reads: Sequence[str] = (),
    force: bool,
    quiet: bool,
) -> Finished:
    from drillrig_pin.batch.runner import parse_keep, run_study
    from drillrig_pin.batch.store import TABLE
    from drillrig_pin.cli.sweep_words import progress, say_first

    parse_keep(keep)
    require_folder(output)
    require_targets(output, [TABLE], reads=reads, force=force)
    say_first(study)
    with progress(quiet=quiet) as listener:
        return run_study(
            study,
            output,
            workers=workers,
            scheduler=scheduler,
            keep=keep,
            time_limit=time_limit,
            listener=listener,
        )


def _show_poses(study: Study, again: str, *, json: bool, quiet: bool) -> None:
    from drillrig_pin.batch.holes import UnreachableError, aim_at
    from drillrig_pin.cli.case import read_rig

    assert study.holes is not None
    rig = read_rig(study.base)
    found: dict[str, Any] = {}
    for name, hole in study.holes.places.items():
        try:
            found[name] = aim_at(rig, hole, study.holes)
        except UnreachableError as error:
            found[name] = error
    if json:
        unreachable = {name: str(item) for name, item in found.items() if isinstance(item, UnreachableError)}
        reached = {name: item for name, item in found.items() if name not in unreachable}
        print_json({"units": "SI, radians", "poses": reached, "unreachable": unreachable})
    elif not quiet:
        from drillrig_pin.cli.sweep_words import print_poses

        print_poses(console(), study, rig, again, found)


def _document(finished: Finished) -> dict[str, Any]:
    tally = finished.tally

    def told(extreme: Any) -> dict[str, Any] | None:
        return None if extreme is None else {"case": extreme[0].index, **extreme[0].inputs, tally.metric: extreme[1]}

    return {
        "table": str(finished.table),
        "cases": tally.total,
        "recorded": tally.done,
        "recorded_before": tally.before,
        "not_steady": tally.unsteady,
        "cannot_show_loads": tally.unseen,
        "interrupted": finished.interrupted,
        "statuses": dict(sorted(tally.statuses.items())),
        "metric": tally.metric,
        "unit": tally.unit,
        "best": told(tally.best),
        "worst": told(tally.worst),
        "trajectories": {str(index): str(path) for index, path in finished.kept.items()},
        "solve_time": tally.solve_time,
    }


def _leave(finished: Finished) -> None:
    if finished.interrupted:
        raise typer.Exit(interrupted_code())
    if finished.tally.total and finished.tally.failures == finished.tally.total:
        raise typer.Exit(FAILED)
