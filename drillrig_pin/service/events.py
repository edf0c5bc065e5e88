"""Progress of a job as server-sent events, and waiting for its end."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator

from fastapi.sse import ServerSentEvent

from drillrig_pin.service.records import Job
from drillrig_pin.service.service import Service
from drillrig_pin.service.visit import unless_gone

#: How often the progress of a run under way is looked at [s].
PROGRESS = 0.2
#: A job says itself when it takes a step; whatever it fails to say is noticed after this time [s].
LOOK = 2.0


async def awaited(job: Job, service: Service, seconds: float) -> Job:
    """The job as it stands when it has ended, or after that many seconds; given up when the client hangs up."""
    if job.ended or seconds <= 0:
        return job
    return await unless_gone(_awaited(job, service, seconds))


async def _awaited(job: Job, service: Service, seconds: float) -> Job:
    end = asyncio.get_running_loop().time() + seconds
    with service.bell.listening(job.id) as rung:
        while True:
            rung.clear()
            job = service.job(job.id, job.kind)
            left = end - asyncio.get_running_loop().time()
            if job.ended or left <= 0:
                return job
            await _rung(rung, min(left, LOOK))


async def job_events(job: Job, service: Service) -> AsyncIterator[ServerSentEvent]:
    """``progress`` whenever something changed, and one ``done`` when the job ended or was deleted."""
    told: tuple[str, float] | None = None
    with service.bell.listening(job.id) as rung:
        while True:
            rung.clear()
            now = service.records.job(job.id, job.kind)
            if now is None:
                yield ServerSentEvent(event="done", data={"id": job.id, "status": "cancelled", "progress": 0.0})
                return
            left = LOOK
            while left > 0 and not rung.is_set():
                state = (now.status, round(service.jobs.progress(now), 3))
                if now.ended or state != told:
                    told = state
                    name = "done" if now.ended else "progress"
                    yield ServerSentEvent(event=name, data={"id": now.id, "status": now.status, "progress": state[1]})
                if now.ended:
                    return
                pause = PROGRESS if now.status == "running" else left
                await _rung(rung, pause)
                left -= pause


async def _rung(event: asyncio.Event, seconds: float) -> None:
    with contextlib.suppress(TimeoutError):
        await asyncio.wait_for(event.wait(), seconds)
