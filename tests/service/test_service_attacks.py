"""Requests that are meant badly: each is refused with a 4xx, in bounded time and memory."""

from __future__ import annotations

import contextlib
import re
import socket
from collections.abc import Callable, Iterator
from pathlib import Path

import httpx
import pytest
from processes import PATIENCE, processor_time
from serving import TOKEN, Server

BOMB = b"""<?xml version="1.0"?><!DOCTYPE r [<!ENTITY a "aaaaaaaaaa">
<!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;"><!ENTITY c "&b;&b;&b;&b;&b;&b;&b;&b;&b;&b;">
<!ENTITY d "&c;&c;&c;&c;&c;&c;&c;&c;&c;&c;"><!ENTITY e "&d;&d;&d;&d;&d;&d;&d;&d;&d;&d;">]>
<robot name="&e;"><link name="a"/></robot>"""
XXE = b"""<?xml version="1.0"?><!DOCTYPE r [<!ENTITY x SYSTEM "file:///etc/passwd">]>
<robot name="r"><link name="&x;"/></robot>"""
XACRO = b"""<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">
<link name="${open('/etc/passwd').read()}"/></robot>"""


@pytest.fixture(autouse=True)
def bounded(server: Server) -> Iterator[None]:
    """Whatever is asked, the server neither grows nor stops answering."""
    before = _memory(server)
    computed = processor_time(server.process.pid)
    yield
    assert processor_time(server.process.pid) - computed < 30
    assert _memory(server) - before < 100e6
    assert server.http.get("/healthz").json()["status"] == "ok"


def _memory(server: Server) -> float:
    text = Path(f"/proc/{server.process.pid}/status").read_text()
    return 1e3 * float(re.search(r"VmRSS:\s+(\d+)", text)[1])  # type: ignore[index]


def refused(answer: httpx.Response, status: int, *words: str) -> None:
    assert answer.status_code == status, answer.text[:500]
    assert answer.headers["content-type"] == "application/problem+json"
    for word in words:
        assert word in answer.json()["detail"], answer.json()["detail"]
    for secret in ("root:", "Traceback", TOKEN):
        assert secret not in answer.text


def upload(server: Server, content: bytes) -> httpx.Response:
    return server.http.post("/v1/uploads", content=content, headers={"Content-Type": "application/xml"})


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (BOMB, "DTD or an entity"),
        (XXE, "DTD or an entity"),
        (XACRO, "xacro"),
        (
            b'<robot name="r"><link name="a"><visual><mesh filename="package://r/a.stl"/></visual></link></robot>',
            "file",
        ),
        (b'<robot name="r"><link name="a"><visual><mesh filename="/etc/passwd"/></visual></link></robot>', "file"),
        (
            b'<robot name="r"><link name="a"/><drillrig><load><table file="/etc/passwd"/></load></drillrig></robot>',
            "file",
        ),
        (b'<robot name="r"><link name="a"/><x y="http://169.254.169.254/"/></robot>', "names a place"),
        (b'<robot name="r">' + b"".join(b'<link name="l%d"/>' % i for i in range(300)) + b"</robot>", "300 links"),
        (b'<robot name="r">' + b"<a/>" * 30_000 + b"</robot>", "30001 XML elements"),
        (b"<a>" * 10_000 + b"</a>" * 10_000, "nests deeper"),
        (b'<robot name="r"><link name="a"/>', "not well-formed"),
        (b"\xff\xfe<\x00r\x00", "UTF-8"),
        (b"", "missing"),
        (b"<urdf/>", "not <robot>"),
    ],
)
def test_a_model_that_could_do_harm_is_not_taken(server: Server, content: bytes, words: str) -> None:
    # Other tests may have left models on this server.
    before = server.http.get("/v1/uploads").json()
    refused(upload(server, content), 422, words)
    assert server.http.get("/v1/uploads").json() == before


def test_what_is_too_large_is_refused_before_it_is_read(server: Server) -> None:
    refused(upload(server, b"<robot>" + b" " * 10_000_000 + b"</robot>"), 413, "larger than 2 MB")
    refused(server.http.post("/v1/runs", json={"model": "a" * 10_000_000}), 413, "larger than 1 MB")

    def drops() -> Iterator[bytes]:
        for _ in range(200):
            yield b" " * 50_000

    headers = {"Content-Type": "application/json"}
    # The server may hang up while the client is still sending.
    with contextlib.suppress(httpx.WriteError):
        refused(server.http.post("/v1/runs", content=drops(), headers=headers), 413)


