"""Studies carried out: the same table however they are run, and nothing lost or done twice whatever breaks."""

from __future__ import annotations

import json
import multiprocessing
import os
import resource
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pyarrow.parquet
import pytest
from command import Command, one_sentence
from processes import PATIENCE, wait_for

from drillrig_pin import load_rig, load_scenario, load_trajectory, simulate
from drillrig_pin.analysis.series import extremes
from drillrig_pin.batch.cases import unfold
from drillrig_pin.batch.pools import BatchError, DiedError, LocalPool, TimeOutError, outcome_of
from drillrig_pin.batch.runner import Finished, run_study
from drillrig_pin.batch.store import Store
from drillrig_pin.batch.study import Study, load_study
from drillrig_pin.batch.worker import Answer
from drillrig_pin.errors import ResultFileError, ScenarioError

SCRIPTS = Path(sys.executable).parent
#: They say how long something took; everything else is the same in every run.
TIMES = ("solve_time", "wall_time")
SHORT: dict[str, Any] = {"scenario.duration": 0.1}
METRICS = ["S.z.rms", "*.p_max"]


def study(count: int = 6, **fields: Any) -> Study:
    axis = {"name": "scenario.velocities.boom_swing", "range": {"start": 0, "stop": 0.01, "count": count}}
    return Study(**{"axes": [axis], "set": SHORT, "metrics": METRICS, **fields})


def slow(count: int = 6) -> Study:
    """Cases of about half a second each."""
    return study(count, set={"scenario.duration": 5, "scenario.output_rate": 20, "scenario.integrator.method": "RK4"})


def table(path: Path) -> list[dict[str, Any]]:
    rows = pyarrow.parquet.read_table(path).to_pylist()
    return [{name: value for name, value in row.items() if name not in TIMES} for row in rows]


def recorded(folder: Path) -> Counter[str]:
    lines = [line for path in (folder / "journal").glob("*.jsonl") for line in path.read_text().splitlines()]
    return Counter(json.loads(line)["key"] for line in lines)


def write(path: Path, content: Study) -> Path:
    fields = content.model_dump(mode="json", exclude_none=True, exclude={"axes"})
    axes = [{"name": axis.name, "range": axis.range.model_dump(exclude_none=True)} for axis in content.axes]
    path.write_text(json.dumps({**fields, "axes": axes}))
    return path


@pytest.fixture(scope="module")
def alone(tmp_path_factory: pytest.TempPathFactory) -> list[dict[str, Any]]:
    """The table of the small study by one worker."""
    return table(run_study(study(), tmp_path_factory.mktemp("alone"), workers=1).table)


def test_a_row_holds_the_numbers_of_the_run_it_names(alone: list[dict[str, Any]]) -> None:
    scenario = load_scenario("hole_9", duration=0.1, velocities={"boom_swing": 0.01})
    run = simulate(load_rig("mkz49"), scenario)
    row = alone[-1]
    assert row["scenario.velocities.boom_swing"] == 0.01
    assert row["content_hash"] == run.content_hash
    record = run.record
    # Peaks count where they are, between the rows.
    highest = [extremes(record.time, p[:, 1])[1] for p in (record.pressure_a, record.pressure_b)]
    assert row["lift_cylinder.p_max"] == pytest.approx(101_325 + max(highest), rel=1e-12)


def test_the_table_is_the_same_for_any_number_of_workers_and_after_a_resume(
    tmp_path: Path, alone: list[dict[str, Any]]
) -> None:
    run_study(study(3), tmp_path, workers=2)
    finished = run_study(study(), tmp_path, workers=2)
    assert table(finished.table) == alone
    assert finished.tally.before == 2  # the ends of both ranges
    again = run_study(study(), tmp_path)
    assert (again.tally.before, again.tally.since_start) == (6, 0)
    assert table(again.table) == alone


