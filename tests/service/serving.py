"""A server in a process of its own, as a user starts it."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx
from processes import PATIENCE

TOKEN = "a-token-that-nobody-guesses"
#: A server whose bounds are tighter than any option makes them.
BOUNDED = """
import json, sys
from pathlib import Path
from drillrig_pin.service.serve import serve
from drillrig_pin.service.settings import Limits, Settings
settings = Settings(Path(sys.argv[1]), port=0, workers=1, limits=Limits(**json.loads(sys.argv[2])))
serve(settings, lambda address: print("drillrig answers at", address, file=sys.stderr, flush=True))
"""


class Server:
    """``drillrig serve`` on a free port. Ends with the test."""

    def __init__(
        self,
        data: Path,
        *options: str,
        limits: dict[str, Any] | None = None,
        setup: Callable[[], None] | None = None,
        **environment: str,
    ) -> None:
        self.data = data
        data.parent.mkdir(parents=True, exist_ok=True)
        self.log = data.with_name(f"{data.name}.log")
        with self.log.open("a") as stream:
            start = self.log.stat().st_size
            command = [
                Path(sys.executable).with_name("drillrig"),
                "serve",
                "--port",
                "0",
                "--data",
                str(data),
                *options,
            ]
            if limits is not None:
                command = [sys.executable, "-c", BOUNDED, str(data), json.dumps(limits)]
            self.process = subprocess.Popen(
                command,
                stderr=stream,
                env={**os.environ, **environment},
                preexec_fn=setup,
            )
        self.url = self._address(start)
        headers = {"Authorization": f"Bearer {environment['DRILLRIG_TOKEN']}"} if environment else {}
        self.http = httpx.Client(base_url=self.url, timeout=PATIENCE, headers=headers)

    def _address(self, start: int) -> str:
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            for line in self.log.read_text()[start:].splitlines():
                if line.startswith("drillrig answers at "):
                    return line.split()[3]
            assert self.process.poll() is None, self.log.read_text()[start:]
            time.sleep(0.02)
        raise AssertionError(f"no server came up: {self.log.read_text()}")

    @property
    def port(self) -> int:
        return int(self.url.rpartition(":")[2])

    def submit(self, **request: Any) -> dict[str, Any]:
        answer = self.http.post("/v1/runs", json=request)
        assert answer.status_code in (200, 202), answer.text
        return dict(answer.json())

    def ended(self, number: str, kind: str = "runs", within: float = PATIENCE) -> dict[str, Any]:
        end = time.monotonic() + within
        while time.monotonic() < end:
            job = self.http.get(f"/v1/{kind}/{number}", params={"wait": 5}).json()
            if job["status"] in ("completed", "failed", "cancelled"):
                return dict(job)
        raise AssertionError(f"{kind} {number} has not ended within {within} s: {job}")

    def run(self, **request: Any) -> dict[str, Any]:
        return self.ended(self.submit(**request)["id"])

    def kill(self) -> None:
        """As a power cut would, as far as a process can tell."""
        self.http.close()
        self.process.kill()
        self.process.wait()

    def stop(self) -> bool:
        """As Ctrl-C does; whether it then ended by itself."""
        self.http.close()
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
            try:
                self.process.wait(PATIENCE)
            except subprocess.TimeoutExpired:
                self.process.kill()
                self.process.wait()
                return False
        return True
