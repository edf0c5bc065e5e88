"""Many inputs in worker processes, so that a crash of a library in C is a finding and not the end."""

from __future__ import annotations

import contextlib
import json
import multiprocessing
import os
import resource
import shutil
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from fuzz.kinds import files_of, kind_of
from fuzz.moment import warm_up

#: What an input may take [s of computing, bytes].
MOST_TIME, MOST_MEMORY = 5.0, 1 << 30
#: A worker that hangs longer is ended [s of computing, s of waiting]: on a busy machine the wall clock says little.
KILL_AFTER, WAIT = 60.0, 900.0
#: A worker that asks for more is refused [bytes].
ADDRESS_SPACE = 16 << 30
#: Words of findings that are of time, which a reduced input need not take.
TOO_LONG = "took longer than"
USED, REFUSED = "used", "refused"


@dataclass
class Finding:
    """An input that ended otherwise than it may."""

    number: int
    kind: str
    what: str
    where: str = ""


@dataclass
class Summary:
    """What came of all inputs.

    Attributes:
        seed, table: which inputs.
        inputs: how many were tried.
        seconds, cpu_seconds: wall time of all, and processor time of their use.
        kinds: by kind: how many were used, how many refused by an error of the package, seconds.
        slowest: seconds, kind and number of the slowest input.
        peak_memory: that any input took [bytes].
        findings: what should not have happened.
    """

    seed: int
    table: str = "spoiled"
    inputs: int = 0
    seconds: float = 0.0
    cpu_seconds: float = 0.0
    kinds: dict[str, dict[str, float]] = field(default_factory=dict)
    slowest: tuple[float, str, int] = (0.0, "", 0)
    peak_memory: int = 0
    findings: list[Finding] = field(default_factory=list)

    def as_json(self) -> str:
        """For files and for other programs."""
        return json.dumps(asdict(self), indent=1)


def campaign(
    inputs: int,
    workers: int = 1,
    seed: int = 1,
    first: int = 0,
    progress: Callable[[Summary], None] | None = None,
    summary: Summary | None = None,
    table: str = "spoiled",
) -> Summary:
    """Try inputs ``first`` to ``first + inputs - 1`` of a seed; ``summary`` is filled as they end."""
    context = multiprocessing.get_context("spawn")
    summary, started = summary or Summary(seed, table), time.perf_counter()
    todo = [list(range(first + i, first + inputs, workers)) for i in range(workers)]
    crew: list[Any] = [None] * workers
    while any(crew) or any(todo):
        for i, numbers in enumerate(todo):
            if crew[i] is None and numbers:
                crew[i] = _Worker(context, numbers, seed, table)
            if crew[i] is not None:
                todo[i] = crew[i].collect(summary)
                crew[i] = crew[i] if crew[i].running else None
        summary.seconds = time.perf_counter() - started
        if progress is not None:
            progress(summary)
        time.sleep(0.02)
    return summary


class _Worker:
    """One process and the numbers it still has to try."""

    def __init__(self, context: Any, numbers: list[int], seed: int, table: str) -> None:
        self.numbers, self.table, self.done, self.running = numbers, table, 0, True
        self.warm = False
        self.here, there = context.Pipe(duplex=False)
        #: Number of the input it is at, wall and processor time when it began.
        self.current = context.RawArray("d", [-1.0, 0.0, 0.0])
        self.process = context.Process(target=_work, args=(numbers, seed, table, there, self.current), daemon=True)
        self.process.start()
        there.close()

    def collect(self, summary: Summary) -> list[int]:
        """Take over what was found; gives the numbers that are left once the process is gone."""
        alive = self.process.is_alive()
        # At the end of a pipe that the process has closed there is something to read: its end.
        with contextlib.suppress(EOFError, OSError):
            while self.here.poll():
                found = self.here.recv()
                self.warm = True
                if found is not None:
                    _take(summary, *found)
                    self.done += 1
        number, since, computed = int(self.current[0]), self.current[1], self.current[2]
        hangs = ""
        if alive and number >= 0:
            if _computed(self.process.pid) - computed > KILL_AFTER:
                hangs = f"{TOO_LONG} {KILL_AFTER:g} s of computing"
            elif time.time() - since > WAIT:
                hangs = f"{TOO_LONG} {WAIT:g} s"
        if hangs:
            self.process.kill()
            self.process.join()
            self._lost(summary, number, hangs)
        elif not alive:
            self.process.join()
            if not self.warm:
                raise RuntimeError("a worker could not be started; above stands why")
            if self.done < len(self.numbers):
                self._lost(summary, self.numbers[self.done], f"the process died (exit code {self.process.exitcode})")
            self.running = False
        return self.numbers[self.done :]

    def _lost(self, summary: Summary, number: int, what: str) -> None:
        if number == self.numbers[self.done]:
            _take(summary, number, kind_of(number, self.table).name, what, 0.0, 0, "")
            self.done += 1
        self.running = False


