"""The page, logging in, and what operators look at."""

from __future__ import annotations

import mimetypes
from importlib.resources import files
from pathlib import Path
from typing import Annotated

from fastapi import APIRouter, Form, Request, Response
from fastapi.responses import FileResponse, RedirectResponse

from drillrig_pin.service.access import COOKIE, Access
from drillrig_pin.service.answers import PROBLEMS, Served, file_answer
from drillrig_pin.service.problems import ServiceError
from drillrig_pin.service.schemas import Health
from drillrig_pin.service.sessions import SESSION
from drillrig_pin.service.visit import client
from drillrig_pin.trajectory import versions

Token = Annotated[str, Form(min_length=1, max_length=1000, description="the server's token")]
router = APIRouter(tags=["server"], responses=PROBLEMS)
TYPES = {
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".html": "text/html; charset=utf-8",
}


@router.get("/healthz", response_model=Health)
async def health(service: Served, request: Request) -> Health:
    """Whether the server lives, and what its operator should look after."""
    access: Access = request.app.state.access
    problems = service.problems()
    return Health(
        status="degraded" if problems else "ok",
        version=versions()["drillrig-pin"],
        waiting=service.jobs.waiting,
        running=service.jobs.running,
        login=not access.open,
        problems=problems,
    )


@router.get(
    "/metrics",
    response_class=Response,
    responses={200: {"content": {"text/plain": {}}, "description": "Prometheus text"}},
)
def numbers(service: Served, request: Request) -> Response:
    """Requests, latencies and jobs, as Prometheus reads them."""
    found = request.app.state.numbers
    found.waiting.set(service.jobs.waiting)
    found.running.set(service.jobs.running)
    return Response(found.text(), media_type="text/plain; version=0.0.4; charset=utf-8")


@router.post(
    "/login", status_code=303, response_class=Response, responses={303: {"description": "logged in; back to the page"}}
)
def login(request: Request, token: Token) -> Response:
    """Trade the token for a cookie that scripts cannot read and other sites cannot use."""
    access: Access = request.app.state.access
    if not access.open and not access.knows(token):
        request.app.state.gate.wrong_token(client())
        raise ServiceError(401, "this is not the server's token", field="token")
    answer = RedirectResponse("/", 303)
    if not access.open:
        answer.set_cookie(
            COOKIE,
            access.sessions.open(),
            max_age=SESSION,
            path="/",
            secure=request.url.scheme == "https",
            httponly=True,
            samesite="strict",
        )
    return answer


@router.post("/logout", status_code=303, response_class=Response, responses={303: {"description": "logged out"}})
def logout(request: Request) -> Response:
    """End the login; its cookie opens nothing any more."""
    access: Access = request.app.state.access
    access.sessions.end(request.cookies.get(COOKIE, ""))
    answer = RedirectResponse("/", 303)
    answer.delete_cookie(COOKIE, path="/", secure=request.url.scheme == "https", httponly=True, samesite="strict")
    return answer


@router.get("/", response_class=FileResponse, include_in_schema=False)
def page() -> FileResponse:
    """The page for people."""
    return static("index.html")


@router.get("/static/{name:path}", response_class=FileResponse, include_in_schema=False)
def static(name: str) -> FileResponse:
    """A file of the page, looked up in a list: no path is built from what a client says."""
    path = _web().get(name)
    if path is None:
        raise ServiceError(404, "there is nothing at this path")
    media = TYPES.get(path.suffix) or mimetypes.guess_type(path.name)[0] or "application/octet-stream"
    return file_answer(path, media)


def _web() -> dict[str, Path]:
    """Files of the page by their path below its folder."""
    folder = Path(str(files("drillrig_pin.service").joinpath("web")))
    return {path.relative_to(folder).as_posix(): path for path in folder.rglob("*") if path.is_file()}
