"""The files of the page: both languages say everything, nothing stands inline, no file is too long."""

from __future__ import annotations

import json
import re
from importlib.resources import files
from pathlib import Path

import pytest

WEB = Path(str(files("drillrig_pin.service").joinpath("web")))
SCRIPTS = sorted(WEB.rglob("*.js"))
LANGUAGES = ("en", "vi")


def words(language: str) -> dict[str, str]:
    return dict(json.loads((WEB / f"{language}.json").read_text(encoding="utf-8")))


def test_both_languages_have_the_same_keys_and_the_same_places_for_values() -> None:
    english, vietnamese = map(words, LANGUAGES)
    assert list(english) == list(vietnamese)
    for key, text in english.items():
        assert text.strip()
        places = [sorted(re.findall(r"\{\w+\}", said)) for said in (text, vietnamese[key])]
        assert places[0] == places[1], key


def test_every_key_in_use_has_words_and_every_word_is_in_use() -> None:
    known = set(words("en"))
    exact: set[str] = set()
    built: set[str] = set()
    for script in SCRIPTS:
        text = script.read_text(encoding="utf-8")
        quoted = re.findall(r'"([a-z_]+(?:\.[A-Za-z0-9_]+)+)"', text)
        exact |= {key for key in quoted if key.split(".")[0] in heads(known)}
        built |= set(re.findall(r"(?:t|translated)\(\s*`([a-z_]+\.(?:[a-z_]+\.)?)\$\{", text))
    assert exact - known == set(), "keys without words"
    assert {start for start in built if not any(key.startswith(start) for key in known)} == set()
    unused = {key for key in known - exact if not any(key.startswith(start) for start in built)}
    assert unused == set(), "words that nothing says"


def heads(keys: set[str]) -> set[str]:
    return {key.split(".")[0] for key in keys} - {"scenario"}


def test_nothing_stands_inline_and_nothing_comes_from_elsewhere() -> None:
    page = (WEB / "index.html").read_text(encoding="utf-8")
    assert re.findall(r"<script(?![^>]*\bsrc=)", page) == []
    assert re.findall(r"<style|\bstyle=|\bon\w+=", page) == []
    for path in WEB.rglob("*"):
        if path.suffix in (".html", ".css", ".js"):
            text = path.read_text(encoding="utf-8").replace("http://www.w3.org/2000/svg", "")
            assert re.findall(r"https?://|@import|innerHTML|\beval\(", text) == [], path.name


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.relative_to(WEB).as_posix())
def test_every_import_is_there_and_no_script_is_too_long(script: Path) -> None:
    text = script.read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 300
    assert text.startswith("// "), "a script says first what it is for"
    for names, source in re.findall(r"import \{([^}]+)\} from \"([^\"]+)\"", text):
        target = (script.parent / source).resolve()
        exported = target.read_text(encoding="utf-8")
        for name in re.split(r",\s*", names.strip()):
            assert re.search(rf"export (?:async )?(?:function|const|class) {name}\b", exported), f"{name} of {source}"
            assert len(re.findall(rf"\b{name}\b", text)) > 1, f"{name} is imported and not used"
