"""Studies over HTTP: submit, watch, stop, read."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Annotated, Any, Literal

from fastapi import APIRouter, Depends, Query, Response
from fastapi.responses import FileResponse
from fastapi.sse import EventSourceResponse, ServerSentEvent

from drillrig_pin.batch.store import TABLE
from drillrig_pin.service import rendering
from drillrig_pin.service.answers import EVENTS, PAGE, PROBLEMS, Served, StudyId, file_answer, page_answer
from drillrig_pin.service.events import awaited, job_events
from drillrig_pin.service.library import UPLOAD
from drillrig_pin.service.problems import Problem, ServiceError
from drillrig_pin.service.records import Job
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
    facts = await service.desk.make(key, study_facts, document, entry, service.settings.limits)
    job, new = await asyncio.to_thread(service.jobs.submit, study_job(entry, document, facts))
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
    items = [study_view(service, job, full=False) for job in jobs[:limit]]
    return StudyPage(items=items, next=items[-1].id if len(jobs) > limit else None)


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
def delete_study(job: Known, service: Served) -> None:
    """Forget a study and its files; one under way is stopped."""
    service.delete(job)


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
    table = _table(job, service)
    if format == "parquet":
        return file_answer(table, "application/vnd.apache.parquet", f"{job.id[:8]}_{TABLE}")
    mark = str(table.stat().st_mtime_ns)
    if format == "csv":
        target = table.with_name("results.csv")
        await service.desk.make((job.id, mark, "csv"), rendering.study_csv, table, target)
        return file_answer(target, "text/csv; charset=utf-8", f"{job.id[:8]}_results.csv")
    return await service.desk.make((job.id, mark, "table"), rendering.study_table, table)


@router.get("/{id}/report", response_class=FileResponse, responses=PAGE)
async def study_report(job: Known, service: Served) -> FileResponse:
    """The study as one page that opens without network."""
    table = _table(job, service)
    mark, target = str(table.stat().st_mtime_ns), table.with_name("report.html")
    if not target.exists() or target.stat().st_mtime_ns < table.stat().st_mtime_ns:
        await service.desk.make((job.id, mark, "report"), rendering.study_report, table.parent, target)
    return page_answer(target)


def _table(job: Job, service: Service) -> Path:
    path = service.folder(job) / TABLE
    if not path.exists():
        raise ServiceError(409, f"the study has no table yet, it is {job.status}", where=job.name)
    return path
