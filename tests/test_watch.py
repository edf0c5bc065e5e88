"""The live design loop in a real browser: a save becomes a picture, an error a sentence over the last good one."""

from __future__ import annotations

import json
import math
import queue
import re
import shutil
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from browser import Watched, chromium
from command import Command, one_sentence
from processes import PATIENCE

from drillrig_pin.files import shipped_folder


@dataclass
class Session:
    """`drillrig watch` on a copy of the shipped model, and a browser that looks at it."""

    folder: Path
    process: subprocess.Popen[str]
    printed: queue.SimpleQueue[str]
    browser: Watched

    def next(self) -> Any:
        """The next document it prints."""
        return json.loads(self.printed.get(timeout=PATIENCE))

    def edit(self, name: str, before: str, after: str) -> None:
        """Save a file as editors do: write a new one and rename it onto the old."""
        path = self.folder / name
        text = path.read_text()
        assert len(re.findall(before, text)) == 1
        aside = path.with_suffix(".part")
        aside.write_text(re.sub(before, after, text))
        aside.replace(path)

    def new_picture(self, boom_length: str) -> None:
        """Save another boom length and wait until it is drawn."""
        page = self.browser.page
        page.evaluate("window.old = replay.words")
        self.edit("params/mkz49.yaml", r"(?m)^boom_length: \{value: [\d.]+", f"boom_length: {{value: {boom_length}")
        page.wait_for_function("replay.words !== window.old && !replay.viewer.needs_render", polling=20)

    def shows(self, text: str) -> None:
        """Wait until the page's banner holds a text; an empty one: until it is gone."""
        self.browser.page.wait_for_function(
            "text => text ? banner.textContent.includes(text) : banner.hidden",
            arg=text,
        )


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Session]:
    folder = tmp_path_factory.mktemp("design") / "urdf"
    shutil.copytree(shipped_folder(), folder)
    command = [str(Path(sys.executable).with_name("drillrig")), "watch", str(folder / "mkz49.urdf.xacro"), "--no-open"]
    process = subprocess.Popen([*command, "--json"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    printed: queue.SimpleQueue[str] = queue.SimpleQueue()
    stdout = process.stdout
    assert stdout is not None
    threading.Thread(target=lambda: [printed.put(line) for line in stdout], daemon=True).start()
    try:
        url = json.loads(printed.get(timeout=PATIENCE))["url"]
        with chromium() as browser:
            browser.open(url)
            found = Session(folder, process, printed, browser)
            first = found.next()
            assert first["completed"]
            assert first["before"] == {}
            yield found
            # Whatever the tests did, in whatever order: the browser complained of nothing, and Ctrl-C ends the command.
            assert browser.errors == []
            assert browser.outside == []
            process.send_signal(signal.SIGINT)
            assert process.wait(PATIENCE) == 0
    finally:
        if process.poll() is None:
            process.kill()
        process.communicate()


def test_a_save_is_a_new_picture_with_its_numbers_in_the_same_page(session: Session) -> None:
    page = session.browser.page
    page.evaluate("replay.look('tip')")
    page.evaluate("window.kept = 'not reloaded'")
    session.browser.pause_at(3.0)
    before = session.browser.position("/machine/point E")
    session.new_picture("2.14")
    document = session.next()
    assert document["parameters"] == ["boom_length 1.94 → 2.14 m"]
    moved = math.dist(session.browser.position("/machine/point E"), before)
    assert moved == pytest.approx(0.2, abs=0.05), "the boom is 0.2 m longer"
    shown = page.inner_text("#values")
    assert "boom_length 1.94 → 2.14 m" in shown
    name = "S across hole, RMS"
    assert name in shown
    change = (document["values"][name] - document["before"][name]) / document["before"][name]
    assert f"{change:+.0%}" in shown
    assert page.evaluate("window.kept") == "not reloaded"
    assert page.evaluate("replay.viewer.animator.time") == pytest.approx(3.0)
    assert page.evaluate("replay.viewer.animator.playing") is False


def test_an_error_is_shown_with_file_and_line_over_the_last_good_machine(session: Session) -> None:
    machine = set(session.browser.nodes())
    session.edit("mkz49.urdf.xacro", 'parent="upper_boom"', 'parent="uper_boom"')
    error = session.next()["error"]
    assert "Did you mean 'upper_boom'?" in error
    assert re.search(r"\.xacro:\d+", error)
    session.shows("uper_boom")
    assert set(session.browser.nodes()) == machine
    session.edit("mkz49.urdf.xacro", 'parent="uper_boom"', 'parent="upper_boom"')
    assert session.next()["completed"]
    session.shows("")


@pytest.mark.parametrize(
    ("name", "before", "after", "words"),
    [
        ("macros/shapes.xacro", r'size="\$\{size\}"', 'size="${sise}"', "sise"),
        ("params/mkz49.yaml", r"(?m)^head_length: \{", "head_length: {{", "mkz49.yaml"),
    ],
)
def test_a_slip_in_an_include_or_a_table_names_that_file(
    session: Session, name: str, before: str, after: str, words: str
) -> None:
    original = (session.folder / name).read_text()
    session.edit(name, before, after)
    error = session.next()["error"]
    assert words in error
    assert re.search(rf"{re.escape(Path(name).name)}:\d+", error)
    session.shows(words)
    (session.folder / name).write_text(original)
    assert session.next()["completed"]
    session.shows("")


def test_nothing_was_wrong_in_the_browser_and_ctrl_c_ends_it(session: Session) -> None:
    """Beside what is asserted behind all tests of this file, where the command ends."""
    assert session.browser.colours() > 1000
    assert session.process.poll() is None


def test_a_model_that_is_not_there_is_waited_for_nowhere(drillrig: Command) -> None:
    one_sentence(drillrig("watch", "nowhere.urdf", "--no-open"), "nowhere.urdf", "no such model file")
