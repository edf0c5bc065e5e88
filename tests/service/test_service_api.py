"""What the service answers to requests that are meant well."""

from __future__ import annotations

import io
import json
import re
from pathlib import Path
from typing import Any

import h5netcdf
import httpx
import numpy as np
import pytest
from serving import Server

from drillrig_pin import Scenario, load_rig, load_trajectory, simulate
from drillrig_pin.files import shipped_folder

Json = dict[str, Any]


def problem(answer: httpx.Response, status: int) -> Json:
    """A refusal as RFC 9457 wants it, with a number that is in the log."""
    assert answer.status_code == status, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    found = dict(answer.json())
    assert found["status"] == status
    assert found["detail"]
    assert found["request_id"] == answer.headers["x-request-id"]
    assert "Traceback" not in answer.text
    return found


def test_a_run_is_computed_once_and_its_result_is_that_of_this_machine(server: Server, tmp_path: Path) -> None:
    request = {"arguments": {"boom_length": 2.0}, "scenario": {"duration": 0.05, "name": "as here"}}
    first = server.http.post("/v1/runs", json=request)
    assert first.status_code == 202
    number = first.json()["id"]
    assert first.headers["location"] == f"/v1/runs/{number}"
    assert server.ended(number)["status"] == "completed"
    again = server.http.post("/v1/runs", json=request)
    assert again.status_code == 200
    assert again.json()["status"] == "completed"
    same = server.http.post("/v1/runs", json={**request, "arguments": {"boom_length": 2}})
    assert same.json()["id"] == number

    path = tmp_path / "run.nc"
    path.write_bytes(server.http.get(f"/v1/runs/{number}/result").content)
    there = load_trajectory(path)
    here = simulate(load_rig("mkz49", boom_length=2.0), Scenario(duration=0.05, name="as here"))
    assert there.content_hash == here.content_hash == again.json()["content_hash"]
    np.testing.assert_array_equal(there.q, here.q)


def test_the_numbers_of_a_run_come_with_unit_limit_and_verdict(server: Server, short: Json) -> None:
    found = server.http.get(f"/v1/runs/{short['id']}/metrics").json()
    by_key = {row["key"]: row for row in found["quantities"]}
    assert by_key["hole.toe_6m.worst"]["unit"] == "m"
    assert by_key["hole.toe_6m.worst"]["limit"] == pytest.approx(0.3)
    assert by_key["feed_cylinder.p_max"]["limit"] > 1e7
    assert {row["verdict"] for row in found["quantities"]} <= {None, "good", "near the limit", "over the limit"}
    assert found["verdict"]["sentence"]
    assert [card["label"] for card in found["cards"]] == [card["label"] for card in short["headlines"]]


def test_results_come_as_netcdf_csv_and_mat(server: Server, short: Json) -> None:
    base = f"/v1/runs/{short['id']}/result"
    with h5netcdf.File(io.BytesIO(server.http.get(base).content), "r") as file:
        assert file.variables["time"].shape == (101,)
    table = server.http.get(base, params={"format": "csv"})
    assert len(table.text.splitlines()) == 102
    assert table.headers["content-disposition"].startswith("attachment")
    from scipy.io import loadmat

    assert loadmat(io.BytesIO(server.http.get(base, params={"format": "mat"}).content))["q"].shape[0] == 101


def test_figures_report_and_replay_are_drawn_and_kept_in_a_sandbox(server: Server, short: Json) -> None:
    base = f"/v1/runs/{short['id']}"
    figures = {row["name"]: row for row in server.http.get(f"{base}/figures").json()}
    assert {"survey", "pressures", "energy"} <= set(figures)
    assert server.http.get(figures["energy"]["svg"]).text.lstrip().startswith("<?xml")
    assert server.http.get(figures["energy"]["png"]).content.startswith(b"\x89PNG")
    problem(server.http.get(f"{base}/figures/nothing.svg"), 404)
    for name in ("report", "replay"):
        page = server.http.get(f"{base}/{name}")
        assert page.headers["content-type"].startswith("text/html")
        assert "sandbox allow-scripts" in page.headers["content-security-policy"]
        assert "allow-same-origin" not in page.headers["content-security-policy"]
        etag = page.headers["etag"]
        assert server.http.get(f"{base}/{name}", headers={"If-None-Match": etag}).status_code == 304


