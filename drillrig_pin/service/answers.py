"""Common parts of the routes: where the service is found, how a file is sent, what an error looks like."""

from __future__ import annotations

import asyncio
import contextlib
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, cast

from fastapi import Depends, Request
from fastapi import Path as InPath
from fastapi.responses import FileResponse, Response
from pydantic import BaseModel
from starlette.datastructures import Headers
from starlette.types import Receive, Scope, Send

from drillrig_pin.service.problems import MEDIA_TYPE, Problem
from drillrig_pin.service.records import Job
from drillrig_pin.service.service import Service

#: For pages made of a run: they bring their scripts along. The sandbox gives them an origin of their own, so that
#: nothing in them can act for the reader, and they can ask nobody for anything.
PAGE_POLICY = (
    "sandbox allow-scripts allow-downloads allow-popups; default-src 'none'; "
    "script-src 'unsafe-inline' 'unsafe-eval' blob: data:; style-src 'unsafe-inline'; img-src data: blob:; "
    "font-src data:; connect-src data: blob:; worker-src blob: data:; frame-src 'self' data: blob:; base-uri 'none'; "
    "form-action 'none'; frame-ancestors 'self'"
)

PROBLEMS: dict[int | str, dict[str, Any]] = {
    "4XX": {
        "description": "The request cannot be carried out; the problem says why (RFC 9457).",
        "model": Problem,
        "content": {MEDIA_TYPE: {}},
    },
    "5XX": {
        "description": "The server cannot carry it out at the moment; the problem says why (RFC 9457).",
        "model": Problem,
        "content": {MEDIA_TYPE: {}},
    },
}

PAGE: dict[int | str, dict[str, Any]] = {200: {"content": {"text/html": {}}, "description": "one page"}}
EVENTS: dict[int | str, dict[str, Any]] = {
    200: {"description": "events `progress` and at the end `done`, data: id, status, progress of the job"}
}


async def service_of(request: Request) -> Service:
    """The service behind the application. Not a plain function: those are called in threads, one hop each."""
    return cast(Service, request.app.state.service)


Served = Annotated[Service, Depends(service_of)]
RunId = Annotated[str, InPath(alias="id", pattern="^[0-9a-f]{32}$", description="id of the run")]
StudyId = Annotated[str, InPath(alias="id", pattern="^[0-9a-f]{32}$", description="id of the study")]


@contextlib.contextmanager
def readable(service: Service, job: Job) -> Iterator[None]:
    """Set a record apart of which the block finds that it holds something else than was written. NotReadableError."""
    try:
        yield
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise service.records.set_apart(job.id, job.kind, f"it cannot be shown ({type(error).__name__})") from None


def json_answer(view: BaseModel, status: int = 200, **headers: str) -> Response:
    """A view as it is. It was made by its own class; FastAPI need not check it once more."""
    return Response(view.model_dump_json(), status, headers or None, "application/json")


class StoredFile(FileResponse):
    """A file, or 304 for a client that has it already."""

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send it."""
        known = Headers(scope=scope).get("if-none-match")
        if known is not None:
            self.set_stat_headers(await asyncio.to_thread(os.stat, self.path))
            etag = self.headers["etag"]
            if etag in [tag.strip().removeprefix("W/") for tag in known.split(",")]:
                kept = {
                    name: value
                    for name, value in self.headers.items()
                    if name not in ("content-length", "content-type")
                }
                await Response(status_code=304, headers=kept)(scope, receive, send)
                return
        await super().__call__(scope, receive, send)


def file_answer(path: Path, media_type: str, name: str | None = None, **headers: str) -> FileResponse:
    """A file; with a name, one to be saved."""
    told = {"Cache-Control": "private, no-cache", **headers}
    return StoredFile(path, media_type=media_type, filename=name, headers=told)


def page_answer(path: Path) -> FileResponse:
    """A page made of a run."""
    return file_answer(path, "text/html; charset=utf-8", **{"Content-Security-Policy": PAGE_POLICY})
