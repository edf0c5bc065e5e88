"""Studies over HTTP: submit, watch, stop, read."""

from __future__ import annotations

import asyncio
import contextlib
import json
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Annotated, Any, Literal

from fastapi import APIRouter, Depends, Query, Response
from fastapi.responses import FileResponse
from fastapi.sse import EventSourceResponse, ServerSentEvent

from drillrig_pin.batch.store import TABLE
from drillrig_pin.service import rendering
from drillrig_pin.service.answers import EVENTS, PAGE, PROBLEMS, Served, StudyId, file_answer, page_answer, readable
from drillrig_pin.service.desk import RefusedError
from drillrig_pin.service.events import awaited, job_events
from drillrig_pin.service.job import NotReadableError
from drillrig_pin.service.kept import kept
from drillrig_pin.service.lanes import PLAN
from drillrig_pin.service.library import UPLOAD
from drillrig_pin.service.problems import Problem, ServiceError
from drillrig_pin.service.records import Job
from drillrig_pin.service.routes_runs import repeated
from drillrig_pin.service.schemas import Id, JobStatus, StudyPage, StudyRequest, StudyView, TableView
from drillrig_pin.service.service import Service
from drillrig_pin.service.studies import placed, study_facts, study_job

ENDED: dict[int | str, dict[str, Any]] = {200: {"model": StudyView, "description": "It ended already."}}
router = APIRouter(prefix="/v1/studies", tags=["studies"], responses=PROBLEMS)


async def known_study(number: StudyId, service: Served) -> Job:
    """The study a path names."""
    return service.job(number, "study")


Known = Annotated[Job, Depends(known_study)]


def study_view(service: Service, job: Job, *, full: bool = True) -> StudyView:
    """A study as clients see it."""
    with readable(service, job):
        return _view(service, job, full)


def _view(service: Service, job: Job, full: bool) -> StudyView:
    found = {"cases": job.request["cases"], **(job.summary or service.jobs.told(job))}
    return StudyView(
        id=job.id,
        status=job.status,
        progress=service.jobs.progress(job),
        name=job.name,
        model=job.model,
        study=job.request["study"] if full else None,
        created=job.created,
        started=job.started,
        finished=job.finished,
        error=Problem(**job.error) if job.error else None,
        **found,
    )


@router.post("", status_code=202, response_model=StudyView, responses=ENDED)
async def submit_study(request: StudyRequest, service: Served, response: Response) -> StudyView:
    """Ask for a study. An identical request is the same study; one that was stopped goes on from where it was."""
    if request.model.startswith(UPLOAD):
        raise ServiceError(422, "a study takes a model of the library, not an upload", field="model")
    document = request.model_dump(exclude_unset=True, exclude_none=True, exclude={"model"})
    entry = await asyncio.to_thread(service.library.entry, request.model)
    key = (entry.name, entry.fingerprint, json.dumps(document, sort_keys=True), "study")
    facts = await service.desk.make(key, study_facts, document, entry, service.settings.limits, kind=PLAN)
    job, new = await asyncio.to_thread(service.submit, study_job(entry, document, facts))
    if not new and job.ended:
        response.status_code = 200
    response.headers["Location"] = f"/v1/studies/{job.id}"
    return study_view(service, job)


@router.get("", response_model=StudyPage)
def list_studies(
    service: Served,
    search: Annotated[str, Query(max_length=200, description="words in name, text, model, what is varied, or id")] = "",
    status: Annotated[JobStatus | None, Query(description="only those that stand so")] = None,
    limit: Annotated[int, Query(ge=1, le=200, description="how many at most")] = 50,
    after: Annotated[Id | None, Query(description="the `next` of the page before")] = None,
) -> StudyPage:
    """Studies, latest first."""
    jobs = service.records.jobs("study", search=search, status=status, after=after, limit=limit + 1)
    items = []
    for job in jobs[:limit]:
        with contextlib.suppress(NotReadableError):
            items.append(study_view(service, job, full=False))
    after = jobs[limit - 1].id if len(jobs) > limit else None
    return StudyPage(items=items, next=after, set_apart=service.records.named_apart("study"))