def test_runs_are_listed_page_by_page_and_found_by_words(server: Server) -> None:
    numbers = [server.run(scenario={"duration": 0.01, "name": f"listed {i}"})["id"] for i in range(3)]
    page = server.http.get("/v1/runs", params={"search": "LISTED", "limit": 2}).json()
    assert [row["id"] for row in page["items"]] == [numbers[2], numbers[1]]
    rest = server.http.get("/v1/runs", params={"search": "listed", "limit": 2, "after": page["next"]}).json()
    assert [row["id"] for row in rest["items"]] == [numbers[0]]
    assert rest["next"] is None
    assert server.http.get("/v1/runs", params={"search": "listed", "status": "failed"}).json()["items"] == []
    assert server.http.get("/v1/runs", params={"search": "100%_"}).json()["items"] == []


def test_a_run_that_fails_says_why_in_the_words_of_the_command_line(server: Server) -> None:
    run = server.run(scenario={"pose": "nowhere", "duration": 0.1})
    assert run["status"] == "failed"
    assert "'nowhere'" in run["error"]["what"]
    assert run["error"]["type"].startswith("urn:drillrig:error:")
    found = problem(server.http.get(f"/v1/runs/{run['id']}/result"), 409)
    assert "failed" in found["detail"]
    assert "'nowhere'" in found["detail"]


@pytest.mark.parametrize(
    ("request_", "field", "words"),
    [
        ({"scenario": {"duration": -1}}, "scenario.duration", "scenario.duration = -1 should be greater than 0"),
        ({"scenario": {"durration": 1}}, "scenario.durration", "Did you mean 'duration'"),
        ({"scenario": {"integrator": {"rtol": 1}}}, "scenario.integrator.rtol", "less than or equal to 0.01"),
        ({"scenario": {"model": "mkz49"}}, "scenario.model", "beside the scenario"),
        ({"scenario": {"duration": 1e3}}, "scenario.duration", "samples"),
        ({"scenario": {"integrator": {"method": "RK4", "step": 1e-12}}}, "scenario.integrator.step", "steps"),
        ({"arguments": {"boom_lenght": 2}}, "arguments.boom_lenght", "Did you mean 'boom_length'"),
        ({"arguments": {"boom_length": "2*3"}}, "arguments.boom_length", "not a finite number"),
        ({"arguments": {"boom_length": True}}, "arguments.boom_length", "True should be a valid number"),
        ({"colour": "red"}, "colour", "no field 'colour'"),
    ],
)
def test_a_request_that_cannot_be_used_is_refused_with_its_field(
    server: Server, request_: Json, field: str, words: str
) -> None:
    found = problem(server.http.post("/v1/runs", json=request_), 422)
    assert found["field"] == field
    assert words in found["detail"]


def test_what_is_not_there_is_a_problem_too(server: Server) -> None:
    problem(server.http.get("/v1/runs/" + "0" * 32), 404)
    problem(server.http.get("/v1/runs/latest"), 404)
    problem(server.http.get("/nothing"), 404)
    problem(server.http.put("/v1/runs"), 405)
    found = problem(server.http.post("/v1/runs", json={"model": "mkz50"}), 404)
    assert "Did you mean 'mkz49'" in found["detail"]
    assert found["field"] == "model"


def test_a_model_shows_its_numbers_its_faults_and_its_text(server: Server) -> None:
    (model,) = server.http.get("/v1/models").json()
    assert (model["name"], model["joints"][0], model["poses"]) == ("mkz49", "boom_swing", ["hole_9"])
    rows = {row["name"]: row for row in server.http.get("/v1/models/mkz49/parameters").json()}
    assert (rows["boom_length"]["value"], rows["boom_length"]["unit"]) == (1.94, "m")
    assert rows["boom_length"]["source"].startswith("paper:")
    assert rows["rock_stiffness"]["assumed"]
    ranged = [row for row in rows.values() if row["usual"] is not None]
    assert len(ranged) >= 15
    assert all(row["usual"]["low"] <= row["value"] <= row["usual"]["high"] for row in ranged)
    assert all(row["usual"]["source"] for row in ranged)
    assert rows["rock_mode"]["choices"] == ["bilateral", "unilateral"]
    assert sum(row["assumed"] for row in rows.values()) == model["assumed"]
    checked = server.http.post("/v1/models/mkz49/check", json={"arguments": {"boom_lift_rod": 0.2}}).json()
    assert checked["errors"] > 0
    text = server.http.post("/v1/models/mkz49/urdf", json={"arguments": {"boom_length": 2.1}}).text
    assert re.search(r'name="boom_length" [^>]*value="2.1"', text)


