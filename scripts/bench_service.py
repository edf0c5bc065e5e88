"""Measure the service on this machine: answers under load, and what a run costs beyond the run itself.

    python scripts/bench_service.py

starts a server of its own on a free port and prints one JSON line per measurement, with the bar it is held to.

    python scripts/bench_service.py --crowd --clients 1000 --seconds 600

measures what a mixed crowd meets: status, lists, pages, long polls, submits, cancels, uploads, wrong tokens, hang-ups.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import httpx
from bench_crowd import Crowd, processor_time

CLIENTS, REQUESTS = 50, 2000
REPEATS = 5


TOKEN = "a-token-for-measuring-only"


def main() -> None:
    """Start a server, measure, stop it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--crowd", action="store_true", help="measure a mixed crowd instead")
    parser.add_argument("--clients", type=int, default=1000, help="of the crowd")
    parser.add_argument("--seconds", type=float, default=600.0, help="how long the crowd stays")
    parser.add_argument("--pace", type=float, default=8.0, help="seconds between two requests of a client")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        script = Path(sys.executable).with_name("drillrig")
        command = [str(script), "serve", "--port", "0", "--data", f"{folder}/data"]
        token = {"DRILLRIG_TOKEN": TOKEN} if asked.crowd else {}
        process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env={**os.environ, **token})
        try:
            url = _address(process)
            if asked.crowd:
                told(crowd(url, process.pid, asked.clients, asked.seconds, asked.pace))
            else:
                told(overhead(url))
                told(asyncio.run(load(url, process.pid)))
        finally:
            process.terminate()
            process.wait()


def crowd(url: str, server: int, clients: int, seconds: float, pace: float) -> dict[str, Any]:
    """A finished run, one that waits, and then everybody."""
    headers = {"Authorization": f"Bearer {TOKEN}"}
    with httpx.Client(base_url=url, timeout=60, headers=headers) as client:
        runs = []
        for name, duration in (("first", 0.2), ("second", 0.3)):
            run = client.post("/v1/runs", json={"scenario": {"name": name, "duration": duration}}).json()
            while run["status"] in ("queued", "running"):
                run = client.get(f"/v1/runs/{run['id']}", params={"wait": 10}).json()
            runs.append(run["id"])
    return asyncio.run(Crowd(url, TOKEN, runs, clients=clients, seconds=seconds, pace=pace).gather(server))


def told(document: dict[str, Any]) -> None:
    """Print a measurement."""
    print(json.dumps(document), flush=True)


def _address(process: subprocess.Popen[str]) -> str:
    assert process.stderr is not None
    for line in process.stderr:
        if line.startswith("drillrig answers at "):
            import threading

            # Whoever does not read the log stops the server that writes it.
            threading.Thread(target=process.stderr.read, daemon=True).start()
            return line.split()[3]
    raise SystemExit("the server did not start")


def overhead(url: str) -> dict[str, Any]:
    """From the request to the result file in hand, less the same run in this process: ``simulate`` and ``save``."""
    from drillrig_pin import Scenario, load_rig, simulate

    plain, served = [], []
    with httpx.Client(base_url=url, timeout=60) as client, tempfile.TemporaryDirectory() as folder:
        rig = load_rig("mkz49")
        for i in range(REPEATS):
            scenario = Scenario(name=f"bench {i}")
            started = time.perf_counter()
            simulate(rig, scenario).save(f"{folder}/run.nc")
            plain.append(time.perf_counter() - started)
            started = time.perf_counter()
            run = client.post("/v1/runs", json={"scenario": {"name": scenario.name}}).json()
            while run["status"] in ("queued", "running"):
                run = client.get(f"/v1/runs/{run['id']}", params={"wait": 10}).json()
            assert run["status"] == "completed", run
            client.get(f"/v1/runs/{run['id']}/result").raise_for_status()
            served.append(time.perf_counter() - started)
    first, rest = served[0] - plain[0], [b - a for a, b in zip(plain[1:], served[1:], strict=True)]
    return {
        "what": "submit to result of the default 10 s run, less the plain run [s]",
        "plain": round(statistics.median(plain), 3),
        "served": round(statistics.median(served), 3),
        "more": round(statistics.median(rest), 3),
        "most": round(max(first, *rest), 3),
        "first": round(first, 3),
        "bar": 1.0,
    }


async def load(url: str, server: int) -> dict[str, Any]:
    """Clients that ask for status and results one after the other."""
    number = httpx.get(f"{url}/v1/runs").json()["items"][0]["id"]
    paths = [f"/v1/runs/{number}", f"/v1/runs/{number}/metrics", "/v1/runs"]
    host, port = url.removeprefix("http://").split(":")
    times: list[float] = []
    errors = 0

    async def ask(which: int) -> None:
        # Bare connections: a client library would take more of the machine than the server does.
        nonlocal errors
        reader, writer = await asyncio.open_connection(host, int(port))
        for i in range(REQUESTS // CLIENTS):
            started = time.perf_counter()
            writer.write(f"GET {paths[(which + i) % len(paths)]} HTTP/1.1\r\nHost: {host}\r\n\r\n".encode())
            head = await reader.readuntil(b"\r\n\r\n")
            length = int(head.lower().partition(b"content-length: ")[2].split(b"\r\n")[0])
            await reader.readexactly(length)
            times.append(time.perf_counter() - started)
            errors += not head.startswith(b"HTTP/1.1 200")
        writer.close()

    before = processor_time(server)
    started = time.perf_counter()
    await asyncio.gather(*(ask(i) for i in range(CLIENTS)))
    seconds = time.perf_counter() - started
    spent = processor_time(server) - before
    times.sort()
    return {
        "what": f"{CLIENTS} clients, {REQUESTS} requests of status, lists and numbers of runs [s]",
        "median": round(statistics.median(times), 4),
        "p99": round(times[int(0.99 * len(times))], 4),
        "most": round(times[-1], 4),
        "errors": errors,
        "a_second": round(len(times) / seconds),
        "server_processor_time_each": round(spent / len(times), 5),
        "bar": 0.1,
    }


if __name__ == "__main__":
    main()
