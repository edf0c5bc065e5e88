"""What is damaged is never sent and hides nothing else: it is made again of what is whole, or set apart and named."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import os
import random
import shutil
import sqlite3
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from inside import Inside

from drillrig_pin.batch.cases import unfold
from drillrig_pin.batch.store import JOURNAL, TABLE, Store
from drillrig_pin.batch.study import Study
from drillrig_pin.batch.worker import Answer
from drillrig_pin.errors import ResultFileError
from drillrig_pin.service import rendering
from drillrig_pin.service.kept import write_text
from drillrig_pin.service.records import Job, Records
from drillrig_pin.service.studies import study_facts, study_job
from drillrig_pin.service.work import Ending, Nothing

Json = dict[str, Any]
STUDY = {
    "scenario": {"duration": 0.1},
    "axes": [{"name": "scenario.duration", "list": [0.05, 0.06]}],
    "metrics": ["S.across.rms"],
}


@pytest.fixture(scope="module")
def inside(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Inside]:
    """A service with pages that cost nothing to make."""
    found = Inside(tmp_path_factory.mktemp("inside") / "data")
    yield found
    found.stop()


@pytest.fixture(scope="module")
def run(inside: Inside) -> Json:
    """A completed run."""
    found = inside.run(duration=0.05, name="damaged")
    assert found["status"] == "completed", found
    return found


@pytest.fixture
def cheap_pages(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pages say what they are made of, and no more."""

    def page(source: Path, target: Path) -> None:
        write_text(target, f"page of {source.name}, {source.stat().st_size}")

    def figure(source: Path, name: str, form: str, folder: Path) -> str:
        page(source, folder / f"{name}.{form}")
        return f"{name}.{form}"

    monkeypatch.setattr(rendering, "figure", figure)
    for name in ("report", "motion", "study_report_of"):
        monkeypatch.setattr(rendering, name, page)


def garbage(path: Path) -> None:
    path.write_bytes(b"\xff\x00{")


def planted(path: Path) -> None:
    """Of the same length and, as far as one can set it, of the same time."""
    state = path.stat()
    path.write_bytes(b"x" * state.st_size)
    os.utime(path, ns=(state.st_atime_ns, state.st_mtime_ns))


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


DAMAGES: list[Callable[[Path], None]] = [Path.unlink, garbage, planted, cut]


@pytest.mark.parametrize("damage", DAMAGES)
@pytest.mark.usefixtures("cheap_pages")
def test_what_is_made_of_a_run_is_made_again_when_it_is_damaged(
    inside: Inside, run: Json, damage: Callable[[Path], None]
) -> None:
    base, folder = f"/v1/runs/{run['id']}", inside.data / "runs" / run["id"]
    for url, name in (
        ("metrics", "metrics.json"),
        ("report", "report.html"),
        ("replay", "replay.html"),
        ("result?format=csv", "run.csv"),
        ("figures/energy.svg", "figures/energy.svg"),
    ):
        sound = inside.get(f"{base}/{url}")
        assert sound.status_code == 200, sound.text
        damage(folder / name)
        again = inside.get(f"{base}/{url}")
        assert (again.status_code, again.content) == (200, sound.content), name
        assert hashlib.sha256((folder / name).read_bytes()).digest() == hashlib.sha256(sound.content).digest()


@pytest.mark.parametrize("damage", [planted, lambda path: shutil.rmtree(path.parent)])
def test_a_run_whose_result_is_damaged_is_carried_out_again(inside: Inside, damage: Callable[[Path], None]) -> None:
    run = inside.run(duration=0.05, name="again")
    base, path = f"/v1/runs/{run['id']}", inside.data / "runs" / run["id"] / "run.nc"
    damage(path)
    told = inside.get(f"{base}/result")
    assert (told.status_code, "is carried out again" in told.json()["todo"]) == (409, True)
    assert inside.get(f"{base}/result").status_code == 200
    assert inside.get(f"{base}/metrics").status_code == 200
    # Asked for once more, it is not said to be there when it is not.
    damage(path)
    assert inside.ask("POST", "/v1/runs", json={"scenario": {"duration": 0.05, "name": "again"}}).status_code == 202
    assert inside.get(f"{base}/result").status_code == 200


@pytest.fixture(scope="module")
def study(inside: Inside) -> Json:
    """A completed study, as its process leaves it."""
    service = inside.service
    entry = service.library.entry("mkz49")
    facts = study_facts(STUDY, entry, service.settings.limits)
    folder = inside.data / "studies" / facts["id"]
    plan = unfold(Study(**STUDY, model=entry.path))
    store = Store(folder)
    store.record(
        Answer(case.question.key, metrics={"S.across.rms": 1.0}, units={"S.across.rms": "m"}) for case in plan.cases
    )
    table = store.write_table(plan)
    store.close()
    job = study_job(entry, STUDY, facts)
    digest = hashlib.sha256(table.read_bytes()).hexdigest()
    ended = {"status": "completed", "finished": job.created, "digest": digest, "summary": {"cases": 2, "done": 2}}
    service.records.add(dataclasses.replace(job, **ended))
    return {"id": job.id, "folder": folder}


@pytest.mark.parametrize(
    ("damage", "url", "name"),
    [
        (Path.unlink, "table", TABLE),
        (garbage, "table?format=csv", TABLE),
        (cut, "table?format=parquet", TABLE),
        (planted, "report", TABLE),
        (planted, "table?format=csv", "results.csv"),
    ],
)
@pytest.mark.usefixtures("cheap_pages")
def test_the_table_of_a_study_is_made_again_of_its_journal(
    inside: Inside, study: Json, damage: Callable[[Path], None], url: str, name: str
) -> None:
    url = f"/v1/studies/{study['id']}/{url}"
    sound = inside.get(url).content
    damage(study["folder"] / name)
    again = inside.get(url)
    assert (again.status_code, again.content) == (200, sound)


