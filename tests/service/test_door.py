"""The front door: who is let in and from where, whom a proxy speaks for, and that every refusal is a problem."""

from __future__ import annotations

import asyncio
import io
import json
import re
import socket
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest
from processes import PATIENCE
from serving import TOKEN, Server
from typer.testing import CliRunner

from drillrig_pin.service.app import create_app
from drillrig_pin.service.gate import Gate
from drillrig_pin.service.proxy import household
from drillrig_pin.service.sessions import Sessions
from drillrig_pin.service.settings import Limits, Settings
from drillrig_pin.service.watch import make_log

PROXY = ("10.0.0.0/8", "::1")


def entrance(tmp_path: Path, **settings: Any) -> Gate:
    """The whole application, but for what it starts."""
    return create_app(Settings(tmp_path, host="0.0.0.0", token=TOKEN, **settings), make_log(io.StringIO()))


def asked(gate: Gate, *requests: tuple[str, str, dict[str, Any]], client: str = "203.0.113.7") -> list[httpx.Response]:
    """Requests one after the other, from one address."""

    async def ask() -> list[httpx.Response]:
        transport = httpx.ASGITransport(app=gate, client=(client, 1), raise_app_exceptions=False)
        async with httpx.AsyncClient(transport=transport, base_url="http://rig.example") as http:
            return [await http.request(method, url, **more) for method, url, more in requests]

    return asyncio.run(ask())


def wrong(count: int, **headers: str) -> list[tuple[str, str, dict[str, Any]]]:
    return [("POST", "/login", {"data": {"token": f"guess {i}"}, "headers": headers}) for i in range(count)]


def login(**headers: str) -> tuple[str, str, dict[str, Any]]:
    return ("POST", "/login", {"data": {"token": TOKEN}, "headers": headers})


def bearer(token: str) -> tuple[str, str, dict[str, Any]]:
    return ("GET", "/v1/schema/scenario", {"headers": {"Authorization": f"Bearer {token}"}})


def test_a_right_token_passes_whatever_wrong_ones_came_before_it(tmp_path: Path) -> None:
    gate = entrance(tmp_path, limits=Limits(logins=3, requests=12))
    answers = asked(gate, *wrong(4), bearer("guess"), login(), bearer(TOKEN))
    assert [answer.status_code for answer in answers] == [401, 401, 401, 429, 429, 303, 200]
    assert int(answers[3].headers["retry-after"]) > 0
    # Strangers who use up all requests of an address do not lock it for who knows the token.
    answers = asked(gate, *[("GET", "/v1/runs", {})] * 12, bearer(TOKEN))
    assert (answers[-2].status_code, answers[-1].status_code) == (429, 200)


def test_clients_behind_a_proxy_are_told_apart_and_only_the_proxy_is_believed(tmp_path: Path) -> None:
    gate = entrance(tmp_path, proxies=PROXY, limits=Limits(logins=2))
    stranger, other = {"X-Forwarded-For": "198.51.100.1"}, {"X-Forwarded-For": "198.51.100.2"}
    answers = asked(gate, *wrong(3, **stranger), *wrong(1, **other), client="10.1.2.3")
    assert [answer.status_code for answer in answers] == [401, 401, 429, 401]
    # The count is that of the address behind it, whichever proxy tells of it.
    for proxy in ("10.3.2.1", "::ffff:10.1.2.3", "::1"):
        assert asked(gate, *wrong(1, **stranger), client=proxy)[0].status_code == 429
    # A client may invent what it likes in front of what the proxy adds.
    answers = asked(gate, *wrong(1, **{"X-Forwarded-For": "1.2.3.4, 198.51.100.1"}), client="10.1.2.3")
    assert answers[0].status_code == 429
    # Who is no proxy speaks for nobody.
    invented = [request for i in range(3) for request in wrong(1, **{"X-Forwarded-For": f"192.0.2.{i}"})]
    assert [answer.status_code for answer in asked(gate, *invented)] == [401, 401, 429]