@pytest.mark.parametrize(
    "body",
    [
        '{"scenario": {"duration": NaN}}',
        '{"scenario": {"duration": Infinity}}',
        '{"arguments": {"boom_length": -Infinity}}',
        '{"arguments": {"boom_length": 1e999}}',
        '{"scenario": {"duration": 1',
        "[" * 100_000,
        '{"arguments": {"boom_length": ' + "9" * 10_000 + "}}",
    ],
)
def test_what_is_not_json_is_refused(server: Server, body: str) -> None:
    refused(server.http.post("/v1/runs", content=body, headers={"Content-Type": "application/json"}), 400, "JSON")


@pytest.mark.parametrize(
    "path",
    [
        "/v1/runs/../../records.sqlite",
        "/v1/runs/%2e%2e%2f%2e%2e%2frecords.sqlite",
        "/v1/runs/..%2f..%2frecords.sqlite/result",
        "/static/..%2f..%2f..%2fetc%2fpasswd",
        "/static/%2fetc%2fpasswd",
        "/v1/uploads/..%2f..%2frecords.sqlite",
        "/v1/models/..%2f..%2fmkz49/parameters",
        "/v1/models/%2fetc%2fpasswd/parameters",
        "/v1/studies/%00/table",
    ],
)
def test_no_path_is_built_of_what_a_client_says(server: Server, path: str) -> None:
    with socket.create_connection(("127.0.0.1", server.port), timeout=PATIENCE) as connection:
        connection.sendall(f"GET {path} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n".encode())
        answer = b""
        while part := connection.recv(65536):
            answer += part
    assert answer.startswith(b"HTTP/1.1 404"), answer[:300]
    assert b"root:" not in answer
    assert b"SQLite" not in answer


@pytest.mark.parametrize("model", ["/etc/passwd", "../mkz49.urdf.xacro", "urdf/mkz49.urdf.xacro", "upload:../../x", ""])
def test_a_model_is_a_name_and_no_path(server: Server, model: str) -> None:
    refused(server.http.post("/v1/runs", json={"model": model}), 404)


@pytest.mark.parametrize(
    "word", ["${1+1}", "$(find x)", "$(arg boom_length)", "open('/etc/passwd')", "aligned\n", "a" * 100, "", "a.b"]
)
def test_no_argument_reaches_xacro_as_an_expression(server: Server, word: str) -> None:
    refused(server.http.post("/v1/runs", json={"arguments": {"com_reading": word}}), 422, "is not a word")
    refused(server.http.post("/v1/runs", json={"arguments": {"boom_length": word}}), 422, "is not a finite number")
    refused(server.http.post("/v1/models/mkz49/urdf", json={"arguments": {"com_reading": word}}), 422)


def test_a_page_of_another_origin_can_change_nothing(server: Server) -> None:
    for headers in (
        {"Origin": "http://evil.example"},
        {"Origin": "null"},
        {"Origin": "http://127.0.0.1:1"},
        {"Sec-Fetch-Site": "cross-site"},
        {"Sec-Fetch-Site": "same-site"},
    ):
        refused(server.http.post("/v1/runs", json={}, headers=headers), 403)
        refused(server.http.delete("/v1/runs/" + "0" * 32, headers=headers), 403)
    for host in ("evil.example", "evil.example:8000", "localhost@evil.example", "127.0.0.1.evil.example"):
        refused(server.http.get("/v1/runs", headers={"Host": host}), 400, "Host")
    own = {"Origin": server.url, "Sec-Fetch-Site": "same-origin"}
    assert server.http.post("/v1/models/mkz49/check", json={}, headers=own).status_code == 200


