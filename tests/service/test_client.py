"""The client: the same verbs, the same results and the same errors as on this machine."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from serving import Server

import drillrig_pin
from drillrig_pin.client import Client, ServerError, connect
from drillrig_pin.errors import ModelError, ScenarioError
from drillrig_pin.model.modelfile import read_model


@pytest.fixture(scope="module")
def there(server: Server) -> Client:
    """The session's server, as a script holds it."""
    return connect(server.url)


def script(drillrig: object) -> drillrig_pin.Trajectory:
    """A script that does not say where it runs."""
    rig = drillrig.load_rig("mkz49", boom_length=2.0)  # type: ignore[attr-defined]
    case = drillrig.Scenario(duration=0.05, name="moved")  # type: ignore[attr-defined]
    return drillrig.simulate(rig, case)  # type: ignore[attr-defined, no-any-return]


def test_a_script_moves_to_a_server_by_one_line_and_gets_the_same_numbers(there: Client) -> None:
    here, remote = script(drillrig_pin), script(there)
    assert remote.content_hash == here.content_hash
    assert remote.arguments == here.arguments
    np.testing.assert_array_equal(remote.point_displacement, here.point_displacement)


def test_many_cases_come_back_in_their_order_and_progress_is_told(there: Client) -> None:
    rig = there.load_rig("mkz49")
    cases = [(rig, there.Scenario(duration=duration)) for duration in (0.03, 0.01, 0.02)]
    assert there.simulate_many(cases, keep=lambda run: round(float(run.time[-1]), 3)) == [0.03, 0.01, 0.02]
    times: list[float] = []
    there.simulate(rig, there.Scenario(duration=0.2, engine="python"), times.append)
    assert times[-1] == pytest.approx(0.2)
    assert times == sorted(times)


def test_a_plain_model_of_this_machine_is_sent_along_and_xacro_is_not(there: Client, tmp_path: Path) -> None:
    path = tmp_path / "mine.urdf"
    path.write_text(read_model("mkz49", {"boom_length": 2.05}).text)
    rig = there.load_rig(path)
    assert rig.name.startswith("upload:")
    assert there.simulate(rig, there.Scenario(duration=0.01)).outcome.completed
    assert there.check_model(path)["errors"] == 0
    with pytest.raises(ModelError, match="takes no xacro"):
        there.load_rig("rig.urdf.xacro")
    for run in there.runs(rig.name):
        there._answer("DELETE", f"/v1/runs/{run['id']}")
    there._answer("DELETE", f"/v1/uploads/{rig.name.removeprefix('upload:')}")


def test_errors_are_those_of_the_local_verbs(there: Client) -> None:
    rig = there.load_rig("mkz49")
    with pytest.raises(ScenarioError, match="'nowhere'"):
        there.simulate(rig, there.Scenario(pose="nowhere", duration=0.02))
    with pytest.raises(ModelError, match="Did you mean 'boom_length'") as told:
        there.submit(there.load_rig("mkz49", boom_lenght=1), there.Scenario())
    assert told.value.field == "arguments.boom_lenght"
    with pytest.raises(ScenarioError, match=r"scenario\.duration = -1"):
        there.Scenario(duration=-1)
    with pytest.raises(ServerError, match="no model named 'mkz50'") as refused:
        there.load_rig("mkz50")
    assert refused.value.status == 404
    with pytest.raises(ServerError, match="cannot be reached"):
        connect("http://127.0.0.1:9")


def test_runs_are_listed_measured_and_compared(there: Client) -> None:
    rig = there.load_rig("mkz49")
    a, b = (there.submit(rig, there.Scenario(duration=0.1 * i, name="asked by a client")) for i in (1, 2))
    there.simulate_many([(rig, there.Scenario(duration=0.1 * i, name="asked by a client")) for i in (1, 2)])
    assert [row["id"] for row in there.runs("asked by a client")] == [b["id"], a["id"]]
    assert there.metrics(a["id"])["quantities"]
    assert there.compare(a["id"], b["id"])["differences"][0]["name"] == "duration"
    assert there.run(a["id"])["status"] == "completed"


def test_a_study_is_carried_out_there_and_its_table_brought_here(there: Client, tmp_path: Path) -> None:
    import pyarrow.parquet

    study = {
        "scenario": {"duration": 0.2},
        "axes": [{"name": "model.rock_stiffness", "list": [2e6, 3e6]}],
        "metrics": ["S.across.rms"],
    }
    table = there.run_study(study, tmp_path / "table.parquet")
    assert pyarrow.parquet.read_table(table).column("model.rock_stiffness").to_pylist() == [2e6, 3e6]