@pytest.mark.parametrize(("client", "secure"), [("10.0.0.1", True), ("203.0.113.7", False)])
def test_the_cookie_is_secure_where_the_proxy_says_https(tmp_path: Path, client: str, secure: bool) -> None:
    gate = entrance(tmp_path, proxies=PROXY, hosts=("outside.example", "rig.example"))
    told = {"X-Forwarded-Proto": "https", "X-Forwarded-Host": "outside.example"}
    own = {**told, "Origin": "https://outside.example"}
    answers = asked(gate, login(**told), login(**own), client=client)
    cookie = answers[0].headers["set-cookie"]
    assert ("Secure" in cookie) is secure
    assert all(word in cookie for word in ("HttpOnly", "SameSite=strict", "Path=/"))
    # The page is at home under the name the proxy was asked by.
    assert answers[1].status_code == (303 if secure else 403)


def test_a_name_the_proxy_was_asked_by_is_held_to_the_list(tmp_path: Path) -> None:
    gate = entrance(tmp_path, proxies=PROXY, hosts=("outside.example", "rig.example"))
    ask = ("GET", "/healthz", {"headers": {"X-Forwarded-Host": "evil.example"}})
    assert asked(gate, ask, client="10.0.0.1")[0].status_code == 400


def test_a_login_ends_with_its_logout(tmp_path: Path) -> None:
    gate = entrance(tmp_path)
    cookie = asked(gate, login())[0].headers["set-cookie"].partition(";")[0]
    mine = {"Cookie": cookie, "Origin": "http://rig.example"}
    look = ("GET", "/v1/schema/scenario", {"headers": mine})
    answers = asked(gate, look, ("POST", "/logout", {"headers": mine}), look)
    assert [answer.status_code for answer in answers] == [200, 303, 401]


def test_logins_end_by_themselves_and_are_few() -> None:
    few = Sessions(most=3)
    names = [few.open() for _ in range(4)]
    assert [few.valid(name) for name in names] == [False, True, True, True]
    assert not few.valid("")
    over = Sessions(seconds=-1)
    assert not over.valid(over.open())


@pytest.mark.parametrize("host", ["[", "a]b", "[zz]", "[::1", "a:b", "a@b", "a/b", "x" * 300])
@pytest.mark.parametrize("hosts", [(), ("rig.example",)])
def test_a_host_that_is_none_is_refused(tmp_path: Path, host: str, hosts: tuple[str, ...]) -> None:
    for path in ("/healthz", "/v1/runs"):
        refused(asked(entrance(tmp_path, hosts=hosts), ("GET", path, {"headers": {"Host": host}}))[0], 400)


@pytest.mark.parametrize("origin", ["http://[", "http://a]b", "http://[zz]", "null", "", "http://rig.example:x"])
def test_an_origin_that_is_none_is_refused(tmp_path: Path, origin: str) -> None:
    headers = {"Authorization": f"Bearer {TOKEN}", "Origin": origin}
    refused(asked(entrance(tmp_path), ("POST", "/v1/runs", {"headers": headers, "json": {}}))[0], 403)


def refused(answer: httpx.Response, status: int) -> None:
    """A problem with the number of its request, and the headers of every answer."""
    assert answer.status_code == status, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    problem = answer.json()
    assert problem["status"] == status
    assert problem["request_id"] == answer.headers["x-request-id"]
    assert answer.headers["x-content-type-options"] == "nosniff"


def test_every_refusal_is_a_problem(tmp_path: Path) -> None:
    gate = entrance(tmp_path)
    known = {"Authorization": f"Bearer {TOKEN}"}
    # Nothing was started: whatever needs the service fails, as a fault of the server's own would.
    for (method, path), status in {
        ("GET", "/v1/runs"): 500,
        ("GET", "/v1/nothing"): 404,
        ("PUT", "/v1/runs"): 405,
        ("TRACE", "/v1/schema/scenario"): 405,
        ("PATCH", "/"): 405,
        ("POST", "/login"): 422,
    }.items():
        (answer,) = asked(gate, (method, path, {"headers": known}))
        refused(answer, status)
        if status == 405:
            assert {"GET", "HEAD", "OPTIONS"} <= set(answer.headers["allow"].split(", "))
    (answer,) = asked(gate, ("POST", "/v1/runs", {"headers": known, "content": b"x" * 2_000_000}))
    refused(answer, 413)