@router.get("/{id}", response_model=StudyView)
async def read_study(
    job: Known,
    service: Served,
    wait: Annotated[float, Query(ge=0, le=60, description="wait up to so many seconds for its end [s]")] = 0,
) -> StudyView:
    """A study and how it stands."""
    return study_view(service, await awaited(job, service, wait))


@router.get("/{id}/events", response_class=EventSourceResponse, responses=EVENTS)
async def study_events(job: Known, service: Served) -> AsyncIterator[ServerSentEvent]:
    """Progress as server-sent events: `progress` while it goes on, then one `done`."""
    async for event in job_events(job, service):
        yield event


@router.post("/{id}/cancel", response_model=StudyView)
def cancel_study(job: Known, service: Served) -> StudyView:
    """Stop a study; what it has recorded is kept, and the same request goes on from there."""
    service.jobs.cancel(job)
    return study_view(service, service.job(job.id, "study"))


@router.delete("/{id}", status_code=204, response_class=Response)
def delete_study(number: StudyId, service: Served) -> None:
    """Forget a study and its files; one under way is stopped."""
    service.delete(number, "study")


@router.get(
    "/{id}/table",
    response_model=TableView,
    responses={
        200: {
            "description": "the table; as JSON: columns, units, inputs, metrics, rows",
            "content": {"application/vnd.apache.parquet": {}, "text/csv": {}},
        }
    },
)
async def study_table(
    job: Known,
    service: Served,
    format: Annotated[Literal["json", "csv", "parquet"], Query(description="JSON, CSV or Parquet")] = "json",
) -> Any:
    """One row per case: what was varied, what was measured, how it ended. SI; pressures absolute.

    As JSON also while the study is under way, with the rows there are.
    """
    if format == "json" and not job.ended:
        order = placed(job.request["study"], service.library.entry(job.model))
        return await service.desk.make((job.id, "so far"), rendering.study_so_far, order, service.folder(job))
    if format == "csv":
        target = await _beside(job, service, "results.csv", rendering.study_csv)
        return file_answer(target, "text/csv; charset=utf-8", f"{job.id[:8]}_results.csv")
    table = await _table(job, service)
    if format == "parquet":
        return file_answer(table, "application/vnd.apache.parquet", f"{job.id[:8]}_{TABLE}")
    mark = str(table.stat().st_mtime_ns)
    return await service.desk.make((job.id, mark, "table"), rendering.study_table, table)


@router.get("/{id}/report", response_class=FileResponse, responses=PAGE)
async def study_report(job: Known, service: Served) -> FileResponse:
    """The study as one page that opens without network."""
    return page_answer(await _beside(job, service, "report.html", rendering.study_report_of))


async def _beside(job: Job, service: Service, name: str, function: Any) -> Path:
    """A file made of the table, found to be what was written; else it is made, or made again."""
    table = await _table(job, service)
    path = table.with_name(name)
    # What was recorded since a study was stopped is in the table, and not in what was made of it before.
    if job.status != "completed" or not await asyncio.to_thread(service.sound, job, name):
        digest = await service.desk.make((job.id, name), kept, path, function, table, path)
        await asyncio.to_thread(service.seal, job, name, digest)
    return path


async def _table(job: Job, service: Service) -> Path:
    """The table of a study that ended, found to be what was written; else it is made again of the journal.

    Raises:
        ServiceError: 409, nothing is recorded, or the journal is damaged as well: the study is carried out again.
    """
    completed, path = job.status == "completed", service.folder(job) / TABLE
    if not job.ended:
        raise ServiceError(409, f"the study has no table yet, it is {job.status}", where=job.name)
    if completed and await asyncio.to_thread(service.sound, job, TABLE):
        return path
    order = placed(job.request["study"], service.library.entry(job.model))
    rows = job.request["cases"] if completed else 1
    try:
        digest = await service.desk.make(
            (job.id, TABLE), kept, path, rendering.study_again, order, path.parent, rows, path
        )
    except RefusedError as error:
        if error.damaged and completed:
            raise await repeated(job, service) from None
        if error.damaged:
            raise ServiceError(409, f"the study has no table, it is {job.status}", where=job.name) from None
        raise
    await asyncio.to_thread(service.seal, job, TABLE, digest)
    return path
