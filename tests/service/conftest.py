"""Servers for the tests: one for all that do it no harm, and fresh ones for those that do."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from serving import Server


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A server that every test may use and none may harm."""
    found = Server(tmp_path_factory.mktemp("server") / "data", "--workers", "2")
    yield found
    found.stop()


@pytest.fixture
def fresh(tmp_path: Path) -> Iterator[Callable[..., Server]]:
    """Start servers on a folder of this test's own."""
    started: list[Server] = []

    def start(*options: str, **more: object) -> Server:
        started.append(Server(tmp_path / "data", *options, **more))  # type: ignore[arg-type]
        return started[-1]

    yield start
    for found in started:
        found.stop()


@pytest.fixture(scope="session")
def short(server: Server) -> dict[str, object]:
    """A completed run of a tenth of a second."""
    run = server.run(scenario={"duration": 0.1, "name": "short"})
    assert run["status"] == "completed", run
    return run
