"""What every request passes before it is looked at, and every answer before it leaves."""

from __future__ import annotations

import asyncio
import json
import math
import re
import time
import uuid
from http.cookies import CookieError, SimpleCookie
from typing import Any

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from drillrig_pin.errors import DrillrigError
from drillrig_pin.service.access import SAFE, Access
from drillrig_pin.service.problems import MEDIA_TYPE, Problem, ServiceError, plain_problem, problem_of
from drillrig_pin.service.settings import Settings
from drillrig_pin.service.watch import Numbers

UPLOADS = "/v1/uploads"
#: Of everything this server sends that is no page made of a run: it may use what the server itself holds, no more.
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; font-src 'self'; "
    "connect-src 'self'; frame-src 'self'; form-action 'self'; base-uri 'none'; frame-ancestors 'self'"
)
HEADERS = {
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "SAMEORIGIN",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Permissions-Policy": "camera=(), geolocation=(), microphone=()",
    "Content-Security-Policy": POLICY,
    "Cache-Control": "no-store",
}
_HEADERS = [(name.lower().encode(), value.encode()) for name, value in HEADERS.items()]
#: Of a request that is too large, so much is read before it is refused [bytes].
DRAINED = 20_000_000
_REQUEST_ID = re.compile(r"[A-Za-z0-9_-]{1,64}")