def test_an_uploaded_model_runs_like_one_of_the_library(server: Server) -> None:
    text = server.http.post("/v1/models/mkz49/urdf", json={}).content
    sent = server.http.post("/v1/uploads", content=text, headers={"Content-Type": "application/xml"})
    assert sent.status_code == 201
    model = sent.json()["model"]
    assert (sent.json()["name"], sent.json()["links"]) == ("mkz49", 13)
    assert sent.json() in server.http.get("/v1/uploads").json()
    run = server.run(model=model, scenario={"duration": 0.02})
    assert run["status"] == "completed", run
    problem(server.http.post("/v1/runs", json={"model": model, "arguments": {"boom_length": 2}}), 422)
    assert server.http.post(f"/v1/models/{model}/check", json={}).json()["errors"] == 0
    assert server.http.delete(f"/v1/uploads/{sent.json()['id']}").status_code == 204
    problem(server.http.post("/v1/runs", json={"model": model}), 404)
    assert server.http.get(f"/v1/runs/{run['id']}/metrics").status_code == 200


def test_two_runs_are_compared_in_the_words_of_the_command(server: Server, short: Json) -> None:
    other = server.run(arguments={"rock_stiffness": 3e6}, scenario={"duration": 0.1, "name": "short"})
    found = server.http.get("/v1/compare", params={"a": short["id"], "b": other["id"]}).json()
    assert [row["name"] for row in found["differences"] if row["kind"] == "parameter"] == ["rock_stiffness"]
    assert found["runs"] == [short["id"], other["id"]]


def test_progress_is_told_while_it_goes_on_and_its_end_once(server: Server) -> None:
    number = server.submit(scenario={"duration": 2.0, "engine": "python", "name": "slow"})["id"]
    events = []
    with server.http.stream("GET", f"/v1/runs/{number}/events") as answer:
        assert answer.headers["content-type"].startswith("text/event-stream")
        for line in answer.iter_lines():
            if line.startswith("event: "):
                events.append([line.removeprefix("event: ")])
            elif line.startswith("data: "):
                events[-1].append(json.loads(line.removeprefix("data: "))["progress"])
            if len(events) > 4 and events[-1][0] == "progress":
                server.http.post(f"/v1/runs/{number}/cancel")
    assert [name for name, _ in events].count("done") == 1
    assert events[-1][0] == "done"
    shares = [share for name, share in events if name == "progress"]
    assert shares == sorted(shares)
    assert shares[-1] > 0


def test_a_run_can_be_stopped_asked_for_again_and_forgotten(server: Server) -> None:
    request = {"scenario": {"duration": 20.0, "engine": "python", "name": "stopped"}}
    number = server.submit(**request)["id"]
    assert server.http.post(f"/v1/runs/{number}/cancel").json()["status"] == "cancelled"
    assert server.submit(**request)["status"] in ("queued", "running")
    assert server.http.delete(f"/v1/runs/{number}").status_code == 204
    problem(server.http.get(f"/v1/runs/{number}"), 404)
    assert not (server.data / "runs" / number).exists()


def test_a_study_is_carried_out_and_ends_in_a_table(server: Server) -> None:
    study = {
        "name": "frequencies",
        "scenario": {"duration": 0.3},
        "axes": [{"name": "model.percussion_frequency", "list": [48, 50]}],
        "metrics": ["S.across.rms"],
    }
    first = server.http.post("/v1/studies", json=study)
    assert first.status_code == 202
    number = first.json()["id"]
    assert first.json()["cases"] == 2
    ended = server.ended(number, "studies")
    assert (ended["status"], ended["done"], ended["statuses"]) == ("completed", 2, {"completed": 2})
    table = server.http.get(f"/v1/studies/{number}/table").json()
    assert table["inputs"] == ["model.percussion_frequency"]
    assert table["metrics"] == ["S.across.rms"]
    column = table["columns"].index("S.across.rms")
    values = [row[column] for row in table["rows"]]
    assert ended["worst"]["value"] == max(values)
    assert server.http.post("/v1/studies", json=study).status_code == 200
    text = server.http.get(f"/v1/studies/{number}/table", params={"format": "csv"}).text
    assert len(text.splitlines()) == 3
    parquet = server.http.get(f"/v1/studies/{number}/table", params={"format": "parquet"}).content
    assert parquet.startswith(b"PAR1")
    report = server.http.get(f"/v1/studies/{number}/report")
    assert report.status_code == 200, report.text[:300]
    assert "sandbox" in report.headers["content-security-policy"]
    assert "frequencies" in report.text


