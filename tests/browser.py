"""A real browser for the tests: headless Chromium that may speak to this machine only, and tells what went wrong."""

from __future__ import annotations

import io
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any
from urllib.parse import urlsplit

import pytest
from processes import PATIENCE

from drillrig_pin.replay.video import find_browser

#: WebGL without a graphics card; Chromium refuses to sandbox itself when it runs as root, as in a container.
FLAGS = ("--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")
#: For pages without WebGL: drawn without the detour through a graphics card that the processor plays, at a fifth of its
#: cost. With WebGL it costs ten times as much, since every picture is read back from there.
PLAIN = ("--disable-gpu-compositing", "--disable-gpu-rasterization")
HERE = ("localhost", "127.0.0.1")
#: Animations at ten pictures a second, as on a slow machine: each is drawn without a graphics card, and none is timed.
SLOWLY = """
window.requestAnimationFrame = (draw) => setTimeout(() => draw(performance.now()), 100);
window.cancelAnimationFrame = clearTimeout;
"""


@dataclass
class Watched:
    """A page and what it did."""

    page: Any
    errors: list[str] = field(default_factory=list)
    requests: list[str] = field(default_factory=list)

    def another(self) -> Watched:
        """A page of its own in the same browser."""
        return _fresh(self.page.context.browser)

    @property
    def outside(self) -> list[str]:
        """Requests that left the machine (they were stopped)."""
        return [url for url in self.requests if not at_home(url)]

    def open(self, url: str) -> None:
        """Load a replay and wait until its scene is there."""
        self.page.goto(url)
        self.page.wait_for_function("window.replay && window.replay.words", timeout=PATIENCE * 1e3)

    def pause_at(self, time: float) -> None:
        """Stop the animation at a time of it [s]."""
        self.page.evaluate("time => { replay.viewer.animator.pause(); replay.seek(time); }", time)

    def nodes(self) -> list[str]:
        """Paths of everything in Meshcat's scene tree."""
        found: list[str] = self.page.evaluate(
            """() => {
                const found = [];
                const walk = (node, path) => {
                    for (const [name, child] of Object.entries(node.children)) {
                        found.push(path + "/" + name);
                        walk(child, path + "/" + name);
                    }
                };
                walk(replay.viewer.scene_tree, "");
                return found;
            }"""
        )
        return found

    def position(self, path: str) -> list[float]:
        """World position of a node, in the machine's axes [m]."""
        x, y, z = self.page.evaluate(
            """path => {
                const node = replay.viewer.scene_tree.find(path.split("/").filter((step) => step)).object;
                replay.viewer.scene.updateMatrixWorld(true);
                return node.getWorldPosition(new MeshCat.THREE.Vector3()).toArray();
            }""",
            path,
        )
        return [x, -z, y]

    def colours(self) -> int:
        """How many different colours a screenshot holds; an empty picture holds a few at most."""
        from PIL import Image

        picture = Image.open(io.BytesIO(self.page.screenshot())).convert("RGB")
        found = picture.getcolors(1 << 24)
        return len(found or ())


def at_home(url: str) -> bool:
    """True for what does not leave the machine."""
    parts = urlsplit(url)
    return parts.scheme in ("file", "data", "blob", "about") or parts.hostname in HERE


@contextmanager
def chromium(*more: str) -> Iterator[Watched]:
    """A page in a fresh browser, started with more flags; without one the test is skipped, in CI it fails."""
    path = find_browser()
    if path is None:
        sentence = "no Chromium on this machine (apt-get install chromium)"
        pytest.fail(sentence) if os.environ.get("CI") else pytest.skip(sentence)
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=[*FLAGS, *more])
        try:
            yield _fresh(browser)
        finally:
            browser.close()


def context_of(browser: Any, **options: Any) -> Any:
    """Room for pages that know nothing of others, whose animations take their time."""
    context = browser.new_context(**options)
    context.add_init_script(SLOWLY)
    # Half a minute, Playwright's own, is not always enough on a busy machine.
    context.set_default_timeout(PATIENCE * 1e3)
    return context


def _fresh(browser: Any) -> Watched:
    context = context_of(browser, viewport={"width": 1000, "height": 640})
    watched = Watched(context.new_page())
    page = watched.page
    page.on("console", lambda m: watched.errors.append(m.text) if m.type == "error" else None)
    page.on("pageerror", lambda error: watched.errors.append(str(error)))
    page.on("request", lambda request: watched.requests.append(request.url))
    context.route(lambda url: not at_home(url), lambda route: route.abort())
    return watched
