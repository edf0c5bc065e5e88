"""What every request passes before it is looked at, and every answer before it leaves."""

from __future__ import annotations

import asyncio
import json
import math
import re
import time
import uuid
from collections import Counter
from http.cookies import CookieError, SimpleCookie
from typing import Any

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from drillrig_pin.errors import DrillrigError
from drillrig_pin.service.access import SAFE, Access
from drillrig_pin.service.headers import USUAL
from drillrig_pin.service.problems import MEDIA_TYPE, Problem, ServiceError, own_fault, problem_of
from drillrig_pin.service.proxy import Proxied, household
from drillrig_pin.service.settings import Settings
from drillrig_pin.service.visit import VISIT, Visit
from drillrig_pin.service.watch import Numbers

UPLOADS = "/v1/uploads"
HEALTH = "/healthz"
#: Of a request that is too large, so much is read before it is refused [bytes].
DRAINED = 20_000_000
_LARGE = re.compile(rb"[eE]\+?0*[1-9]\d\d|\d{200}")
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
        self._under_way: Counter[str] = Counter()
        self._entry: ASGIApp = Proxied(self._serve, settings.proxies) if settings.proxies else self._serve
        self._rates = {
            "requests": limits.RateLimitItemPerMinute(bounds.requests),
            "submissions": limits.RateLimitItemPerMinute(bounds.submissions),
            "logins": limits.RateLimitItemPerMinute(bounds.logins),
        }

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""
        if scope["type"] == "http":
            await self._entry(scope, receive, send)
        else:
            await self.app(scope, receive, send)

    async def _serve(self, scope: Scope, receive: Receive, send: Send) -> None:
        started, headers = time.perf_counter(), Headers(scope=scope)
        given = headers.get("x-request-id", "")
        number = given if _REQUEST_ID.fullmatch(given) else uuid.uuid4().hex
        scope.setdefault("state", {})["request_id"] = number
        client, method = household(_client(scope)), scope["method"]
        only_head, status, failed = method == "HEAD", 0, None
        if only_head:
            scope = {**scope, "method": "GET"}

        async def answer(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
                sent = message.get("headers", ())
                names = {name for name, _ in sent}
                usual = [(name, value) for name, value in USUAL if name not in names]
                message["headers"] = [*sent, (b"x-request-id", number.encode()), *usual]
            elif only_head:
                message = {**message, "body": b""}
            await send(message)

        self._under_way[client] += 1
        try:
            visit = await self._admitted(scope, headers, receive, client)
            VISIT.set(visit)
            await self.app(scope, visit.receive, answer)
        except ServiceError as error:
            if not status:
                await _refuse(answer, problem_of(error), number, error.headers)
        except Exception as error:
            failed = error
            self.log.error("request failed", request_id=number, method=method, path=_path(scope), exc_info=True)
            if not status:
                await _refuse(answer, own_fault(number), number, {})
        finally:
            self._under_way[client] -= 1
            if not self._under_way[client]:
                del self._under_way[client]
            seconds = time.perf_counter() - started
            route = getattr(scope.get("route"), "path", "other")
            self.numbers.requests.labels(method if route != "other" else "", route, status).inc()
            self.numbers.latency.labels(route).observe(seconds)
            self.log.info(
                "request",
                request_id=number,
                client=_client(scope),
                method=method,
                path=_path(scope),
                status=status,
                seconds=round(seconds, 4),
                **({"failed": type(failed).__name__} if failed else {}),
            )

    async def _admitted(self, scope: Scope, headers: Headers, receive: Receive, client: str) -> Visit:
        """The request with its body, read and found acceptable; ServiceError if it is not admitted."""
        method, path, bounds = scope["method"], scope["path"], self.settings.limits
        self.access.require_host(headers.get("host", ""))
        if path == HEALTH and method in SAFE:
            # Whoever looks after the server has to see it live however many others ask for something.
            return Visit(client, receive)
        if scope["state"].get("crowded"):
            raise _busy(503, "more connections are open than this server keeps")
        if self._under_way[client] > bounds.under_way:
            raise _busy(429, f"more than {bounds.under_way} requests of this address are under way")
        cookies = _cookies(headers)
        entrance = self.access.entrance(headers, cookies)
        # Who shows the token is not counted with strangers who share its address.
        self._count("requests", f"{client} {'known' if entrance else ''}")
        try:
            self.access.require_known(path, headers, entrance)
        except ServiceError:
            if "authorization" in headers:
                self.wrong_token(client)
            raise
        self.access.require_own_page(method, headers, cookie=entrance == "cookie")
        if method in SAFE or method == "DELETE":
            return Visit(client, receive)
        self._count("submissions", f"{client} {'known' if entrance else ''}")
        body = await _read(headers, receive, bounds.upload if path == UPLOADS else bounds.body, bounds.body_time)
        if "json" in headers.get("content-type", ""):
            _require_strict(body)
        return Visit(client, _again(body, receive))

    def wrong_token(self, client: str) -> None:
        """Count a token that is none; ServiceError 429 when it was one too many. A right one is never counted."""
        self._count("logins", client)

    def _count(self, kind: str, client: str) -> None:
        item = self._rates[kind]
        if not self._limiter.hit(item, kind, client):
            wait = max(1, math.ceil(self._limiter.get_window_stats(item, kind, client).reset_time - time.time()))
            raise ServiceError(
                429,
                f"more than {item.amount} {kind} a minute came from this address",
                todo=f"Try again in {wait} s.",
                headers={"Retry-After": str(wait)},
            )


def _busy(status: int, what: str) -> ServiceError:
    return ServiceError(status, what, todo="Try again in 2 s.", headers={"Retry-After": "2", "Connection": "close"})


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
    # Numbers that could be beyond every number are looked at one by one, which takes long where there are many.
    read = _finite if _LARGE.search(body) else None
    try:
        json.loads(body, parse_constant=_no_constant, parse_float=read)
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
