"""The report in a real browser: it opens without network or complaint, its figures are drawn and answer."""

from __future__ import annotations

from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import Any

import pytest
from browser import chromium, context_of
from PIL import Image
from processes import PATIENCE, wait_for
from test_ur5 import EXTENSION, POSE, ur5_text

from drillrig_pin import Rig, Scenario, load_rig_text, simulate
from drillrig_pin.analysis.limits import read_limits
from drillrig_pin.figures.registry import sheets_of
from drillrig_pin.figures.subject import subject_of
from drillrig_pin.report.content import gather
from drillrig_pin.report.page import report_page

WAIT = PATIENCE * 1e3


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """Headless Chromium; a machine without one skips these tests, the pipeline may not."""
    with chromium() as watched:
        yield watched.page.context.browser


def written(run: Any, path: Path, *limits: str) -> Path:
    subject = subject_of(run, limits=read_limits(None, limits))
    path.write_text(report_page(gather(subject), sheets_of(subject)))
    return path


@pytest.fixture(scope="module")
def report(mkz49: Rig, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The report of a second of drilling, with a changed number."""
    return written(simulate(mkz49, Scenario(duration=1.0)), tmp_path_factory.mktemp("report") / "report.html")


class Watched:
    """A page with everything it said and asked for."""

    def __init__(self, browser: Any, path: Path, **options: Any) -> None:
        self.page = context_of(browser, **options).new_page()
        self.said: list[str] = []
        self.asked: list[str] = []
        self.page.set_default_timeout(WAIT)
        self.page.on("console", lambda message: self.said.append(f"{message.type}: {message.text}"))
        self.page.on("pageerror", lambda error: self.said.append(f"error: {error}"))
        self.page.on("request", lambda request: self.asked.append(request.url))
        self.page.goto(path.as_uri())
        self.page.wait_for_function("document.documentElement.dataset.drawn === 'yes'", timeout=WAIT)

    def left(self, path: Path) -> list[str]:
        """Requests for anything but the page itself and what it carries."""
        return [url for url in self.asked if url != path.as_uri() and not url.startswith(("data:", "blob:", "about:"))]


@pytest.fixture(scope="module")
def watched(browser: Any, report: Path) -> Iterator[Watched]:
    found = Watched(browser, report, viewport={"width": 1280, "height": 900})
    yield found
    found.page.context.close()


def test_the_report_opens_without_complaint_and_without_a_request(watched: Watched, report: Path) -> None:
    assert watched.said == []
    assert watched.left(report) == []
    assert watched.page.title().startswith("hole_9")


def test_every_figure_is_drawn_and_a_picture_of_it_is_not_blank(watched: Watched) -> None:
    plots = watched.page.locator(".plot")
    assert plots.count() >= 12
    for i in range(plots.count()):
        plot = plots.nth(i)
        name = plot.get_attribute("data-figure")
        assert plot.locator("svg.main-svg").count() > 0, name
        assert plot.locator(".trace path, .point path").count() > 0, name
        box = plot.bounding_box()
        assert box is not None
        assert box["height"] > 200
        picture = Image.open(BytesIO(plot.screenshot())).convert("RGB")
        assert len(set(picture.convert("L").resize((200, 100)).tobytes())) > 20, f"{name} is blank"


def test_the_animation_plays_inside_the_page(watched: Watched) -> None:
    frame = watched.page.locator("#animation iframe")
    frame.scroll_into_view_if_needed()
    inside = watched.page.frame_locator("#animation iframe")
    inside.locator("canvas").first.wait_for(timeout=WAIT)
    first = frame.screenshot()
    picture = Image.open(BytesIO(first)).convert("L")
    assert len(set(picture.resize((200, 100)).tobytes())) > 20, "the animation is blank"
    wait_for(lambda: frame.screenshot() != first)
    assert watched.said == []


def test_the_legend_hides_and_shows_a_curve_in_every_panel(watched: Watched) -> None:
    plot = watched.page.locator("[data-figure=pressures]")

    def visible() -> list[Any]:
        found: list[Any] = plot.evaluate("plot => plot.data.map(t => [t.name, t.visible ?? true])")
        return found

    shown = "plot => plot.querySelectorAll('.trace.scatter path.js-line').length"
    before = plot.evaluate(shown)
    toggle = plot.locator(".legendtoggle").first
    toggle.click()
    watched.page.wait_for_function(
        "document.querySelector('[data-figure=pressures]').data.some(t => t.visible === 'legendonly')"
    )
    assert {name for name, state in visible() if state == "legendonly"} == {"chamber A"}
    assert plot.evaluate(shown) == before / 2
    watched.page.wait_for_timeout(400)  # two clicks in quick succession mean something else
    toggle.click()
    watched.page.wait_for_function(
        "document.querySelector('[data-figure=pressures]').data.every(t => t.visible !== 'legendonly')"
    )
    assert plot.evaluate(shown) == before


def test_dragging_zooms_all_panels_of_a_figure(watched: Watched) -> None:
    plot = watched.page.locator("[data-figure=joints]")
    plot.evaluate("plot => scrollTo({top: plot.getBoundingClientRect().top + scrollY - 120, behavior: 'instant'})")
    area = plot.locator(".nsewdrag").first.bounding_box()
    assert area is not None
    y = area["y"] + area["height"] / 2
    watched.page.mouse.move(area["x"] + area["width"] * 0.25, y)
    watched.page.mouse.down()
    watched.page.mouse.move(area["x"] + area["width"] * 0.5, y, steps=5)
    watched.page.mouse.up()
    watched.page.wait_for_function("document.querySelector('[data-figure=joints]').layout.xaxis.range?.[1] < 0.6")
    ranges = plot.evaluate("({_fullLayout: l}) => Object.keys(l).filter(k => /^xaxis/.test(k)).map(k => l[k].range)")
    assert len(ranges) == 6
    assert all(low == pytest.approx(0.25, abs=0.03) and high == pytest.approx(0.5, abs=0.03) for low, high in ranges)


def test_pointing_at_a_curve_tells_its_value_with_unit(watched: Watched) -> None:
    plot = watched.page.locator("[data-figure=energy]")
    plot.evaluate("plot => scrollTo({top: plot.getBoundingClientRect().top + scrollY - 120, behavior: 'instant'})")
    area = plot.locator(".nsewdrag").first.bounding_box()
    assert area is not None
    watched.page.mouse.move(area["x"] + area["width"] / 2, area["y"] + area["height"] / 2)
    plot.locator(".hoverlayer .hovertext").first.wait_for()
    assert "J" in " ".join(plot.locator(".hoverlayer .hovertext").all_text_contents())


def test_the_table_of_parameters_is_filtered_from_the_keyboard(watched: Watched) -> None:
    page = watched.page
    rows = page.locator("#parameter-table tbody tr:visible")
    everything = rows.count()
    page.locator("#find").focus()
    page.keyboard.type("boom_lift bore")
    assert 0 < rows.count() < 10
    assert page.locator("#found").inner_text() == f"{rows.count()} shown"
    page.locator("#find").fill("")
    page.locator("#only-assumed").focus()
    page.keyboard.press("Space")
    assert 0 < rows.count() < everything
    assert rows.count() == page.locator("#parameter-table tr.assumed").count()


@pytest.mark.parametrize("width", [360, 800, 1280])
def test_nothing_is_wider_than_the_window(browser: Any, report: Path, width: int) -> None:
    found = Watched(browser, report, viewport={"width": width, "height": 900})
    assert found.page.evaluate("document.documentElement.scrollWidth") <= width
    found.page.context.close()


def test_in_the_dark_the_page_and_its_figures_are_dark(browser: Any, report: Path) -> None:
    found = Watched(browser, report, color_scheme="dark")
    picture = Image.open(BytesIO(found.page.locator("[data-figure=survey]").screenshot())).convert("L")
    light = sum(value > 200 for value in picture.tobytes()) / (picture.width * picture.height)
    assert light < 0.2
    found.page.context.close()


def test_it_prints_on_paper(watched: Watched) -> None:
    assert watched.page.pdf(format="A4").startswith(b"%PDF")
    assert watched.said == []


def test_the_report_of_a_robot_that_does_not_drill_opens_too(browser: Any, tmp_path: Path) -> None:
    rig = load_rig_text(ur5_text().replace("</robot>", EXTENSION + "</robot>"))
    path = written(simulate(rig, Scenario(duration=0.5, positions=POSE)), tmp_path / "ur5.html")
    found = Watched(browser, path)
    assert found.said == []
    assert found.left(path) == []
    assert found.page.locator(".plot svg.main-svg").count() > 0
    found.page.context.close()
