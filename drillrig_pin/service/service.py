"""The server without HTTP: records, queue, models and the desk, opened and closed together."""

from __future__ import annotations

import contextlib
import shutil
import threading
import uuid
from pathlib import Path

from drillrig_pin.batch.store import TABLE
from drillrig_pin.errors import ResultFileError
from drillrig_pin.files import lock_folder
from drillrig_pin.service.bell import Bell
from drillrig_pin.service.desk import Desk
from drillrig_pin.service.jobs import Jobs
from drillrig_pin.service.kept import RESULT, sha256_of
from drillrig_pin.service.library import Library
from drillrig_pin.service.problems import ServiceError
from drillrig_pin.service.records import Job, Kind, Records
from drillrig_pin.service.runs import ID, RunCarrier
from drillrig_pin.service.settings import Settings
from drillrig_pin.service.studies import StudyCarrier
from drillrig_pin.service.work import Carrier, Listener

#: Folders of jobs on their way to be removed.
REMOVED = "removed"
#: The file a job ends in.
RESULTS: dict[Kind, str] = {"run": RESULT, "study": TABLE}


class Service:
    """Everything one server holds.

    Raises:
        ResultFileError: the data folder cannot be used, or another server works in it.
    """

    def __init__(self, settings: Settings, listener: Listener) -> None:
        self.settings = settings
        data = settings.data
        try:
            for name in ("runs", "studies", REMOVED):
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
        self.bell = Bell()

        def heard(step: str, job: Job) -> None:
            listener(step, job)
            self.bell.ring(job.id)

        self.jobs = Jobs(self.records, carriers, settings.limits.queue, heard)
        self.desk = Desk(settings.limits)

    def start(self) -> int:
        """Start the workers and take up what an earlier server left; gives how many jobs that are."""
        self.runs.warm_up()
        self.desk.warm_up()
        for left in (self.settings.data / REMOVED).iterdir():
            shutil.rmtree(left, ignore_errors=True)
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
        return self._place(job.id, job.kind)

    def _place(self, number: str, kind: Kind) -> Path:
        return self.settings.data / ("runs" if kind == "run" else "studies") / number

    def submit(self, job: Job) -> tuple[Job, bool]:
        """See :meth:`drillrig_pin.service.jobs.Jobs.submit`; one whose result is damaged is carried out again.

        Raises:
            ServiceError: it cannot be queued.
        """
        found, new = self.jobs.submit(job)
        if found.status == "completed" and not self.sound(found, RESULTS[found.kind]):
            self.repeat(found)
            return self.job(found.id, found.kind), True
        return found, new

    def delete(self, number: str, kind: Kind) -> None:
        """Stop a job if it is under way, and forget it and its files, also one whose record is damaged.

        Raises:
            ServiceError: 404, there is none; 507, its files cannot be removed.
        """
        if number not in self.records.apart:
            self.jobs.cancel(self.job(number, kind))
        self._remove(self._place(number, kind))
        if not self.records.forget(number):
            self.jobs.settle_later()

    def sound(self, job: Job, name: str) -> bool:
        """Whether a file of a job is what was written. All of it is read each time: nothing else tells for certain."""
        known = (job.beside or {}).get(name) or (job.digest if name == RESULTS[job.kind] else "")
        try:
            return bool(known) and sha256_of(self.folder(job) / name) == known
        except (OSError, ValueError):
            return False

    def seal(self, job: Job, name: str, digest: str) -> None:
        """Remember what was written into a file of a job that was made now."""
        # What cannot be remembered is made again when it is asked for again.
        with contextlib.suppress(ServiceError):
            if not self.records.add_beside(job.id, job.kind, name, digest):
                self.jobs.settle_later()

    def repeat(self, job: Job) -> None:
        """Carry a finished job out again because its files are damaged. A study keeps what its journal holds."""

        def clear() -> None:
            if job.kind == "run":
                self._remove(self.folder(job))

        self.jobs.repeat(job, clear)

    def problems(self) -> list[str]:
        """What an operator should look after, in sentences; no file is named, everybody may read them."""
        found = []
        if self.records.trouble:
            found.append(
                f"jobs of which a change is kept in memory until it can be recorded: {self.records.unrecorded}; "
                f"{self.records.trouble}"
            )
        if self.jobs.held and self.jobs.held != self.records.trouble:
            found.append(f"jobs that wait: {self.jobs.waiting}; {self.jobs.held}")
        if self.records.apart:
            found.append(f"damaged records set apart: {len(self.records.apart)}; the lists name them")
        return found

    def _remove(self, folder: Path) -> None:
        """Take a folder away at once; what somebody still writes into it goes with it.

        Raises:
            ServiceError: 507, that is not possible.
        """
        target = self.settings.data / REMOVED / uuid.uuid4().hex
        try:
            target.parent.mkdir(exist_ok=True)
            if not folder.exists():
                return
            folder.rename(target)
        except OSError as error:
            raise ServiceError(
                507, f"its files cannot be removed ({error.strerror})", todo="Look after the server's disk."
            ) from None
        shutil.rmtree(target, ignore_errors=True)
