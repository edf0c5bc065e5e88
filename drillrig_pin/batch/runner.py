"""Carry a study out: all cases, the trajectories wanted, the table."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from drillrig_pin.batch.cases import Case, Plan, unfold
from drillrig_pin.batch.session import TIME_LIMIT_DEFAULT, Listener, Session
from drillrig_pin.batch.study import Study
from drillrig_pin.batch.summary import Tally
from drillrig_pin.errors import ResultFileError


@dataclass(frozen=True)
class Finished:
    """A study carried out.

    Attributes:
        table: the Parquet file.
        tally: counts, best and worst case.
        interrupted: stopped by Ctrl-C.
        kept: trajectories, by case number.
    """

    table: Path
    tally: Tally
    interrupted: bool = False
    kept: dict[int, Path] = field(default_factory=dict)


def run_study(
    study: Study | Plan,
    folder: str | Path,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    keep: str = "none",
    time_limit: float | None = TIME_LIMIT_DEFAULT,
    listener: Listener | None = None,
) -> Finished:
    """Run all cases of a study that are not in the folder yet, and write the table.

    A script that calls this guards it with ``if __name__ == "__main__":``, since every worker imports the script.

    Args:
        study: the study, or its unfolded plan.
        folder: where journal and table go; what an earlier, interrupted command left there is not computed again.
        workers: processes on this machine; None: one a core.
        scheduler: address of a Dask scheduler to use instead, e.g. ``tcp://host:8786``.
        keep: trajectories to keep: ``none``, ``all`` or ``worst:10``.
        time_limit: of a case [s]; one that takes longer becomes a row that says so. None: no limit.
        listener: called after every chunk and a few times a second with the tally.

    Raises:
        ScenarioError, ModelError: the study does not fit its model, or asks for a metric its runs do not have.
        ResultFileError: the folder cannot be written.
        BatchError: the scheduler cannot be reached or went away.
    """
    wanted = parse_keep(keep)
    # Workers start while the study is unfolded here: both take their half second.
    session = Session(study, folder, workers=workers, scheduler=scheduler, time_limit=time_limit, listener=listener)
    with session:
        plan = study if isinstance(study, Plan) else unfold(study)
        tally = session.start(plan)
        interrupted = False
        kept: dict[int, Path] = {}
        try:
            session.answer(plan.cases, keeping=wanted is None)
            kept = session.keep(_to_keep(plan, tally, wanted))
        except KeyboardInterrupt:
            interrupted = True
        finally:
            table = session.write_table()
        return Finished(table, tally, interrupted, kept)


def parse_keep(text: str) -> int | None:
    """How many of the worst are kept; None: all. ResultFileError for anything but none, all and worst:N."""
    if text == "none":
        return 0
    if text == "all":
        return None
    word, colon, count = text.partition(":")
    if word == "worst" and colon and count.isdecimal():
        return int(count)
    raise ResultFileError(f"{text!r} does not say what to keep", where="--keep", todo="Write none, all or worst:10.")


def _to_keep(plan: Plan, tally: Tally, wanted: int | None) -> list[Case]:
    """Cases whose trajectory is wanted: all that have one, or the worst."""
    return tally.with_run(plan.cases) if wanted is None else tally.ranked(plan.cases)[:wanted]
