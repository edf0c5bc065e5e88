"""Runs: from a request to a job, and from a job to a worker process and back."""

from __future__ import annotations

import contextlib
import hashlib
import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

from drillrig_pin.batch.pools import BatchError, ClusterPool, DiedError, LocalPool, Pool, TimeOutError, outcome_of
from drillrig_pin.batch.worker import warm
from drillrig_pin.errors import DrillrigError, ResultFileError, ScenarioError, SimulationError
from drillrig_pin.files import write_aside
from drillrig_pin.scenario import Scenario
from drillrig_pin.service.library import Library
from drillrig_pin.service.problems import problem_of
from drillrig_pin.service.records import Job
from drillrig_pin.service.settings import Limits, Settings
from drillrig_pin.service.work import Ending, Work, is_passing
from drillrig_pin.service.worker import PROGRESS, LimitError, Order, carry_out
from drillrig_pin.trajectory import versions

ID = re.compile(r"[0-9a-f]{32}")
#: Time a worker has beyond the limit of a run to say so itself [s].
GRACE = 10.0
#: Modules every worker finds imported, so that a short run need not wait for them.
PRELOAD = ("drillrig_pin.service.worker", "drillrig_pin.core", "h5netcdf", "scipy.signal", "xacro")


def run_job(library: Library, limits: Limits, model: str, arguments: dict[str, Any], fields: dict[str, Any]) -> Job:
    """The job a request stands for.

    Its id is the SHA-256 of everything that decides the numbers: files of the model, arguments, scenario, versions.

    Raises:
        ModelError, ScenarioError, ServiceError: the request cannot be carried out.
    """
    entry = library.entry(model)
    entry.require(arguments)
    scenario = Scenario(**{**fields, "model": model, "arguments": arguments})
    require_bounded(scenario, limits)
    content = {
        "model": entry.fingerprint,
        "arguments": {name: canonical(value) for name, value in sorted(arguments.items())},
        "scenario": scenario.model_dump(mode="json", exclude={"model", "arguments", "text"}),
        "versions": versions(),
    }
    digest = hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:32]
    given = " ".join(f"{name}={value}" for name, value in arguments.items())
    return Job(
        digest,
        "run",
        "queued",
        scenario.name,
        model,
        f"{scenario.name} {scenario.text} {model} {given} {digest}".lower(),
        {"model": model, "arguments": arguments, "scenario": scenario.model_dump(mode="json")},
    )


def canonical(value: Any) -> Any:
    """2 and 2.0 ask the same."""
    return float(value) if isinstance(value, int | float) else value


def told(error: ScenarioError, field: str) -> ScenarioError:
    """The error with the field of the request it concerns."""
    error.field = field
    return error


def require_bounded(scenario: Scenario, limits: Limits) -> None:
    """ScenarioError for a run that would keep the machine from everybody else."""
    samples = scenario.duration * scenario.output_rate
    if samples > limits.samples:
        raise told(
            ScenarioError(
                f"duration x output_rate asks for {samples:.3g} samples, this server allows {limits.samples}",
                todo="Shorten scenario.duration or lower scenario.output_rate.",
            ),
            "scenario.duration",
        )
    for name in ("step", "max_step"):
        step = getattr(scenario.integrator, name)
        if step is not None and scenario.duration / step > limits.steps:
            raise told(
                ScenarioError(
                    f"duration / integrator.{name} asks for {scenario.duration / step:.3g} steps, "
                    f"this server allows {limits.steps}",
                    todo=f"Take a longer scenario.integrator.{name}.",
                ),
                f"scenario.integrator.{name}",
            )


