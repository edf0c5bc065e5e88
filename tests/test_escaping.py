"""Names and titles of anybody are shown as text: on a terminal, in a page, in a spreadsheet, in a log."""

from __future__ import annotations

import csv
import io
import json
import re
from dataclasses import replace
from pathlib import Path

import pytest
import rigs
from command import Command

from drillrig_pin.escaping import cell, json_visible, script_json, visible
from drillrig_pin.replay.page import animation_page
from drillrig_pin.rig import load_rig_text
from drillrig_pin.scenario import Scenario
from drillrig_pin.service.watch import make_log
from drillrig_pin.simulation import simulate
from drillrig_pin.trajectory import Trajectory

#: Clears a screen, sets a title, starts a sequence in one byte, turns letters round.
OBEYED = "\x1b[2J\x1b]0;owned\x07\x9b31m\u202etxt.\u2066"
HIDDEN = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")


@pytest.fixture(scope="module")
def run() -> Trajectory:
    found = simulate(load_rig_text(rigs.mass_on_cylinder()), Scenario(duration=0.02))
    names = {dim: [f"{word};=cmd|{OBEYED}" for word in words] for dim, words in found.labels.items()}
    case = replace(found, labels=names, notes=(OBEYED,)).scenario.changed({"name": f"<!--<script>{OBEYED}"})
    return replace(found, labels=names, notes=(OBEYED,), scenario=case)


def test_no_title_opens_a_script_in_a_page(run: Trajectory) -> None:
    for page in (animation_page([run]), animation_page([run], names=["x<!--<script>"])):
        words = re.search(r'id="scene-words">(.*?)</script>', page, re.DOTALL)
        assert words is not None
        assert "<" not in words[1]
        assert "<!--<script>" in json.loads(words[1])["title"]
    assert "<" not in script_json({"a": "<!--<script>", "b": "</script>"})


def test_a_terminal_gets_no_commands_from_a_file(run: Trajectory, drillrig: Command) -> None:
    run.save("run.nc")
    name = f"{OBEYED.replace('/', '')}.nc"
    Path(name).write_bytes(b"no result")
    answers = [
        drillrig("compare", "run.nc", "run.nc", "--all"),
        drillrig("compare", "run.nc", "run.nc", "--all", "--json"),
        drillrig("compare", "run.nc", name),
        drillrig("replay", "run.nc", "--html", "x.html"),
    ]
    for answer in answers:
        assert not HIDDEN.search(answer.out + answer.err), answer
    assert r"\x1b[2J" in answers[0].out
    assert r"\x1b[2J" in answers[2].err
    assert answers[1].document


def test_json_for_programs_means_what_it_meant() -> None:
    text = json.dumps({"a": OBEYED + "\x7f\U000e0041"}, ensure_ascii=False)
    assert json.loads(json_visible(text)) == json.loads(text)
    assert not HIDDEN.search(json_visible(text))
    assert visible("Máy khoan\n\tđập ° µ") == "Máy khoan\n\tđập ° µ"


@pytest.mark.parametrize(
    "words", ["=1+1", "+A1", "-A1", "@SUM(A1)", "\t=1", "\r=1", "\tx", " =1", '"=1', "x;=1", "\uff1d1"]
)
def test_a_cell_is_no_formula(words: str) -> None:
    assert re.search(r"(^|;)'", cell(words))
    assert cell(words).replace("'", "") == words


@pytest.mark.parametrize("words", ["boom_lift", "-1.5e-3", "+2", "a - b = c", "x@y", "S.across.rms"])
def test_other_cells_stay_as_they_are(words: str) -> None:
    assert cell(words) == words


def test_an_exported_header_is_no_formula_whatever_the_separator(run: Trajectory, tmp_path: Path) -> None:
    run.to_csv(tmp_path / "run.csv")
    header = next(csv.reader((tmp_path / "run.csv").open(newline="")))
    assert not [name for name in header if re.search(r"(^|[;,\t])[=+@-]", name)]


def test_a_log_at_a_terminal_obeys_no_name() -> None:
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    stream = Terminal()
    make_log(stream).info("run", name=OBEYED)
    assert r"\x1b[2J" in stream.getvalue()
    assert "\x1b[2J" not in stream.getvalue()
    assert "\u202e" not in stream.getvalue()
