"""Whatever dies, fills up or rots: nothing is lost, nothing is run twice, and the sentence says what happened."""

from __future__ import annotations

import json
import os
import resource
import signal
import subprocess
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from processes import PATIENCE, processor_time, wait_for
from serving import Server

#: Takes a second or two in readable Python.
SLOW = {"duration": 0.5, "engine": "python"}


def steps(server: Server, number: str) -> list[str]:
    """What the log says became of a job."""
    lines = [json.loads(line) for line in server.log.read_text().splitlines() if line.startswith("{")]
    return [line["step"] for line in lines if line.get("event") == "job" and line["id"] == number]


def children(server: Server) -> list[int]:
    """All processes below a server."""
    found, todo = [], [server.process.pid]
    while todo:
        told = subprocess.run(
            ["ps", "-o", "pid=", "--ppid", str(todo.pop())], capture_output=True, text=True, check=False
        )
        below = [int(word) for word in told.stdout.split()]
        found += below
        todo += below
    return found


def test_a_server_killed_in_the_middle_takes_up_where_it_was(fresh: Callable[..., Server]) -> None:
    first = fresh("--workers", "1")
    done = first.run(scenario={"duration": 0.05, "name": "done"})
    under_way = first.submit(scenario=SLOW)["id"]
    waiting = [first.submit(scenario={"duration": 0.05, "name": f"waiting {i}"})["id"] for i in range(3)]
    study = {"scenario": {"duration": 0.1}, "axes": [{"name": "model.percussion_frequency", "list": [40, 44, 48, 52]}]}
    number = first.http.post("/v1/studies", json=study).json()["id"]
    wait_for(lambda: first.http.get(f"/v1/runs/{under_way}").json()["progress"] > 0)
    left = children(first)
    assert left
    first.kill()

    second = fresh("--workers", "1")
    assert second.http.get(f"/v1/runs/{done['id']}").json() == done
    for job in (under_way, *waiting):
        assert second.ended(job)["status"] == "completed"
        assert second.http.get(f"/v1/runs/{job}/metrics").status_code == 200
    ended = second.ended(number, "studies")
    assert (ended["status"], ended["statuses"]) == ("completed", {"completed": 4})
    assert len(second.http.get(f"/v1/studies/{number}/table").json()["rows"]) == 4
    assert len(second.http.get("/v1/runs").json()["items"]) == 5
    assert steps(second, done["id"]) == ["queued", "running", "completed"]
    assert steps(second, under_way).count("completed") == 1
    wait_for(lambda: not [pid for pid in left if Path(f"/proc/{pid}").exists()])


def test_a_killed_worker_is_replaced_and_ctrl_c_leaves_no_process_behind(fresh: Callable[..., Server]) -> None:
    server = fresh("--workers", "1")
    # Long enough to be met at work, however late a busy machine lets this process look.
    number = server.submit(scenario={**SLOW, "duration": 1.5})["id"]
    wait_for(lambda: server.http.get(f"/v1/runs/{number}").json()["progress"] > 0)
    # Of those that were forked ready for work, the one that works.
    busiest = max(filter(_is_forked, children(server)), key=processor_time)
    os.kill(busiest, signal.SIGKILL)
    assert server.ended(number)["status"] == "completed"
    assert steps(server, number) == ["queued", "running", "died", "running", "completed"]

    number = server.submit(scenario={**SLOW, "duration": 5.0})["id"]
    study = {"scenario": {"duration": 5.0}, "axes": [{"name": "model.percussion_frequency", "list": [40, 44, 48, 52]}]}
    server.http.post("/v1/studies", json=study)
    left = children(server)
    with server.http.stream("GET", f"/v1/runs/{number}/events") as events:
        next(events.iter_lines())
        assert server.stop()
    assert server.process.returncode == 0
    assert "Traceback" not in server.log.read_text()
    wait_for(lambda: not [pid for pid in left if Path(f"/proc/{pid}").exists()])


def _is_forked(pid: int) -> bool:
    """Whether a process is a worker: forked by the process that forks them, whose command line it still shows."""
    parent = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[1]
    return all(b"forkserver" in Path(f"/proc/{number}/cmdline").read_bytes() for number in (pid, parent))


def test_a_hundred_equal_requests_are_one_run(server: Server) -> None:
    request = {"scenario": {"duration": 0.3, "name": "asked by a hundred"}}

    with ThreadPoolExecutor(50) as pool:
        answers = list(pool.map(lambda _: server.http.post("/v1/runs", json=request), range(100)))
    assert {answer.status_code for answer in answers} <= {200, 202}
    (number,) = {answer.json()["id"] for answer in answers}
    assert server.ended(number)["status"] == "completed"
    assert steps(server, number) == ["queued", "running", "completed"]


def test_a_full_disk_fails_the_run_in_one_sentence_and_room_makes_it_run(fresh: Callable[..., Server]) -> None:
    def full() -> None:
        # As large as the records get, smaller than a result.
        resource.setrlimit(resource.RLIMIT_FSIZE, (150_000, 150_000))

    request = {"scenario": {"duration": 1.0}}
    tight = fresh(setup=full)
    failed = tight.run(**request)
    assert failed["status"] == "failed"
    assert "cannot be written" in failed["error"]["detail"]
    assert tight.http.get("/healthz").status_code == 200
    left = list((tight.data / "runs" / failed["id"]).iterdir())
    assert all(path.stat().st_size < 1000 for path in left), left
    again = tight.submit(**request)
    assert again["status"] in ("queued", "running")


def test_a_damaged_result_is_noticed_and_computed_again(server: Server) -> None:
    run = server.run(scenario={"duration": 0.1, "name": "damaged"})
    path = server.data / "runs" / run["id"] / "run.nc"
    sound = path.read_bytes()
    path.write_bytes(sound[:5000] + bytes(100) + sound[5100:])
    answer = server.http.get(f"/v1/runs/{run['id']}/result")
    assert answer.status_code == 409
    assert "damaged" in answer.json()["detail"]
    assert server.ended(run["id"])["status"] == "completed"
    assert server.http.get(f"/v1/runs/{run['id']}/metrics").status_code == 200
    path.unlink()
    assert server.http.get(f"/v1/runs/{run['id']}/report").status_code == 409
    assert server.ended(run["id"])["status"] == "completed"
    assert server.http.get(f"/v1/runs/{run['id']}/result").status_code == 200


def test_a_run_that_needs_too_much_is_stopped_and_says_so(fresh: Callable[..., Server]) -> None:
    tight = fresh(limits={"job_time": 3.0, "job_memory": 60_000_000, "output": 3_000_000})
    late = tight.run(scenario={"duration": 100.0, "engine": "python"})
    assert (late["status"], "longer than 3 s" in late["error"]["detail"]) == ("failed", True), late
    large = tight.run(scenario={"duration": 100.0, "output_rate": 4000.0})
    assert (large["status"], "60 MB of memory" in large["error"]["detail"]) == ("failed", True), large
    bulky = tight.run(scenario={"duration": 10.0})
    assert (bulky["status"], "cannot be written" in bulky["error"]["detail"]) == ("failed", True), bulky
    assert tight.run(scenario={"duration": 1.0})["status"] == "completed"


def test_two_servers_do_not_share_a_folder(server: Server) -> None:
    told = subprocess.run(server.process.args, capture_output=True, text=True, timeout=PATIENCE, check=False)
    assert told.returncode == 1
    assert "another server works in this data folder" in told.stderr