class RunCarrier:
    """Sends runs to worker processes that stay warm, or to a cluster."""

    def __init__(self, settings: Settings, library: Library, folder: Path) -> None:
        self.settings, self.library, self.folder = settings, library, folder
        self._pool: Pool | None = None

    @property
    def slots(self) -> int:
        """One a worker; of a cluster, as many as it has threads."""
        return self.settings.workers if self.settings.scheduler is None else self._ready().workers

    def warm_up(self) -> None:
        """Start the workers ahead of the first run. BatchError: no cluster answers."""
        pool = self._ready()
        if self.settings.scheduler is None:
            first = next(iter(self.library.paths()), None)
            for _ in range(pool.workers):
                pool.submit(GRACE * 6, warm, first, {})

    def start(self, job: Job, ended: Callable[[Ending], None]) -> Work:
        """See :class:`drillrig_pin.service.jobs.Carrier`."""
        pool, limits = self._ready(), self.settings.limits
        folder = self.folder / job.id
        try:
            folder.mkdir(parents=True, exist_ok=True)
            for left in folder.glob(".*"):
                # Half a file of a worker that was killed.
                left.unlink()
            (folder / PROGRESS).write_bytes(b"0")
            entry = self.library.entry(job.model)
        except (DrillrigError, OSError) as error:
            if is_passing(error):
                raise
            if isinstance(error, OSError):
                error = ResultFileError(f"cannot be written ({error.strerror})", todo="Look after the server's disk.")
            ended(Ending(problem=problem_of(error).model_dump(), passing=True))
            return _Run(None, folder)
        order = Order(
            entry.path,
            entry.text,
            entry.fingerprint,
            job.request["arguments"],
            job.request["scenario"],
            str(folder) if pool.local else "",
            limits.job_time,
            limits.job_memory if pool.local else 0,
            limits.output if pool.local else 0,
        )
        future: Any = pool.submit(limits.job_time + GRACE, carry_out, order)
        future.add_done_callback(lambda done: ended(self._told(done, folder)))
        return _Run(future, folder)

    def close(self) -> None:
        """Kill the workers."""
        if self._pool is not None:
            self._pool.close()

    def _ready(self) -> Pool:
        if self._pool is None:
            scheduler = self.settings.scheduler
            self._pool = ClusterPool(scheduler) if scheduler else LocalPool(self.settings.workers, PRELOAD)
        try:
            self._pool.require_alive()
        except BatchError:
            with contextlib.suppress(Exception):
                self._pool.close()
            self._pool = None
            raise
        return self._pool

    def _told(self, future: Any, folder: Path) -> Ending:
        """How a run ended, whatever comes in between: whoever waits for a slot waits for this."""
        try:
            return self._ending(future, folder)
        except Exception as error:
            lost = SimulationError(f"its end could not be read ({type(error).__name__})", todo="Ask for it again.")
            return Ending(problem=problem_of(lost).model_dump(), passing=True)

    def _ending(self, future: Any, folder: Path) -> Ending:
        answer, cause = outcome_of(future)
        if isinstance(cause, TimeOutError):
            error = LimitError(f"the run took longer than {self.settings.limits.job_time:g} s and was stopped")
            return Ending(problem=problem_of(error).model_dump(), passing=True)
        if isinstance(cause, DiedError):
            return Ending(died=str(cause))
        if cause is not None:
            why = f"{type(cause).__name__}: {' '.join(str(cause).split())[:200]}"
            wrong = SimulationError(
                f"the workers could not carry it out ({why})", todo="They need the same version of this package."
            )
            return Ending(problem=problem_of(wrong).model_dump(), passing=True)
        try:
            for name, content in answer.files.items():
                with write_aside(folder / name) as aside:
                    aside.write_bytes(content)
        except OSError as error:
            full = ResultFileError(f"cannot be written ({error.strerror})", todo="Make room on the server's disk.")
            return Ending(problem=problem_of(full, 422).model_dump(), passing=True)
        return Ending(answer.summary, answer.problem, answer.passing, digest=answer.digest, beside=answer.beside)


class _Run:
    """A run under way."""

    def __init__(self, future: Any, folder: Path) -> None:
        self.told: dict[str, Any] = {}
        self._future, self._progress = future, folder / PROGRESS

    def progress(self) -> float:
        try:
            return min(1.0, float(self._progress.read_bytes() or b"0"))
        except (OSError, ValueError):
            return 0.0

    def stop(self) -> None:
        if self._future is not None:
            self._future.cancel()
