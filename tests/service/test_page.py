"""The page as people use it, in a real browser: by mouse and by keyboard, in both languages, on laptop and tablet."""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from browser import PLAIN, Watched, chromium
from PIL import Image, ImageChops
from playwright.sync_api import expect
from processes import PATIENCE, wait_for
from serving import TOKEN, Server

LAPTOP, TABLET = {"width": 1280, "height": 800}, {"width": 820, "height": 1180}
WAIT = PATIENCE * 1e3
expect.set_options(timeout=WAIT)


@pytest.fixture(scope="module")
def plain() -> Iterator[Watched]:
    """One browser for all tests of this file that look at no animation."""
    with chromium(*PLAIN) as watched:
        yield watched


@pytest.fixture
def animated() -> Iterator[Watched]:
    """A browser for a test that does."""
    with chromium() as watched:
        yield watched


@pytest.fixture
def watched(request: pytest.FixtureRequest) -> Iterator[Watched]:
    """A fresh page, as large as a laptop's; whatever it did, it complained of nothing and asked nobody else."""
    browser = request.getfixturevalue("animated" if "animated" in request.fixturenames else "plain")
    found = browser.another()
    found.page.set_viewport_size(LAPTOP)
    found.page.set_default_timeout(WAIT)
    yield found
    found.page.context.close()
    assert found.errors == []
    assert found.outside == []


@pytest.fixture
def quick(watched: Watched) -> None:
    """Leave out what takes the server and the browser seconds and is looked at elsewhere: animation and drawings."""
    watched.page.route("**/replay", lambda route: route.fulfill(content_type="text/html", body="<p>animation</p>"))
    drawing = "<svg xmlns='http://www.w3.org/2000/svg' width='400' height='300'/>"
    watched.page.route("**/*.svg", lambda route: route.fulfill(content_type="image/svg+xml", body=drawing))


@pytest.fixture
def at(server: Server, watched: Watched) -> Callable[[str], Any]:
    """Open an address of the page."""

    def opened(address: str) -> Any:
        watched.page.goto(f"{server.url}/#{address}")
        watched.page.wait_for_selector("main h1")
        return watched.page

    return opened


@pytest.fixture(scope="module")
def pair(server: Server) -> tuple[str, str]:
    """Two finished runs: a longer boom, and the default one."""
    case = {"duration": 0.3, "pose": "hole_9"}
    first, second = (server.run(arguments=given, scenario=case) for given in ({"boom_length": 2.05}, {}))
    return str(first["id"]), str(second["id"])


