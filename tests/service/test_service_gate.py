"""The gate around the application, with an application that does what the test says."""

from __future__ import annotations

import asyncio
import io
import json
from pathlib import Path
from typing import Any

import httpx

from drillrig_pin.service.access import Access
from drillrig_pin.service.gate import Gate
from drillrig_pin.service.settings import Limits, Settings
from drillrig_pin.service.watch import Numbers, make_log


def ask(app: Any, settings: Settings, **request: Any) -> tuple[httpx.Response, list[dict[str, Any]]]:
    """One request through a gate; gives the answer and the lines of the log."""
    log = io.StringIO()
    gate = Gate(app, settings, Access(settings), make_log(log), Numbers())

    async def asked() -> httpx.Response:
        transport = httpx.ASGITransport(app=gate, raise_app_exceptions=False)
        async with httpx.AsyncClient(transport=transport, base_url="http://localhost") as client:
            return await client.request(**request)

    answer = asyncio.run(asked())
    return answer, [json.loads(line) for line in log.getvalue().splitlines()]


async def broken(scope: Any, receive: Any, send: Any) -> None:
    secret = "/srv/secret"
    raise RuntimeError(f"cannot open {secret}")


async def echo(scope: Any, receive: Any, send: Any) -> None:
    body = (await receive())["body"]
    await send({"type": "http.response.start", "status": 200, "headers": [(b"cache-control", b"max-age=1")]})
    await send({"type": "http.response.body", "body": body})


def test_an_error_of_the_servers_own_tells_a_number_and_nothing_else(tmp_path: Path) -> None:
    answer, lines = ask(broken, Settings(tmp_path), method="GET", url="/v1/runs")
    assert answer.status_code == 500
    assert answer.headers["content-type"] == "application/problem+json"
    assert "secret" not in answer.text
    assert "Traceback" not in answer.text
    number = answer.json()["request_id"]
    assert number in answer.json()["detail"]
    (failed,) = [line for line in lines if line["level"] == "error"]
    assert failed["request_id"] == number
    assert "cannot open /srv/secret" in failed["exception"]


def test_a_body_arrives_whole_and_the_usual_headers_leave_with_every_answer(tmp_path: Path) -> None:
    answer, lines = ask(echo, Settings(tmp_path), method="POST", url="/v1/x", content=b"x" * 70_000)
    assert answer.content == b"x" * 70_000
    assert answer.headers["cache-control"] == "max-age=1"
    assert answer.headers["x-frame-options"] == "SAMEORIGIN"
    assert answer.headers["referrer-policy"] == "no-referrer"
    assert [line["status"] for line in lines] == [200]


def test_nothing_a_client_sends_is_logged_but_method_and_path(tmp_path: Path) -> None:
    settings = Settings(tmp_path, token="a-token-of-the-server")
    for headers in ({"Authorization": "Bearer a-token-of-the-server"}, {"Authorization": "Bearer guess"}):
        _, lines = ask(echo, settings, method="GET", url="/v1/x?token=in-the-url", headers=headers)
        assert "a-token-of-the-server" not in json.dumps(lines)
        assert "in-the-url" not in json.dumps(lines)
        assert "guess" not in json.dumps(lines)


def test_who_guesses_tokens_is_turned_away_after_a_few(tmp_path: Path) -> None:
    settings = Settings(tmp_path, token="a-token-of-the-server", limits=Limits(logins=3))
    gate = Gate(echo, settings, Access(settings), make_log(io.StringIO()), Numbers())

    async def statuses() -> list[int]:
        transport = httpx.ASGITransport(app=gate)
        async with httpx.AsyncClient(transport=transport, base_url="http://localhost") as client:
            wrong = [client.get("/v1/x", headers={"Authorization": f"Bearer {i}"}) for i in range(5)]
            return [(await answer).status_code for answer in wrong]

    assert asyncio.run(statuses()) == [401, 401, 401, 429, 429]