def test_a_case_that_fails_is_a_row_with_its_reason_and_the_study_goes_on(tmp_path: Path) -> None:
    places = {"near": {"pose": "hole_9"}, "far": {"at": [9, 0, 2]}}
    axes = [
        {"name": "model.boom_length", "list": [1.94, 0.5]},
        {"holes": {"fixed": ["head_rotation"], "places": places}},
    ]
    rows = table(run_study(study(axes=axes), tmp_path, workers=1).table)
    assert [(row["hole"], row["status"]) for row in rows] == [
        ("near", "completed"),
        ("far", "unreachable"),
        ("near", "failed"),
        ("far", "failed"),
    ]
    assert rows[0]["S.z.rms"] > 0
    assert rows[1]["S.z.rms"] is None
    assert "boom_extension stands at its upper limit" in rows[1]["reason"]
    assert "boom_length 0.5 m leaves a lower boom" in rows[2]["reason"]


def test_a_case_that_takes_too_long_is_a_row_that_says_so(tmp_path: Path) -> None:
    fields = {"scenario.integrator.method": "RK4", "scenario.output_rate": 100}

    def carried_out(durations: list[float], limit: float) -> Finished:
        axes = [{"name": "scenario.duration", "list": durations}]
        return run_study(study(axes=axes, set=fields), tmp_path, workers=1, time_limit=limit)

    # The short case first, on its own: on a busy machine a limit that ends the long one soon might end it, too.
    assert carried_out([0.01], PATIENCE).tally.statuses == {"completed": 1}
    for limit in (2.0, 1.0):
        finished = carried_out([0.01, 10_000], limit)
        rows = table(finished.table)
        assert [row["status"] for row in rows] == ["completed", "time limit"]
        assert [row["reason"] for row in rows] == ["", f"took longer than {limit:g} s"]
        assert finished.tally.before == 1


def test_a_worker_that_hangs_is_killed_and_one_that_dies_is_replaced() -> None:
    pool = LocalPool(1)
    try:
        hung, died = pool.submit(0.5, time.sleep, 2 * PATIENCE), pool.submit(PATIENCE, os._exit, 7)
        assert isinstance(outcome_of(hung)[1], TimeOutError)
        assert isinstance(outcome_of(died)[1], DiedError)
        assert pool.submit(PATIENCE, abs, -3).result(PATIENCE) == 3
    finally:
        pool.close()


def test_workers_that_are_killed_lose_nothing(tmp_path: Path) -> None:
    killed: list[int] = []

    def kill_one(tally: Any) -> None:
        if tally.since_start >= 1 + 2 * len(killed) and len(killed) < 2:
            victim = multiprocessing.active_children()[0].pid
            assert victim is not None
            os.kill(victim, signal.SIGKILL)
            killed.append(victim)

    finished = run_study(slow(), tmp_path, workers=2, listener=kill_one)
    assert len(killed) == 2
    assert finished.tally.statuses == {"completed": 6}
    assert set(recorded(tmp_path).values()) == {1}


def test_a_command_that_is_killed_goes_on_where_it_was(tmp_path: Path) -> None:
    path = write(tmp_path / "s.yaml", slow())
    command = [str(SCRIPTS / "drillrig"), "sweep", str(path), "-o", str(tmp_path / "out"), "--workers", "2"]
    first = subprocess.Popen(command)
    wait_for(lambda: len(recorded(tmp_path / "out")) >= 1)
    first.kill()
    first.wait()
    before = recorded(tmp_path / "out")
    assert 1 <= len(before) < 6
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    after = recorded(tmp_path / "out")
    assert len(after) == 6
    assert set(after.values()) == {1}
    rows = table(tmp_path / "out" / "results.parquet")
    assert [row["case"] for row in rows] == list(range(6))
    assert {row["status"] for row in rows} == {"completed"}


def test_ctrl_c_ends_at_once_and_says_how_to_go_on(tmp_path: Path) -> None:
    path = write(tmp_path / "s.yaml", slow(40))
    command = [str(SCRIPTS / "drillrig"), "sweep", str(path), "-o", str(tmp_path / "out"), "--workers", "2"]
    run = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True)
    wait_for(lambda: len(recorded(tmp_path / "out")) >= 1)
    os.killpg(run.pid, signal.SIGINT)  # as a terminal sends it: to the workers, too
    before = len(recorded(tmp_path / "out"))
    out, err = run.communicate(timeout=PATIENCE)
    assert run.returncode == 130
    assert "To go on: drillrig sweep" in out
    assert err == ""
    after = len(recorded(tmp_path / "out"))
    # Not one case is begun any more: at most those under way, and those answered but not yet recorded, are added.
    assert after <= before + 2 * 2
    assert len(table(tmp_path / "out" / "results.parquet")) == after


