"""The report: judged by the user's limits, safe whatever the model says, complete without network."""

from __future__ import annotations

import json
import math
import re
import shlex
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from command import Command, one_sentence
from rigs import joint, link, mass_on_cylinder, robot
from test_ur5 import EXTENSION, POSE, ur5_text

from drillrig_pin import Rig, Scenario, ScenarioError, Trajectory, load_rig_text, load_trajectory, simulate
from drillrig_pin.analysis.limits import limited_depths, read_limits
from drillrig_pin.analysis.verdict import Level
from drillrig_pin.figures.registry import sheets_of
from drillrig_pin.figures.subject import subject_of
from drillrig_pin.report.content import Content, gather
from drillrig_pin.report.page import report_page
from drillrig_pin.report.provenance import asks_the_same, command

EVIL = "</script><script>alert(1)</script>"


def content_of(run: Trajectory, *settings: str) -> Content:
    return gather(subject_of(run, limits=read_limits(None, settings)))


def page_of(run: Trajectory) -> str:
    return report_page(content_of(run), sheets_of(subject_of(run)))


def without_library(page: str) -> str:
    """The page without the text of plotly.js, which is not ours to judge."""
    scripts = re.findall(r"<script>.*?</script>", page, re.DOTALL)
    return page.replace(max(scripts, key=len), "")


@pytest.fixture(scope="module")
def drilling(mkz49: Rig) -> Trajectory:
    return simulate(mkz49, Scenario(duration=0.5))


