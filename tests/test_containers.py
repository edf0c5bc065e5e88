"""The container files fit the package: what they copy exists, what they start starts. The image needs an engine."""

from __future__ import annotations

import os
import re
import shlex
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import httpx
import pytest
import yaml
from processes import PATIENCE, wait_for

ROOT = Path(__file__).parent.parent
BIN = Path(sys.executable).parent
TOKEN = "a-token-for-this-test-0123456789abcdef"


def compose() -> dict[str, Any]:
    return yaml.safe_load((ROOT / "docker/compose.yaml").read_text())


def dockerfile() -> list[str]:
    return (ROOT / "docker/Dockerfile").read_text().replace("\\\n", " ").splitlines()


def test_everything_the_image_copies_exists_and_nothing_else_is_needed() -> None:
    copied = [word for line in dockerfile() if line.startswith("COPY ") for word in line.split()[1:-1]]
    outside = [name for name in copied if not name.startswith("--from") and not name.startswith("/")]
    assert outside
    assert not [name for name in outside if not (ROOT / name).exists()]
    # What the wheel is made of, by pyproject.toml, must be among it.
    for folder in ("drillrig_pin", "urdf", "scripts/studies"):
        assert folder in outside


def test_image_installs_as_the_scripts_do() -> None:
    installed = next(line for line in dockerfile() if "install_into" in line)
    assert "scripts/environment.sh" in installed
    assert "requirements.lock" in installed
    assert "install_into" in (ROOT / "scripts/environment.sh").read_text()


def test_image_does_not_run_as_root() -> None:
    users = [line.split()[1] for line in dockerfile() if line.startswith("USER ")]
    assert users
    assert all(not user.startswith(("0", "root")) for user in users)


def test_service_is_published_to_this_machine_only_and_has_no_token_of_its_own() -> None:
    service = compose()["services"]["service"]
    assert all(port.startswith("127.0.0.1:") for port in service["ports"])
    assert service["environment"]["DRILLRIG_TOKEN"].startswith("${DRILLRIG_TOKEN:?")
    assert service["read_only"]
    assert service["cap_drop"] == ["ALL"]


@pytest.mark.parametrize("name", ["scheduler", "service", "worker"])
def test_every_option_of_a_command_is_one_the_program_knows(name: str) -> None:
    started = compose()["services"][name]
    words = started.get("entrypoint", ["drillrig"]) + started.get("command", [])
    program, command = words[:2]
    run = subprocess.run([BIN / program, command, "--help"], capture_output=True, text=True, env=_plain())
    assert run.returncode == 0, run.stderr
    for word in words[2:]:
        if word.startswith("--"):
            assert re.search(rf"{word}\b", run.stdout), word


def _plain() -> dict[str, str]:
    return {**os.environ, "NO_COLOR": "1", "COLUMNS": "200", "TERM": "dumb"}


def test_commands_of_the_readme_use_files_that_exist() -> None:
    text = (ROOT / "docker/README.md").read_text()
    named = set(re.findall(r"-f (docker/\S+)", text))
    assert named == {"docker/Dockerfile", "docker/compose.yaml"}
    assert all((ROOT / name).is_file() for name in named)


@contextmanager
def process(words: list[str], folder: Path, **environment: str) -> Iterator[subprocess.Popen[bytes]]:
    with (folder / f"{words[1]}.log").open("ab") as log:
        started = subprocess.Popen(
            [str(BIN / words[0]), *words[1:]], cwd=folder, env={**_plain(), **environment}, stdout=log, stderr=log
        )
    try:
        yield started
    finally:
        started.terminate()
        try:
            started.wait(10)
        except subprocess.TimeoutExpired:
            started.kill()


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def listened_to(port: int) -> bool:
    try:
        socket.create_connection(("127.0.0.1", port), 1).close()
    except OSError:
        return False
    return True


def test_service_scheduler_and_workers_answer_as_compose_starts_them(tmp_path: Path) -> None:
    """The commands of the compose file, with addresses of this machine in place of the names of its network."""
    services = compose()["services"]
    ports = {"8786": str(free_port()), "8000": str(free_port())}

    def words(name: str) -> list[str]:
        given = services[name].get("entrypoint", ["drillrig"]) + services[name].get("command", [])
        line = shlex.join(given).replace("scheduler:8786", f"127.0.0.1:{ports['8786']}").replace("/data", str(tmp_path))
        line = line.replace("--port 8786", f"--port {ports['8786']}").replace("--port 8000", f"--port {ports['8000']}")
        return shlex.split(line)

    with ExitStack() as running:
        running.enter_context(process(words("scheduler"), tmp_path))
        wait_for(lambda: listened_to(int(ports["8786"])))
        for number in range(services["worker"]["deploy"]["replicas"]):
            (tmp_path / str(number)).mkdir()
            running.enter_context(process(words("worker"), tmp_path / str(number)))
        running.enter_context(process(words("service"), tmp_path, DRILLRIG_TOKEN=TOKEN))
        wait_for(lambda: listened_to(int(ports["8000"])))
        with httpx.Client(base_url=f"http://127.0.0.1:{ports['8000']}", timeout=PATIENCE) as client:
            assert client.get("/healthz").status_code == 200
            assert client.get("/v1/models").status_code == 401
            client.headers["Authorization"] = f"Bearer {TOKEN}"
            case = {"model": "mkz49", "scenario": {"duration": 0.2}}
            submitted = client.post("/v1/runs", json=case)
            assert submitted.status_code in (200, 202), submitted.text
            run = submitted.json()["id"]
            wait_for(lambda: client.get(f"/v1/runs/{run}").json()["status"] not in ("queued", "running"))
            state = client.get(f"/v1/runs/{run}").json()
            assert state["status"] == "completed", state
            assert len(client.get(f"/v1/runs/{run}/result?format=nc").content) > 10_000
