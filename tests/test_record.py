"""The record of a run: statistics do not depend on the output rate, and a file keeps what they are taken from."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import h5netcdf
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from rigs import point_mass
from scipy.io import loadmat

from drillrig_pin import Rig, Scenario, Trajectory, load_rig_text, load_trajectory, simulate
from drillrig_pin.errors import ResultSizeError
from drillrig_pin.sampling import PHASES, record_rate
from drillrig_pin.trajectory import VARIABLES, Kept

ENGINES = ("core", "python")
#: 100 kg on a mount of 5 Hz, damped by 5 % of the critical damping.
MASS, STIFFNESS, DAMPING = 100.0, 100.0 * (10 * np.pi) ** 2, 314.1592653589794
HAMMER = f"""<gravity xyz="0 0 0"/>
<joint_spring name="mount" joint="z" stiffness="{STIFFNESS}" damping="{DAMPING}"/>
<load name="hammer" kind="force" point="P" axis="0 0 1" frame="world">
  <harmonics ramp="0.05">{{}}</harmonics></load>"""


def hammered(*terms: tuple[float, float]) -> Rig:
    """The mass under sines of amplitude [N] and frequency [Hz]."""
    words = "".join(f'<term amplitude="{a}" frequency="{f}"/>' for a, f in terms)
    return load_rig_text(point_mass(MASS, HAMMER.format(words)))


def response(frequency: float) -> float:
    """Amplitude of the steady motion under a newton [m/N]."""
    w = 2 * np.pi * frequency
    return float(1 / abs(STIFFNESS - MASS * w**2 + 1j * w * DAMPING))


def assert_same_record(one: Trajectory, other: Trajectory) -> None:
    np.testing.assert_array_equal(one.record.time, other.record.time)
    for name in VARIABLES:
        np.testing.assert_array_equal(one.record.arrays[name], other.record.arrays[name], err_msg=name)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("method", ["auto", "RK4"])
def test_the_record_is_the_same_to_the_last_bit_whatever_output_rate_is_asked_for(engine: str, method: str) -> None:
    rig = hammered((5000.0, 48.0), (700.0, 96.0))
    case = Scenario(duration=0.1 if engine == "core" else 0.03, engine=engine, integrator={"method": method})
    plain = simulate(rig, case)
    assert plain.record is plain
    for rate in (20.0, 49.0, 96.0, 333.3, 5000.0, 20_000.0):
        run = simulate(rig, case.changed({"output_rate": rate}))
        assert_same_record(run, plain)
        np.testing.assert_allclose(run.time, np.append(np.arange(len(run.time) - 1) / rate, run.time[-1]), rtol=1e-15)


@settings(max_examples=15, deadline=None)
@given(
    frequency=st.floats(1.0, 400.0),
    second=st.floats(0.5, 4.0),
    rate=st.floats(20.0, 20_000.0),
    stiffness=st.floats(1e4, 1e7),
)
def test_statistics_do_not_depend_on_the_output_rate(
    frequency: float, second: float, rate: float, stiffness: float
) -> None:
    terms = ((100, frequency), (50, second * frequency))
    words = "".join(f'<term amplitude="{a}" frequency="{f}"/>' for a, f in terms)
    rig = load_rig_text(point_mass(MASS, HAMMER.replace(str(STIFFNESS), str(stiffness)).format(words)))
    case = Scenario(duration=0.06, engine="core")
    assert_same_record(simulate(rig, case.changed({"output_rate": rate})), simulate(rig, case))


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("rate", [130.0, 7000.0])
def test_samples_between_the_steps_are_as_exact_as_those_at_their_ends(engine: str, rate: float) -> None:
    # Free vibration at 40 Hz has a closed form; the tolerance is 1e-8 of the amplitude, some forty steps add up.
    k = MASS * (80 * np.pi) ** 2
    text = HAMMER.split("<load")[0].replace(str(STIFFNESS), str(k))
    rig = load_rig_text(point_mass(MASS, text))
    run = simulate(rig, Scenario(duration=0.1, output_rate=rate, engine=engine, velocities={"z": 1.0}))
    decay = DAMPING / (2 * MASS)
    w = np.sqrt(k / MASS - decay**2)
    exact = np.exp(-decay * run.time) * np.sin(w * run.time) / w
    z = run.q[:, run.labels["joint"].index("z")]
    assert np.abs(z - exact).max() < 1e-6 * np.abs(exact).max()


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("rate", [20.0, 1000.0])
def test_an_impact_shows_its_peak_however_short_it_is(engine: str, rate: float) -> None:
    # Thrown against a spring without gravity: the greatest force is v sqrt(k m), held for no more than 0.1 ms; a row
    # may miss it by half a per cent of it.
    m, k, v = 2.0, 4e6, 1.0
    ground = f'<gravity xyz="0 0 0"/><contact name="g" point="P" axis="0 0 -1" stiffness="{k}" mode="unilateral"/>'
    case = Scenario(duration=0.02, output_rate=rate, engine=engine, velocities={"z": -v})
    run = simulate(load_rig_text(point_mass(m, ground)), case)
    peak = np.abs(run.record.element_force).max()
    assert 0.995 * v * np.sqrt(k * m) < peak < 1.000001 * v * np.sqrt(k * m)
    assert (np.diff(run.record.time) >= 0).all()
    assert np.isin(run.time, run.record.time).all()


@settings(deadline=None)
@given(frequency=st.floats(5.0, 1e4))
@example(frequency=100.0)
@example(frequency=50.0)
@example(frequency=96.0)
@example(frequency=1000.0)
def test_rows_of_the_record_meet_every_load_at_many_phases(frequency: float) -> None:
    rate = record_rate([frequency])
    assert rate >= max(1000.0, 10 * frequency * (1 - 1e-9))
    rows = np.arange(int(2 * rate / frequency) + 40 * PHASES)
    phases = np.sort((rows * frequency / rate) % 1.0)
    gaps = np.diff(np.append(phases, phases[0] + 1.0))
    # No wider than those of twenty equally spaced phases, but for a slow drift.
    assert gaps.max() < 1.15 / PHASES or rate / frequency > PHASES


def test_the_default_rows_suffice_for_the_loads_of_a_drill() -> None:
    assert record_rate([2.0, 8.0, 48.0, 96.0]) == 1000.0
    assert record_rate([]) == 1000.0
    assert record_rate([100.0]) == 2000.0


@pytest.mark.parametrize("engine", ENGINES)
def test_a_term_without_amplitude_asks_for_no_rows(engine: str) -> None:
    run = simulate(hammered((10.0, 48.0), (0.0, 5000.0)), Scenario(duration=0.01, engine=engine))
    assert (run.load_frequency, run.record is run) == (48.0, True)
    assert simulate(hammered((10.0, 48.0)), Scenario(duration=0.01, engine=engine, loads="none")).load_frequency == 0.0


def test_a_result_larger_than_the_memory_is_refused_before_the_run_with_its_size(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("drillrig_pin.sampling.available_memory", lambda: 1e9)
    with pytest.raises(ResultSizeError, match=r"would take .* GB of memory .* 1 GB are available") as refused:
        simulate(hammered((10.0, 48.0)), Scenario(duration=2000.0, output_rate=20_000.0))
    assert refused.value.field == "scenario.output_rate"
    assert refused.value.needed > 1e9
    with pytest.raises(ResultSizeError, match="1000 rows a second whatever the output_rate"):
        simulate(hammered((10.0, 48.0)), Scenario(duration=1e5, output_rate=10.0))


@pytest.fixture
def run() -> Trajectory:
    return simulate(load_rig_text(point_mass()), Scenario(duration=0.05))


def test_a_run_whose_samples_are_its_record_keeps_one_set_of_arrays(run: Trajectory) -> None:
    assert run.record is run
    assert not run.sampled_only


def test_a_file_keeps_samples_and_record_and_says_which_it_has(run: Trajectory, tmp_path: Path) -> None:
    kept = Kept(run.time[::2], {name: run.arrays[name][::2] for name in VARIABLES})
    both = replace(run, kept=kept, load_frequency=96.0)
    both.save(tmp_path / "both.nc")
    back = load_trajectory(tmp_path / "both.nc")
    assert (len(back.time), len(back.record.time), back.load_frequency) == (len(run.time), len(kept.time), 96.0)
    for name in VARIABLES:
        np.testing.assert_array_equal(back.record.arrays[name], kept.arrays[name])
    record = back.record
    assert record.record is record
    assert not back.sampled_only


def test_a_file_from_before_there_was_a_record_says_that_it_holds_samples_only(run: Trajectory, tmp_path: Path) -> None:
    run.save(tmp_path / "old.nc")
    with h5netcdf.File(tmp_path / "old.nc", "a") as file:
        del file.attrs["record"]
    old = load_trajectory(tmp_path / "old.nc")
    assert old.sampled_only
    assert old.record is old
    old.save(tmp_path / "again.nc")
    assert load_trajectory(tmp_path / "again.nc").sampled_only


@pytest.mark.parametrize(("frequency", "shown"), [(None, True), (0.0, True), (400.0, True), (401.0, False)])
def test_samples_show_a_load_of_up_to_four_tenths_of_the_output_rate(
    run: Trajectory, frequency: float | None, shown: bool, tmp_path: Path
) -> None:
    run = replace(run, load_frequency=frequency)
    assert run.samples_show_loads is shown
    # Whoever opens the samples elsewhere is told there.
    run.to_csv(tmp_path / "run.csv")
    run.to_mat(tmp_path / "run.mat")
    with (tmp_path / "run.csv").open() as table:
        names, first = (next(table).strip().split(",") for _ in range(2))
    told = dict(zip(names, first, strict=True)).get("samples_show_loads [1 or 0]")
    assert told is None if shown else float(told) == 0.0
    assert bool(loadmat(tmp_path / "run.mat")["samples_show_loads"].item()) is shown
