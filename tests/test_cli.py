"""The command line as a user meets it: exit codes, sentences instead of tracebacks, files whole or not at all."""

from __future__ import annotations

import math
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from command import Command, one_sentence
from rigs import mass_on_cylinder

import drillrig_pin.cli.run
import drillrig_pin.simulation
from drillrig_pin import load_trajectory
from drillrig_pin.cli import main
from drillrig_pin.cli.guard import FAILED, INTERRUPTED, STOPPED_EARLY, UNEXPECTED, USAGE
from drillrig_pin.cli.output import number, plain

SHORT = ("--set", "scenario.duration=0.05")
PUSH = '<load name="push" kind="force" point="pin_b" axis="0 0 1" frame="world">{}</load>\n'


def test_run_leaves_a_file_and_a_readable_summary(drillrig: Command) -> None:
    answer = drillrig("run", *SHORT)
    assert answer.code == 0
    for word in ("Point S", "Range of the joints", "bar absolute", "Force of the face", "Trust:", "x real time"):
        assert word in answer.out
    assert "drillrig params mkz49 --assumed" in answer.out
    assert "drillrig plot run.nc" in answer.out
    assert max(map(len, answer.out.splitlines())) <= 100
    assert load_trajectory("run.nc").time[-1] == pytest.approx(0.05)
    assert "(replaced)" in drillrig("run", *SHORT, "-o", "run.nc").out
    assert [path.name for path in Path().iterdir()] == ["run.nc"]


def test_run_json_is_one_document_and_nothing_else(drillrig: Command) -> None:
    document = drillrig("run", *SHORT, "--json").document
    assert document["status"]["completed"] is True
    assert document["metrics"]["survey"]["point"] == "S"
    assert {c["cylinder"] for c in document["metrics"]["cylinders"]} == set(
        load_trajectory("run.nc").labels["cylinder"]
    )
    assert document["assumed_parameters"]


def test_quiet_says_nothing(drillrig: Command) -> None:
    answer = drillrig("run", *SHORT, "--quiet", "-o", "a.nc")
    assert (answer.code, answer.out, answer.err) == (0, "", "")


def test_settings_reach_model_and_scenario_and_are_kept_with_the_result(drillrig: Command) -> None:
    words = (
        "--set",
        "model.percussion_frequency=45",
        "--set",
        "scenario.integrator.rtol=1e-7",
        "--set",
        "scenario.loads=[]",
    )
    assert drillrig("run", "mkz49", *SHORT, *words).code == 0
    run = load_trajectory("run.nc")
    assert run.arguments == {"percussion_frequency": 45}
    assert run.scenario.arguments == {"percussion_frequency": 45}
    assert run.scenario.integrator.rtol == 1e-7
    assert run.labels["load"] == []


def test_a_model_of_ones_own_runs_and_is_named_in_the_scenario(drillrig: Command) -> None:
    Path("press.urdf").write_text(mass_on_cylinder())
    assert drillrig("run", "press.urdf", *SHORT).code == 0
    assert load_trajectory("run.nc").scenario.name == "press"


def test_a_scenario_file_names_a_model_beside_it(drillrig: Command) -> None:
    Path("cases").mkdir()
    Path("cases/press.urdf").write_text(mass_on_cylinder())
    Path("cases/one.yaml").write_text("model: press.urdf\nduration: 0.05\n")
    assert drillrig("run", "--scenario", "cases/one.yaml").code == 0


def test_shipped_scenarios_start(drillrig: Command) -> None:
    document = drillrig("static", "--scenario", "hole_9_printed_tip", "--json").document
    assert any(abs(moved) > 1e-3 for moved in document["moved_by_assembly"].values())
    assert set(drillrig("scenarios", "--json").document["scenarios"]) >= {"hole_9", "hole_9_printed_tip"}


@pytest.mark.parametrize("place", ["nowhere/run.nc", "/proc/run.nc", "."])
def test_a_place_that_cannot_be_written_is_refused_before_the_run(
    drillrig: Command, monkeypatch: pytest.MonkeyPatch, place: str
) -> None:
    monkeypatch.setattr(drillrig_pin.simulation, "simulate", lambda *_, **__: pytest.fail("it ran"))
    one_sentence(drillrig("run", "-o", place), place)
    assert list(Path().iterdir()) == []


