"""Statistics of a run: what is taken over time, settled, and called by its name; held against closed forms."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rigs import joint, link, mass_on_cylinder, point, robot

from drillrig_pin import Scenario, load_rig_text, simulate
from drillrig_pin.analysis.comparison import compare_runs
from drillrig_pin.analysis.fatigue import cylinder_rainflow, rainflow_ranges
from drillrig_pin.analysis.metrics import Metrics, measure
from drillrig_pin.analysis.motion import ring_down
from drillrig_pin.analysis.quantities import quantities
from drillrig_pin.analysis.series import extremes, rms, share_above, turning_points, weights
from drillrig_pin.analysis.sources import source_of
from drillrig_pin.analysis.spectra import amplitude_spectrum, strongest_lines
from drillrig_pin.analysis.verdict import Level
from drillrig_pin.batch.face import Face, FaceHole
from drillrig_pin.errors import ResultFileError
from drillrig_pin.figures.face import inks_of
from drillrig_pin.figures.registry import sheets_of
from drillrig_pin.figures.subject import subject_of
from drillrig_pin.report.content import gather
from drillrig_pin.report.page import report_page
from drillrig_pin.trajectory import Kept, Mode, Trajectory, load_trajectory

ENGINES = ("core", "python")


def driven(load: str, mass: float = 500.0, hertz: float = 20.0, zeta: float = 0.05) -> str:
    """A mass on a damped spring, pushed along z."""
    omega = 2 * math.pi * hertz
    spring = (
        f'<joint_spring name="mount" joint="slide" stiffness="{mass * omega**2}" damping="{2 * zeta * mass * omega}"/>'
    )
    push = f'<load name="push" kind="force" point="P" axis="0 0 1" frame="world">{load}</load>'
    slide = joint("slide", "prismatic", "world", "mass")
    return robot(link("mass", mass), slide, extension=point("P", "mass") + spring + push)


def harmonics(ramp: float) -> str:
    return f'<harmonics mean="4000" ramp="{ramp}"><term amplitude="2500" frequency="48"/></harmonics>'


def table() -> str:
    time = np.arange(0.0, 10.0005, 0.0005)
    rows = np.stack([time, 4000 + 2500 * np.sin(2 * math.pi * 48 * time)], axis=1)
    return "<table>\n" + "\n".join(f"{t:.4f},{value:.3f}" for t, value in rows) + "\n</table>"


def right(frequency: float = 48.0, force: float = 2500.0, mass: float = 500.0) -> float:
    """Amplitude F / |k - m w^2 + i c w| after all transients [m]."""
    own, w = 2 * math.pi * 20.0, 2 * math.pi * frequency
    return force / abs(mass * own**2 - mass * w**2 + 1j * 2 * 0.05 * mass * own * w)


@lru_cache(maxsize=32)
def run_of(load: str, duration: float, engine: str = "core", **fields: float) -> Trajectory:
    scenario = Scenario(duration=duration, engine=engine, **fields)
    return simulate(load_rig_text(driven(load)), scenario)


def along_z(found: Metrics) -> tuple[float, float]:
    assert found.survey is not None
    return found.survey.axes[2].peak_to_peak, found.survey.axes[2].rms


@pytest.mark.parametrize("load", [harmonics(0.2), harmonics(0.0), table()], ids=["ramp", "no ramp", "table"])
def test_statistics_begin_when_what_the_start_stirred_up_has_rung_down(load: str) -> None:
    found = measure(run_of(load, 10.0))
    span, effective = along_z(found)
    # What is left of the start is a thousandth of some 570 um the loads deflect, to both sides, against 133 um.
    assert span == pytest.approx(2 * right(), rel=9e-3)
    assert effective == pytest.approx(right() / math.sqrt(2), rel=1e-3)
    assert found.steadiness.steady
    assert not found.warnings


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize(
    ("load", "duration", "why"),
    [
        (harmonics(2.0), 5.0, "within the loads' ramp"),
        (harmonics(0.0), 2.0, "the peak to peak of P along z changes"),
        (table(), 1.0, "the peak to peak of P along z changes"),
        (harmonics(0.0), 0.03, "less than two periods of the slowest load"),
    ],
    ids=["ramp", "ring-down", "table", "short"],
)
def test_a_motion_that_has_not_settled_is_said_with_how_long_it_takes(
    load: str, duration: float, why: str, engine: str
) -> None:
    found = measure(run_of(load, duration, engine))
    assert found.steadiness.steady is False
    assert why in found.steadiness.words
    assert any("not steady yet" in warning and "run at least" in warning for warning in found.warnings)
    needed = found.steadiness.needed
    assert needed is not None
    assert needed > duration
    if needed <= 10:
        again = measure(run_of(load, math.ceil(10 * needed) / 10))
        assert again.steadiness.steady
        assert along_z(again)[0] == pytest.approx(2 * right(), rel=0.01)


@settings(max_examples=12, deadline=None)
@given(
    ramp=st.sampled_from([0.0, 0.05, 0.3]),
    zeta=st.floats(0.02, 0.3),
    hertz=st.floats(4.0, 40.0),
    ratio=st.floats(0.3, 3.0),
    duration=st.floats(0.5, 6.0),
)
def test_what_is_called_steady_is_that_of_the_closed_form(
    ramp: float, zeta: float, hertz: float, ratio: float, duration: float
) -> None:
    mass, own, w = 100.0, 2 * math.pi * hertz, 2 * math.pi * hertz * ratio
    load = f'<harmonics mean="1000" ramp="{ramp}"><term amplitude="900" frequency="{hertz * ratio}"/></harmonics>'
    rig = load_rig_text(driven(load, mass, hertz, zeta))
    found = measure(simulate(rig, Scenario(duration=duration, output_rate=1000.0)))
    amplitude = 900 / abs(mass * own**2 - mass * w**2 + 2j * zeta * mass * own * w)
    if found.steadiness.steady:
        # Parts that agree to 5 % may both hold what is left of the start, a part of it.
        assert along_z(found)[0] == pytest.approx(2 * amplitude, rel=0.1)


def test_a_run_without_loads_is_looked_at_from_its_start() -> None:
    found = measure(simulate(load_rig_text(driven(harmonics(0.0))), Scenario(duration=0.1, loads="none")))
    assert found.steadiness.steady is None
    assert not found.warnings


@pytest.mark.parametrize("engine", ENGINES)
def test_the_modes_of_a_mass_on_a_spring_are_those_of_the_textbook(engine: str, tmp_path) -> None:  # type: ignore[no-untyped-def]
    run = run_of(harmonics(0.2), 0.05, engine)
    (mode,) = run.modes
    assert mode.frequency == pytest.approx(20 * math.sqrt(1 - 0.05**2), rel=1e-6)
    assert mode.decay == pytest.approx(0.05 * 2 * math.pi * 20, rel=1e-6)
    run.save(tmp_path / "run.nc")
    assert load_trajectory(tmp_path / "run.nc").modes == run.modes


def test_a_ramp_stirs_up_less_than_a_step_and_no_damping_never_rings_down() -> None:
    slow = (Mode(10.0, 2.0),)
    assert ring_down(slow, 0.0) == pytest.approx(math.log(1000) / 2)
    assert 0 < ring_down(slow, 0.3) < ring_down(slow, 0.0)
    assert ring_down((Mode(10.0, 0.0),), 0.0) == 0.0


def test_an_orbit_has_its_radius_for_amplitude_and_a_slanting_motion_its_direction() -> None:
    time = np.arange(8001) / 1000.0
    wave = 2 * math.pi * 20 * time
    circle = np.stack([1e-3 * np.cos(wave), 1e-3 * np.sin(wave), 0 * time], axis=1)
    spectrum = amplitude_spectrum(time, circle)
    assert spectrum is not None
    (line,) = strongest_lines(spectrum, "xyz")
    assert (line.amplitude, line.minor) == pytest.approx((1e-3, 1e-3), rel=1e-3)
    assert line.way == "on an orbit in x–y"
    slanting = np.outer(np.sin(wave), [1e-3, 0.0, -1e-3])
    spectrum = amplitude_spectrum(time, slanting)
    assert spectrum is not None
    (line,) = strongest_lines(spectrum, "xyz")
    assert line.amplitude == pytest.approx(math.sqrt(2) * 1e-3, rel=1e-3)
    assert line.direction == pytest.approx((math.sqrt(0.5), 0, -math.sqrt(0.5)), abs=1e-6)
    assert line.way == "along x−z"


@given(
    c=st.lists(st.complex_numbers(max_magnitude=1.0, min_magnitude=0.05), min_size=3, max_size=3),
)
@settings(max_examples=50, deadline=None)
def test_the_amplitude_of_a_line_is_the_farthest_the_point_goes(c: list[complex]) -> None:
    time = np.arange(4000) / 1000.0
    u = (np.exp(2j * math.pi * 20 * time)[:, None] * np.array(c)).real
    spectrum = amplitude_spectrum(time, u)
    assert spectrum is not None
    line = strongest_lines(spectrum, "xyz")[0]
    # Fifty samples a turn: the farthest one is within (pi / 50)^2 / 2 of the tip of the ellipse.
    assert line.amplitude == pytest.approx(float(np.linalg.norm(u, axis=1).max()), rel=3e-3)


def test_a_line_is_told_to_be_driven_own_made_together_or_unknown() -> None:
    modes, loads = (Mode(8.7, 1.9),), {"hammer": (48.0,), "turn": (2.0,)}

    def kind(frequency: float, rate: float = 1000.0, modes: tuple[Mode, ...] = modes) -> str:
        return source_of(frequency, 0.1, loads, modes, rate).kind

    assert [kind(f) for f in (48.05, 8.6, 96.0, 50.0, 13.3)] == [
        "load",
        "mode",
        "combination",
        "combination",
        "unknown",
    ]
    assert kind(2.0, 50.0) == "load"
    assert source_of(4.0, 0.1, {"hammer": (48.0,)}, (), 52.0).kind == "alias"
    # Forced motion below 15 Hz is not the machine's own.
    forced = source_of(8.0, 0.1, {"push": (8.0,)}, modes, 1000.0)
    assert "driven by push" in forced.words
    assert "not known" in source_of(13.3, 0.1, loads, (), 1000.0).words


def test_the_typical_range_is_never_above_the_largest_and_the_one_at_one_hertz_says_so() -> None:
    time = np.arange(0, 4, 1e-3)
    found = rainflow_ranges("oil", 16e3 * np.sin(2 * math.pi * 48 * time), 4.0)
    assert found.typical == pytest.approx(32e3, rel=0.01)
    assert found.typical <= found.largest
    assert found.cycles == pytest.approx(192, abs=1)
    assert found.equivalent == pytest.approx(48 ** (1 / 3) * found.typical, rel=0.01)


@settings(max_examples=50, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_statistics_do_not_depend_on_where_rows_lie(seed: int) -> None:
    even = np.arange(2001) / 1000.0
    extra = np.sort(np.random.default_rng(seed).uniform(0.7, 0.9, 300))
    time = np.unique(np.concatenate([even, extra]))
    for rows in (even, time):
        x = 3 + np.sin(2 * math.pi * 8 * rows + 0.4)
        w = weights(rows)
        assert float(w @ x) == pytest.approx(3, abs=1e-3)
        assert float(rms(w, x)) == pytest.approx(math.sqrt(0.5), rel=1e-3)
        assert extremes(rows, x) == pytest.approx((2, 4), rel=1e-5)
        assert share_above(rows, x, 3.5) == pytest.approx(1 / 3, abs=2e-3)


def test_a_peak_between_rows_is_found_and_an_edge_is_not_rounded() -> None:
    time = np.arange(0, 1, 1 / 200)
    sine = np.sin(2 * math.pi * 10 * (time + 1 / 400))
    assert extremes(time, sine)[1] == pytest.approx(1, rel=3e-4)
    assert sine.max() < 0.988
    saw = np.abs((time * 10) % 2 - 1)
    assert extremes(time, saw)[1] == saw.max()
    assert np.array_equal(turning_points(time, saw), saw)


def only_samples(run: Trajectory, every: int) -> Trajectory:
    """The run as a file of an earlier version holds it: one sample in so many, and nothing else."""
    kept = slice(None, None, every)
    scenario = run.scenario.changed({"output_rate": run.scenario.output_rate / every})
    arrays = {name: array[kept] for name, array in run.arrays.items()}
    return replace(run, time=run.time[kept], arrays=arrays, scenario=scenario, kept=None, sampled_only=True)


def test_samples_that_cannot_show_the_loads_are_said_and_make_no_spectrum() -> None:
    fine = run_of(harmonics(0.2), 6.0)
    coarse = only_samples(fine, 20)  # 50 a second, under a load of 48 Hz
    found = measure(coarse)
    assert not found.sampling.enough
    assert found.frequencies is None
    assert any("cannot show the 48.00 Hz of push" in warning for warning in found.warnings)
    content = gather(subject_of(coarse))
    assert content.verdict[0] is Level.BAD
    assert any("cannot show the 48.00 Hz" in finding.sentence for finding in content.findings)
    sheets = {sheet.name: sheet for sheet in sheets_of(subject_of(coarse))}
    assert "survey_spectrum" not in sheets
    assert "Misleading" in sheets["survey"].caption
    with pytest.raises(ResultFileError, match="wrong frequencies"):
        sheets_of(subject_of(coarse), ["survey_spectrum"])
    assert not any("Misleading" in sheet.caption for sheet in sheets_of(subject_of(fine)))


def test_a_coarser_sampled_run_is_never_better() -> None:
    fine = run_of(harmonics(0.2), 6.0)
    coarse = only_samples(fine, 20)
    for pair in ((fine, coarse), (coarse, fine)):
        found = compare_runs(pair)
        assert any("neither better nor worse" in caution for caution in found.cautions)
        assert {change.verdict for row in found.rows for change in row.changes} <= {"same", "other"}


def test_curves_are_drawn_from_the_record_where_the_samples_mislead() -> None:
    fine = run_of(harmonics(0.2), 6.0)
    coarse = only_samples(fine, 20)
    run = replace(coarse, kept=Kept(fine.time, fine.arrays), sampled_only=False)
    found = measure(run)
    assert found.survey == measure(fine).survey
    assert found.sampling.enough
    assert not found.stored.enough
    assert any("exported samples mislead" in warning for warning in found.warnings)
    (sheet,) = sheets_of(subject_of(run), ["survey"])
    assert len(sheet.panels[2].curves[0].y) == len(fine.time)
    assert "Drawn from the rows the statistics are made of" in sheet.caption


def test_an_unsteady_run_is_not_judged_and_says_so_in_the_report() -> None:
    run = run_of(harmonics(2.0), 5.0)
    content = gather(subject_of(run))
    assert content.verdict == (Level.NEAR, "Not to be judged yet: the motion is not steady.")
    assert "not steady yet" in report_page(content, sheets_of(subject_of(run, limits={}), ["survey"]))


def test_a_comparison_says_which_run_is_not_steady() -> None:
    found = compare_runs([run_of(harmonics(0.2), 6.0), run_of(harmonics(2.0), 5.0)])
    assert any(caution.startswith("run 2 is not steady yet") for caution in found.cautions)


def test_the_range_of_force_is_that_after_the_start_up_and_pressures_are_those_of_the_whole_run() -> None:
    shaker = (
        '<load name="shaker" kind="force" point="pin_b" axis="0 0 1" frame="world"><harmonics mean="5000">'
        '<term amplitude="1000" frequency="40"/></harmonics></load>'
    )
    run = simulate(load_rig_text(mass_on_cylinder(extension=shaker)), Scenario(duration=2.0))
    found = measure(run)
    (oil,) = found.cylinders
    record = run.record
    after = record.time >= found.start_up
    force = record.of("cylinder_force", "oil")
    assert oil.force_max - oil.force_min == pytest.approx(np.ptp(force[after]), rel=0.02)
    assert oil.a_max >= record.of("pressure_a", "oil").max() + 101_325 - 1


def test_every_share_worth_drawing_has_a_look_of_its_own() -> None:
    shares = {f"element_{i}": 0.07 for i in range(14)}
    hole = FaceHole("h", (0.0, 0.0, 0.0), 0.0, 0.0, False, 0, 1.0, (1.0, 1.0), "", True, shares, None, None)
    looks = inks_of(Face("S.z.rms", "m", (hole,), frozenset(), False))
    assert set(looks) == set(shares)
    assert len(set(looks.values())) == 14


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), begin=st.floats(0.0, 0.5), dense=st.booleans())
def test_a_spectrum_does_not_depend_on_rows_between_its_own(seed: int, begin: float, dense: bool) -> None:
    even = np.arange(4001) / 1000.0
    random = np.random.default_rng(seed)
    # A few rows in between, or one in every step, as a load table has them at its own times.
    extra = even[:-1] + random.uniform(2e-4, 8e-4, 4000) if dense else np.sort(random.uniform(0.7, 0.9, 50))
    time = np.unique(np.concatenate([even, extra]))
    time = time[time >= begin]
    spectrum = amplitude_spectrum(time, (1e-3 * np.sin(2 * math.pi * 48 * time + 1))[:, None])
    assert spectrum is not None
    (line,) = strongest_lines(spectrum, "z")
    assert line.frequency == pytest.approx(48, abs=0.05)
    # Between its bins a line loses 0.3 % of its height.
    assert line.amplitude == pytest.approx(1e-3, rel=4e-3)


RATES = (20.0, 49.0, 96.0, 1000.0, 20_000.0)


@pytest.mark.parametrize("engine", ENGINES)
def test_numbers_are_the_same_at_any_output_rate(engine: str) -> None:
    whole = {}
    for rate in RATES:
        run = run_of(harmonics(0.2), 1.5, engine, output_rate=rate)
        found = measure(run)
        counts = cylinder_rainflow(run.record, slice(0, None))
        whole[rate] = {key: item.value for key, item in quantities(found, found.hole, counts).items()}
        assert found.frequencies is not None
        assert found.frequencies.lines[0].frequency == pytest.approx(48, abs=0.5)
        assert found.stored.enough == (rate >= 120)
    for rate in RATES:
        for key, value in whole[1000.0].items():
            if not key.startswith(("cost.", "trust.")):
                assert whole[rate][key] == pytest.approx(value, rel=1e-6, abs=1e-12), (rate, key)
