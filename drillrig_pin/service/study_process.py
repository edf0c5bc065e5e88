"""Carry out one study for a server: the order comes in as a line of JSON, progress goes out as lines of JSON."""

from __future__ import annotations

import contextlib
import json
import os
import resource
import signal
import sys
import threading
import time
from pathlib import Path
from typing import Any

from drillrig_pin.batch.runner import Finished, run_study
from drillrig_pin.batch.study import Study
from drillrig_pin.batch.summary import Tally
from drillrig_pin.errors import DrillrigError, ResultFileError
from drillrig_pin.service.bounds import lower
from drillrig_pin.service.kept import sha256_of
from drillrig_pin.service.problems import problem_of

#: Address space of a worker that does nothing, with room to spare [bytes].
IDLE = 1_500_000_000
#: A study is not waited for as a run is: runs go first.
NICE = 5
#: Between two lines [s].
EVERY = 0.2
#: The process of a server that was killed needs a moment to notice before its folder is free [s].
PATIENCE = 15.0


def main() -> None:
    """Read the order, carry it out, say how it went."""
    order = json.loads(sys.stdin.readline())
    threading.Thread(target=_end_with_server, daemon=True).start()
    os.nice(NICE)
    if order["memory"]:
        lower(resource.RLIMIT_AS, IDLE + order["memory"])
    if order["output"]:
        lower(resource.RLIMIT_FSIZE, order["output"])
    try:
        finished = _carried_out(order)
    except DrillrigError as error:
        _say({"problem": problem_of(error, 422).model_dump()})
        return
    if not finished.interrupted:
        _say({**state(finished.tally), "finished": True, "digest": sha256_of(finished.table)})


def _carried_out(order: dict[str, Any]) -> Finished:
    last = 0.0

    def listener(tally: Tally) -> None:
        nonlocal last
        if time.monotonic() - last > EVERY:
            last = time.monotonic()
            _say(state(tally))

    end = time.monotonic() + PATIENCE
    while True:
        try:
            return run_study(
                Study(**order["study"]),
                Path(order["folder"]),
                workers=order["workers"],
                scheduler=order["scheduler"],
                time_limit=order["time"],
                listener=listener,
            )
        except ResultFileError as error:
            if "journal is damaged" in error.what and _set_apart(error.where):
                continue
            if "another command" not in error.what or time.monotonic() > end:
                raise
            time.sleep(0.5)


def _set_apart(damaged: object) -> bool:
    """Keep a damaged file of the journal under another name: its cases are computed again. False: it cannot be done."""
    path = Path(str(damaged))
    with contextlib.suppress(OSError):
        path.rename(path.with_name(f"{path.name}.damaged"))
        return True
    return False


def state(tally: Tally) -> dict[str, Any]:
    """What is known of a study, as it is shown."""

    def told(extreme: Any) -> dict[str, Any] | None:
        if extreme is None:
            return None
        inputs = {name: getattr(value, "name", value) for name, value in extreme[0].inputs.items()}
        return {"case": extreme[0].index, "inputs": inputs, "value": extreme[1]}

    return {
        "cases": tally.total,
        "done": tally.done,
        "statuses": dict(sorted(tally.statuses.items())),
        "metric": tally.metric,
        "unit": tally.unit,
        "best": told(tally.best),
        "worst": told(tally.worst),
    }


def _say(document: dict[str, Any]) -> None:
    # A server that is gone hears nothing; the thread that watches it ends this process.
    with contextlib.suppress(OSError):
        sys.stdout.write(json.dumps(document) + "\n")
        sys.stdout.flush()


def _end_with_server() -> None:
    """The server holds the other end of stdin as long as it lives."""
    while sys.stdin.readline():
        pass
    os.kill(os.getpid(), signal.SIGINT)
    time.sleep(PATIENCE / 3)
    os.killpg(0, signal.SIGKILL)


if __name__ == "__main__":
    main()