FORK_WITHOUT_ORDERS = """
import os
from multiprocessing import forkserver
from drillrig_pin.batch.pools import LocalPool

pool = LocalPool(1, preload=())
pool.submit(None, abs, -1).result()
sentinel, orders = forkserver.connect_to_new_process([])
os._exit(0)  # as if killed: the worker that was just forked finds the end of a pipe where its orders should be
"""


def test_a_worker_whose_command_was_killed_while_it_started_prints_nothing() -> None:
    run = subprocess.run([sys.executable, "-c", FORK_WITHOUT_ORDERS], capture_output=True, text=True)
    assert run.returncode == 0
    assert "Traceback" not in run.stderr


def test_a_full_disk_is_said_and_what_was_recorded_stays(tmp_path: Path) -> None:
    store = Store(tmp_path)
    store.record([Answer("a")])
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, hard))
    try:
        with pytest.raises(ResultFileError, match="1 cases are safe"):
            store.record([Answer("b")])
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert recorded(tmp_path) == {"a": 1}
    assert [answer.key for answer in store.record([Answer("a"), Answer("b")])] == ["b"]
    store.close()


FILL = """
mount -t tmpfs -o size=700k none "$1" || exit 77
"$2" sweep "$3" -o "$1/out" --keep all --workers 1 -q 2> "$4/first"; echo "first $?"
mount -o remount,size=80m "$1"
"$2" sweep "$3" -o "$1/out" --keep all --workers 1 -q 2> "$4/second"; echo "second $?"
cp -r "$1/out" "$4/kept"
"""


def test_a_disk_that_runs_full_loses_nothing_and_the_same_command_goes_on(tmp_path: Path) -> None:
    """A small file system of its own, in a mount namespace that ends with the commands."""
    disk = tmp_path / "disk"
    disk.mkdir()
    path = write(tmp_path / "study.yaml", study(12))
    script = ["unshare", "--map-root-user", "--mount", "sh", "-c", FILL, "sh"]
    run = subprocess.run(
        [*script, str(disk), str(SCRIPTS / "drillrig"), str(path), str(tmp_path)], capture_output=True, text=True
    )
    if run.returncode == 77 and "CI" not in os.environ:
        pytest.skip("this system lets nobody mount a file system of his own")
    assert run.stdout.split() == ["first", "1", "second", "0"], run.stderr
    said = (tmp_path / "first").read_text()
    assert "No space left on device" in said
    assert "Traceback" not in said
    rows = table(tmp_path / "kept" / "results.parquet")
    assert [row["status"] for row in rows] == ["completed"] * 12
    assert len(list((tmp_path / "kept" / "trajectories").glob("*.nc"))) == 12
    assert set(recorded(tmp_path / "kept").values()) == {1}


def test_one_command_at_a_time_works_in_a_folder(tmp_path: Path) -> None:
    store = Store(tmp_path)
    with pytest.raises(ResultFileError, match="another command is working"):
        Store(tmp_path)
    store.close()
    Store(tmp_path).close()


def test_the_worst_cases_are_kept_as_the_runs_they_were(tmp_path: Path) -> None:
    finished = run_study(study(4), tmp_path, workers=1, keep="worst:2")
    rows = sorted(table(finished.table), key=lambda row: -row["S.z.rms"])
    assert set(finished.kept) == {row["case"] for row in rows[:2]}
    for index, path in finished.kept.items():
        row = next(row for row in rows if row["case"] == index)
        assert load_trajectory(path).content_hash == row["content_hash"]