def picture(page: Any) -> Any:
    """The middle of the animation, without its words and controls."""
    shot = Image.open(io.BytesIO(page.locator("iframe").screenshot())).convert("RGB")
    wide, high = shot.size
    return shot.crop((wide // 3, high // 8, wide, high * 5 // 6))


def overflows(page: Any) -> bool:
    """Whether the page is wider than the screen."""
    found: bool = page.evaluate("document.documentElement.scrollWidth > document.documentElement.clientWidth + 1")
    return found


def tab_to(page: Any, selector: str, most: int = 60) -> None:
    """Walk with the tabulator to an element; every stop on the way shows where one is."""
    for _ in range(most):
        page.keyboard.press("Tab")
        here = page.evaluate(
            "s => [document.activeElement.matches(s), getComputedStyle(document.activeElement).outlineStyle]", selector
        )
        assert here[1] != "none", "a stop without a visible focus"
        if here[0]:
            return
    raise AssertionError(f"{selector} is not reached by the tabulator")


@pytest.mark.usefixtures("animated")
def test_a_longer_boom_is_run_watched_seen_moving_compared(at: Any, server: Server) -> None:
    reference = server.run(scenario={"duration": 20.0, "pose": "hole_9"})
    page = at("/new")
    page.locator("main input[type=search]").fill("boom length")
    expect(page.locator(".field[data-name=boom_length]")).to_be_visible()
    expect(page.locator(".field[data-name=gravity]")).to_be_hidden()
    length = page.locator("input[name=boom_length]")
    assert length.input_value() == "1940"  # millimetres here, metres in the file
    length.fill("2100")
    page.locator("input[name=duration]").fill("20")
    page.evaluate(
        """() => { window.seen = []; new MutationObserver(() => {
            for (const bar of document.querySelectorAll(".job progress")) window.seen.push(bar.value);
        }).observe(document.body, {subtree: true, childList: true, attributes: true}); }"""
    )
    page.get_by_role("button", name="Run", exact=True).click()
    page.wait_for_selector(".headline")
    seen = page.evaluate("window.seen")
    assert seen == sorted(seen)
    assert any(0 < share <= 1 for share in seen)
    expect(page.locator("h1")).to_have_text("boom_length = 2100 mm")
    assert "104 of 219 numbers" in page.locator("main").inner_text()

    page.frame_locator("iframe").locator("#bar").wait_for()
    page.locator("iframe").scroll_into_view_if_needed()
    first = picture(page)

    def moved() -> bool:
        change = ImageChops.difference(first, picture(page)).convert("L").point(lambda value: 255 if value > 24 else 0)
        return change.histogram()[255] > 100

    wait_for(moved)

    number = page.url.rpartition("/")[2]
    page.goto(f"{server.url}/#/")
    for run in (reference["id"], number):
        page.locator(f"input[value='{run}']").check()
    page.get_by_role("button", name="Compare two").click()
    page.wait_for_selector("#changes-title")
    text = page.locator("main").inner_text().replace("\u00a0", " ")
    assert "1940 mm" in text
    assert "2100 mm" in text
    assert page.locator(".worse").count() > 10  # a longer boom shakes more
    shown = float(server.http.get(f"/v1/runs/{number}/metrics").json()["quantities"][0]["value"])
    assert f"{shown * 57.29578:.4f}°" in text


@pytest.mark.usefixtures("quick")
def test_a_sweep_over_two_numbers_grows_into_a_heat_map_whose_cells_open(at: Any, server: Server) -> None:
    page = at("/studies/new")
    for axis, name in ((1, "percussion_frequency"), (2, "force_percussion")):
        row = page.locator(f"[data-axis='{axis}'] input")
        row.nth(0).fill(name)
        row.nth(3).fill("2")
    page.locator("input[name=duration]").fill("0.1")
    assert "2 × 2 = 4" in page.locator(".plan").inner_text()
    page.get_by_role("button", name="Start").click()
    page.wait_for_selector(".job progress")
    early = server.http.get(f"/v1/studies/{page.url.rpartition('/')[2]}/table").json()
    assert early["inputs"] == ["model.percussion_frequency", "model.force_percussion"]
    assert len(early["rows"]) <= 4
    page.wait_for_selector("text=CSV")
    expect(page.locator(".heatmap a .cell:not(.failed)")).to_have_count(4)
    colours = page.eval_on_selector_all(".heatmap a .cell", "cells => cells.map((cell) => cell.getAttribute('fill'))")
    assert len(set(colours)) > 1
    page.locator(".filter select").select_option("S.z.rms")
    page.wait_for_selector(".heatmap[aria-label*='S along z']")
    cell = page.locator(".heatmap a").first
    assert "percussion_frequency = 43.2\u00a0Hz" in cell.get_attribute("aria-label")
    cell.focus()
    page.keyboard.press("ArrowRight")
    page.keyboard.press("Enter")
    page.wait_for_selector(".headline")
    expect(page.locator("h1")).to_have_text("percussion_frequency = 52.8 Hz, force_percussion = 2250 N")


@pytest.mark.usefixtures("quick")
def test_the_form_is_filled_and_sent_by_keyboard_alone(at: Any) -> None:
    page = at("/")
    page.keyboard.press("Tab")
    page.keyboard.press("Enter")
    assert page.evaluate("document.activeElement.id") == "main"
    tab_to(page, "a.button.main")
    page.keyboard.press("Enter")
    page.wait_for_selector("input[name=duration]")
    tab_to(page, "input[name=duration]")
    page.keyboard.press("Control+A")
    page.keyboard.type("0.1")
    tab_to(page, "main input[type=search]")
    page.keyboard.type("rock stiff")
    page.wait_for_selector(".field:visible[data-name=rock_stiffness]")
    tab_to(page, "input[name=rock_stiffness]")
    page.keyboard.press("Control+A")
    page.keyboard.type("2.5")
    page.keyboard.press("Enter")
    page.wait_for_selector(".headline")
    expect(page.locator("h1")).to_have_text("rock_stiffness = 2.5 MN/m")


@pytest.mark.usefixtures("quick")
def test_wrong_input_is_told_at_its_field(at: Any, watched: Watched) -> None:
    page = at("/new")
    duration = page.locator("input[name=duration]")
    trouble = page.locator(".field[data-name=duration] .trouble")
    for wrong, sentence in (("1,5", "not a number"), ("0", "allowed range"), ("1e4", "samples")):
        duration.fill(wrong)
        duration.press("Enter")  # the last one only the server can judge
        expect(trouble).to_contain_text(sentence)
        assert trouble.is_visible()
        assert page.locator("input[name=duration]:focus").count() == 1
        assert duration.get_attribute("aria-invalid") == "true"
    page.get_by_role("button", name="Reset all").click()
    assert duration.input_value() == "10"
    assert trouble.is_hidden()
    page.locator("input[name=duration]").fill("3.5")
    page.get_by_role("button", name="Tiếng Việt").click()
    page.wait_for_selector("h1:has-text('Lần tính mới')")
    assert duration.input_value() == "3,5"  # another language costs nothing that was typed
    # Chromium reports the refused request; that is the only thing it reports.
    assert [text for text in watched.errors if "422" not in text] == []
    watched.errors.clear()


@pytest.mark.usefixtures("quick")
def test_a_run_can_be_changed_and_run_again_found_and_deleted(at: Any, server: Server) -> None:
    given = {"gravity": 9.7, "rock_mode": "unilateral"}
    earlier = server.run(arguments=given, scenario={"duration": 0.1, "pose": "hole_9", "lock": ["boom_extension"]})
    page = at(f"/new?from={earlier['id']}")
    assert page.locator("select[name=rock_mode]").input_value() == "unilateral"
    page.get_by_label("only changed").check()
    gravity = page.locator("input[name=gravity]")
    assert gravity.input_value() == "9.7"
    gravity.fill("9.6")
    page.get_by_role("button", name="Run", exact=True).click()
    page.wait_for_selector(".headline")
    expect(page.locator("h1")).to_have_text("gravity = 9.6 m/s², rock_mode = unilateral")
    page.goto(f"{server.url}/#/?search=gravity")
    rows = page.locator("table.runs tbody tr")
    expect(rows).to_have_count(2)
    expect(rows.filter(has_text="locked: boom_extension")).to_have_count(2)
    delete = rows.filter(has_text="9.6").locator("td button")
    delete.click()
    expect(delete).to_have_text("Really delete?")
    delete.click()
    expect(rows).to_have_count(1)


@pytest.mark.usefixtures("quick")
def test_every_view_speaks_vietnamese_and_fits_laptop_and_tablet(
    at: Any, server: Server, pair: tuple[str, str]
) -> None:
    page = at("/")
    page.get_by_role("button", name="Tiếng Việt").click()
    page.wait_for_selector("h1:has-text('Các lần tính')")
    for address in ("/", "/new", "/studies", "/studies/new", f"/compare?a={pair[0]}&b={pair[1]}", f"/runs/{pair[0]}"):
        page.goto("about:blank")  # the language is remembered
        page.goto(f"{server.url}/#{address}")
        page.wait_for_selector("main h1")
        assert page.evaluate("document.documentElement.lang") == "vi"
        for size in (TABLET, LAPTOP):
            page.set_viewport_size(size)
            assert not overflows(page), (address, size)
        words = page.locator("body").inner_text()
        assert re.search("[ăâđêôơưạảấầẩậắằặẹẻếềểệịọỏốồổộớờởợụủứừửữựỳỷỹ]", page.locator("main").inner_text())
        keys = re.findall(r"\b(?:runs|run|new|field|result|compare|studies|study|sweep|kind|level)\.[a-z_]+\b", words)
        assert keys == [], address
    # 0.3 s are no steady motion: the page says of them what the report says, and no more.
    assert "Chưa thể đánh giá: chuyển động chưa ổn định" in words
    page.get_by_role("button", name="English").click()
    page.wait_for_selector("h2:has-text('Verdict')")
    told = server.http.get(f"/v1/runs/{pair[0]}/metrics").json()["verdict"]["sentence"]
    expect(page.locator(".headline")).to_have_text(told)


def test_a_server_with_a_token_asks_for_it_first(fresh: Any, watched: Watched) -> None:
    server = fresh("--workers", "1", DRILLRIG_TOKEN=TOKEN)
    page = watched.page
    page.goto(f"{server.url}/#/new")
    page.wait_for_selector("#token")
    page.keyboard.type("a guess")
    page.keyboard.press("Enter")
    page.wait_for_selector("text=not the server's token")
    page.locator("#token").fill(TOKEN)
    page.keyboard.press("Enter")
    page.wait_for_selector("input[name=duration]")
    page.get_by_role("button", name="Log out").click()
    page.wait_for_selector("#token")
    assert TOKEN not in page.url + page.content()
    assert [text for text in watched.errors if "401" not in text] == []
    watched.errors.clear()
