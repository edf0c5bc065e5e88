"""A film of a scene: a headless browser plays the page frame by frame and hands every picture to ffmpeg."""

from __future__ import annotations

import contextlib
import os
import queue
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

from drillrig_pin.errors import ResultFileError
from drillrig_pin.files import write_aside
from drillrig_pin.litter import temporary_folder
from drillrig_pin.replay.payload import scene_bytes, scene_words
from drillrig_pin.replay.server import LiveServer
from drillrig_pin.scene.scene import Scene

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
WIDTH, HEIGHT = 1280, 720
RATE = 30
#: A longer film than this takes longer to make than anybody waits for it [s of watching].
LONGEST = 30.0
#: The first picture may take this long, any other one less [s].
PATIENCE = 60.0

Progress = Callable[[int, int], None]


def find_browser() -> str | None:
    """Path of an installed Chromium or Chrome."""
    return next((path for name in BROWSERS if (path := shutil.which(name))), None)


def pictures(scene: Scene) -> int:
    """How many pictures the film of a scene has; it may end before the run does."""
    return max(1, round(min(LONGEST, float(scene.frames[-1] - scene.frames[0]) / scene.speed) * RATE))


def film(scene: Scene, target: Path, progress: Progress | None = None) -> None:
    """Write an MP4 film of 1280 x 720 points, 30 pictures a second.

    Args:
        scene: what is shown.
        target: the file.
        progress: called with the pictures made and their total.

    Raises:
        ResultFileError: no Chromium, no ffmpeg, or one of them fails.
    """
    browser, encoder = find_browser(), shutil.which("ffmpeg")
    missing = [name for name, path in (("Chromium (or Chrome)", browser), ("ffmpeg", encoder)) if path is None]
    if browser is None or encoder is None:
        raise ResultFileError(
            f"a film needs {' and '.join(missing)}, not found on this machine",
            where=target,
            todo="On Debian and Ubuntu: apt-get install chromium ffmpeg. Without them, --html FILE writes a page.",
        )
    count = pictures(scene)
    server = LiveServer(scene.title, port=0)
    server.show(scene_bytes(scene), scene_words(scene))
    try:
        with write_aside(target) as aside, _encoder(encoder, aside, target) as pipe, _browser(browser, server, count):
            for number in range(count):
                pipe(_picture(server, target))
                if progress is not None:
                    progress(number + 1, count)
    except OSError as error:
        raise ResultFileError(f"the film cannot be written ({error.strerror})", where=target) from None
    finally:
        server.close()


def _picture(server: LiveServer, target: Path) -> bytes:
    try:
        return server.frames.get(timeout=PATIENCE)
    except queue.Empty:
        raise ResultFileError(
            f"the browser made no picture for {PATIENCE:g} s", where=target, todo="Look whether it starts by itself."
        ) from None


@contextlib.contextmanager
def _encoder(ffmpeg: str, aside: Path, target: Path) -> Iterator[Callable[[bytes], object]]:
    source = f"-f image2pipe -framerate {RATE} -c:v mjpeg -i -".split()
    result = ["-c:v", "libx264", "-pix_fmt", "yuv420p", "-crf", "20", "-metadata", "comment=drillrig-pin", "-f", "mp4"]
    command = [ffmpeg, "-hide_banner", "-loglevel", "error", "-y", *source, *result, str(aside)]
    with tempfile.TemporaryFile() as complaints, _child(command, stdin=subprocess.PIPE, stderr=complaints) as process:
        assert process.stdin is not None
        failed = False
        try:
            yield process.stdin.write
        except BrokenPipeError:
            failed = True
        finally:
            with contextlib.suppress(BrokenPipeError):
                process.stdin.close()
        if process.wait() != 0 or failed:
            complaints.seek(0)
            reason = " ".join(complaints.read().decode(errors="replace").split())[-200:]
            raise ResultFileError(f"ffmpeg could not make the film ({reason})", where=target)


@contextlib.contextmanager
def _browser(browser: str, server: LiveServer, count: int) -> Iterator[None]:
    with temporary_folder() as profile:
        quiet = "--no-first-run --disable-extensions --disable-background-networking --disable-sync --mute-audio"
        picture = f"--disable-gpu --use-angle=swiftshader --enable-unsafe-swiftshader --window-size={WIDTH},{HEIGHT}"
        command = [browser, "--headless=new", *picture.split(), *quiet.split(), f"--user-data-dir={profile}"]
        if sys.platform.startswith("linux") and os.geteuid() == 0:
            # Chromium refuses to run as root, the usual user of a container, inside its own sandbox.
            command.append("--no-sandbox")
        command.append(f"{server.url}?once&film={count}&rate={RATE}&width={WIDTH}&height={HEIGHT}")
        with _child(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL):
            yield


@contextlib.contextmanager
def _child(command: list[str], **streams: object) -> Iterator[subprocess.Popen[bytes]]:
    """A process that does not outlive the block."""
    process: subprocess.Popen[bytes] = subprocess.Popen(command, **streams)  # type: ignore[call-overload]
    try:
        yield process
    finally:
        if process.poll() is None:
            process.terminate()
            try:
                process.wait(2)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
