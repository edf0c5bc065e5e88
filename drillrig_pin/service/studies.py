"""Studies: from a document to a job, and from a job to a process of its own that sweeps its cases."""

from __future__ import annotations

import contextlib
import errno
import hashlib
import json
import math
import os
import re
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from drillrig_pin.batch.axes import size_of
from drillrig_pin.batch.cases import Plan, unfold
from drillrig_pin.batch.store import recorded
from drillrig_pin.batch.study import Study
from drillrig_pin.batch.worker import TRIED_AGAIN
from drillrig_pin.errors import DrillrigError, FieldError, ScenarioError, SimulationError, legal_names, shown
from drillrig_pin.files import shipped_scenarios
from drillrig_pin.service.library import Entry, Library
from drillrig_pin.service.problems import problem_of
from drillrig_pin.service.records import Job
from drillrig_pin.service.runs import require_bounded
from drillrig_pin.service.settings import Limits, Settings
from drillrig_pin.service.work import Ending, Work, is_passing
from drillrig_pin.trajectory import versions

#: A study told to stop writes its table first; longer than this it does not take [s].
PATIENCE = 10.0


def study_facts(document: dict[str, Any], entry: Entry, limits: Limits) -> dict[str, Any]:
    """What there is to know of a study before it is carried out: its hash and its number of cases.

    Raises:
        ScenarioError, ModelError: it is not valid, names a file or another model, or is too large.
    """
    for name in ("set", "scenario"):
        _refuse_model(document.get(name), name)
    try:
        study = Study(**placed(document, entry))
    except FieldError as error:
        raise _named(error, ".".join(map(str, error.way))) from None
    if any(
        name in ("scenario.model", "scenario.name") or name.startswith("scenario.arguments") for name in study.names
    ):
        raise _named(ScenarioError("a study on this server varies numbers of one model", where="axes"), "axes")
    # Names first: of thousands of them, the number of cases alone takes a while to multiply.
    _require_few(len(study.names), "varied names", limits.names)
    _require_few(size_of(study.axes), "cases", limits.cases)
    plan = unfold(study)
    entry.require(plan.base.arguments)
    _require_cases_bounded(plan, entry, limits)
    content = {"model": entry.fingerprint, "study": study.model_dump(mode="json", exclude={"text"})}
    digest = hashlib.sha256(json.dumps([content, versions()], sort_keys=True).encode()).hexdigest()[:32]
    return {"id": digest, "name": study.name, "cases": len(plan.cases), "names": list(study.names)}


def _refuse_model(given: Any, name: str) -> None:
    """A study has one model, named at its top; nothing below may bring in another, or a file."""
    if name == "scenario" and isinstance(given, str):
        known = shipped_scenarios()
        if given not in known:
            error = ScenarioError(f"no scenario named {shown(given)}", todo=legal_names(given, known, "scenarios"))
            raise _named(error, "scenario")
    elif isinstance(given, Mapping):
        for key in given:
            if re.sub(r"^scenario\.", "", str(key)) == "model":
                raise _named(ScenarioError(f"{name}.{key} is given beside the scenario, as model"), f"{name}.{key}")


def placed(document: dict[str, Any], entry: Entry) -> dict[str, Any]:
    """The document with the model where its files are."""
    return {**document, "model": entry.path}


def _require_few(count: int, what: str, limit: int) -> None:
    if count > limit:
        many = ScenarioError(f"the study has {_number(count)} {what}, this server allows {limit}", where="axes")
        raise _named(many, "axes")


def _number(count: int) -> str:
    """A number of any length in a few letters."""
    return str(count) if count < 10**15 else f"about 10^{round((count.bit_length() - 1) * math.log10(2))}"


def _require_cases_bounded(plan: Plan, entry: Entry, limits: Limits) -> None:
    """Every case as a run of its own. What varies only the model's numbers is one scenario, looked at once."""
    seen: set[str] = set()
    for case in plan.cases:
        changes = case.question.changes
        entry.require({k.removeprefix("arguments."): v for k, v in changes.items() if k.startswith("arguments.")})
        others = {k: v for k, v in changes.items() if not k.startswith("arguments.")}
        key = json.dumps(others, sort_keys=True)
        if key not in seen:
            seen.add(key)
            require_bounded(plan.base.changed(others), limits)


def _named(error: ScenarioError, field: str) -> ScenarioError:
    error.field = field or None
    return error