def test_a_run_that_stops_early_keeps_what_it_has(drillrig: Command) -> None:
    push = PUSH.format('<constant value="3e7" ramp="0.02"/>')
    Path("press.urdf").write_text(mass_on_cylinder(extension=push))
    answer = drillrig("run", "press.urdf", "--set", "scenario.duration=1")
    assert answer.code == STOPPED_EARLY
    assert "stopped early: diverged" in answer.err
    assert "'oil'" in answer.err
    run = load_trajectory("run.nc")
    assert 0 < len(run.time) < 1001
    assert not run.outcome.completed
    assert drillrig("plot", "run.nc").code == 0


def test_ctrl_c_keeps_what_it_has(drillrig: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    @contextmanager
    def impatient(*_: object, **__: object) -> Iterator[Callable[[float], None]]:
        def tick(t: float) -> None:
            if t > 0.02:
                raise KeyboardInterrupt

        yield tick

    monkeypatch.setattr(drillrig_pin.cli.run, "_progress", impatient)
    answer = drillrig("run", *SHORT, "--set", "scenario.engine=python")
    assert answer.code == INTERRUPTED
    assert "interrupted" in answer.err
    assert 20 < len(load_trajectory("run.nc").time) < 30


def test_check_json_and_exit_code(drillrig: Command) -> None:
    good = drillrig("check", "mkz49", "--json")
    assert good.code == 0
    assert good.document["errors"] == 0
    bad = drillrig("check", "mkz49", "--set", "model.lower_boom_mass=-3", "--json")
    assert bad.code == FAILED
    assert bad.document["problems"][0]["line"] > 0


def test_static_reports_forces_and_absolute_pressures(drillrig: Command) -> None:
    Path("press.urdf").write_text(mass_on_cylinder(options='precharge="2e6"'))
    document = drillrig("static", "press.urdf", "--json").document
    assert document["cylinders"]["oil"]["force"] == pytest.approx(500 * 9.81)
    assert document["cylinders"]["oil"]["pressure_b"] == pytest.approx(2e6 + 101_325)
    assert document["at_rest"] is True
    assert "oil" in drillrig("static", "press.urdf").out


def test_params_lists_source_and_marks_what_is_assumed_or_changed(drillrig: Command) -> None:
    rows = drillrig("params", "mkz49", "--json", "--set", "model.boom_length=2").document["parameters"]
    assert [row["name"] for row in rows if row["changed"]] == ["boom_length"]
    assumed = drillrig("params", "mkz49", "--assumed", "--json").document["parameters"]
    assert assumed
    assert all(row["source"].startswith("assumed") for row in assumed)
    assert "assumed" in drillrig("params", "mkz49").out


def test_expanded_model_runs_as_the_source_does(drillrig: Command) -> None:
    assert drillrig("expand", "mkz49", "-o", "flat.urdf").code == 0
    assert "xacro:" not in Path("flat.urdf").read_text()
    assert (
        drillrig("static", "flat.urdf", "--json").document["cylinders"]
        == (drillrig("static", "mkz49", "--json").document["cylinders"])
    )


def test_plot_and_export_write_what_they_say(drillrig: Command) -> None:
    drillrig("run", *SHORT, "-q")
    document = drillrig("plot", "run.nc", "-o", "figures", "--json").document
    assert sorted(document["figures"]) == sorted(str(path) for path in Path("figures").iterdir())
    assert drillrig("export", "run.nc", "--csv", "run.csv", "--mat", "run.mat").code == 0
    assert Path("run.csv").read_text().startswith("time [s]")
    assert Path("run.mat").stat().st_size > 0


def test_plot_takes_figures_panels_and_a_window(drillrig: Command) -> None:
    drillrig("run", *SHORT, "-q")
    document = drillrig(
        "plot", "run.nc", "-f", "survey.z", "-f", "energy", "--window", "0.01", "0.03", "--json"
    ).document
    assert {Path(path).name for path in document["figures"]} == {
        f"{name}.{form}" for name in ("survey.z", "energy") for form in ("png", "svg")
    }
    one_sentence(drillrig("plot", "run.nc", "-f", "survey", "--window", "7", "8"), "--window", "survey")
    one_sentence(drillrig("plot", "run.nc", "-f", "surfey"), "survey")
    one_sentence(drillrig("plot", "run.nc", "--format", "gif"), "png, svg")


def test_plot_beside_a_measurement(drillrig: Command) -> None:
    drillrig("run", *SHORT, "-q")
    run = load_trajectory("run.nc")
    z = run.of("point_displacement", "S", "z")
    rows = "\n".join(f"{t:.6f},{1e3 * value:.9f}" for t, value in zip(run.time, z, strict=True))
    Path("gauge.csv").write_text(rows)
    one_sentence(drillrig("plot", "run.nc", "--measured", "gauge.csv"), "--measured-unit")
    document = drillrig("plot", "run.nc", "--measured", "gauge.csv", "--measured-unit", "mm", "--json").document
    assert any(path.endswith("measured.svg") for path in document["figures"])
    # The run itself: what is left is the rounding of nine digits of a millimetre.
    assert document["measured"]["rms_error"] < 1e-4
    assert document["measured"]["shift"] == pytest.approx(0.0, abs=1e-6)
    fixed = ("--measured", "gauge.csv", "--measured-unit", "mm", "--shift", "0.001", "--json")
    assert drillrig("plot", "run.nc", "-f", "measured", *fixed).document["measured"]["shift"] == 0.001
    assert drillrig("report", "run.nc", *fixed).document["measured"]["rms_error"] > 1e-3
    one_sentence(drillrig("plot", "run.nc", "--shift", "1"), "--shift", "--measured")
    one_sentence(drillrig("plot", "run.nc", "--measured", "gauge.csv", "--measured-axis", "w"), "x, y, z")
    Path("still.csv").write_text("t [s],z [mm]\n" + "".join(f"{i},1\n" for i in range(20)))
    one_sentence(drillrig("plot", "run.nc", "--measured", "still.csv"), "still.csv", "cannot be compared")


@pytest.mark.parametrize(
    "name",
    [
        "run",
        "check",
        "static",
        "params",
        "expand",
        "export",
        "plot",
        "report",
        "compare",
        "replay",
        "watch",
        "sweep",
        "holes",
        "models",
        "scenarios",
    ],
)
def test_every_command_has_help_with_an_example(drillrig: Command, name: str) -> None:
    answer = drillrig(name, "--help")
    assert answer.code == 0
    assert f"Example:  drillrig {name}" in answer.out
    assert "--json" in answer.out


def test_wrong_usage_has_its_own_code(drillrig: Command) -> None:
    assert drillrig("rnu").code == USAGE
    assert drillrig("run", "--nope").code == USAGE
    assert "Exit codes" in drillrig("--help").out
    assert drillrig("--version").out.startswith("drillrig-pin ")


def test_a_bug_is_one_sentence_too(drillrig: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object, **__: object) -> None:
        raise RuntimeError("two\nlines")

    monkeypatch.setattr(drillrig_pin.simulation, "simulate", broken)
    answer = drillrig("run", *SHORT)
    assert answer.code == UNEXPECTED
    assert answer.err == "unexpected RuntimeError: two lines; run with --debug for the traceback\n"


def test_debug_shows_the_traceback(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(drillrig_pin.simulation.ScenarioError):
        main(["--debug", "run", "--set", "nonsense"])


def test_a_reader_that_leaves_early_is_no_error(tmp_path: Path) -> None:
    command = f"{sys.executable} -c 'from drillrig_pin.cli import main; main()' expand mkz49 | head -c 10"
    result = subprocess.run(command, shell=True, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert result.stdout.startswith("<?xml")
    assert result.stderr == ""


def test_help_does_not_wait_for_heavy_imports() -> None:
    code = (
        "import sys\nfrom drillrig_pin.cli import main\ntry: main(['run', '--help'])\nexcept SystemExit: pass\n"
        "assert not {'pinocchio', 'scipy', 'matplotlib', 'xarray', 'numpy'} & set(sys.modules), sorted(sys.modules)"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stderr


def test_json_has_no_word_for_infinity() -> None:
    assert plain({"a": math.inf, "b": (1, math.nan), "c": True, "d": 3}) == {
        "a": None,
        "b": [1, None],
        "c": True,
        "d": 3,
    }
    assert (number(0.0), number(12345.678), number(None)) == ("0", "12346", "–")
