"""Measure how soon a run is seen; one JSON object a line, each with its bar.

    python scripts/bench_pictures.py            about a minute
    python scripts/bench_pictures.py --no-watch without a browser

Medians of whole commands on the default 10 s run, as a user waits for them. `watch` is timed from the save of a file to
the new machine drawn in headless Chromium.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from drillrig_pin.files import shipped_folder
from drillrig_pin.replay.video import find_browser

DRILLRIG = str(Path(sys.executable).with_name("drillrig"))
FLAGS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]


def say(what: str, value: float, bar: float, **more: object) -> None:
    """One line: value, bar, whether it is met, and whatever explains it."""
    print(json.dumps({"what": what, "value": round(value, 3), "bar": bar, "met": value <= bar} | more), flush=True)


def command(*arguments: str) -> tuple[float, float]:
    """Seconds and megabytes of one whole command."""
    started = time.perf_counter()
    process = subprocess.Popen([DRILLRIG, *arguments], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    seconds = time.perf_counter() - started
    if status:
        raise SystemExit(f"drillrig {' '.join(arguments)} failed")
    return seconds, usage.ru_maxrss / 1024


def timed(name: str, bar: float, *arguments: str, after: Callable[[], dict[str, object]] = dict) -> None:
    """Median of five runs of a command."""
    runs = [command(name, *arguments) for _ in range(5)]
    megabytes = max(size for _, size in runs)
    say(
        f"drillrig {name}, 10 s run, seconds",
        statistics.median(s for s, _ in runs),
        bar,
        megabytes=megabytes,
        **after(),
    )


def replay(run: Path) -> None:
    """From the command to the address that shows the machine."""
    waited, sizes = [], []
    for _ in range(5):
        started = time.perf_counter()
        process = subprocess.Popen(
            [DRILLRIG, "replay", str(run), "--no-open", "--json"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
        )
        assert process.stdout is not None
        process.stdout.readline()
        waited.append(time.perf_counter() - started)
        status = Path(f"/proc/{process.pid}/status").read_text()
        sizes.append(int(re.findall(r"VmHWM:\s+(\d+)", status)[0]) / 1024)
        process.send_signal(signal.SIGINT)
        process.communicate()
    say("drillrig replay ready, 10 s run, seconds", statistics.median(waited), 3.0, megabytes=max(sizes))


def watch(folder: Path) -> None:
    """From a save to its picture."""
    from playwright.sync_api import sync_playwright

    models = folder / "urdf"
    shutil.copytree(shipped_folder(), models)
    table = models / "params" / "mkz49.yaml"
    process = subprocess.Popen(
        [DRILLRIG, "watch", str(models / "mkz49.urdf.xacro"), "--no-open", "--json"],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
    )
    try:
        assert process.stdout is not None
        url = json.loads(process.stdout.readline())["url"]
        waited = []
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=find_browser(), args=FLAGS)
            page = browser.new_page(viewport={"width": 1000, "height": 640})
            page.goto(url)
            page.wait_for_function("window.replay && window.replay.words", timeout=20_000)
            process.stdout.readline()
            for length in ("2.14", "2.10", "2.06", "2.02", "1.98", "1.94", "1.90"):
                page.evaluate("window.old = replay.words")
                text = re.sub(
                    r"(?m)^boom_length: \{value: [\d.]+", f"boom_length: {{value: {length}", table.read_text()
                )
                started = time.perf_counter()
                table.write_text(text)
                page.wait_for_function("replay.words !== window.old && !replay.viewer.needs_render", polling=20)
                waited.append(time.perf_counter() - started)
                process.stdout.readline()
            browser.close()
    finally:
        process.send_signal(signal.SIGINT)
        process.communicate()
    say(
        "drillrig watch, from save to picture, seconds",
        statistics.median(waited),
        2.0,
        all=[round(w, 2) for w in waited],
    )


def main() -> None:
    """Print one line per promise."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--no-watch", action="store_true", help="leave out what needs a browser")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        run, page = folder / "run.nc", folder / "report.html"
        command("run", "-q", "-o", str(run))
        timed("plot", 6.0, str(run), "-o", str(folder / "figures"))
        timed("report", 6.0, str(run), "-o", str(page), after=lambda: {"page_megabytes": page.stat().st_size / 1e6})
        replay(run)
        if not arguments.no_watch:
            watch(folder)


if __name__ == "__main__":
    main()
