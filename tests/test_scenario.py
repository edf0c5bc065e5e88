"""The case: validated, with defaults, from YAML or keywords; what is wrong is one sentence with the field."""

from __future__ import annotations

from pathlib import Path

import pytest
from rigs import double_pendulum

from drillrig_pin import Rig, Scenario, ScenarioError, load_rig_text, load_scenario, simulate


def refused(tmp_path: Path, text: str | bytes) -> str:
    path = tmp_path / "case.yaml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(ScenarioError) as caught:
        load_scenario(path)
    sentence = str(caught.value)
    assert "case.yaml" in sentence
    assert "\n" not in sentence
    return sentence


def test_the_default_is_hole_9_for_ten_seconds_at_one_kilohertz() -> None:
    case = Scenario()
    assert (case.name, case.model, case.duration, case.output_rate) == ("hole_9", "mkz49", 10.0, 1000.0)
    assert load_scenario("hole_9").duration == 10.0


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("duraton: 5", ("no field 'duraton'", "Did you mean 'duration'", "output_rate")),
        ("integrator:\n  metod: RK4", ("no field 'integrator.metod'", "Did you mean 'method'")),
        ("stabilization:\n  alfa: 3", ("no field 'stabilization.alfa'", "Did you mean 'alpha'")),
        ("duration: long", ("scenario.duration", "'long'", "number")),
        ("duration: -1", ("scenario.duration", "greater than 0")),
        ("duration: .nan", ("scenario.duration", "finite")),
        ("duration: .inf", ("scenario.duration", "finite")),
        ("output_rate: 0", ("scenario.output_rate", "greater than 0")),
        ("integrator:\n  method: Euler", ("scenario.integrator.method", "'Euler'", "DOP853")),
        ("integrator:\n  rtol: 1e-20", ("scenario.integrator.rtol",)),
        ("integrator: RK4", ("scenario.integrator",)),
        ("formulation: lagrange", ("'multipliers', 'null_space' or 'damped'",)),
        ("loads: [3]", ("scenario.loads",)),
        ("positions:\n  boom_lift: high", ("scenario.positions.boom_lift",)),
        ("velocities:\n  boom_lift: .nan", ("scenario.velocities.boom_lift", "finite")),
        ("duration: 1e9\noutput_rate: 1e9", ("samples",)),
        ("integrator:\n  method: LSODA\nstabilization:\n  projection: true", ("LSODA", "projection")),
        ("- 1\n- 2", ("field: value",)),
        ("hello", ("field: value",)),
        ("1: 2", ("field: value",)),
        ("a: [1", ("YAML",)),
        ("a: !!python/object/apply:os.system [ls]", ("YAML",)),
        ("a: &x [1]\nb: *x", ("aliases",)),
        (b"\xff\xfe\x00", ("YAML",)),
        ("[" * 500_000, ("YAML", "nested deeper")),
        ("text: " + "x" * 2_000_000, ("larger than 1 MB",)),
        ("text: " + "x" * 20_000, ("scenario.text",)),
    ],
)
def test_faults_of_a_scenario_are_one_sentence_with_the_field(
    tmp_path: Path, text: str | bytes, words: tuple[str, ...]
) -> None:
    sentence = refused(tmp_path, text)
    for word in words:
        assert word in sentence, sentence
    assert len(sentence) < 600


def test_an_alias_bomb_is_refused_before_it_unfolds(tmp_path: Path) -> None:
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]" for i in range(1, 10)]
    assert "aliases" in refused(tmp_path, "\n".join(lines))


def test_a_scenario_that_is_not_there_is_said(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match="cannot be read"):
        load_scenario(tmp_path / "none.yaml")
    with pytest.raises(ScenarioError, match=r"no scenario named 'hole_8'.*Did you mean 'hole_9'"):
        load_scenario("hole_8")


def test_an_empty_file_is_refused_and_one_field_makes_a_case(tmp_path: Path) -> None:
    (tmp_path / "mine.yaml").write_text("# nothing\n")
    assert "holds nothing" in refused(tmp_path, "# nothing\n")
    (tmp_path / "mine.yaml").write_text("name: mine\n")
    assert load_scenario(tmp_path / "mine.yaml") == Scenario(name="mine")


def test_changes_are_given_by_dotted_names(tmp_path: Path) -> None:
    (tmp_path / "mine.yaml").write_text("integrator:\n  method: RK4\n")
    case = load_scenario(
        tmp_path / "mine.yaml", **{"integrator.step": 1e-4, "positions.boom_lift": 1.2, "targets.face.y": 0.3}
    )
    assert (case.integrator.method, case.integrator.step) == ("RK4", 1e-4)
    assert case.positions == {"boom_lift": 1.2}
    assert case.targets == {"face.y": 0.3}
    assert case.changed({"duration": 2.0}).integrator == case.integrator
    with pytest.raises(ScenarioError, match=r"no field 'integrator\.stp'"):
        case.changed({"integrator.stp": 1.0})
    with pytest.raises(ScenarioError, match="'duration' has no fields"):
        case.changed({"duration.x": 1.0})


def test_a_scenario_cannot_be_changed_by_accident() -> None:
    from pydantic import ValidationError

    with pytest.raises(ValidationError):
        Scenario().duration = 3.0


@pytest.mark.parametrize(
    ("case", "words"),
    [
        ({"pose": "hole_8"}, "no pose 'hole_8'.*Did you mean 'hole_9'"),
        ({"positions": {"boom_lft": 1.0}}, "no moving joint 'boom_lft'.*Did you mean 'boom_lift'"),
        ({"positions": {"boom_lift": [1.0, 2.0]}}, "'boom_lift' takes 1 values, not 2"),
        ({"velocities": {"boom_lft": 1.0}}, "no dof 'boom_lft'.*Did you mean 'boom_lift'"),
        ({"loads": ["drilling_forse"]}, "no load 'drilling_forse'.*Did you mean 'drilling_force'"),
    ],
)
def test_a_scenario_that_does_not_fit_the_model_names_what_would(
    mkz49: Rig, case: dict[str, object], words: str
) -> None:
    with pytest.raises(ScenarioError, match=words):
        simulate(mkz49, Scenario(duration=0.1, **case))


def test_a_pose_of_the_model_with_some_joints_set_otherwise() -> None:
    pose = '<pose name="up"><joint name="shoulder" position="0.5"/><joint name="elbow" position="0.25"/></pose>'
    rig = load_rig_text(double_pendulum(pose))
    run = simulate(rig, Scenario(duration=0.001, positions={"elbow": -0.5}))
    assert run.q[0].tolist() == [0.5, -0.5], "the first pose is the default, single joints go before it"