def test_head_tells_what_get_would_and_options_what_a_path_knows(tmp_path: Path) -> None:
    gate = entrance(tmp_path)
    known = {"headers": {"Authorization": f"Bearer {TOKEN}"}}
    got, head = asked(gate, ("GET", "/v1/schema/scenario", known), ("HEAD", "/v1/schema/scenario", known))
    assert (head.status_code, head.content) == (200, b"")
    assert head.headers["content-length"] == str(len(got.content))
    (options,) = asked(gate, ("OPTIONS", "/v1/runs", known))
    assert options.status_code == 204
    assert options.headers["allow"] == "GET, HEAD, OPTIONS, POST"


def test_a_household_of_ipv6_is_one_client() -> None:
    assert household("2001:db8:1:2::1") == household("2001:db8:1:2:ffff::9") != household("2001:db8:1:3::1")
    assert household("::ffff:192.0.2.1") == household("192.0.2.1") == "192.0.2.1"


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--proxy", "rig.example"], "no address and no network"),
        (["--proxy", "10.0.0.0/99"], "no address and no network"),
        (["--proxy", "127.0.0.1"], "no token is set"),
    ],
)
def test_a_proxy_that_cannot_be_meant_is_refused(tmp_path: Path, options: list[str], words: str) -> None:
    from drillrig_pin.cli.app import app

    told = CliRunner().invoke(app, ["serve", "--data", str(tmp_path / "d"), *options])
    assert told.exit_code != 0
    assert words in f"{told.output} {told.exception}"


@pytest.fixture(scope="module")
def guarded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A server with a token from the environment."""
    found = Server(tmp_path_factory.mktemp("door") / "data", "--workers", "1", DRILLRIG_TOKEN=TOKEN)
    yield found
    found.stop()


def test_the_token_is_in_no_environment_once_it_is_read(guarded: Server) -> None:
    from test_service_faults import children

    guarded.http.get("/v1/models").raise_for_status()
    for number in (guarded.process.pid, *children(guarded)):
        assert TOKEN.encode() not in Path(f"/proc/{number}/environ").read_bytes()
        assert TOKEN.encode() not in Path(f"/proc/{number}/cmdline").read_bytes()


def raw(server: Server, content: bytes) -> bytes:
    """What the server answers to these bytes, until it hangs up."""
    with socket.create_connection(("127.0.0.1", server.port), timeout=PATIENCE) as connection:
        connection.sendall(content)
        answer = b""
        while part := connection.recv(65536):
            answer += part
    return answer


@pytest.mark.parametrize(
    ("content", "status"),
    [
        (b"nonsense\r\n\r\n", 400),
        (b"GET / HTTP/1.1\r\n\r\n", 400),
        (b"GET / HTTP/1.1\r\nHost: a\r\nHost: b\r\n\r\n", 400),
        (b"GET / HTTP/1.1\r\nHost: localhost\r\nX: " + b"y" * 40_000, 431),
        (b"GET /healthz HTTP/1.1\r\nHost: [\r\nConnection: close\r\n\r\n", 400),
    ],
)
def test_what_is_no_request_is_answered_by_a_problem_too(guarded: Server, content: bytes, status: int) -> None:
    head, _, body = raw(guarded, content).partition(b"\r\n\r\n")
    assert head.startswith(f"HTTP/1.1 {status} ".encode()), head
    assert b"application/problem+json" in head
    assert b"x-content-type-options: nosniff" in head.lower()
    number = json.loads(body)["request_id"]
    assert re.search(rf"x-request-id: {number}".encode(), head, re.IGNORECASE)
    assert number in guarded.log.read_text()


def test_a_mixed_crowd_meets_no_fault_of_the_servers_own(guarded: Server, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2] / "scripts"))
    import bench_service

    monkeypatch.setattr(bench_service, "TOKEN", TOKEN)
    found = bench_service.crowd(guarded.url, guarded.process.pid, clients=50, seconds=4.0, pace=0.5)
    assert found["server_errors"] == 0, found
    assert not found["broken"]
    assert found["by_kind"]["status"].keys() == {"200"}
    assert found["by_kind"]["wrong_token"].keys() <= {"401", "429"}
    assert found["memory_mb"]["end"] < found["memory_mb"]["settled"] + 100