def _take(summary: Summary, number: int, kind: str, end: str, seconds: float, memory: int, where: str) -> None:
    counts = summary.kinds.setdefault(kind, {"inputs": 0, USED: 0, REFUSED: 0, "seconds": 0.0})
    counts["inputs"] += 1
    counts["seconds"] += seconds
    summary.cpu_seconds += seconds
    summary.inputs += 1
    if end in (USED, REFUSED):
        counts[end] += 1
    else:
        summary.findings.append(Finding(number, kind, end, where))
    if seconds > MOST_TIME:
        summary.findings.append(Finding(number, kind, f"took {seconds:.1f} s"))
    if memory > MOST_MEMORY:
        summary.findings.append(Finding(number, kind, f"took {memory / 1e6:.0f} MB"))
    summary.slowest = max(summary.slowest, (seconds, kind, number))
    summary.peak_memory = max(summary.peak_memory, memory)


def _work(numbers: list[int], seed: int, table: str, there: Any, current: Any) -> None:
    warm_up()
    there.send(None)
    quiet = os.open(os.devnull, os.O_WRONLY)
    os.dup2(quiet, 1)
    os.dup2(quiet, 2)
    resource.setrlimit(resource.RLIMIT_AS, (ADDRESS_SPACE, ADDRESS_SPACE))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    warnings.simplefilter("ignore")
    place = Path(tempfile.mkdtemp(prefix="fuzz"))
    os.chdir(place)
    try:
        for number in numbers:
            name = kind_of(number, table).name
            folder = place / str(number)
            folder.mkdir()
            try:
                files = files_of(seed, number, table)
            except Exception as error:
                there.send((number, name, f"not made: {error!r:.300}", 0.0, 0, place_of(error)))
                continue
            started = time.process_time()
            current[1], current[2] = time.time(), _computed(os.getpid())
            current[0] = number
            resting = _resident("VmRSS")
            Path("/proc/self/clear_refs").write_text("5")
            end, where = attempt(number, files, folder, table)
            seconds = time.process_time() - started
            there.send((number, name, end, seconds, max(0, _resident("VmHWM") - resting), where))
            shutil.rmtree(folder, ignore_errors=True)
    finally:
        shutil.rmtree(place, ignore_errors=True)


def attempt(number: int, files: dict[str, bytes], folder: Path, table: str = "spoiled") -> tuple[str, str]:
    """Use the files of one input; how that ended, and where for what should not happen."""
    from drillrig_pin import DrillrigError

    for name, data in files.items():
        (folder / name).write_bytes(data)
    try:
        kind_of(number, table).use(folder)
    except DrillrigError as error:
        sentence = str(error)
        if "\n" in sentence or len(sentence) > 3000:
            return f"the error is no one sentence: {sentence[:300]!r}", place_of(error)
        return REFUSED, ""
    except BaseException as error:
        return f"{type(error).__name__}: {str(error)[:300]}", place_of(error)
    return USED, ""


def place_of(error: BaseException) -> str:
    """Where it was raised: the innermost calls, the last one first."""
    frames = traceback.extract_tb(error.__traceback__)
    return " < ".join(f"{Path(frame.filename).name}:{frame.lineno}" for frame in reversed(frames[-6:]))


def _resident(which: str) -> int:
    """Memory of this process [bytes]: ``VmRSS`` now, ``VmHWM`` at most since it was last asked to forget."""
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith(which):
            return int(line.split()[1]) * 1024
    return 0


def _computed(process: int | None) -> float:
    """Processor time a process has taken [s]."""
    try:
        fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return 0.0
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def told(summary: Summary) -> str:
    """The findings, alike ones together."""
    groups = Counter((finding.kind, finding.what[:60], finding.where) for finding in summary.findings)
    lines = []
    for (kind, what, where), count in groups.most_common():
        first = next(f for f in summary.findings if (f.kind, f.what[:60], f.where) == (kind, what, where))
        lines.append(f"{count:6d} x {kind}, first input {first.number}: {first.what}\n         {where}")
    return "\n".join(lines) or "no findings"