def test_all_runs_are_kept_also_those_an_earlier_command_solved_and_those_without_the_first_metric(
    tmp_path: Path,
) -> None:
    axes = [{"name": "model.boom_length", "list": [1.94, 0.5, 1.9]}]
    run_study(study(axes=axes), tmp_path, workers=1)
    finished = run_study(study(axes=axes), tmp_path, workers=2, keep="all")
    assert finished.tally.since_start == 0
    rows = table(finished.table)
    assert [row["status"] for row in rows] == ["completed", "failed", "completed"]
    assert set(finished.kept) == {0, 2}
    for index, path in finished.kept.items():
        assert load_trajectory(path).content_hash == rows[index]["content_hash"]


def test_a_metric_that_no_run_has_is_said_with_its_line_after_the_first_run(tmp_path: Path) -> None:
    path = tmp_path / "s.yaml"
    head = "set: {scenario.duration: 0.1}\naxes:\n  - name: scenario.velocities.boom_swing\n"
    path.write_text(
        head + "    range: {start: 0, stop: 0.01, count: 20}\nmetrics:\n  - S.z.rms\n  - lift_cylindr.p_m*\n"
    )
    with pytest.raises(ScenarioError) as caught:
        run_study(load_study(path), tmp_path / "out", workers=1)
    assert "s.yaml:7: no run of this study has a metric 'lift_cylindr.p_m*'" in str(caught.value)
    assert "Did you mean 'lift_cylinder.p_m" in str(caught.value)
    assert 1 <= len(table(tmp_path / "out" / "results.parquet")) < 20


def test_the_commands_answer_in_json_and_in_one_sentence(drillrig: Command, tmp_path: Path) -> None:
    answer = drillrig("sweep", str(write(tmp_path / "s.yaml", study(2))), "-o", "out", "--workers", "1", "--json")
    assert answer.code == 0
    assert answer.document["statuses"] == {"completed": 2}
    poses = drillrig("holes", "--set", "model.boom_length=2.0", "--json").document
    assert poses["poses"]["hole_9"]["positions"]["boom_extension"] == 2.0
    one_sentence(drillrig("sweep", "nine_hole", "-o", "x"), "Did you mean 'nine_holes'?")
    one_sentence(drillrig("sweep", "nine_holes", "-o", "x", "--keep", "some"), "none, all or worst:10")
    one_sentence(drillrig("holes", "oil_and_rock"), "no holes")
    one_sentence(drillrig("sweep", "nine_holes", "-o", "x", "--scheduler", "tcp://127.0.0.1:1"), "no scheduler answers")


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[tuple[str, subprocess.Popen[bytes]]]:
    """A Dask scheduler and two worker processes of their own; its address and its process."""
    file = tmp_path / "scheduler.json"
    dask, quiet = str(SCRIPTS / "dask"), {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    scheduler = subprocess.Popen(
        [dask, "scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", str(file)],
        **quiet,  # type: ignore[call-overload]
    )
    options = ["--scheduler-file", str(file), "--nthreads", "1", "--no-dashboard", "--local-directory", str(tmp_path)]
    started = [scheduler]
    try:
        wait_for(file.exists)
        started += [subprocess.Popen([dask, "worker", *options], **quiet) for _ in range(2)]  # type: ignore[call-overload]
        yield json.loads(file.read_text())["address"], scheduler
    finally:
        for process in reversed(started):
            process.terminate()
        for process in started:
            process.wait(PATIENCE)


def test_a_cluster_gives_the_same_table_and_may_go_away(
    tmp_path: Path, cluster: tuple[str, subprocess.Popen[bytes]], alone: list[dict[str, Any]]
) -> None:
    address, scheduler = cluster
    finished = run_study(study(), tmp_path / "a", scheduler=address, keep="worst:1")
    assert table(finished.table) == alone
    assert all(path.exists() for path in finished.kept.values())

    def stop(tally: Any) -> None:
        if tally.since_start:
            scheduler.kill()

    plan = unfold(slow())
    with pytest.raises(BatchError, match="the scheduler went away"):
        run_study(plan, tmp_path / "b", scheduler=address, listener=stop)
    before = recorded(tmp_path / "b")
    assert 1 <= len(before) < 6
    run_study(plan, tmp_path / "b", workers=2)
    after = recorded(tmp_path / "b")
    assert len(after) == 6
    assert set(after.values()) == {1}
