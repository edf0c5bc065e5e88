"""The live replay as a user starts it: ready soon, seen in a browser, and gone when it is stopped."""

from __future__ import annotations

import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from browser import chromium
from command import Command
from processes import PATIENCE

from drillrig_pin import Rig, Scenario, simulate

MEMORY = 600e6  # bytes


@pytest.fixture(scope="module")
def run(mkz49: Rig, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("live") / "run.nc"
    simulate(mkz49, Scenario()).save(path)
    return path


@contextmanager
def replaying(run: Path, *words: str) -> Iterator[tuple[subprocess.Popen[str], dict[str, Any]]]:
    """``drillrig replay`` in a session of its own, and the document it prints when it is ready."""
    command = [str(Path(sys.executable).with_name("drillrig")), "replay", str(run), "--no-open", "--json", *words]
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    assert process.stdout is not None
    try:
        text = ""
        for line in process.stdout:
            text += line
            if line.startswith("}"):
                break
        yield process, json.loads(text)
    finally:
        if process.poll() is None:
            process.kill()
        process.communicate()


def peak_memory(process: int) -> float:
    """Largest memory a running process ever had [bytes]; where the system does not tell, nothing."""
    status = Path(f"/proc/{process}/status")
    if not status.exists():
        return 0.0
    (line,) = (line for line in status.read_text().splitlines() if line.startswith("VmHWM:"))
    return 1024.0 * float(line.split()[1])


def test_it_is_seen_in_a_browser_and_takes_little_memory(run: Path) -> None:
    with replaying(run) as (process, document):
        with chromium() as watched:
            watched.open(document["url"])
            assert any(node.endswith("trace S") for node in watched.nodes())
            watched.pause_at(2.0)
            before = watched.position("/machine/point S")
            watched.page.evaluate("replay.viewer.animator.play()")
            watched.page.wait_for_function("replay.viewer.animator.time > 2.01")
            assert watched.position("/machine/point S") != before
            assert watched.colours() > 1000
            assert watched.errors == []
            assert watched.outside == []
            memory = peak_memory(process.pid)
            process.send_signal(signal.SIGINT)
            watched.page.wait_for_function("document.getElementById('banner').textContent.includes('stopped')")
        assert process.wait(PATIENCE) == 0
    assert memory < MEMORY


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_however_it_is_stopped_no_process_stays(run: Path, number: signal.Signals) -> None:
    with replaying(run, "--to", "0.2") as (process, document):
        process.send_signal(number)
        assert process.wait(PATIENCE) == 0
        with pytest.raises(ProcessLookupError):
            os.killpg(process.pid, 0)
        with pytest.raises(urllib.error.URLError):
            urllib.request.urlopen(document["url"], timeout=PATIENCE)


def test_a_port_in_use_is_passed_over(run: Path) -> None:
    with replaying(run, "--to", "0.2") as (_, first), replaying(run, "--to", "0.2") as (_, second):
        assert first["url"] != second["url"]


def test_a_port_asked_for_is_taken_or_refused(run: Path, drillrig: Command) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        answer = drillrig("replay", str(run), "--to", "0.2", "--no-open", "--port", str(port))
    assert answer.code == 1
    assert f"cannot listen on 127.0.0.1:{port}" in answer.err


def test_other_sites_get_nothing_through_a_users_browser(run: Path) -> None:
    with replaying(run, "--to", "0.2") as (_, document):
        request = urllib.request.Request(document["url"] + "scene", headers={"Host": "elsewhere.example"})
        with pytest.raises(urllib.error.HTTPError) as refused:
            urllib.request.urlopen(request, timeout=PATIENCE)
        assert refused.value.code == 403


def test_a_film_is_made_and_its_browser_goes(run: Path, tmp_path: Path, drillrig: Command) -> None:
    if shutil.which("ffmpeg") is None or shutil.which("ffprobe") is None:
        sentence = "no ffmpeg on this machine (apt-get install ffmpeg)"
        pytest.fail(sentence) if os.environ.get("CI") else pytest.skip(sentence)
    target = tmp_path / "film.mp4"
    answer = drillrig("replay", str(run), "--from", "2", "--to", "2.02", "--video", str(target))
    assert answer.code == 0, answer.err
    show = ["ffprobe", "-v", "error", "-show_entries", "stream=nb_frames,width", "-of", "json", str(target)]
    (stream,) = json.loads(subprocess.run(show, capture_output=True, text=True, check=True).stdout)["streams"]
    assert (stream["width"], int(stream["nb_frames"])) == (1280, 12)
    assert [path.name for path in tmp_path.iterdir()] == ["film.mp4"]
