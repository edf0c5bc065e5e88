"""A design while it is edited: every save becomes a picture, its key numbers and what the save changed."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from drillrig_pin.analysis.headlines import Headline, headlines
from drillrig_pin.analysis.metrics import measure
from drillrig_pin.errors import ResultFileError
from drillrig_pin.files import MODEL_SUFFIXES
from drillrig_pin.model.modelfile import ModelFile, find_model, read_model
from drillrig_pin.rig import build_rig
from drillrig_pin.scenario import Scenario
from drillrig_pin.scene.options import ReplayOptions
from drillrig_pin.scene.scene import Scene, build_scene
from drillrig_pin.simulation import simulate
from drillrig_pin.trajectory import Trajectory

#: Files beside those read so far whose change may matter: an include that was missing, a table that was misspelt.
SUFFIXES = (*MODEL_SUFFIXES, ".yaml", ".yml", ".csv")
#: Notices that come within this time are one [ms].
TOGETHER = 30
#: Files are looked at this often even without a notice of a change, which some file systems do not send [ms].
LOOK = 1000


@dataclass(frozen=True, slots=True)
class Change:
    """One key number now and at the previous save; None where there was none."""

    now: Headline
    before: Headline | None

    @property
    def difference(self) -> float | None:
        """By how much it changed, in the unit people read; None if there is nothing to compare with."""
        return None if self.before is None else self.now.shown - self.before.shown

    @property
    def better(self) -> bool | None:
        """Whether the change is for the better; None: neither, or not to be seen in three digits."""
        if self.before is None or self.now.less_is_better is None:
            return None
        if abs(self.now.value - self.before.value) <= 5e-4 * abs(self.before.value):
            return None
        return (self.now.value < self.before.value) == self.now.less_is_better


@dataclass(frozen=True, slots=True)
class Version:
    """What one save led to.

    Attributes:
        trajectory: its run.
        scene: its picture.
        changes: key numbers against the previous version.
        parameters: parameters of the model that differ from the previous version, in words.
        warnings: what a designer must not overlook.
        seconds: from reading the file to the picture [s].
    """

    trajectory: Trajectory
    scene: Scene
    changes: tuple[Change, ...]
    parameters: tuple[str, ...]
    warnings: tuple[str, ...]
    seconds: float


@dataclass
class DesignLoop:
    """Reads, simulates and draws a model again and again.

    Attributes:
        read: makes the scenario anew, so that edits of its file count too.
        options: of the replay. Factors that are `auto` are settled by the first version, so that pictures compare.
        scenario_file: watched as well, if there is one.
        stopped: set from outside to break off a simulation.
    """

    read: Callable[[], Scenario]
    options: ReplayOptions
    scenario_file: Path | None = None
    stopped: threading.Event = field(default_factory=threading.Event)
    _file: ModelFile | None = None
    _before: dict[str, Headline] = field(default_factory=dict)
    _model: Path | None = None
    _read: dict[Path, tuple[int, int]] = field(default_factory=dict)

    def version(self) -> Version:
        """The design as it is on disk now.

        Raises:
            DrillrigError: whatever is wrong with it; the previous version stays the one to compare with.
        """
        started = time.perf_counter()
        self._read = {file: _stamp(file) for file in self._files()}
        case = self.read()
        self._model = find_model(case.model).resolve()
        self._read.setdefault(self._model, _stamp(self._model))
        file = read_model(case.model, case.arguments)
        trajectory = simulate(build_rig(file), case, self._watchful)
        if len(trajectory.time) < 2:
            raise ResultFileError(f"the run stopped at once, {trajectory.outcome}", where=file.path)
        scene = build_scene([trajectory], self.options, [file.path])
        with np.errstate(all="ignore"):
            metrics = measure(trajectory)
        numbers = headlines(metrics)
        changes = tuple(Change(number, self._before.get(number.name)) for number in numbers)
        parameters = tuple(_differences(self._file, file)) if self._file is not None else ()
        self.options = replace(self.options, exaggeration=scene.exaggeration.factor, speed=scene.speed)
        self._before, self._file = {number.name: number for number in numbers}, file
        for path in self._files():
            self._read.setdefault(path, _stamp(path))
        return Version(trajectory, scene, changes, parameters, metrics.warnings, time.perf_counter() - started)

    def saves(self) -> Iterator[set[Path]]:
        """Files changed since the last version was read, every time some are; ends when ``stopped`` is set.

        The notices of the operating system say when to look; what counts is whether a file is not the one that was
        read, so that no save is missed while a version is in the making.
        """
        from watchfiles import watch

        while not self.stopped.is_set():
            folders = self._folders()
            for notices in watch(
                *folders,
                watch_filter=lambda _, path: path.endswith(SUFFIXES),
                step=TOGETHER,
                debounce=10 * TOGETHER,
                rust_timeout=LOOK,
                yield_on_timeout=True,
                stop_event=self.stopped,
                recursive=False,
                raise_interrupt=False,
            ):
                if changed := self._changed({Path(path) for _, path in notices}):
                    yield changed
                if self._folders() != folders:
                    break

    def _changed(self, noticed: set[Path]) -> set[Path]:
        now = {file: _stamp(file) for file in self._files()}
        known = {file for file, stamp in now.items() if self._read.get(file) != stamp}
        # A file never read so far may be the include that was missing.
        return known | {file for file in noticed if file.resolve() not in now}

    def _files(self) -> list[Path]:
        files = [*(self._file.files if self._file is not None else ())]
        files += [file for file in (self._model, self.scenario_file) if file is not None]
        return sorted({file.resolve() for file in files})

    def _folders(self) -> list[Path]:
        """Folders rather than files: most editors write a new file and rename it onto the old one."""
        found = {file.parent for file in self._files() if file.parent.is_dir()}
        if self._file is None and self._model is not None:
            # Before the first version that can be read nobody knows what it includes; it is rarely farther away.
            found |= {folder for folder in self._model.parent.iterdir() if folder.is_dir() and _holds_model(folder)}
        return sorted(found)

    def _watchful(self, _: float) -> None:
        if self.stopped.is_set():
            raise KeyboardInterrupt


def _differences(before: ModelFile, now: ModelFile) -> Iterator[str]:
    old = before.parameters()
    for name, row in now.parameters().items():
        if name not in old:
            yield f"{name} = {row.value} {row.unit} (new)"
        elif old[name].value != row.value:
            yield f"{name} {old[name].value} → {row.value} {row.unit}"


def _holds_model(folder: Path) -> bool:
    return any(file.name.endswith(SUFFIXES) for file in folder.iterdir())


def _stamp(file: Path) -> tuple[int, int]:
    """What changes when a file is saved."""
    try:
        state = file.stat()
    except OSError:
        return 0, -1
    return state.st_mtime_ns, state.st_size