def test_without_the_token_nothing_is_told(fresh: Callable[..., Server]) -> None:
    guarded = fresh("--host", "0.0.0.0", DRILLRIG_TOKEN=TOKEN)
    url = f"http://127.0.0.1:{guarded.port}"
    with httpx.Client(base_url=url) as anybody:
        for path in ("/v1/runs", "/v1/models", "/metrics", "/openapi.json", "/v1/nothing"):
            refused(anybody.get(path), 401)
        refused(anybody.post("/v1/runs", json={}), 401)
        refused(anybody.get("/v1/runs", params={"token": TOKEN}), 401)
        for header in ("Bearer wrong", f"Basic {TOKEN}", f"Bearer {TOKEN}x", "Bearer", f"bearer{TOKEN}"):
            refused(anybody.get("/v1/runs", headers={"Authorization": header}), 401)
        assert anybody.get("/healthz").json()["login"] is True
        assert anybody.get("/").status_code == 200
        assert anybody.get("/v1/runs", headers={"Authorization": f"Bearer {TOKEN}"}).status_code == 200

        refused(anybody.post("/login", data={"token": "wrong"}), 401)
        entered = anybody.post("/login", data={"token": TOKEN})
        assert entered.status_code == 303
        cookie = entered.headers["set-cookie"]
        assert all(word in cookie for word in ("HttpOnly", "SameSite=strict", "Path=/"))
        assert TOKEN not in cookie
        assert anybody.get("/v1/runs").status_code == 200
        refused(anybody.post("/v1/models/mkz49/check", json={}), 403)
        own = {"Origin": url}
        assert anybody.post("/v1/models/mkz49/check", json={}, headers=own).status_code == 200
        session = anybody.cookies["drillrig_session"]
        anybody.cookies.clear()
        end, _, signature = session.partition(".")
        for forged in (f"{int(end) + 999}.{signature}", f"{end}.", "1.0", f"{end}.{'0' * 64}"):
            refused(anybody.get("/v1/runs", headers={"Cookie": f"drillrig_session={forged}"}), 401)
        answers = {anybody.post("/login", data={"token": f"guess {i}"}).status_code for i in range(25)}
        assert answers == {401, 429}
    assert TOKEN not in guarded.log.read_text()


def test_a_server_others_can_reach_does_not_start_without_a_token(tmp_path: Path) -> None:
    import subprocess
    import sys

    command = [Path(sys.executable).with_name("drillrig"), "serve", "--host", "0.0.0.0", "--data", str(tmp_path / "d")]
    told = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
    assert told.returncode == 1
    assert "no token is set" in told.stderr
    assert not (tmp_path / "d").exists()


def test_clients_that_are_too_slow_or_too_many_are_turned_away(fresh: Callable[..., Server]) -> None:
    tight = fresh(limits={"body_time": 0.5, "requests": 60, "queue": 1})
    head = b"POST /v1/runs HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: 10\r\n\r\n"
    with socket.create_connection(("127.0.0.1", tight.port), timeout=PATIENCE) as slow:
        slow.sendall(head + b'{"')
        assert slow.recv(65536).startswith(b"HTTP/1.1 408")
    slow_runs = [{"scenario": {"duration": 20.0 + i, "engine": "python"}} for i in range(3)]
    answers = [tight.http.post("/v1/runs", json=request) for request in slow_runs]
    assert [answer.status_code for answer in answers] == [202, 202, 429]
    assert int(answers[2].headers["retry-after"]) >= 1
    refused(answers[2], 429, "waiting already")
    answers = [tight.http.get("/v1/runs") for _ in range(70)]
    assert answers[0].status_code == 200
    refused(answers[-1], 429, "a minute")
    assert 1 <= int(answers[-1].headers["retry-after"]) <= 60


def test_a_request_that_never_gets_to_its_end_is_hung_up_on(monkeypatch: pytest.MonkeyPatch) -> None:
    import asyncio

    import uvicorn

    from drillrig_pin.service import connection

    monkeypatch.setattr(connection, "HEAD_TIME", 0.2)

    async def app(scope: object, receive: object, send: object) -> None:
        raise AssertionError("no request was complete")

    async def hung_up() -> bytes:
        listener = socket.create_server(("127.0.0.1", 0))
        config = uvicorn.Config(app, http=connection.PromptConnection, lifespan="off", log_config=None)
        server = uvicorn.Server(config)
        serving = asyncio.create_task(server.serve(sockets=[listener]))
        reader, writer = await asyncio.open_connection(*listener.getsockname())
        writer.write(b"GET / HTTP/1.1\r\nHost:")
        answer = await asyncio.wait_for(reader.read(), PATIENCE)
        writer.close()
        server.should_exit = True
        await serving
        return answer

    assert asyncio.run(hung_up()).startswith(b"HTTP/1.1 408")
