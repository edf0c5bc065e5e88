"""Uploaded models over HTTP."""

from __future__ import annotations

import hashlib
from typing import Annotated, Any

from fastapi import APIRouter, Body, Path, Response

from drillrig_pin.service.answers import PROBLEMS, Served
from drillrig_pin.service.lanes import READ
from drillrig_pin.service.library import UPLOAD
from drillrig_pin.service.problems import ServiceError
from drillrig_pin.service.schemas import UploadView
from drillrig_pin.service.uploads import upload_facts

router = APIRouter(prefix="/v1/uploads", tags=["uploads"], responses=PROBLEMS)
UploadId = Annotated[str, Path(alias="id", pattern="^[0-9a-f]{32}$", description="id of the upload")]
Content = Annotated[bytes, Body(media_type="application/xml", description="a plain URDF file, no xacro, in UTF-8")]


@router.post("", status_code=201, response_model=UploadView)
async def upload_model(content: Content, service: Served, response: Response) -> UploadView:
    """Send a model: plain URDF with this package's elements beside it, which names no other file."""
    number = hashlib.sha256(content).hexdigest()[:32]
    known = service.records.upload(number)
    if known is None:
        limits = service.settings.limits
        if len(service.records.uploads()) >= limits.uploads:
            raise ServiceError(409, f"the server keeps {limits.uploads} uploads already", todo="Delete one first.")
        facts = await service.desk.make((number, "upload"), upload_facts, content, limits, kind=READ)
        service.records.add_upload(number, facts["name"], content.decode("utf-8"), facts)
        known = service.records.upload(number)
    response.headers["Location"] = f"/v1/uploads/{number}"
    return _view(number, known)


@router.get("", response_model=list[UploadView])
def list_uploads(service: Served) -> list[UploadView]:
    """The uploaded models, latest first."""
    return [_view(row["id"], row) for row in service.records.uploads()]


@router.get("/{id}", response_model=UploadView)
def read_upload(number: UploadId, service: Served) -> UploadView:
    """One uploaded model."""
    return _view(number, service.records.upload(number))


@router.delete("/{id}", status_code=204, response_class=Response)
def delete_upload(number: UploadId, service: Served) -> None:
    """Forget an uploaded model. Runs made of it stay."""
    _view(number, service.records.upload(number))
    service.records.remove_upload(number)


def _view(number: str, row: dict[str, Any] | None) -> UploadView:
    if row is None:
        raise ServiceError(404, "there is no upload of this id", todo="It may have been deleted.")
    return UploadView(id=number, model=UPLOAD + number, created=row["created"], **row["facts"])
