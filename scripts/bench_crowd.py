"""Many clients at once, of whom some know no token, hang up or say nothing: what the others get meanwhile.

python scripts/bench_service.py --crowd --clients 1000 --seconds 600
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import random
import time
from collections import Counter
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

#: What a client does next, and how often of a hundred times.
HABITS = {
    "status": 45,
    "list": 10,
    "page": 8,
    "long_poll": 12,
    "submit": 5,
    "cancel": 3,
    "upload": 3,
    "wrong_token": 5,
    "hang_up": 6,
    "health": 3,
}
#: How the numbers of runs differ; more of them would only fill the disk.
KINDS = 40
MODEL = (
    '<robot name="pendulum"><link name="base"/><link name="bob"><inertial><mass value="{mass}"/>'
    '<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>'
    '<joint name="swing" type="continuous"><parent link="base"/><child link="bob"/><axis xyz="0 1 0"/></joint></robot>'
)


class Client:
    """One of the crowd, with a connection of its own that it keeps as long as the server lets it."""

    def __init__(self, number: int, crowd: Crowd) -> None:
        self.crowd, self.random = crowd, random.Random(number)
        self._wires: tuple[asyncio.StreamReader, asyncio.StreamWriter] | None = None

    async def live(self) -> None:
        """Ask for one thing after the other."""
        await asyncio.sleep(self.random.uniform(0, min(self.crowd.pace, self.crowd.seconds / 2)))
        acts: dict[str, Callable[[], Awaitable[None]]] = {name: getattr(self, f"_{name}") for name in HABITS}
        while time.perf_counter() < self.crowd.end:
            name = self.random.choices(list(HABITS), list(HABITS.values()))[0]
            try:
                await acts[name]()
            except (OSError, asyncio.IncompleteReadError) as error:
                self.crowd.broken[f"{name}: {type(error).__name__}"] += 1
                self._drop()
            await asyncio.sleep(self.random.expovariate(1 / self.crowd.pace))
        self._drop()

    async def _status(self) -> None:
        started = time.perf_counter()
        await self._ask("status", "GET", f"/v1/runs/{self.random.choice(self.crowd.runs)}")
        self.crowd.times.append(time.perf_counter() - started)

    async def _list(self) -> None:
        await self._ask("list", "GET", "/v1/runs?limit=20")

    async def _page(self) -> None:
        pages = ["/", "/static/main.js", "/v1/models", f"/v1/runs/{self.crowd.runs[0]}/metrics"]
        await self._ask("page", "GET", self.random.choice(pages))

    async def _long_poll(self) -> None:
        await self._ask("long_poll", "GET", f"/v1/runs/{self.random.choice(self.crowd.runs[1:])}?wait=5")

    async def _submit(self) -> None:
        kind = self.random.randrange(KINDS)
        engine = "python" if kind % 10 == 0 else "auto"
        scenario = {"name": f"crowd {kind}", "duration": 0.1 + 0.01 * kind, "engine": engine}
        answer = await self._ask("submit", "POST", "/v1/runs", json.dumps({"scenario": scenario}).encode())
        with contextlib.suppress(ValueError, KeyError):
            number = json.loads(answer)["id"]
            if number not in self.crowd.runs:
                self.crowd.runs.append(number)

    async def _cancel(self) -> None:
        await self._ask("cancel", "POST", f"/v1/runs/{self.random.choice(self.crowd.runs[1:])}/cancel", b"")

    async def _upload(self) -> None:
        model = MODEL.format(mass=1 + self.random.randrange(KINDS)).encode()
        await self._ask("upload", "POST", "/v1/uploads", model, kind="application/xml")

    async def _wrong_token(self) -> None:
        await self._ask("wrong_token", "GET", "/v1/runs", token=f"guess {self.random.random()}")

    async def _health(self) -> None:
        await self._ask("health", "GET", "/healthz")

    async def _hang_up(self) -> None:
        """Say nothing, begin a request, or wait for a minute; and be gone."""
        reader, writer = await asyncio.open_connection(self.crowd.host, self.crowd.port)
        poll = self._head("GET", f"/v1/runs/{self.random.choice(self.crowd.runs)}?wait=60", self.crowd.token)
        writer.write(self.random.choice([b"", b"GET / HTTP/1.1\r\nHost:", poll + b"\r\n"]))
        await asyncio.sleep(self.random.uniform(0, 1))
        writer.transport.abort()
        del reader
        self.crowd.answers["hang_up", 0] += 1

    def _head(self, method: str, path: str, token: str) -> bytes:
        return f"{method} {path} HTTP/1.1\r\nHost: {self.crowd.host}\r\nAuthorization: Bearer {token}\r\n".encode()

    async def _ask(
        self,
        name: str,
        method: str,
        path: str,
        body: bytes | None = None,
        *,
        token: str | None = None,
        kind: str = "application/json",
    ) -> bytes:
        head = self._head(method, path, token or self.crowd.token)
        if body is not None:
            head += f"Content-Type: {kind}\r\nContent-Length: {len(body)}\r\n".encode()
        kept = self._wires is not None
        try:
            status, answer = await self._told(head + b"\r\n" + (body or b""))
        except (ConnectionError, asyncio.IncompleteReadError):
            # A connection that was kept may have been ended by the server in the meantime, as HTTP allows it.
            self._drop()
            if not kept:
                raise
            status, answer = await self._told(head + b"\r\n" + (body or b""))
        self.crowd.answers[name, status] += 1
        return answer

    async def _told(self, request: bytes) -> tuple[int, bytes]:
        if self._wires is None:
            self._wires = await asyncio.open_connection(self.crowd.host, self.crowd.port)
        reader, writer = self._wires
        writer.write(request)
        head = (await reader.readuntil(b"\r\n\r\n")).lower()
        length = head.partition(b"content-length: ")[2].split(b"\r\n")[0]
        answer = await reader.readexactly(int(length or 0))
        if b"connection: close" in head:
            self._drop()
        return int(head.split()[1]), answer

    def _drop(self) -> None:
        if self._wires is not None:
            self._wires[1].transport.abort()
            self._wires = None


class Crowd:
    """All clients, and what they met."""

    def __init__(self, url: str, token: str, runs: list[str], *, clients: int, seconds: float, pace: float) -> None:
        self.host, port = url.removeprefix("http://").split(":")
        self.port, self.token, self.runs = int(port), token, runs
        self.clients, self.seconds, self.pace = clients, seconds, pace
        self.times: list[float] = []
        self.answers: Counter[tuple[str, int]] = Counter()
        self.broken: Counter[str] = Counter()
        self.end = 0.0

    async def gather(self, server: int) -> dict[str, Any]:
        """Let them live; gives what was measured. ``server`` is its process."""
        started, computed = time.perf_counter(), processor_time(server)
        self.end = started + self.seconds
        everybody = asyncio.gather(*(Client(i, self).live() for i in range(self.clients)))
        memory = []
        while not everybody.done():
            await asyncio.wait([everybody], timeout=self.seconds / 20)
            memory.append(resident(server))
        await everybody
        self.times.sort()
        statuses: Counter[int] = Counter()
        for (_, status), count in self.answers.items():
            statuses[status] += count
        # The first quarter warms up: what is imported and remembered once.
        settled = memory[len(memory) // 4 :] or memory
        return {
            "what": f"{self.clients} clients mixed for {self.seconds:g} s on loopback",
            "requests": sum(self.answers.values()),
            "a_second": round(sum(self.answers.values()) / (time.perf_counter() - started), 1),
            "server_processor_time_each_ms": round(
                1e3 * (processor_time(server) - computed) / max(1, sum(self.answers.values())), 2
            ),
            "answers": dict(sorted(statuses.items())),
            "server_errors": sum(count for status, count in statuses.items() if status >= 500),
            "broken": dict(self.broken),
            "status_median_ms": round(1e3 * _share(self.times, 0.5), 1),
            "status_p99_ms": round(1e3 * _share(self.times, 0.99), 1),
            "status_most_ms": round(1e3 * _share(self.times, 1.0), 1),
            "memory_mb": {"settled": round(settled[0]), "end": round(settled[-1]), "most": round(max(memory))},
            "load_average": [round(value, 1) for value in os.getloadavg()],
            "cores": len(os.sched_getaffinity(0)),
            "by_kind": {
                name: {str(status): n for (kind, status), n in sorted(self.answers.items()) if kind == name}
                for name in HABITS
            },
            "bar_p99_ms": 200,
        }


def resident(pid: int) -> float:
    """Memory of a process [MB]."""
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def processor_time(pid: int) -> float:
    """What a process has computed [s], which a busy machine does not change much."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _share(times: list[float], share: float) -> float:
    return times[min(len(times) - 1, int(share * len(times)))] if times else 0.0