class Outline(HTMLParser):
    """Tags, headings and references of a page."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.ids: set[str] = set()
        self.targets: set[str] = set()
        self.fetched: list[str] = []
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        for name, value in attrs:
            if name == "id" and value:
                assert value not in self.ids, f"id {value!r} twice"
                self.ids.add(value)
            if name == "href" and value:
                (self.targets.add(value[1:]) if value.startswith("#") else self.fetched.append(value))
            if name == "src" and value:
                self.fetched.append(value)


def test_the_page_is_whole_and_needs_nothing_else(drilling: Trajectory) -> None:
    page = without_library(page_of(drilling))
    outline = Outline(page)
    assert outline.fetched == []
    assert outline.targets <= outline.ids
    assert {"header", "nav", "main", "h1", "figure", "figcaption"} <= set(outline.tags)
    assert outline.tags.count("h1") == 1
    assert "default-src 'none'" in page
    for section in ("verdict", "numbers", "figures", "cycles", "parameters", "scenario", "trust", "provenance"):
        assert section in outline.ids
    assert drilling.content_hash in page


def test_figures_hold_the_peaks_of_the_run(drilling: Trajectory) -> None:
    page = page_of(drilling)
    text = re.search(r'<script type="application/json" id="figure-data">(.*?)</script>', page, re.DOTALL)
    assert text is not None
    figures = json.loads(text.group(1))
    assert set(figures) == {sheet.name for sheet in sheets_of(subject_of(drilling))}
    import base64

    trace = next(t for t in figures["cylinder_forces"]["data"] if t["name"] == "lift_cylinder")
    values = np.frombuffer(base64.b64decode(trace["y"]["bdata"]), "<f4")
    force = drilling.of("cylinder_force", "lift_cylinder") / 1e3
    assert (values.min(), values.max()) == pytest.approx((force.min(), force.max()), rel=1e-6)


def test_words_of_a_model_stay_words() -> None:
    model = robot(
        link("wheel"),
        joint("axle", "continuous", "world", "wheel"),
        extension='<parameter name="p" value="1" default="1" unit="m" source="assumed: &lt;/script&gt;&lt;script&gt;'
        'alert(1)&lt;/script&gt;" text="&lt;img src=x onerror=alert(1)&gt;"/>\n',
    )
    run = simulate(load_rig_text(model), Scenario(duration=0.05, name=EVIL, text=EVIL))
    run = replace(run, notes=(EVIL,), added=(EVIL,))
    page = without_library(page_of(run))
    assert "alert(1)" in page
    assert "<script>alert" not in page
    assert "<img" not in page


def test_names_in_figures_stay_words() -> None:
    run = simulate(load_rig_text(mass_on_cylinder()), Scenario(duration=0.05))
    labels = {**run.labels, "cylinder": ["<img src=x>%{y}"]}
    page = without_library(page_of(replace(run, labels=labels)))
    assert "<img" not in page
    data = re.search(r'id="figure-data">(.*?)</script>', page, re.DOTALL)
    assert data is not None
    assert "<" not in data.group(1)
    assert all("<img" not in trace["name"] for f in json.loads(data.group(1)).values() for trace in f["data"])


def test_a_limit_decides_and_the_sentence_says_value_limit_and_what_to_do(drilling: Trajectory) -> None:
    tight = content_of(drilling, "toe_6m=1mm")
    assert tight.verdict[0] is Level.BAD
    (finding,) = (f for f in tight.findings if f.level is Level.BAD)
    assert "Toe offset at 6 m" in finding.sentence
    assert "the limit is 1.00 mm" in finding.sentence
    assert finding.advice
    loose = content_of(drilling, "toe_6m=10m", "angle=5deg")
    assert not any(f.level is Level.BAD for f in loose.findings)


def test_a_chamber_below_gas_release_or_above_relief_is_not_acceptable(drilling: Trajectory) -> None:
    arrays = {name: array.copy() for name, array in drilling.arrays.items()}
    arrays["pressure_a"][5, 0] = -5e5
    arrays["pressure_b"][7, 1] = 30e6
    bad = [f for f in content_of(replace(drilling, arrays=arrays)).findings if f.level is Level.BAD]
    assert {f.title for f in bad} == {"swing_cylinder", "lift_cylinder"}
    assert any("releases air" in f.sentence for f in bad)
    assert any("relief" in f.sentence for f in bad)


def test_a_direction_of_the_hole_makes_the_aim_count(drillrig: Command) -> None:
    drillrig("run", "--set", "scenario.duration=0.1", "-q")
    document = drillrig("report", "run.nc", "--hole-direction", "1 0 0", "--json").document
    assert math.degrees(document["hole_quality"]["errors"][0]["static"]) == pytest.approx(27.6, abs=0.1)
    assert document["verdict"]["level"] == "BAD"
    one_sentence(drillrig("report", "run.nc", "--hole-direction", "1 0"), "--hole-direction")
    one_sentence(drillrig("report", "run.nc", "--hole-direction", "0,0,0"), "--hole-direction")


def test_limits_near_the_curves_are_drawn_with_them(drilling: Trajectory) -> None:
    (sheet,) = sheets_of(subject_of(drilling, limits=read_limits(None, ["angle=0.2deg", "toe_9m=20mm"])), ["hole"])
    angle, offset = sheet.panels
    assert [(level.name, level.value) for level in angle.levels] == [("limit", pytest.approx(0.2))]
    assert [(level.name, level.value) for level in offset.levels] == [("limit, toe 9 m", pytest.approx(20))]
    assert [curve.name for curve in offset.curves] == ["toe 12 m", "toe 9 m", "toe 6 m", "toe 3 m", "collar"]


def test_an_inaccurate_or_stopped_run_is_not_acceptable(drilling: Trajectory) -> None:
    arrays = {**drilling.arrays, "constraint_error": drilling.constraint_error + 1e-3}
    content = content_of(replace(drilling, arrays=arrays))
    assert content.findings[0].level is Level.BAD
    assert "not accurate" in content.findings[0].title


def test_a_robot_without_hole_cylinders_and_limits_is_reported() -> None:
    rig = load_rig_text(ur5_text().replace("</robot>", EXTENSION + "</robot>"))
    run = simulate(rig, Scenario(duration=0.3, positions=POSE))
    content = content_of(run)
    assert content.quality is None
    assert content.verdict[0] is Level.NOTE
    page = without_library(page_of(run))
    assert "Hole quality" not in page
    assert 'id="cycles"' not in page


def test_limits_come_from_the_examples_a_file_and_the_command_line(tmp_path: Path) -> None:
    examples = read_limits()
    assert examples["collar"].value == pytest.approx(0.076)
    assert all(limit.assumed for limit in examples.values())
    path = tmp_path / "ours.yaml"
    path.write_text("toe_6m: 120 mm\nangle: {value: 0.5, unit: deg, source: 'our standard 7'}\ncollar: none\n")
    limits = read_limits(path, ["toe_9.5m=0.2m", "shake=4mm"])
    assert {name: limit.value for name, limit in limits.items()} == pytest.approx(
        {"toe_6m": 0.12, "angle": math.radians(0.5), "toe_9.5m": 0.2, "shake": 0.004}
    )
    assert limits["angle"].source == "our standard 7"
    assert not any(limit.assumed for limit in limits.values())
    assert limited_depths(limits) == (3, 6, 9.5, 12)


@pytest.mark.parametrize(
    "setting", ["toe=1", "angle", "angle=-1", "collar=3kg", "collar=nan", "angle=5mm", "collar=1e999"]
)
def test_a_limit_that_means_nothing_is_refused(setting: str) -> None:
    with pytest.raises(ScenarioError):
        read_limits(None, [setting])


@pytest.mark.parametrize("setting", ["toe_6m=100", "collar=0.076", "shake= 4 ", "angle=0.5"])
def test_a_limit_without_unit_is_refused_with_the_ways_to_write_it(setting: str, tmp_path: Path) -> None:
    name, _, number = setting.partition("=")
    usual = ("deg", "rad") if name == "angle" else ("mm", "m")
    with pytest.raises(ScenarioError) as given:
        read_limits(None, [setting])
    assert "has no unit" in str(given.value)
    (tmp_path / "ours.yaml").write_text(f"{name}: {number}\n")
    with pytest.raises(ScenarioError) as written:
        read_limits(tmp_path / "ours.yaml")
    (tmp_path / "rows.yaml").write_text(f"{name}: {{value: {number}, source: ours}}\n")
    with pytest.raises(ScenarioError, match="has no unit"):
        read_limits(tmp_path / "rows.yaml")
    assert "ours.yaml:1" in str(written.value)
    for unit in usual:
        assert f"--limit {name}={number.strip()}{unit}" in given.value.todo
        assert f"{name}: {number.strip()}{unit}" in written.value.todo
        assert read_limits(None, [f"{name}={number.strip()}{unit}"])[name].value > 0


@pytest.mark.parametrize("text", ["- 1\n", "a: &x 1\nb: *x\n", "{", "nonsense: 3\n"])
def test_a_file_of_limits_that_cannot_be_read_is_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / "bad.yaml").write_text(text)
    with pytest.raises(ScenarioError, match=re.escape("bad.yaml")):
        read_limits(tmp_path / "bad.yaml")


@pytest.mark.parametrize(
    "words",
    [
        ("--set", "scenario.duration=0.02"),
        ("mkz49", "--set", "model.boom_length=2.1", "--set", "scenario.duration=0.02"),
        (
            "--scenario",
            "hole_9_printed_tip",
            "--set",
            "scenario.duration=0.02",
            "--set",
            "scenario.text=\"a: 'b' #c $d\"",
        ),
        ("--set", "scenario.duration=0.02", "--set", "scenario.loads=[drilling_force]", "--set", 'scenario.name="7"'),
        ("--set", "scenario.duration=0.02", "--set", "scenario.positions.boom_lift=1.2", "-s", "hole_9"),
    ],
)
def test_the_command_in_the_report_asks_the_same_question(drillrig: Command, words: tuple[str, ...]) -> None:
    drillrig("run", *words, "-q")
    first = load_trajectory("run.nc")
    again = shlex.split(command(first))
    assert again[0] == "drillrig"
    assert asks_the_same(first)
    assert drillrig(*again[1:], "-q", "-o", "again.nc").code == 0
    assert load_trajectory("again.nc").content_hash == first.content_hash


def test_a_rig_made_in_python_is_not_said_to_be_that_of_the_command() -> None:
    run = simulate(load_rig_text(mass_on_cylinder()), Scenario(duration=0.05))
    assert not asks_the_same(run)
    page = without_library(page_of(run))
    assert "load_rig_text(old.model)" in page
    assert "drillrig run" not in page


def test_the_command_writes_the_page_and_says_the_verdict(drillrig: Command) -> None:
    drillrig("run", "--set", "scenario.duration=0.1", "-q")
    answer = drillrig("report", "run.nc", "--limit", "angle=0.0001deg")
    assert answer.code == 0
    assert "Not good enough" in answer.out
    assert Path("run_report.html").stat().st_size < 20e6
    document = drillrig("report", "run.nc", "-o", "r.html", "--json").document
    assert document["report"] == "r.html"
    assert document["hole_quality"]["errors"][0]["name"] == "angle"
    one_sentence(drillrig("report", "run.nc", "-o", "nowhere/r.html"), "nowhere")
    one_sentence(drillrig("report", "run.nc", "--limit", "tow=1"), "tow")
    one_sentence(drillrig("report", "nothing.nc"), "nothing.nc")


def test_a_run_remembers_the_versions_it_was_made_with(drilling: Trajectory, tmp_path: Path) -> None:
    old = replace(drilling, made_with={**drilling.made_with, "numpy": "1.0"})
    assert old.content_hash != drilling.content_hash
    old.save(tmp_path / "old.nc")
    again = load_trajectory(tmp_path / "old.nc")
    assert again.made_with["numpy"] == "1.0"
    assert again.content_hash == old.content_hash
    assert "installed now" in page_of(again)