def test_a_study_whose_journal_is_damaged_as_well_is_carried_out_again(
    inside: Inside, study: Json, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun: list[Callable[[Ending], None]] = []
    monkeypatch.setattr(
        inside.service.jobs.carriers["study"], "start", lambda job, ended: begun.append(ended) or Nothing()
    )
    (journal,) = (study["folder"] / JOURNAL).glob("*.jsonl")
    garbage(journal)
    (study["folder"] / TABLE).unlink()
    told = inside.get(f"/v1/studies/{study['id']}/table")
    assert (told.status_code, "is carried out again" in told.json()["todo"]) == (409, True)
    assert len(begun) == 1
    assert inside.get(f"/v1/studies/{study['id']}").json()["status"] == "running"


@pytest.fixture
def records(tmp_path: Path) -> Path:
    """Records of three runs, one of which waits, closed."""
    path = tmp_path / "data" / "records.sqlite"
    path.parent.mkdir()
    base = Records(path)
    for digit, status in (("a", "completed"), ("b", "completed"), ("c", "failed")):
        request = {"model": "mkz49", "arguments": {}, "scenario": {"name": digit}}
        base.add(Job(digit * 32, "run", status, digit, "mkz49", digit, request))  # type: ignore[arg-type]
    base.close()
    return path


@pytest.mark.parametrize(
    "change",
    [
        "summary = '{broken', request = '['",
        "status = 'nonsense'",
        "request = '{}'",
        "request = x'ff00'",
        "summary = '[1]'",
        "summary = '{\"numbers\": 3}'",
        "error = '{\"what\": 1}'",
        "created = 'yesterday'",
        "started = 9e999",
        "attempts = 'many'",
        "name = x'00ff'",
    ],
)
def test_a_damaged_record_is_set_apart_and_hides_no_other(records: Path, change: str) -> None:
    with sqlite3.connect(records) as base:
        base.execute(f"UPDATE jobs SET {change} WHERE id = ?", ["b" * 32])
    base.close()
    server = Inside(records.parent)
    try:
        listed = server.get("/v1/runs").json()
        assert sorted(item["id"][0] for item in listed["items"]) == ["a", "c"]
        assert server.get("/v1/runs").json()["set_apart"] == ["b" * 32]
        told = server.get(f"/v1/runs/{'b' * 32}")
        assert (told.status_code, "damaged and was set apart" in told.json()["detail"]) == (404, True)
        health = server.get("/healthz").json()
        assert health["status"] == "degraded"
        assert "damaged records set apart: 1" in health["problems"][0]
        assert server.ask("DELETE", f"/v1/runs/{'b' * 32}").status_code == 204
        assert server.get("/healthz").json()["status"] == "ok"
    finally:
        server.stop()


def test_a_damaged_upload_is_set_apart_and_taken_again(records: Path) -> None:
    base = Records(records)
    base.add_upload("d" * 32, "x", "<robot/>", {})
    assert (base.upload("d" * 32), list(base.apart)) == (None, ["d" * 32])
    number = hashlib.sha256(b"<robot/>").hexdigest()[:32]
    base.add_upload(number, "x", "<robot/>", {})
    assert (base.upload(number) or {})["content"] == "<robot/>"
    base.close()


def pages(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[4096:] = random.Random(2).randbytes(len(content) - 4096)
    path.write_bytes(content)


def folder(path: Path) -> None:
    path.unlink()
    path.mkdir()


def empty(path: Path) -> None:
    path.write_bytes(b"")
    (path.parent / "runs" / ("a" * 32)).mkdir(parents=True)


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        (cut, "damaged"),
        (lambda path: path.write_bytes(b"garbage!" * 10 + path.read_bytes()[80:]), "damaged"),
        (pages, "damaged"),
        (empty, "damaged"),
        (folder, "cannot be opened"),
    ],
)
def test_damaged_records_are_called_damaged(records: Path, damage: Callable[[Path], None], words: str) -> None:
    damage(records)
    with pytest.raises(ResultFileError) as told:
        Records(records)
    assert words in told.value.what
    assert "room" not in str(told.value)


@pytest.mark.parametrize("change", ["ADD COLUMN extra TEXT", "DROP COLUMN digest", "DROP COLUMN beside"])
def test_records_of_an_earlier_and_of_a_later_version_are_read(records: Path, change: str) -> None:
    with sqlite3.connect(records) as base:
        base.execute(f"ALTER TABLE jobs {change}")
    base.close()
    found = Records(records)
    assert [job.name for job in found.jobs("run")] == ["c", "b", "a"]
    found.change("a" * 32, digest="x", beside={"y": "z"})
    job = found.job("a" * 32, "run")
    assert job is not None
    assert (job.digest, job.beside) == ("x", {"y": "z"})
    found.close()


def test_a_journal_is_freed_of_a_damaged_file_and_goes_on(tmp_path: Path) -> None:
    from drillrig_pin.service.study_process import _set_apart

    path = tmp_path / "000001-x.jsonl"
    path.write_text(json.dumps({}))
    assert _set_apart(path)
    assert [found.name for found in tmp_path.iterdir()] == ["000001-x.jsonl.damaged"]
    assert not _set_apart(path)