class Gate:
    """An ASGI application around another one.

    Attributes:
        failure: why it could not start.
    """

    failure: DrillrigError | None = None

    def __init__(self, app: ASGIApp, settings: Settings, access: Access, log: Any, numbers: Numbers) -> None:
        import limits
        from limits.storage import MemoryStorage
        from limits.strategies import FixedWindowRateLimiter

        self.app, self.settings, self.access, self.log, self.numbers = app, settings, access, log, numbers
        bounds = settings.limits
        self._limiter = FixedWindowRateLimiter(MemoryStorage())
        self._rates = {
            "requests": limits.RateLimitItemPerMinute(bounds.requests),
            "submissions": limits.RateLimitItemPerMinute(bounds.submissions),
            "logins": limits.RateLimitItemPerMinute(bounds.logins),
        }

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        started, headers = time.perf_counter(), Headers(scope=scope)
        given = headers.get("x-request-id", "")
        number = given if _REQUEST_ID.fullmatch(given) else uuid.uuid4().hex
        scope.setdefault("state", {})["request_id"] = number
        status = 0

        async def answer(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
                sent = message.get("headers", ())
                names = {name for name, _ in sent}
                usual = [(name, value) for name, value in _HEADERS if name not in names]
                message["headers"] = [*sent, (b"x-request-id", number.encode()), *usual]
            await send(message)

        try:
            await self.app(scope, await self._admitted(scope, headers, receive), answer)
        except ServiceError as error:
            await _refuse(answer, problem_of(error), number, error.headers)
        except Exception:
            self.log.error(
                "request failed", request_id=number, method=scope["method"], path=_path(scope), exc_info=True
            )
            if not status:
                sentence = f"The server met an error of its own. Tell its operator the number {number}."
                await _refuse(answer, plain_problem(500, sentence), number, {})
        finally:
            seconds = time.perf_counter() - started
            route = getattr(scope.get("route"), "path", "other")
            self.numbers.requests.labels(scope["method"] if route != "other" else "", route, status).inc()
            self.numbers.latency.labels(route).observe(seconds)
            self.log.info(
                "request",
                request_id=number,
                client=_client(scope),
                method=scope["method"],
                path=_path(scope),
                status=status,
                seconds=round(seconds, 4),
            )

    async def _admitted(self, scope: Scope, headers: Headers, receive: Receive) -> Receive:
        """The request's body, read and found acceptable; ServiceError if it is not admitted."""
        method, path = scope["method"], scope["path"]
        self.access.require_host(headers.get("host", ""))
        self._count("requests", scope)
        if path == "/login" and method == "POST":
            self._count("logins", scope)
        try:
            cookie = self.access.require_known(path, headers, _cookies(headers))
        except ServiceError:
            if "authorization" in headers:
                self._count("logins", scope)
            raise
        self.access.require_own_page(method, headers, cookie=cookie)
        if method in SAFE or method == "DELETE":
            return receive
        self._count("submissions", scope)
        bounds = self.settings.limits
        body = await _read(headers, receive, bounds.upload if path == UPLOADS else bounds.body, bounds.body_time)
        if "json" in headers.get("content-type", ""):
            _require_strict(body)
        return _again(body, receive)

    def _count(self, kind: str, scope: Scope) -> None:
        item, client = self._rates[kind], _client(scope)
        if not self._limiter.hit(item, kind, client):
            wait = max(1, math.ceil(self._limiter.get_window_stats(item, kind, client).reset_time - time.time()))
            raise ServiceError(
                429,
                f"more than {item.amount} {kind} a minute came from this address",
                todo=f"Try again in {wait} s.",
                headers={"Retry-After": str(wait)},
            )


async def _read(headers: Headers, receive: Receive, limit: int, seconds: float) -> bytes:
    too_large = ServiceError(413, f"the request is larger than {limit / 1e6:g} MB", headers={"Connection": "close"})
    told = headers.get("content-length", "0")
    refused = not told.isdecimal() or int(told) > limit
    chunks: list[bytes] = []
    size, more = 0, True
    try:
        async with asyncio.timeout(seconds):
            while more:
                message = await receive()
                if message["type"] == "http.disconnect":
                    raise ServiceError(400, "the client went away in the middle of its request")
                chunk, more = message.get("body", b""), message.get("more_body", False)
                size += len(chunk)
                refused = refused or size > limit
                if size > limit + DRAINED:
                    break
                if refused:
                    # Who is still sending does not hear an answer: a little more is read, and forgotten.
                    chunks.clear()
                else:
                    chunks.append(chunk)
    except TimeoutError:
        raise ServiceError(
            408, f"the request did not arrive within {seconds:g} s", headers={"Connection": "close"}
        ) from None
    if refused:
        raise too_large
    return b"".join(chunks)


def _again(body: bytes, receive: Receive) -> Receive:
    """Hands out a body that was read already, and then whatever else comes."""
    told = False

    async def handed() -> Message:
        nonlocal told
        if told:
            return await receive()
        told = True
        return {"type": "http.request", "body": body, "more_body": False}

    return handed


def _require_strict(body: bytes) -> None:
    """ServiceError 400 for what is not JSON; NaN and infinity are not, whatever Python's reader thinks of them."""
    if not body:
        return
    try:
        json.loads(body, parse_constant=_no_constant, parse_float=_finite)
    except RecursionError:
        raise ServiceError(400, "the JSON is nested too deeply") from None
    except ValueError as error:
        raise ServiceError(400, f"the request is not readable as JSON ({str(error)[:120]})") from None


def _no_constant(word: str) -> float:
    raise ValueError(f"{word} is not JSON")


def _finite(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(f"the number {text[:20]} is too large")
    return value


async def _refuse(send: Send, problem: Problem, number: str, headers: dict[str, str]) -> None:
    body = problem.model_copy(update={"request_id": number}).model_dump_json().encode()
    told = {"Content-Type": MEDIA_TYPE, "Content-Length": str(len(body)), **headers}
    pairs = [(name.lower().encode("latin-1"), value.encode("latin-1")) for name, value in told.items()]
    await send({"type": "http.response.start", "status": problem.status, "headers": pairs})
    await send({"type": "http.response.body", "body": body})


def _cookies(headers: Headers) -> dict[str, str]:
    try:
        return {name: morsel.value for name, morsel in SimpleCookie(headers.get("cookie", "")).items()}
    except CookieError:
        return {}


def _client(scope: Scope) -> str:
    return scope["client"][0] if scope.get("client") else "local"


def _path(scope: Scope) -> str:
    """The path as it is logged: without the query, and not longer than a line."""
    return str(scope["path"])[:200]
