"""The self-contained page in a real browser: it draws the machine, it plays, and it asks nobody for anything."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from browser import Watched, chromium
from command import Command, one_sentence
from rigs import slider_crank

from drillrig_pin import Rig, Scenario, Trajectory, load_rig_text, simulate
from drillrig_pin.replay.page import animation_page, viewer_script
from drillrig_pin.scene.options import ReplayOptions

#: Longest page of a 10 s run, the viewer's library left out [bytes].
PAGE = 5_000_000


@pytest.fixture(scope="module")
def run(mkz49: Rig) -> Trajectory:
    return simulate(mkz49, Scenario())


@pytest.fixture(scope="module")
def page(run: Trajectory, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("page") / "run.html"
    path.write_text(animation_page([run], names=["run.nc"]), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def browser(page: Path) -> Iterator[Watched]:
    with chromium() as watched:
        watched.open(page.as_uri())
        yield watched
        # Whatever the tests did with it, in whatever order.
        assert watched.errors == []
        assert watched.requests == [page.as_uri()]


def test_the_page_of_a_ten_second_run_is_small(page: Path) -> None:
    assert page.stat().st_size - len(viewer_script()) < PAGE


def test_every_object_of_the_machine_is_in_the_scene(browser: Watched, mkz49: Rig) -> None:
    nodes = browser.nodes()
    steps = {step for node in nodes for step in node.split("/")}
    for joint in mkz49.joints:
        assert joint in steps
    for element in mkz49.forces:
        if element.tag == "cylinder":
            assert {f"{element.name} barrel", f"{element.name} rod", f"arrow {element.name}"} <= steps
    assert {"rock rock", "trace E", "trace S", "arrow drilling_force", "arrow reaction face rock"} <= steps
    assert sum(node.endswith("<object>") and node.startswith("/machine") for node in nodes) > 100


def test_playing_moves_the_machine(browser: Watched) -> None:
    browser.pause_at(2.0)
    before = browser.position("/machine/point S")
    browser.page.evaluate("replay.viewer.animator.play()")
    browser.page.wait_for_function("replay.viewer.animator.time > 2.01")
    browser.page.evaluate("replay.viewer.animator.pause()")
    assert math.dist(browser.position("/machine/point S"), before) > 0.001


def test_a_point_is_drawn_where_the_run_puts_it_times_the_exaggeration(browser: Watched, run: Trajectory) -> None:
    from drillrig_pin.analysis.design import design_of
    from drillrig_pin.analysis.motion import after, start_up

    factor = 50.0
    assert f"× {factor:g}:" in browser.page.inner_text("#sentences")
    steady = after(run, start_up(run, design_of(run)))
    positions = run.of("point_position", "S")
    mean = positions[steady].mean(axis=0)
    for time in (0.5, 3.0):
        browser.pause_at(time)
        drawn = np.array(browser.position("/machine/point S"))
        expected = factor * (positions[round(1000 * time)] - mean)
        # Exaggerated in joint space, a path is bent a little where a straight one is exaggerated in space.
        assert np.linalg.norm(drawn - mean - expected) < 0.05 * np.linalg.norm(expected) + 0.01


def test_rods_stay_in_their_barrels_and_links_together(browser: Watched, mkz49: Rig) -> None:
    """The rod's pin hangs on one link, the barrel's on another: the rod still points into the barrel."""
    for time in (0.3, 2.0):
        browser.pause_at(time)
        for element in mkz49.forces:
            if element.tag != "cylinder":
                continue
            paths = {node.rpartition("/")[2]: node for node in browser.nodes()}
            barrel = np.array(browser.position(paths[f"{element.name} barrel"]))
            rod = np.array(browser.position(paths[f"{element.name} rod"]))
            middle = np.array(browser.position(paths[f"{element.name} barrel"] + "/chamber B/<object>"))
            axis = (rod - barrel) / np.linalg.norm(rod - barrel)
            off = middle - barrel - ((middle - barrel) @ axis) * axis
            assert np.linalg.norm(off) < 1e-4


def test_named_views_fit_the_machine_into_the_picture(browser: Watched) -> None:
    browser.pause_at(1.0)
    for view in ("overview", "side", "top", "front"):
        browser.page.click(f"#views button:text-is('{view}')")
        inside = browser.page.evaluate(
            """() => {
                const {viewer, words} = replay;
                viewer.render();
                const view = words.views.side;
                const ends = [];
                for (let i = 0; i < 8; i++) {
                    const [x, y, z] = [0, 1, 2].map((k) => (i >> k & 1 ? view.high : view.low)[k]);
                    ends.push(new MeshCat.THREE.Vector3(x, z, -y).project(viewer.camera).toArray());
                }
                return ends;
            }"""
        )
        assert np.abs(np.array(inside)[:, :2]).max() <= 1.0, view


def test_the_picture_is_not_blank(browser: Watched) -> None:
    assert browser.colours() > 1000


def test_meshcats_own_slider_pause_and_speed_drive_it(browser: Watched) -> None:
    page = browser.page
    page.evaluate("replay.viewer.animator.play()")
    controls = page.evaluate("replay.viewer.animator.folder.__folders.default.__controllers.map((c) => c.property)")
    assert {"play", "pause", "reset", "time", "timeScale"} <= set(controls)
    page.evaluate("replay.viewer.animator.pause()")
    held = page.evaluate("replay.viewer.animator.time")
    page.wait_for_timeout(150)
    assert page.evaluate("replay.viewer.animator.time") == held
    page.evaluate("replay.viewer.animator.time_scrubber.setValue(4)")
    page.wait_for_function("document.getElementById('time').textContent.startsWith('4.000')")
    page.select_option("#speed", "1")
    assert page.evaluate("replay.viewer.animator.mixer.timeScale") == 1
    page.wait_for_function("document.getElementById('sentences').textContent.includes('faster than a screen')")
    page.select_option("#speed", "0.05")
    page.wait_for_function("document.getElementById('sentences').textContent.includes('2.4 Hz')")


def test_nothing_was_wrong_and_nothing_asked_for(browser: Watched, page: Path) -> None:
    """Asserted behind all tests of this file as well: they share the page."""
    assert browser.errors == []
    assert browser.requests == [page.as_uri()]


def test_two_runs_as_a_ghost_and_a_machine_without_shapes(browser: Watched, run: Trajectory, tmp_path: Path) -> None:
    crank = simulate(load_rig_text(slider_crank()), Scenario(duration=0.5, name="crank"))
    path = tmp_path / "both.html"
    path.write_text(animation_page([run, crank], ReplayOptions(end=0.5)), encoding="utf-8")
    watched = browser.another()
    watched.open(path.as_uri())
    nodes = watched.nodes()
    assert any(node.startswith("/ghost 1/") and "bone" in node for node in nodes)
    watched.pause_at(0.0)
    rod = next(node for node in nodes if node.endswith("rod_joint"))
    before = watched.position(rod)
    watched.pause_at(0.3)
    assert math.dist(watched.position(rod), before) > 0.01
    assert watched.errors == []
    assert watched.outside == []


def test_the_command_writes_the_page_and_says_what_it_shows(drillrig: Command) -> None:
    drillrig("run", "--set", "scenario.duration=0.2", "-q")
    answer = drillrig("replay", "run.nc", "--html", "page.html", "--true-scale", "--json")
    assert answer.document["written"] == ["page.html"]
    assert answer.document["exaggeration"] == 1
    text = Path("page.html").read_text()
    assert "True scale" in text
    assert "src=" not in text.split("<script>")[0]


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("--view", "tipp"), "Did you mean 'tip'?"),
        (("--exaggerate", "much"), "neither a number nor auto"),
        (("--exaggerate", "-3"), "makes no picture"),
        (("--speed", "0"), "cannot be played"),
        (("--from", "7"), "goes from 0 to 0.05 s"),
        (("--port", "99999"), "--port"),
    ],
)
def test_what_cannot_be_shown_is_one_sentence(drillrig: Command, words: tuple[str, ...], sentence: str) -> None:
    drillrig("run", "--set", "scenario.duration=0.05", "-q")
    one_sentence(drillrig("replay", "run.nc", "--no-open", *words), sentence)


def test_a_film_without_its_programs_is_refused_with_what_to_install(
    drillrig: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    drillrig("run", "--set", "scenario.duration=0.05", "-q")
    monkeypatch.setenv("PATH", "")
    one_sentence(drillrig("replay", "run.nc", "--video", "film.mp4"), "Chromium", "ffmpeg", "apt-get install", "--html")
    assert not Path("film.mp4").exists()
