"""Files that are hostile, broken or slightly wrong end in success or in one of the package's own errors."""

from __future__ import annotations

import json
import time
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from fuzz import seeds
from fuzz.campaign import campaign, told
from fuzz.kinds import SPOILED, files_of, use_journal, use_measurement, use_model, use_result, use_scenario, use_study
from fuzz.moment import WarnedError, moment, no_warning
from fuzz.oracle import DisagreementError, NotFiniteError, compare_engines, look_at
from rigs import double_pendulum, pendulum, point

from drillrig_pin import (
    AssemblyError,
    DrillrigError,
    ModelError,
    ResultFileError,
    Scenario,
    ScenarioError,
    load_rig_text,
    simulate,
)
from drillrig_pin.batch.cases import unfold
from drillrig_pin.batch.study import load_study
from drillrig_pin.trajectory import ESTIMATE


def test_the_files_that_are_spoiled_are_sound(tmp_path: Path) -> None:
    for i, text in enumerate(seeds.models()):
        (tmp_path / f"{i}.urdf").write_bytes(text)
        use_model(tmp_path / f"{i}.urdf")
    for name, data in {
        **seeds.XACRO,
        "tabled.urdf": seeds.model_with_table(),
        **{f"case_{i}.yaml": text for i, text in enumerate(seeds.SCENARIOS)},
        **{f"study_{i}.yaml": text for i, text in enumerate(seeds.STUDIES)},
        "limits.yaml": seeds.LIMITS,
        "gauge.csv": seeds.MEASUREMENT,
        "run.nc": seeds.result(),
    }.items():
        (tmp_path / name).write_bytes(data)
    use_model(tmp_path / "tabled.urdf")
    use_model(tmp_path / "rig.urdf.xacro")
    for i in range(len(seeds.SCENARIOS)):
        use_scenario(tmp_path / f"case_{i}.yaml")
    for i in range(len(seeds.STUDIES)):
        use_study(tmp_path / f"study_{i}.yaml")
    use_measurement(tmp_path / "gauge.csv")
    use_result(tmp_path / "run.nc")


def test_spoiled_files_end_in_success_or_in_an_error_of_the_package() -> None:
    summary = campaign(2000)
    assert not summary.findings, told(summary)
    assert set(summary.kinds) == {kind.name for kind in SPOILED}
    assert summary.inputs == 2000


def test_an_input_follows_from_its_seed_and_number() -> None:
    for table in ("spoiled", "legal"):
        assert [files_of(3, n, table) for n in range(40)] == [files_of(3, n, table) for n in range(40)]
        assert [files_of(3, n, table) for n in range(40)] != [files_of(4, n, table) for n in range(40)]


def test_a_moment_is_one_of_computing_and_not_of_waiting() -> None:
    with moment(0.05) as waited:
        time.sleep(0.3)
    assert not waited.over
    with moment(0.05) as computed:
        while True:
            pass
    assert computed.over


def test_the_oracle_hears_what_a_run_does_not_say(tmp_path: Path) -> None:
    rig = load_rig_text(double_pendulum())
    run = simulate(rig, Scenario(duration=0.02, output_rate=500))
    look_at(run, 1, tmp_path)
    energy = np.where(run.time > 0.01, np.nan, run.energy_kinetic)
    with pytest.raises(NotFiniteError, match="energy_kinetic"):
        look_at(replace(run, arrays={**run.arrays, "energy_kinetic": energy}), 1, tmp_path)
    short = replace(run, outcome=replace(run.outcome, time=0.01))
    with pytest.raises(NotFiniteError, match="ends at"):
        look_at(short, 1, tmp_path)
    moved = replace(run, arrays={**run.arrays, "q": run.q * 1.01})
    with pytest.raises(DisagreementError, match="differ"):
        compare_engines(rig, moved, finer=lambda _, each: replace(each, cost={**each.cost, ESTIMATE: 1e-12}))
    with pytest.raises(WarnedError, match="divide by zero"), no_warning():
        np.ones(1) / np.zeros(1)


def test_a_load_table_that_no_spline_can_follow_is_refused(tmp_path: Path) -> None:
    for line, words in (
        ("0.02,1e301", "line 4 .* beyond"),
        ("0.01000000000000001,1\n0.01000000000000002,2", "does not increase at line 5"),
    ):
        rows = seeds.LOAD_TABLE.decode().splitlines()
        rows[3] = line
        (tmp_path / "rig.urdf").write_bytes(seeds.model_with_table())
        (tmp_path / "push.csv").write_text("\n".join(rows))
        with pytest.raises(ModelError, match=words):
            use_model(tmp_path / "rig.urdf")
    (tmp_path / "push.csv").write_bytes(seeds.LOAD_TABLE)
    (tmp_path / "rig.urdf").write_bytes(seeds.model_with_table().replace(b'scale="2"', b'scale="1e300"'))
    with pytest.raises(ModelError, match="scale"):
        use_model(tmp_path / "rig.urdf")


