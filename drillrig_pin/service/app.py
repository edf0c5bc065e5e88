"""The ASGI application: routes, errors, and the gate around them."""

from __future__ import annotations

import contextlib
import gc
from collections.abc import AsyncIterator
from http import HTTPStatus
from typing import Any

from fastapi import FastAPI, Request, Response
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException
from starlette.routing import Match

from drillrig_pin.errors import DrillrigError
from drillrig_pin.service import routes_models, routes_page, routes_runs, routes_studies, routes_uploads
from drillrig_pin.service.access import Access
from drillrig_pin.service.gate import Gate
from drillrig_pin.service.problems import (
    MEDIA_TYPE,
    Problem,
    own_fault,
    plain_problem,
    problem_of,
    validation_problem,
)
from drillrig_pin.service.records import Job
from drillrig_pin.service.service import Service
from drillrig_pin.service.settings import Settings
from drillrig_pin.service.watch import Numbers, make_log
from drillrig_pin.trajectory import versions

#: What a path may be asked by.
METHODS = ("GET", "POST", "PUT", "PATCH", "DELETE")
DESCRIPTION = """Vibration of drilling rigs over HTTP. Ask for a run (`POST /v1/runs`), watch it (`/events`), read its
numbers (`/metrics`), figures, report and file. Units are SI, pressures absolute where numbers are shown.
Errors are problem details (RFC 9457)."""


def create_app(settings: Settings, log: Any = None) -> Gate:
    """The application of one server.

    Raises (when it starts): ResultFileError, the data folder cannot be used; BatchError, no cluster answers.
    """
    log, numbers, access = log or make_log(), Numbers(), Access(settings)

    def heard(step: str, job: Job) -> None:
        numbers.job(step, job)
        problem = (job.error or {}).get("detail") if step == "failed" else None
        log.info("job", kind=job.kind, id=job.id, step=step, **({"problem": problem} if problem else {}))

    @contextlib.asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        with contextlib.ExitStack() as opened:
            try:
                service = Service(settings, heard)
                opened.callback(service.close)
                left = service.start()
            except DrillrigError as error:
                gate.failure = error
                raise
            app.state.service = service
            # What was imported stays; looking through it again and again would keep clients waiting.
            gc.collect()
            gc.freeze()
            log.info("ready", data=str(settings.data), taken_up=left, workers=settings.workers)
            yield

    app = FastAPI(
        title="drillrig",
        version=versions()["drillrig-pin"],
        description=DESCRIPTION,
        docs_url=None,
        redoc_url=None,
        lifespan=lifespan,
        separate_input_output_schemas=False,
    )
    app.state.access, app.state.numbers = access, numbers
    for module in (routes_models, routes_uploads, routes_runs, routes_studies, routes_page):
        app.include_router(module.router)
    app.add_exception_handler(DrillrigError, _refused)
    app.add_exception_handler(RequestValidationError, _not_valid)
    app.add_exception_handler(HTTPException, _http)
    # Without it Starlette answers with plain text before the gate sees the error, which the gate then logs.
    app.add_exception_handler(Exception, _own_fault)
    gate = app.state.gate = Gate(app, settings, access, log, numbers)
    return gate


def _refused(request: Request, error: Exception) -> Response:
    assert isinstance(error, DrillrigError)
    return _answer(request, getattr(error, "problem", None) or problem_of(error), getattr(error, "headers", None))


def _not_valid(request: Request, error: Exception) -> Response:
    assert isinstance(error, RequestValidationError)
    found = list(error.errors())
    if any(item["loc"][0] == "path" for item in found):
        return _answer(request, plain_problem(404, "There is nothing of this name."))
    return _answer(request, validation_problem(found))


def _own_fault(request: Request, error: Exception) -> Response:
    return _answer(request, own_fault(request.scope["state"].get("request_id")))


def _http(request: Request, error: Exception) -> Response:
    assert isinstance(error, HTTPException)
    if error.status_code == 405:
        known = _methods(request)
        if request.method == "OPTIONS":
            return Response(status_code=204, headers={"Allow": known})
        return _answer(request, plain_problem(405, "This path does not know that method."), {"Allow": known})
    sentences = {404: "There is nothing at this path."}
    sentence = sentences.get(error.status_code, f"{error.detail or HTTPStatus(error.status_code).phrase}")
    return _answer(request, plain_problem(error.status_code, sentence), dict(error.headers or {}))


def _methods(request: Request) -> str:
    """The methods a path knows: what every route of it takes, and what the gate makes of GET."""
    found = {"OPTIONS"}
    for method in METHODS:
        scope = {**request.scope, "method": method}
        if any(route.matches(scope)[0] is Match.FULL for route in request.app.routes):
            found.add(method)
    return ", ".join(sorted(found | ({"HEAD"} if "GET" in found else set())))


def _answer(request: Request, problem: Problem, headers: dict[str, str] | None = None) -> Response:
    named = problem.model_copy(update={"request_id": request.scope["state"].get("request_id")})
    return Response(named.model_dump_json(), problem.status, headers or None, MEDIA_TYPE)
