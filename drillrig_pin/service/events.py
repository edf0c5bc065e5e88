"""Progress of a job as server-sent events."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator

from fastapi.sse import ServerSentEvent

from drillrig_pin.service.records import Job
from drillrig_pin.service.service import Service

#: How often somebody who waits for a job looks at it [s].
LOOK = 0.04


async def awaited(job: Job, service: Service, seconds: float) -> Job:
    """The job as it stands when it has ended, or after that many seconds."""
    end = asyncio.get_running_loop().time() + seconds
    while not job.ended and asyncio.get_running_loop().time() < end:
        await asyncio.sleep(LOOK)
        job = service.job(job.id, job.kind)
    return job


async def job_events(job: Job, service: Service) -> AsyncIterator[ServerSentEvent]:
    """``progress`` whenever something changed, and one ``done`` when the job ended or was deleted."""
    told: tuple[str, float] | None = None
    while True:
        now = service.records.job(job.id, job.kind)
        if now is None:
            yield ServerSentEvent(event="done", data={"id": job.id, "status": "cancelled", "progress": 0.0})
            return
        state = (now.status, round(service.jobs.progress(now), 3))
        if now.ended or state != told:
            told = state
            name = "done" if now.ended else "progress"
            yield ServerSentEvent(event=name, data={"id": now.id, "status": now.status, "progress": state[1]})
        if now.ended:
            return
        await asyncio.sleep(LOOK)