def test_a_start_that_is_no_finite_number_is_refused_before_the_run(tmp_path: Path) -> None:
    spring = point("Q", "world", (0.7, 0, 0)) + '<spring name="s" from="Q" to="P" stiffness="1"/>'
    (tmp_path / "rig.urdf").write_text(pendulum(extension=spring))
    with pytest.raises(AssemblyError, match=r"no finite numbers.*coincide"):
        use_model(tmp_path / "rig.urdf")
    (tmp_path / "case.yaml").write_text("targets: {face.z: -1.0e+308}\nduration: 0.01")
    # A size that no machine has is told where it was read, before anything is assembled.
    with pytest.raises(ScenarioError, match=r"case.yaml:1: scenario.targets = .*face.z.* is beyond 1e\+30"):
        use_scenario(tmp_path / "case.yaml")


@pytest.mark.parametrize(
    ("name", "value"),
    [("q", 0.0), ("reaction", np.zeros(())), ("energy_elastic", np.zeros(2)), ("time", np.zeros((11, 2)))],
)
def test_arrays_of_a_result_that_do_not_fit_its_samples_and_names_are_refused(
    tmp_path: Path, name: str, value: object
) -> None:
    (tmp_path / "run.nc").write_bytes(seeds.result())
    with h5py.File(tmp_path / "run.nc", "r+") as file:
        del file[name]
        file[name] = value
    with pytest.raises(ResultFileError, match="not readable as a result file"):
        use_result(tmp_path / "run.nc")


@pytest.mark.parametrize(
    ("name", "value"),
    [("cost", "5"), ("versions", "[]"), ("notes", "1"), ("arguments", "x"), ("format", np.zeros(3)),
     ("model", b"<robot name='\xf4'/>"), ("cause", b"\xf4")],
    ids=str,
)  # fmt: skip
def test_words_of_a_result_of_another_kind_are_refused(tmp_path: Path, name: str, value: object) -> None:
    (tmp_path / "run.nc").write_bytes(seeds.result())
    with h5py.File(tmp_path / "run.nc", "r+") as file:
        file.attrs.create(name, value, dtype=h5py.string_dtype() if isinstance(value, bytes) else None)
    with pytest.raises(ResultFileError):
        use_result(tmp_path / "run.nc")


ANSWER = json.loads(seeds.JOURNAL.splitlines()[0])


@pytest.mark.parametrize(
    "change",
    [{"metrics": "x"}, {"metrics": {"a": {}}}, {"found": 3}, {"key": 5}, {"key": []}, {"status": 1.5},
     {"wall_time": "1"}, {"units": ["a"]}],
    ids=str,
)  # fmt: skip
def test_a_journal_with_an_answer_of_another_kind_names_the_file_to_remove(
    tmp_path: Path, change: dict[str, object]
) -> None:
    (tmp_path / "000001-a.jsonl").write_text(json.dumps(ANSWER | change))
    with pytest.raises(ResultFileError, match=r"000001-a\.jsonl: the journal is damaged.*Remove this file"):
        use_journal(tmp_path)


def test_a_name_of_thousands_of_letters_does_not_drown_the_sentence(tmp_path: Path) -> None:
    (tmp_path / "rig.urdf").write_text(double_pendulum().replace('link="upper"', f'link="{"1" * 5000}"'))
    with pytest.raises(ModelError) as caught:
        use_model(tmp_path / "rig.urdf")
    assert "no link '111" in str(caught.value)
    assert len(str(caught.value)) < 2000


def test_a_model_with_a_name_too_long_for_a_file_is_not_there(tmp_path: Path) -> None:
    (tmp_path / "study.yaml").write_text(f"model: {'a' * 5000}.urdf\nscenario: {{duration: 0.01}}")
    with pytest.raises(DrillrigError, match="no such model file"):
        use_study(tmp_path / "study.yaml")


def test_a_study_of_more_than_a_million_cases_is_refused_before_they_are_laid_out(tmp_path: Path) -> None:
    for name, data in seeds.XACRO.items():
        (tmp_path / name).write_bytes(data)
    span = "{start: 1, stop: 2, count: 1001}"
    (tmp_path / "study.yaml").write_text(
        f"model: rig.urdf.xacro\naxes:\n  - grid: {{model.mass: {span}, scenario.duration: {span}}}"
    )
    with pytest.raises(ScenarioError, match="more than"):
        unfold(load_study(tmp_path / "study.yaml"))


HOSTILE = {
    "a bomb of entities": '<!DOCTYPE r [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;">]><robot name="&b;"/>',
    "an external entity": '<!DOCTYPE r [<!ENTITY a SYSTEM "file:///etc/passwd">]><robot name="r">&a;</robot>',
    "an external definition": '<!DOCTYPE r SYSTEM "http://127.0.0.1/x.dtd"><robot name="r"/>',
    "a nest": "<robot name='r'>" + "<x>" * 100_000 + "</x>" * 100_000 + "</robot>",
    "a heap": "<robot name='r'>" + "<x/>" * 100_000 + "</robot>",
}


@pytest.mark.parametrize("case", HOSTILE)
@pytest.mark.parametrize("name", ["rig.urdf", "rig.urdf.xacro"])
def test_hostile_xml_is_refused_at_once(tmp_path: Path, case: str, name: str) -> None:
    (tmp_path / name).write_text(HOSTILE[case])
    with pytest.raises(ModelError, match=r"DTD or an entity|nests deeper"):
        use_model(tmp_path / name)