@pytest.mark.parametrize(
    ("study", "field"),
    [
        ({"scenario": "/etc/passwd"}, "scenario"),
        ({"scenario": {"model": "/etc/passwd"}}, "scenario.model"),
        ({"set": {"scenario.model": "/etc/passwd"}}, "set.scenario.model"),
        ({"axes": [{"name": "scenario.model", "list": ["/etc/passwd"]}]}, "axes"),
        ({"axes": [{"name": "model.cylinder_law", "list": ["${1}"]}]}, "arguments.cylinder_law"),
        ({"set": {"scenario.arguments.cylinder_law": "${1}"}}, "arguments.cylinder_law"),
        ({"axes": [{"name": "model.boom_length", "range": {"start": 1, "stop": 2, "count": 999999}}]}, "axes"),
        ({"axes": [{"name": "scenario.duration", "list": [1e3]}]}, "scenario.duration"),
    ],
)
def test_a_study_names_no_file_no_other_model_and_no_expression(server: Server, study: Json, field: str) -> None:
    assert problem(server.http.post("/v1/studies", json=study), 422)["field"] == field


def test_scenarios_and_their_fields_are_described(server: Server) -> None:
    names = {row["name"]: row["scenario"] for row in server.http.get("/v1/scenarios").json()}
    assert names["hole_9_printed_tip"]["targets"] == {"face.y": 0.35, "face.z": 1.71}
    run = server.http.post("/v1/runs", json={"scenario": {**names["hole_9"], "duration": 0.01}})
    assert run.status_code == 202
    fields = server.http.get("/v1/schema/scenario").json()["properties"]
    assert fields["duration"]["description"] == "simulated time [s]"
    assert fields["duration"]["exclusiveMinimum"] == 0
    assert "model" not in fields


def test_every_operation_is_described(server: Server) -> None:
    document = server.http.get("/openapi.json").json()
    for path, item in document["paths"].items():
        for method, operation in item.items():
            assert operation["description"], f"{method} {path}"
            assert "4XX" in operation["responses"], f"{method} {path}"
            for parameter in operation.get("parameters", []):
                assert parameter.get("description"), f"{method} {path} {parameter['name']}"


def test_operators_see_requests_and_jobs_but_no_secrets(server: Server, short: Json) -> None:
    server.http.get("/v1/runs", params={"search": "a-secret-word"}, headers={"X-Request-ID": "named-by-me"})
    lines = [json.loads(line) for line in server.log.read_text().splitlines() if line.startswith("{")]
    (line,) = [line for line in lines if line.get("request_id") == "named-by-me"]
    assert (line["method"], line["path"], line["status"]) == ("GET", "/v1/runs", 200)
    assert "a-secret-word" not in server.log.read_text()
    assert [line["step"] for line in lines if line.get("id") == short["id"]] == ["queued", "running", "completed"]
    text = server.http.get("/metrics").text
    assert 'drillrig_job_steps_total{kind="run",step="completed"}' in text
    assert 'route="/v1/runs/{id}"' in text


def test_the_page_and_its_files_come_from_this_server_alone(server: Server) -> None:
    page = server.http.get("/")
    assert page.status_code == 200
    policy = page.headers["content-security-policy"]
    assert "default-src 'none'" in policy
    assert "script-src 'self';" in policy
    assert page.headers["x-content-type-options"] == "nosniff"
    assert server.http.get("/", headers={"If-None-Match": page.headers["etag"]}).status_code == 304
    for name in ("../serve.py", "..%2fserve.py", "/etc/passwd", "%2e%2e/serve.py"):
        assert server.http.get(f"/static/{name}").status_code == 404
    assert shipped_folder().is_dir()
