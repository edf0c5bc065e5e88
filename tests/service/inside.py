"""A whole service within the process of the test: workers that work at once, HTTP without a socket, a clock by hand."""

from __future__ import annotations

import asyncio
import io
from collections.abc import Callable
from concurrent.futures import Future
from pathlib import Path
from typing import Any

import httpx
import pytest

from drillrig_pin.service import desk, jobs, runs
from drillrig_pin.service.app import create_app
from drillrig_pin.service.library import Library
from drillrig_pin.service.service import Service
from drillrig_pin.service.settings import Limits, Settings
from drillrig_pin.service.watch import make_log


class AtOnce:
    """A pool whose only worker is this process."""

    local, workers = True, 1

    def __init__(self, *_: Any, **__: Any) -> None:
        pass

    def submit(self, timeout: float | None, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        future: Future[Any] = Future()
        try:
            future.set_result(function(*arguments))
        except Exception as error:
            future.set_exception(error)
        return future

    def require_alive(self) -> None:
        pass

    def close(self) -> None:
        pass


class Timers:
    """Stands for ``threading.Timer``: what was to be called later is called when the test says so."""

    daemon = False
    waiting: list[Callable[[], None]]

    def __init__(self, seconds: float, call: Callable[[], None]) -> None:
        self._call = call

    def start(self) -> None:
        self.waiting.append(self._call)

    @classmethod
    def fire(cls) -> None:
        """Let the time pass, once."""
        due, cls.waiting = cls.waiting, []
        for call in due:
            call()


@pytest.fixture
def timers(monkeypatch: pytest.MonkeyPatch) -> type[Timers]:
    """The clock of the queue, by hand."""
    Timers.waiting = []
    monkeypatch.setattr(jobs.threading, "Timer", Timers)
    return Timers


class Inside:
    """A server without a process of its own. Ends with :meth:`stop`; another one may then take up its folder."""

    def __init__(self, data: Path) -> None:
        self.data = data
        self._patch = pytest.MonkeyPatch()
        self._patch.setattr(runs, "LocalPool", AtOnce)
        self._patch.setattr(desk, "LocalPool", AtOnce)
        self._patch.setattr(Library, "warm_up", lambda library: None)
        settings = Settings(data, workers=1, limits=Limits(job_memory=0, output=0))
        self.log = io.StringIO()
        self._gate: Any = create_app(settings, make_log(self.log))
        self._loop = asyncio.new_event_loop()
        self._life = self._gate.app.router.lifespan_context(self._gate.app)
        try:
            self._loop.run_until_complete(self._life.__aenter__())
        except BaseException:
            self._end()
            raise
        self.service: Service = self._gate.app.state.service

    def ask(self, method: str, url: str, **request: Any) -> httpx.Response:
        """One request. Nothing a client is told says where on the server a file lies."""

        async def asked() -> httpx.Response:
            transport = httpx.ASGITransport(app=self._gate, raise_app_exceptions=False)
            async with httpx.AsyncClient(transport=transport, base_url="http://localhost") as client:
                return await client.request(method, url, **request)

        answer = self._loop.run_until_complete(asked())
        assert str(self.data) not in answer.text
        return answer

    def get(self, url: str, **request: Any) -> httpx.Response:
        return self.ask("GET", url, **request)

    def run(self, **scenario: Any) -> dict[str, Any]:
        """Ask for a run, which is carried out at once."""
        answer = self.ask("POST", "/v1/runs", json={"scenario": scenario})
        assert answer.status_code in (200, 202), answer.text
        return dict(answer.json())

    def stop(self) -> None:
        self._loop.run_until_complete(self._life.__aexit__(None, None, None))
        self._end()

    def _end(self) -> None:
        self._loop.run_until_complete(self._loop.shutdown_default_executor())
        self._loop.close()
        self._patch.undo()
