"""One job as it is recorded, and how it stands in a row of the records."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import math
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, get_args

from drillrig_pin.service.problems import ServiceError

Kind = Literal["run", "study"]
Status = Literal["queued", "running", "completed", "failed", "cancelled"]
#: Nothing more will happen to a job with one of these.
ENDED = frozenset({"completed", "failed", "cancelled"})


@dataclass(frozen=True, slots=True)
class Job:
    """One job as it is recorded.

    Attributes:
        id: hash of what is asked: an identical request is the same job.
        kind: ``run`` or ``study``.
        status: how it stands.
        name, model: for people.
        words: what a search looks through, lower case.
        request: what was asked, in full.
        created, started, finished: seconds since 1970.
        attempts: how often it was begun since something of it was recorded.
        error: a problem, if it failed.
        summary: numbers for lists, if it completed.
        digest: SHA-256 of the result file.
        reached: how much of it was recorded when it was begun last: cases of a study.
        beside: SHA-256 of the files beside the result, by name.
    """

    id: str
    kind: Kind
    status: Status
    name: str
    model: str
    words: str
    request: dict[str, Any]
    created: float = field(default_factory=time.time)
    started: float | None = None
    finished: float | None = None
    attempts: int = 0
    error: dict[str, Any] | None = None
    summary: dict[str, Any] | None = None
    digest: str = ""
    reached: int = 0
    beside: dict[str, str] | None = None

    @property
    def ended(self) -> bool:
        """True when nothing more will happen to it."""
        return self.status in ENDED


class NotReadableError(ServiceError):
    """A record is there and cannot be read."""


_JSON = ("request", "error", "summary", "beside")
FIELDS = tuple(item.name for item in dataclasses.fields(Job))
_TEXTS = ("id", "name", "model", "words", "digest")


def not_readable(kind: str) -> NotReadableError:
    """What to say of a record that is damaged."""
    return NotReadableError(
        404, f"the record of this {kind} is damaged and was set apart", todo="Ask for it again, or delete it."
    )


def stored(name: str, value: Any) -> Any:
    """A field as it stands in a row."""
    return json.dumps(value) if name in _JSON and value is not None else value


def job_of(row: Mapping[str, Any]) -> Job:
    """The job a row holds. ValueError, TypeError: none that this program wrote."""
    job = Job(**{name: json.loads(row[name]) if name in _JSON and row[name] else row[name] for name in FIELDS})
    _require(job.kind in get_args(Kind) and job.status in get_args(Status), "kind or status")
    _require(all(isinstance(getattr(job, name), str) for name in _TEXTS), "a text")
    _require(isinstance(job.attempts, int) and isinstance(job.reached, int), "a count")
    times = [job.created, *(time for time in (job.started, job.finished) if time is not None)]
    _require(all(isinstance(time, int | float) and math.isfinite(time) for time in times), "a time")
    _require(isinstance(job.request, dict), "the request")
    _require(all(found is None or isinstance(found, dict) for found in (job.error, job.summary, job.beside)), "its end")
    return job


def upload_of(row: Mapping[str, Any]) -> dict[str, Any]:
    """The upload a row holds. ValueError, TypeError: none that this program wrote."""
    content = row["content"]
    if content:
        _require(hashlib.sha256(content.encode()).hexdigest()[:32] == row["id"], "the content")
    return {**row, "created": float(row["created"]), "facts": dict(json.loads(row["facts"]))}


def _require(holds: bool, what: str) -> None:
    if not holds:
        raise ValueError(f"{what} is none that was written")
