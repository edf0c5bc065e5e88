"""One run, in a process of its own: within its limits, with its progress written down, ending in files and numbers."""

from __future__ import annotations

import contextlib
import json
import os
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from drillrig_pin.batch.worker import rig_of
from drillrig_pin.beat import listening
from drillrig_pin.errors import DrillrigError, ResultFileError, SimulationError
from drillrig_pin.litter import temporary_folder
from drillrig_pin.model.modelfile import read_model_text
from drillrig_pin.rig import Rig, build_rig
from drillrig_pin.scenario import Scenario
from drillrig_pin.service.bounds import bounded
from drillrig_pin.service.kept import METRICS, RESULT, sha256_of, write_metrics
from drillrig_pin.service.measured import measured_document, summary
from drillrig_pin.service.problems import Problem, problem_of
from drillrig_pin.simulation import Case

PROGRESS = "progress"
#: How often a job looks whether its server is still there [s].
WATCH = 0.25


@dataclass(frozen=True, slots=True)
class Order:
    """What a worker is told.

    Attributes:
        model: a name or path to expand; empty for an uploaded model.
        text: an uploaded model.
        fingerprint: of the model's files, so that a worker that lives on notices a change.
        arguments: of the model.
        scenario: its fields, as the result shall carry them.
        folder: where the files go; empty: they are sent back.
        time: wall time it may take [s].
        memory: it may take on top of what the process has [bytes]; 0: no bound.
        output: size of a file it may write [bytes]; 0: no bound.
    """

    model: str
    text: str
    fingerprint: str
    arguments: dict[str, Any]
    scenario: dict[str, Any]
    folder: str
    time: float
    memory: int = 0
    output: int = 0


@dataclass(slots=True)
class Answer:
    """What became of a run: its summary, or the problem it met; files by name, if they are sent back.

    ``digest`` is the SHA-256 of the result file, ``beside`` that of those beside it, by name.

    A ``passing`` problem says something about the server, not about the run: asked again, it is tried again.
    """

    summary: dict[str, Any] | None = None
    problem: dict[str, Any] | None = None
    passing: bool = False
    digest: str = ""
    beside: dict[str, str] = field(default_factory=dict)
    files: dict[str, bytes] = field(default_factory=dict)


class LimitError(SimulationError):
    """The run needs more time, memory or room than the server grants."""


def carry_out(order: Order) -> Answer:
    """Simulate, save, measure. Whatever goes wrong is the answer."""
    try:
        if order.folder:
            return _into(order, Path(order.folder))
        with temporary_folder() as folder:
            answer = _into(order, Path(folder))
            answer.files = {name: Path(folder, name).read_bytes() for name in (RESULT, METRICS)}
            return answer
    except DrillrigError as error:
        return Answer(problem=_told(error), passing=isinstance(error, LimitError) or _about_the_disk(error))
    except OSError as error:
        full = ResultFileError(f"cannot be written ({error.strerror or error})", todo="Make room on the server's disk.")
        return Answer(problem=_told(full), passing=True)
    except MemoryError:
        short = LimitError(
            f"the run needs more than {order.memory / 1e6:.0f} MB of memory",
            todo="Ask for fewer samples: a shorter duration or a lower output_rate.",
        )
        return Answer(problem=_told(short), passing=True)
    except Exception as error:
        reason = f"the run ended with an unexpected {type(error).__name__}"
        return Answer(problem=_told(SimulationError(reason, todo="This is a bug of the program.")), passing=True)


def _into(order: Order, folder: Path) -> Answer:
    with bounded(order.memory, order.output), _with_server(order):
        rig = _rig(order)
        scenario = Scenario(**order.scenario)
        with _progress(folder / PROGRESS, scenario.duration, order.time) as tick:
            with listening(lambda: tick(0.0)):
                case = Case(rig, scenario)
            trajectory = case.run(tick)
        trajectory.save(folder / RESULT)
        document = measured_document(trajectory)
        beside = {METRICS: write_metrics(document, folder / METRICS)}
        return Answer(summary=summary(trajectory, document), digest=sha256_of(folder / RESULT), beside=beside)


def _rig(order: Order) -> Rig:
    if order.text:
        return build_rig(read_model_text(order.text, "upload"))
    return rig_of(order.model, json.dumps(order.arguments, sort_keys=True), order.fingerprint)


@contextlib.contextmanager
def _progress(path: Path, duration: float, limit: float) -> Iterator[Callable[[float], None]]:
    """Writes the share that is done into a small file; a run that takes too long is stopped."""
    end = time.monotonic() + limit
    with path.open("wb", buffering=0) as file:

        def tick(simulated: float) -> None:
            # A disk that is full takes no progress; the run may yet end in something that fits.
            with contextlib.suppress(OSError):
                os.pwrite(file.fileno(), f"{min(simulated / duration, 1.0):8.6f}".encode(), 0)
            if time.monotonic() > end:
                raise LimitError(
                    f"the run took longer than {limit:g} s",
                    todo="Shorten it, loosen scenario.integrator.rtol, or choose another method.",
                )

        yield tick


@contextlib.contextmanager
def _with_server(order: Order) -> Iterator[None]:
    """An end with the server that gave the order, for as long as the block lasts."""
    done = threading.Event()
    if order.folder:
        threading.Thread(target=_end_with_server, args=(os.getppid(), done), daemon=True).start()
    try:
        yield
    finally:
        done.set()


def _end_with_server(parent: int, done: threading.Event) -> None:
    """A server that was killed starts again and gives the order again; nobody waits for this answer."""
    while not done.wait(WATCH):
        if os.getppid() != parent:
            os._exit(1)


def _about_the_disk(error: DrillrigError) -> bool:
    return "cannot be written" in error.what


def _told(error: DrillrigError) -> dict[str, Any]:
    found: Problem = problem_of(error, 422)
    return found.model_dump()