def study_job(entry: Entry, document: dict[str, Any], facts: dict[str, Any]) -> Job:
    """The job of a study whose facts are known."""
    words = f"{facts['name']} {document.get('text', '')} {entry.name} {' '.join(facts['names'])} {facts['id']}"
    request = {"model": entry.name, "study": document, "cases": facts["cases"]}
    return Job(facts["id"], "study", "queued", facts["name"], entry.name, words.lower(), request)


class StudyCarrier:
    """One study at a time, in a process of its own with workers of its own."""

    slots = 1

    def __init__(self, settings: Settings, library: Library, folder: Path) -> None:
        self.settings, self.library, self.folder = settings, library, folder

    def start(self, job: Job, ended: Callable[[Ending], None]) -> Work:
        """See :class:`drillrig_pin.service.jobs.Carrier`."""
        limits = self.settings.limits
        try:
            entry = self.library.entry(job.model)
            order = {
                "study": placed(job.request["study"], entry),
                "folder": str(self.folder / job.id),
                "workers": self.settings.workers,
                "scheduler": self.settings.scheduler,
                "time": limits.job_time,
                "memory": limits.job_memory,
                "output": limits.output,
            }
            return _Study(order, limits.study_time, ended)
        except (DrillrigError, OSError) as error:
            if is_passing(error):
                raise
            if isinstance(error, OSError):
                error = SimulationError(f"cannot be started ({error.strerror})", todo="Look after the server.")
            ended(Ending(problem=problem_of(error).model_dump(), passing=True))
            return _Study(None, 0.0, ended)

    def reached(self, job: Job) -> int:
        """How many cases are recorded that no later attempt computes again."""
        return len({row.key for row in recorded(self.folder / job.id) if row.status not in TRIED_AGAIN})

    def close(self) -> None:
        """Every study was stopped by the queue."""


class _Study:
    """A study under way: its process, what it told last, and a thread that listens to it."""

    def __init__(self, order: dict[str, Any] | None, limit: float, ended: Callable[[Ending], None]) -> None:
        self.told: dict[str, Any] = {}
        self._process: subprocess.Popen[str] | None = None
        if order is None:
            return
        self._process = subprocess.Popen(
            [sys.executable, "-m", "drillrig_pin.service.study_process"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            errors="replace",
            # Ctrl-C on the server is the server's; it tells its studies itself.
            start_new_session=True,
        )
        assert self._process.stdin is not None
        # A process that is gone already is heard of by whoever listens to it.
        with contextlib.suppress(BrokenPipeError):
            self._process.stdin.write(json.dumps(order) + "\n")
            self._process.stdin.flush()
        self._late = False
        self._clock = threading.Timer(limit, self._too_long)
        self._clock.daemon = True
        try:
            threading.Thread(target=self._listen, args=(ended, limit), daemon=True).start()
            self._clock.start()
        except RuntimeError:
            self._kill()
            raise OSError(errno.EAGAIN, "no thread can be started") from None

    def progress(self) -> float:
        """Share of the cases that are recorded."""
        total = self.told.get("cases") or 0
        return self.told.get("done", 0) / total if total else 0.0

    def stop(self) -> None:
        """Let it write its table; it goes on from there when it is asked for again."""
        if self._process is None:
            return
        with contextlib.suppress(OSError):
            self._process.send_signal(signal.SIGINT)
        killer = threading.Timer(PATIENCE, self._kill)
        killer.daemon = True
        killer.start()

    def _too_long(self) -> None:
        self._late = True
        self.stop()

    def _kill(self) -> None:
        assert self._process is not None
        with contextlib.suppress(OSError):
            os.killpg(self._process.pid, signal.SIGKILL)

    def _listen(self, ended: Callable[[Ending], None], limit: float) -> None:
        assert self._process is not None
        assert self._process.stdout is not None
        problem, finished, digest = None, False, ""
        for line in self._process.stdout:
            # Whatever a library may print is no word of the study's.
            with contextlib.suppress(ValueError, AttributeError):
                told = json.loads(line)
                problem = told.pop("problem", problem)
                finished = told.pop("finished", finished)
                digest = told.pop("digest", digest)
                self.told = told or self.told
        code = self._process.wait()
        self._clock.cancel()
        if self._late:
            error = ScenarioError(f"the study took longer than {limit:g} s", todo="What it has recorded is kept.")
            ended(Ending(problem=problem_of(error).model_dump(), passing=True))
        elif problem is not None:
            ended(Ending(problem=problem, passing=True))
        elif finished:
            ended(Ending(summary=self.told, digest=digest))
        else:
            ended(Ending(died=f"exit code {code}"))
