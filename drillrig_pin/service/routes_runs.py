"""Runs over HTTP: submit, watch, stop, read."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator
from pathlib import Path as FilePath
from typing import Annotated, Any, Literal

from fastapi import APIRouter, Depends, Path, Query, Response
from fastapi.responses import FileResponse
from fastapi.sse import EventSourceResponse, ServerSentEvent

from drillrig_pin.service import rendering
from drillrig_pin.service.answers import (
    EVENTS,
    PAGE,
    PROBLEMS,
    RunId,
    Served,
    file_answer,
    json_answer,
    page_answer,
    readable,
)
from drillrig_pin.service.desk import RefusedError
from drillrig_pin.service.events import awaited, job_events
from drillrig_pin.service.job import NotReadableError
from drillrig_pin.service.kept import METRICS, RESULT, kept
from drillrig_pin.service.problems import Problem, ServiceError
from drillrig_pin.service.records import Job
from drillrig_pin.service.runs import run_job
from drillrig_pin.service.schemas import FigureView, Id, JobStatus, RunPage, RunRequest, RunView
from drillrig_pin.service.service import Service

ENDED: dict[int | str, dict[str, Any]] = {200: {"model": RunView, "description": "It ended already."}}
router = APIRouter(prefix="/v1", tags=["runs"], responses=PROBLEMS)
FORMATS = {
    "nc": ("application/x-netcdf", "run.nc"),
    "csv": ("text/csv; charset=utf-8", "run.csv"),
    "mat": ("application/x-matlab-data", "run.mat"),
}
IMAGES = {"svg": "image/svg+xml", "png": "image/png"}


async def known_run(number: RunId, service: Served) -> Job:
    """The run a path names."""
    return service.job(number, "run")


Run = Annotated[Job, Depends(known_run)]
FigureName = Annotated[str, Path(max_length=100, description="name of a figure the run has")]
Form = Annotated[Literal["svg", "png"], Path(description="format of the drawing")]


def run_view(service: Service, job: Job, *, full: bool = True) -> RunView:
    """A run as clients see it."""
    with readable(service, job):
        return _view(service, job, full)


def _view(service: Service, job: Job, full: bool) -> RunView:
    summary = job.summary or {}
    scenario = {name: value for name, value in job.request["scenario"].items() if name not in ("model", "arguments")}
    return RunView(
        id=job.id,
        status=job.status,
        progress=service.jobs.progress(job),
        name=job.name,
        model=job.model,
        arguments=job.request["arguments"],
        scenario=scenario if full else None,
        lock=scenario.get("lock", []),
        created=job.created,
        started=job.started,
        finished=job.finished,
        error=Problem(**job.error) if job.error else None,
        content_hash=summary.get("content_hash"),
        outcome=summary.get("outcome"),
        verdict=summary.get("verdict"),
        numbers=summary.get("numbers", {}),
        headlines=summary.get("cards", []),
    )


@router.post("/runs", status_code=202, response_model=RunView, responses=ENDED)
def submit_run(request: RunRequest, service: Served, response: Response) -> RunView:
    """Ask for a run. An identical request is the same run: a finished one is answered at once, with 200."""
    fields = request.scenario.model_dump(exclude_unset=True)
    job = run_job(service.library, service.settings.limits, request.model, request.arguments, fields)
    job, new = service.submit(job)
    if not new and job.ended:
        response.status_code = 200
    response.headers["Location"] = f"/v1/runs/{job.id}"
    return run_view(service, job)


@router.get("/runs", response_model=RunPage)
async def list_runs(
    service: Served,
    search: Annotated[str, Query(max_length=200, description="words in name, model, arguments or id")] = "",
    status: Annotated[JobStatus | None, Query(description="only those that stand so")] = None,
    limit: Annotated[int, Query(ge=1, le=200, description="how many at most")] = 50,
    after: Annotated[Id | None, Query(description="the `next` of the page before")] = None,
) -> Response:
    """Runs, latest first."""
    jobs = service.records.jobs("run", search=search, status=status, after=after, limit=limit + 1)
    items = []
    for job in jobs[:limit]:
        with contextlib.suppress(NotReadableError):
            items.append(run_view(service, job, full=False))
    after = jobs[limit - 1].id if len(jobs) > limit else None
    return json_answer(RunPage(items=items, next=after, set_apart=service.records.named_apart("run")))


@router.get("/runs/{id}", response_model=RunView)
async def read_run(
    job: Run,
    service: Served,
    wait: Annotated[float, Query(ge=0, le=60, description="wait up to so many seconds for its end [s]")] = 0,
) -> Response:
    """A run and how it stands."""
    return json_answer(run_view(service, await awaited(job, service, wait)))


@router.get("/runs/{id}/events", response_class=EventSourceResponse, responses=EVENTS)
async def run_events(job: Run, service: Served) -> AsyncIterator[ServerSentEvent]:
    """Progress as server-sent events: `progress` while it goes on, then one `done`."""
    async for event in job_events(job, service):
        yield event


@router.post("/runs/{id}/cancel", response_model=RunView)
def cancel_run(job: Run, service: Served) -> RunView:
    """Stop a run that waits or is under way; one that ended stays as it is."""
    service.jobs.cancel(job)
    return run_view(service, service.job(job.id, "run"))


@router.delete("/runs/{id}", status_code=204, response_class=Response)
def delete_run(number: RunId, service: Served) -> None:
    """Forget a run and its files; one under way is stopped."""
    service.delete(number, "run")


@router.get(
    "/runs/{id}/result",
    response_class=FileResponse,
    responses={
        200: {"content": {media.partition(";")[0]: {} for media, _ in FORMATS.values()}, "description": "the file"}
    },
)
async def run_result(
    job: Run,
    service: Served,
    format: Annotated[Literal["nc", "csv", "mat"], Query(description="NetCDF-4, CSV or MATLAB 5")] = "nc",
) -> FileResponse:
    """The result: every sample of every variable."""
    media, name = FORMATS[format]
    if format == "nc":
        path = await result_file(job, service)
    else:
        path = await beside(job, service, name, getattr(rendering, format))
    return file_answer(path, media, f"{job.id[:8]}_{name}")


@router.get(
    "/runs/{id}/metrics",
    responses={200: {"description": "units, verdict, findings, quantities: key, label, value, unit, limit, verdict"}},
)
async def run_metrics(job: Run, service: Served) -> Response:
    """The numbers of the run with unit, limit and verdict, and what they mean. SI; pressures absolute."""
    path = await beside(job, service, METRICS, rendering.metrics)
    return Response(await asyncio.to_thread(path.read_bytes), media_type="application/json")


@router.get("/runs/{id}/figures", response_model=list[FigureView])
async def run_figures(job: Run, service: Served) -> list[FigureView]:
    """The figures the run has."""
    run = await result_file(job, service)
    found = await made(job, service, (job.id, "figures"), rendering.figure_list, run)
    base = f"/v1/runs/{job.id}/figures"
    return [FigureView(**row, svg=f"{base}/{row['name']}.svg", png=f"{base}/{row['name']}.png") for row in found]


@router.get(
    "/runs/{id}/figures/{name}.{form}",
    response_class=FileResponse,
    responses={200: {"content": {media: {} for media in IMAGES.values()}, "description": "the drawing"}},
)
async def run_figure(job: Run, service: Served, name: FigureName, form: Form) -> FileResponse:
    """One figure, ready for print."""
    path = await beside(job, service, f"figures/{name}.{form}", rendering.figure_file, name, form)
    return file_answer(path, IMAGES[form])


@router.get(
    "/runs/{id}/report",
    response_class=FileResponse,
    responses=PAGE,
)
async def run_report(job: Run, service: Served) -> FileResponse:
    """Verdict, numbers, animation, figures and sources as one page that opens without network."""
    return page_answer(await beside(job, service, "report.html", rendering.report))


@router.get(
    "/runs/{id}/replay",
    response_class=FileResponse,
    responses=PAGE,
)
async def run_replay(job: Run, service: Served) -> FileResponse:
    """The machine in motion as one page that opens without network."""
    return page_answer(await beside(job, service, "replay.html", rendering.motion))


@router.get("/compare", responses={200: {"description": "as drillrig compare --json"}})
async def compare_runs(
    service: Served,
    a: Annotated[Id, Query(description="the run that is the reference")],
    b: Annotated[Id, Query(description="the run held against it")],
) -> dict[str, Any]:
    """In what two runs differ: numbers, parameters, scenario, software. SI; pressures absolute."""
    jobs = [service.job(number, "run") for number in (a, b)]
    runs = [await result_file(job, service) for job in jobs]
    found: dict[str, Any] = await made(jobs[0], service, (a, b, "compare"), rendering.compare, runs, [a, b])
    return found


async def beside(job: Job, service: Service, name: str, function: Any, *arguments: Any) -> FilePath:
    """A file beside the result of a completed run, found to be what was written; else it is made, or made again.

    Args:
        name: of the file.
        function: writes it; takes the result file, the arguments, and the file.

    Raises:
        ServiceError: 409, there is no result; 507, there is no room.
    """
    path = service.folder(job) / name
    if job.status != "completed" or not await asyncio.to_thread(service.sound, job, name):
        run = await result_file(job, service)
        digest = await made(job, service, (job.id, name), kept, path, function, run, *arguments, path)
        await asyncio.to_thread(service.seal, job, name, digest)
    return path


async def made(job: Job, service: Service, key: tuple[str, ...], function: Any, *arguments: Any) -> Any:
    """Something made of a run; if its file turns out to be damaged, the run is carried out again."""
    try:
        return await service.desk.make(key, function, *arguments)
    except RefusedError as error:
        if error.damaged:
            raise await repeated(job, service) from None
        raise


async def result_file(job: Job, service: Service) -> FilePath:
    """The result file of a completed run, found to be what the worker wrote.

    Raises:
        ServiceError: 409, there is none, or it is damaged, in which case the run is carried out again.
    """
    if job.status != "completed":
        why = f": {job.error['what']}" if job.error else ""
        raise ServiceError(409, f"the run has no result, it is {job.status}{why}", where=job.name)
    if not await asyncio.to_thread(service.sound, job, RESULT):
        raise await repeated(job, service)
    return service.folder(job) / RESULT


async def repeated(job: Job, service: Service) -> ServiceError:
    """Have a job carried out again whose result is damaged; gives what to say of it."""
    await asyncio.to_thread(service.repeat, job)
    return ServiceError(
        409,
        "the result file was damaged or is gone",
        where=job.name,
        todo=f"The {job.kind} is carried out again; ask again when it is completed.",
        headers={"Retry-After": "2"},
    )
