"""A scenario, a study or a command line locks joints: they stand where its pose and positions put them."""

from __future__ import annotations

import json
import shlex
from pathlib import Path

import numpy as np
import pytest
from command import Command, one_sentence
from hypothesis import given, settings
from hypothesis import strategies as st
from rigs import joint, link, robot
from test_locks import ENGINES, SWING, carrier

from drillrig_pin import ModelError, Scenario, ScenarioError, load_rig_text, simulate
from drillrig_pin.batch.again import recall
from drillrig_pin.batch.table import read_table
from drillrig_pin.errors import LockedError
from drillrig_pin.fitting import fitted
from drillrig_pin.model.modelfile import read_model_text
from drillrig_pin.report.provenance import asks_the_same, command
from drillrig_pin.service.worker import Order, carry_out
from drillrig_pin.trajectory import load_trajectory

POSES = (
    '<pose name="road"><joint name="outrigger_pin" position="-1.5"/></pose>'
    '<pose name="work"><joint name="outrigger_pin" position="0.4"/></pose>'
)
LOCK = ["wheel_.*", "outrigger_pin"]


@pytest.fixture
def model(tmp_path: Path) -> Path:
    path = tmp_path / "carrier.urdf"
    path.write_text(carrier(POSES))
    return path


def chain(n: int) -> str:
    """n arms, one on the end of the other, turning about y."""
    arms = [
        link(f"arm_{i}", 10.0 + i, (0.4, 0, 0.1), (0.1, 0.7, 0.8))
        + joint(f"pin_{i}", "revolute", f"arm_{i - 1}" if i else "world", f"arm_{i}", (float(i > 0), 0, 0), (0, 1, 0))
        for i in range(n)
    ]
    return robot(*arms)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_scenario_locks_as_if_the_joints_were_fixed_by_hand(engine: str) -> None:
    case = Scenario(**SWING, engine=engine, lock=LOCK, positions={"outrigger_pin": 0.7})
    run = simulate(load_rig_text(carrier("")), case)
    by_hand = load_rig_text(carrier('<lock joints="wheel_axle"/>', "fixed", (0, 0.7, 0)))
    fixed = simulate(by_hand, Scenario(**SWING, engine=engine))
    assert run.labels["joint"] == ["boom_pin"]
    # The same machine, its inertias added in another order.
    np.testing.assert_allclose(run.q, fixed.q, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(run.point_position, fixed.point_position, atol=1e-9)
    assert "locked joints: outrigger_pin at 0.7 rad, wheel_axle at 0 rad" in run.notes


@pytest.mark.parametrize("engine", ENGINES)
def test_a_locked_pendulum_swings_with_the_period_of_a_compound_pendulum(engine: str) -> None:
    """Two point masses 1 m apart on one line, the second pin locked: omega^2 = g (m l + m 2 l) / (m l^2 + m 4 l^2)."""
    arms = [
        link(f"arm_{i}", 1.0, (0, 0, -1), (1e-9, 1e-9, 1e-9))
        + joint(f"pin_{i}", "revolute", f"arm_{i - 1}" if i else "world", f"arm_{i}", (0, 0, -float(i > 0)), (0, 1, 0))
        for i in range(2)
    ]
    omega = np.sqrt(9.81 * 3.0 / 5.0)
    case = Scenario(lock=["pin_1"], duration=2.0, output_rate=100, positions={"pin_0": 1e-4}, engine=engine)
    run = simulate(load_rig_text(robot(*arms)), case)
    # sin(q) = q - q^3/6: 1e-8 of the angle; 1e-6 leaves room for the integration.
    np.testing.assert_allclose(run.q[:, 0], 1e-4 * np.cos(omega * run.time), atol=1e-4 * 1e-6)


@settings(max_examples=12, deadline=None)
@given(st.data())
def test_any_choice_of_locked_arms_is_the_machine_with_these_joints_in_its_file(data: st.DataObject) -> None:
    n = data.draw(st.integers(2, 5))
    free = data.draw(st.integers(0, n - 1))
    locked = [i for i in data.draw(st.sets(st.integers(0, n - 1), min_size=1)) if i != free] or [(free + 1) % n]
    at = {f"pin_{i}": data.draw(st.floats(-1.5, 1.5)) for i in range(n)}
    fields = {"positions": at, "duration": 0.05, "output_rate": 100}
    run = simulate(load_rig_text(chain(n)), Scenario(**fields, lock=[f"pin_[{''.join(map(str, locked))}]"]))
    rows = "".join(f'<lock joints="pin_{i}" position="{at[f"pin_{i}"]!r}"/>' for i in locked)
    written = load_rig_text(chain(n).replace("<drillrig>", f"<drillrig>{rows}"))
    np.testing.assert_array_equal(run.q, simulate(written, Scenario(**fields)).q)
    assert load_rig_text(run.model).locked == {f"pin_{i}": at[f"pin_{i}"] for i in sorted(locked)}


def test_a_result_with_locks_runs_again_and_its_model_is_complete(tmp_path: Path) -> None:
    case = Scenario(**SWING, lock=LOCK, pose="work")
    run = simulate(load_rig_text(carrier(POSES)), case)
    run.save(tmp_path / "run.nc")
    read = load_trajectory(tmp_path / "run.nc")
    rig = load_rig_text(read.model)
    assert rig.locked == {"wheel_axle": 0.0, "outrigger_pin": 0.4}
    # Text, content hash and samples are those of the first run: locks are not written twice.
    assert read_model_text(read.model).text == read.model
    again = simulate(rig, read.scenario)
    assert again.content_hash == run.content_hash
    np.testing.assert_array_equal(again.q, run.q)
    with pytest.raises(LockedError, match=r"joint 'outrigger_pin' is locked at 0\.4"):
        simulate(rig, read.scenario.changed({"pose": "road"}))


def test_names_with_signs_of_regular_expressions_and_xml_are_locked_alone() -> None:
    text = chain(3).replace("pin_1", "pin.&quot;&lt;1 a").replace("pin_2", "pinx&quot;&lt;1 a")
    case = Scenario(lock=['pin."<1 a'], duration=0.01)
    rig = fitted(load_rig_text(text.replace("pinx", "pin+")), case)
    assert rig.locked == {'pin."<1 a': 0.0, 'pin+"<1 a': 0.0}
    case = case.changed({"lock": [r'pin\."<1 a']})
    rig = fitted(load_rig_text(text), case)
    assert load_rig_text(rig.file.text).locked == rig.locked == {'pin."<1 a': 0.0}


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"lock": ["whel_axle"]}, "scenario.lock: no moving joint 'whel_axle'"),
        ({"lock": ["[wheel"]}, "scenario.lock: '[wheel' is no regular expression"),
        ({"lock": ["wheel_axle"], "velocities": {"wheel_axle": 1.0}}, "'wheel_axle' is locked and has a velocity"),
    ],
)
def test_locks_of_a_scenario_that_cannot_be_are_one_sentence(fields: dict[str, object], words: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        simulate(load_rig_text(carrier("")), Scenario(**fields))
    assert words in str(caught.value)
    if "whel" in words:
        assert "wheel_axle" in str(caught.value)


def test_an_element_of_a_locked_joint_is_named() -> None:
    with pytest.raises(ModelError, match=r"'hold'.*joint 'boom_pin' is locked"):
        simulate(load_rig_text(carrier("")), Scenario(lock=["boom_pin"]))


def test_a_gear_between_locked_joints_has_nothing_to_do_if_it_fits() -> None:
    text = chain(3).replace(
        'name="pin_2" type="revolute">', 'name="pin_2" type="revolute"><mimic joint="pin_1" multiplier="2"/>'
    )
    start = {"duration": 0.05, "positions": {"pin_1": 0.2}, "lock": ["pin_[12]"]}
    rig = fitted(load_rig_text(text), Scenario(**start))
    assert (rig.locked, rig.constraints) == ({"pin_1": 0.2, "pin_2": 0.4}, ())
    with pytest.raises(ModelError, match="joint 'pin_2' is locked"):
        fitted(load_rig_text(text), Scenario(lock=["pin_2"]))


def test_locks_on_the_command_line(drillrig: Command, model: Path, tmp_path: Path) -> None:
    out = tmp_path / "run.nc"
    options = ("--lock", "wheel_.*", "--lock", "outrigger_pin", "--set", "scenario.pose=work")
    answer = drillrig("run", str(model), *options, "--set", "scenario.duration=0.05", "-o", str(out), "--no-estimate")
    assert "note: locked joints: outrigger_pin at 0.4 rad, wheel_axle at 0 rad" in answer.out
    run = load_trajectory(out)
    assert run.scenario.lock == LOCK
    assert asks_the_same(run)
    told = shlex.split(command(run))[1:]
    again = drillrig(*told, "-o", str(tmp_path / "again.nc"), "--no-estimate")
    assert again.code == answer.code
    assert load_trajectory(tmp_path / "again.nc").content_hash == run.content_hash
    rest = drillrig("static", str(model), *options)
    assert "locked joints: outrigger_pin at 0.4 rad, wheel_axle at 0 rad" in rest.out
    assert drillrig("static", str(model), *options, "--json").document["locked"] == {
        "wheel_axle": 0.0,
        "outrigger_pin": 0.4,
    }
    expanded = drillrig("expand", str(model), "--lock", ".*axle")
    assert load_rig_text(expanded.out).locked == {"wheel_axle": 0.0}
    one_sentence(drillrig("static", str(model), "--lock", "whel.*"), "no moving joint 'whel.*'", "wheel_axle")


def test_check_judges_the_start_with_locked_joints(drillrig: Command, model: Path) -> None:
    bare = drillrig("check", str(model))
    assert "wheel_axle" not in bare.out
    assert "'outrigger_pin' (" in bare.out
    locked = drillrig("check", str(model), "--lock", ["wheel_.*", "outrigger_pin"][0], "--lock", "outrigger_pin")
    assert "'outrigger_pin' (" not in locked.out
    one_sentence(drillrig("check", str(model), "--lock", "nothing"), "no moving joint 'nothing'")


def test_check_says_which_pose_a_lock_of_the_model_contradicts(drillrig: Command, tmp_path: Path) -> None:
    path = tmp_path / "carrier.urdf"
    path.write_text(carrier(POSES + '<lock joints="outrigger_pin"/>'))
    answer = drillrig("check", str(path))
    assert answer.code == 0
    assert "warning: pose 'work' cannot be taken: joint 'outrigger_pin' is locked at -1.5" in answer.out


def test_every_row_of_a_study_is_the_run_with_these_locks(drillrig: Command, model: Path, tmp_path: Path) -> None:
    study = tmp_path / "study.yaml"
    fields = {
        "scenario": {"model": str(model), "duration": 0.2, "output_rate": 100, "lock": ["wheel_axle"]},
        "axes": [{"name": "scenario.positions.outrigger_pin", "list": [0.0, 0.5]}],
        "metrics": ["tip.z.*"],
    }
    study.write_text(json.dumps(fields))
    out = tmp_path / "out"
    answer = drillrig("sweep", str(study), "--lock", "outrigger_pin", "-o", str(out), "--workers", "1")
    assert answer.code == 0, answer.out + answer.err
    assert "note: locked joints: outrigger_pin at -1.5 rad, wheel_axle at 0 rad (in the base scenario)" in answer.err
    table = read_table(out)
    for case, at in enumerate((0.0, 0.5)):
        found = recall(table, case, keep=False)
        assert found.same
        assert load_rig_text(found.trajectory.model).locked == {"wheel_axle": 0.0, "outrigger_pin": at}
    typo = drillrig("sweep", str(study), "--lock", "outriger", "-o", str(tmp_path / "other"))
    one_sentence(typo, "no moving joint 'outriger'", "outrigger_pin")


def test_the_service_locks_in_uploads_and_in_its_own_models(model: Path, tmp_path: Path) -> None:
    case = Scenario(**SWING, lock=LOCK, pose="work")
    runs = []
    for name, text in ((str(model), ""), ("", carrier(POSES))):
        answer = carry_out(Order(name, text, "", {}, case.model_dump(), "", 60.0))
        assert answer.problem is None
        path = tmp_path / "served.nc"
        path.write_bytes(answer.files["run.nc"])
        runs.append(load_trajectory(path))
    for run in runs:
        assert run.labels["joint"] == ["boom_pin"]
        assert "locked joints: outrigger_pin at 0.4 rad, wheel_axle at 0 rad" in run.notes


def test_a_cylinder_over_a_locked_joint_is_idle_and_shares_nothing(drillrig: Command) -> None:
    rest = drillrig("static", "--lock", "boom_extension")
    assert "locked joints: boom_extension at 1.94 m; idle, with both ends on one body: extension_cylinder" in rest.out
    assert "indeterminate" not in rest.out
    assert "lever arm of 0 m" not in rest.out


def test_holes_are_reached_with_a_locked_joint_or_not_at_all(drillrig: Command, tmp_path: Path) -> None:
    study = tmp_path / "holes.yaml"
    places = {"near": {"pose": "hole_9"}, "aside": {"at": [4.048, -0.405, 1.007], "pitch": -27.5}}
    study.write_text(json.dumps({"scenario": "hole_9", "axes": [{"holes": {"places": places}}]}))
    assert "aside is out of reach" not in drillrig("holes", str(study)).out
    answer = drillrig("holes", str(study), "--lock", "boom_extension")
    assert "note: locked joints: boom_extension at 1.94 m" in answer.out
    assert "aside is out of reach" in answer.out
    assert "--lock boom_extension -o holes" in " ".join(answer.out.split())
    # What a study holds fixed may be locked as well.
    study.write_text(json.dumps({"axes": [{"holes": {"fixed": ["boom_extension"], "places": places}}]}))
    assert drillrig("holes", str(study), "--lock", "boom_extension", "--json").document["poses"]["near"]
