"""What went wrong, as an HTTP answer: RFC 9457 problem details with the sentences of the command line."""

from __future__ import annotations

from http import HTTPStatus
from typing import Any

from pydantic import BaseModel, Field

from drillrig_pin.errors import (
    DrillrigError,
    ResultFileError,
    shown,
)

MEDIA_TYPE = "application/problem+json"
VARIANTS = frozenset({"float", "str", "constrained-float", "constrained-str", "list[str]", "dict[str,any]"})
#: So many things that are wrong with a request are told; nobody reads more.
MOST = 50
#: Problems that are errors of this package are named after its classes, so that a client can raise the same ones.
PREFIX = "urn:drillrig:error:"


class Finding(BaseModel):
    """One thing wrong with a request."""

    field: str = Field(description="dotted name of the field at fault, e.g. scenario.duration")
    detail: str = Field(description="what is wrong with it")


class Problem(BaseModel):
    """Why a request was not carried out, or why a job failed (RFC 9457)."""

    type: str = Field(description="about:blank, or urn:drillrig:error: and the name of the error class")
    title: str = Field(description="the kind of problem")
    status: int = Field(description="HTTP status")
    detail: str = Field(description="one or two sentences: what is wrong, and what to do")
    what: str = Field("", description="only what is wrong")
    where: str | None = Field(None, description="file and line, element or time it concerns")
    todo: str = Field("", description="only what to do")
    field: str | None = Field(None, description="the field of the request at fault, by dotted name")
    errors: list[Finding] = Field(default_factory=list, description="everything wrong with the request")
    request_id: str | None = Field(None, description="names this request in the server's log")


class ServiceError(DrillrigError):
    """A request that is not carried out.

    Args:
        status: HTTP status of the answer.
        what, where, todo: as every error of this package.
        field: dotted name of the field at fault.
        headers: of the answer.
    """

    def __init__(
        self,
        status: int,
        what: str,
        *,
        where: object = None,
        todo: str = "",
        field: str | None = None,
        headers: dict[str, str] | None = None,
    ) -> None:
        super().__init__(what, where=where, todo=todo)
        self.status = status
        self.field = field
        self.headers = headers or {}


def problem_of(error: DrillrigError, status: int | None = None) -> Problem:
    """An error of this package as a problem."""
    if status is None:
        status = getattr(error, "status", 409 if isinstance(error, ResultFileError) else 422)
    plain = isinstance(error, ServiceError)
    where = str(error.where) if error.where is not None else None
    if where is not None and where.startswith("/"):
        # The name of a file helps; where on the server it lies is nobody's business.
        where = where.rpartition("/")[2]
    return Problem(
        type="about:blank" if plain else PREFIX + type(error).__name__,
        title=HTTPStatus(status).phrase,
        status=status,
        detail=str(DrillrigError(error.what, where=where, todo=error.todo)),
        what=error.what,
        where=where,
        todo=error.todo,
        field=getattr(error, "field", None),
    )


def plain_problem(status: int, detail: str) -> Problem:
    """A problem that is no error of this package."""
    return Problem(
        type="about:blank", title=HTTPStatus(status).phrase, status=status, detail=detail, what=detail.rstrip(".")
    )


def own_fault(number: str | None) -> Problem:
    """The server's own error, which its log tells under this number."""
    return plain_problem(500, f"The server met an error of its own. Tell its operator the number {number}.")


def validation_problem(errors: list[Any]) -> Problem:
    """What pydantic found in a request, in the words of the scenario's own errors."""
    findings = []
    for error in errors[:MOST]:
        # Names of variants that pydantic puts between are no words of the request.
        way = [str(part) for part in error["loc"] if str(part) not in VARIANTS]
        place = ".".join(way[1:] if len(way) > 1 and way[0] in ("body", "query", "path", "header") else way)
        message = error["msg"].removeprefix("Value error, ").removeprefix("Input ")
        if error["type"] == "extra_forbidden":
            sentence = f"there is no field {place!r}"
        elif error["type"] == "missing":
            sentence = f"{place} is missing"
        else:
            sentence = f"{place} = {shown(error.get('input'))} {message}"
        findings.append(Finding(field=place, detail=sentence))
    problem = plain_problem(422, f"{findings[0].detail}.")
    return problem.model_copy(update={"field": findings[0].field, "errors": findings})
