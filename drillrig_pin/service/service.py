"""The server without HTTP: records, queue, models and the desk, opened and closed together."""

from __future__ import annotations

import hashlib
import shutil
import threading
from pathlib import Path

from drillrig_pin.errors import ResultFileError
from drillrig_pin.files import lock_folder
from drillrig_pin.service.desk import Desk
from drillrig_pin.service.jobs import Carrier, Jobs, Listener
from drillrig_pin.service.library import Library
from drillrig_pin.service.problems import ServiceError
from drillrig_pin.service.records import Job, Kind, Records
from drillrig_pin.service.runs import ID, RunCarrier
from drillrig_pin.service.settings import Settings
from drillrig_pin.service.studies import StudyCarrier
from drillrig_pin.service.worker import RESULT


class Service:
    """Everything one server holds.

    Raises:
        ResultFileError: the data folder cannot be used, or another server works in it.
    """

    def __init__(self, settings: Settings, listener: Listener) -> None:
        self.settings = settings
        data = settings.data
        try:
            for name in ("runs", "studies"):
                (data / name).mkdir(parents=True, exist_ok=True)
            lock = lock_folder(data)
        except OSError as error:
            raise ResultFileError(
                f"the data folder cannot be made ({error.strerror})", where=data, todo="Choose another with --data."
            ) from None
        if lock is None:
            raise ResultFileError(
                "another server works in this data folder", where=data, todo="Give another with --data."
            )
        self._lock = lock
        self.records = Records(data / "records.sqlite")
        self.library = Library(self.records, settings.library)
        self.runs = RunCarrier(settings, self.library, data / "runs")
        carriers: dict[Kind, Carrier] = {
            "run": self.runs,
            "study": StudyCarrier(settings, self.library, data / "studies"),
        }
        self.jobs = Jobs(self.records, carriers, settings.limits.queue, listener)
        self.desk = Desk(settings.limits)
        self._sound: dict[Path, tuple[str, int, int]] = {}

    def start(self) -> int:
        """Start the workers and take up what an earlier server left; gives how many jobs that are."""
        self.runs.warm_up()
        self.desk.warm_up()
        threading.Thread(target=self.library.warm_up, daemon=True).start()
        return self.jobs.recover()

    def close(self) -> None:
        """Stop the workers and close the records."""
        self.jobs.close()
        self.desk.close()
        self.records.close()
        self._lock.close()

    def job(self, number: str, kind: Kind) -> Job:
        """A job by id; ServiceError 404 if there is none."""
        job = self.records.job(number, kind) if ID.fullmatch(number) else None
        if job is None:
            raise ServiceError(404, f"there is no {kind} of this id", todo="It may have been deleted.")
        return job

    def folder(self, job: Job) -> Path:
        """The folder of a job's files. Its name is an id that was recorded, never a client's text."""
        return self.settings.data / ("runs" if job.kind == "run" else "studies") / job.id

    def delete(self, job: Job) -> None:
        """Stop a job if it is under way, and forget it and its files."""
        self.jobs.cancel(job)
        self.records.remove(job.id)
        shutil.rmtree(self.folder(job), ignore_errors=True)
        self._sound.pop(self.folder(job) / RESULT, None)

    def known_sound(self, path: Path, digest: str) -> bool:
        """Whether a file was found to be what was written, and has not been touched since."""
        try:
            return self._sound.get(path) == _mark(path, digest)
        except OSError:
            return False

    def sound(self, path: Path, digest: str) -> bool:
        """Whether a file is what was written: reads all of it."""
        try:
            mark = _mark(path, digest)
            if hashlib.sha256(path.read_bytes()).hexdigest() != digest:
                return False
        except OSError:
            return False
        self._sound[path] = mark
        return True

    def repeat(self, job: Job) -> None:
        """Throw the files of a finished job away and carry it out again."""
        shutil.rmtree(self.folder(job), ignore_errors=True)
        self.jobs.repeat(job)


def _mark(path: Path, digest: str) -> tuple[str, int, int]:
    state = path.stat()
    return digest, state.st_mtime_ns, state.st_size
