"""What a run is summarised to: known motions give known numbers."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from rigs import joint, link, mass_on_cylinder, point, robot

from drillrig_pin import Rig, Scenario, Trajectory, load_rig_text, simulate
from drillrig_pin.analysis.design import design_of
from drillrig_pin.analysis.metrics import measure
from drillrig_pin.analysis.motion import after, point_motion, start_up
from drillrig_pin.analysis.spectra import amplitude_spectrum, averaged_spectrum, band_share, strongest_lines
from drillrig_pin.analysis.trust import trust

TIME = np.arange(8001) / 1000.0

CONTACT = '<contact name="rock" point="pin_b" axis="0 0 1" stiffness="1e6" preload="100"/>\n'
SHAKER = (
    '<load name="shaker" kind="force" point="pin_b" axis="0 0 1" frame="world"><harmonics mean="0" ramp="0.05">'
    '<term amplitude="{}" frequency="40" phase="0"/></harmonics></load>\n'
)


def short_run(model: str, **fields: Any) -> Trajectory:
    return simulate(load_rig_text(model), Scenario(**{"duration": 0.2, **fields}))


@pytest.fixture(scope="module")
def drilling(mkz49: Rig) -> Trajectory:
    return simulate(mkz49, Scenario(duration=0.2))


def with_displacement(run: Trajectory, time: np.ndarray, u: np.ndarray) -> Trajectory:
    """The run with another motion of its first point."""
    n = len(time)
    arrays = {name: np.zeros((n, *array.shape[1:])) for name, array in run.arrays.items()}
    arrays["point_displacement"][:, 0, :] = u
    return replace(run, time=time, arrays=arrays)


@pytest.mark.parametrize("frequency", [3.0, 7.77, 12.3456, 48.03, 199.9])
def test_spectrum_of_a_sine_shows_its_amplitude_and_frequency(frequency: float) -> None:
    signal = 0.25 + 1.7e-3 * np.sin(2 * math.pi * frequency * TIME + 0.7)
    spectrum = amplitude_spectrum(TIME, signal[:, None])
    assert spectrum is not None
    (line,) = strongest_lines(spectrum, ["x"])
    assert line.amplitude == pytest.approx(1.7e-3, rel=0.01)
    assert line.frequency == pytest.approx(frequency, abs=spectrum.bin / 8)
    assert line.share == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize("frequency", [2.0, 7.77, 12.3456, 48.03, 199.9])
def test_averaged_spectrum_shows_the_amplitude_of_a_lasting_sine(frequency: float) -> None:
    noise = 1e-5 * np.random.default_rng(5).standard_normal(len(TIME))
    signal = 0.25 + 1.7e-3 * np.sin(2 * math.pi * frequency * TIME + 0.7) + noise
    spectrum = averaged_spectrum(TIME, signal[:, None])
    assert spectrum is not None
    assert spectrum.segments == 3
    assert spectrum.bin == pytest.approx(0.25)
    peak = int(np.argmax(spectrum.amplitude[:, 0]))
    assert spectrum.amplitude[peak, 0] == pytest.approx(1.7e-3, rel=0.01)
    assert spectrum.frequency[peak] == pytest.approx(frequency, abs=spectrum.bin)


def test_averaging_lowers_what_does_not_last() -> None:
    early = np.where(TIME < 2, np.sin(2 * math.pi * 20 * TIME), 0.0)
    lasting = np.sin(2 * math.pi * 50 * TIME)
    spectrum = averaged_spectrum(TIME, np.stack([early, lasting], axis=1))
    assert spectrum is not None
    assert spectrum.amplitude[:, 0].max() < 0.7
    assert spectrum.amplitude[:, 1].max() == pytest.approx(1.0, rel=0.01)
    assert averaged_spectrum(TIME[:10], np.zeros((10, 1))) is None


def test_lines_of_a_mixture_are_sorted_and_share_its_power() -> None:
    low, high = 2e-3 * np.sin(2 * math.pi * 5.3 * TIME), 1e-3 * np.sin(2 * math.pi * 41.7 * TIME)
    spectrum = amplitude_spectrum(TIME, np.stack([low, 0 * low, high], axis=1))
    assert spectrum is not None
    first, second = strongest_lines(spectrum, ["x", "y", "z"])
    assert (first.axis, second.axis) == ("x", "z")
    assert first.share == pytest.approx(0.8, abs=0.01)
    assert second.share == pytest.approx(0.2, abs=0.01)
    assert band_share(spectrum, 0, 15) == pytest.approx(0.8, abs=0.01)
    assert band_share(spectrum, 15, 80) == pytest.approx(0.2, abs=0.01)
    assert spectrum.power.sum() == pytest.approx(1.0)


def test_spectrum_leaves_out_a_last_sample_off_the_grid() -> None:
    time = np.append(TIME, TIME[-1] + 1e-4)
    signal = np.sin(2 * math.pi * 10 * time)
    spectrum = amplitude_spectrum(time, signal[:, None])
    assert spectrum is not None
    assert strongest_lines(spectrum, ["x"])[0].frequency == pytest.approx(10, abs=0.02)


def test_too_few_samples_have_no_spectrum_and_rest_has_no_lines() -> None:
    assert amplitude_spectrum(TIME[:10], np.zeros((10, 3))) is None
    rest = amplitude_spectrum(TIME, np.zeros((len(TIME), 3)))
    assert rest is not None
    assert strongest_lines(rest, "xyz") == ()
    assert np.isfinite(rest.power).all()


def test_point_motion_of_a_known_ellipse(drilling: Trajectory) -> None:
    phase = 2 * math.pi * TIME[:-1]
    u = np.stack([0.1 + 0 * phase, 2e-3 * np.sin(phase), 1e-3 * np.cos(phase)], axis=1)
    motion = point_motion(
        with_displacement(drilling, TIME[:-1], u), drilling.labels["point"][0], slice(None), (1, 0, 0)
    )
    x, y, z = motion.axes
    assert (x.peak_to_peak, x.rms) == pytest.approx((0, 0), abs=1e-12)
    assert x.mean == pytest.approx(0.1)
    assert y.peak_to_peak == pytest.approx(4e-3)
    assert y.rms == pytest.approx(2e-3 / math.sqrt(2))
    assert z.rms == pytest.approx(1e-3 / math.sqrt(2))
    assert motion.across is not None
    assert motion.across.rms == pytest.approx(math.hypot(y.rms, z.rms))
    assert motion.across.farthest == pytest.approx(2e-3)


def test_start_up_is_ramp_and_three_periods_but_at_most_a_fifth_of_the_run() -> None:
    run = short_run(mass_on_cylinder(extension=SHAKER.format(100)))
    design = design_of(run)
    assert (design.ramp, design.slowest) == (0.05, 40)
    assert start_up(run, design) == pytest.approx(0.2 * 0.2)
    long = with_displacement(run, TIME, np.zeros((len(TIME), 3)))
    assert start_up(long, design) == pytest.approx(0.05 + 3 / 40)
    assert after(long, 0.125) == slice(125, None)


def test_a_run_without_loads_has_no_start_up() -> None:
    run = short_run(mass_on_cylinder(extension=SHAKER.format(100)), loads="none")
    assert start_up(run, design_of(run)) == 0


def test_pressures_are_absolute_and_a_chamber_below_gas_release_is_named() -> None:
    calm = measure(short_run(mass_on_cylinder(options='precharge="3e6"')))
    (oil,) = calm.cylinders
    assert oil.b_min == pytest.approx(3e6 + 101_325)
    assert oil.relief == pytest.approx(21e6 + 101_325)
    assert oil.below == oil.above == 0
    assert calm.warnings == ()
    torn = measure(short_run(mass_on_cylinder(extension=SHAKER.format(50_000))))
    assert torn.cylinders[0].below > 0
    assert any("oil: chamber" in warning and "bar absolute" in warning for warning in torn.warnings)


def test_pressure_above_relief_is_named() -> None:
    found = measure(short_run(mass_on_cylinder(options='precharge="3e6" relief_pressure="1e6"')))
    assert found.cylinders[0].above == 1
    assert sum("relief valve opens" in warning for warning in found.warnings) == 2


def test_a_contact_that_pulls_is_reported_with_its_share_of_time() -> None:
    pressed = measure(short_run(mass_on_cylinder(extension=CONTACT)))
    (rock,) = pressed.reactions
    assert rock.name == "rock"
    assert rock.mean == pytest.approx(-100, rel=1e-6)
    assert rock.tension == 0
    pulled = measure(short_run(mass_on_cylinder(extension=CONTACT + SHAKER.format(20_000))))
    tension = pulled.reactions[0].tension
    assert tension is not None
    assert 0.2 < tension < 0.8
    assert any("pulls at the tip" in warning for warning in pulled.warnings)


def test_joint_ranges_know_units_and_turns() -> None:
    spinner = robot(
        link("wheel"), joint("axle", "continuous", "world", "wheel"), extension=point("rim", "wheel", (1, 0, 0))
    )
    found = measure(short_run(spinner, velocities={"axle": 40.0}))
    (axle,) = found.joints
    assert (axle.joint, axle.unit) == ("axle", "rad")
    assert axle.whole == pytest.approx(8.0, rel=1e-6)
    slider = measure(short_run(mass_on_cylinder()))
    assert slider.joints[0].unit == "m"
    body = robot(link("body"), joint("free", "floating", "world", "body"))
    names = {r.joint: r for r in measure(short_run(body, velocities={"free.wz": 1.0})).joints}
    assert set(names) == {"free.x", "free.y", "free.z", "free.turn"}
    assert names["free.z"].whole == pytest.approx(0.5 * 9.81 * 0.2**2, rel=1e-6)
    assert names["free.turn"].whole == pytest.approx(0.2, rel=1e-4)


def test_energy_residual_is_relative_to_work_in_or_else_to_energy_exchanged() -> None:
    # Micrometres: the tolerances in metres must be finer than for a machine that moves by millimetres.
    fine = {"rtol": 1e-10, "atol": 1e-13}
    shaken = trust(short_run(mass_on_cylinder(extension=SHAKER.format(100)), integrator=fine))
    assert shaken.against == "work in"
    assert shaken.relative is not None
    assert shaken.relative < 1e-5
    swinging = trust(short_run(mass_on_cylinder(), velocities={"slide": 0.01}))
    assert swinging.against == "energy exchanged"
    assert swinging.relative is not None
    assert swinging.relative < 1e-5
    rest = trust(short_run(mass_on_cylinder()))
    assert rest.relative is None
    assert rest.doubts == ()


def test_a_broken_energy_balance_raises_doubts() -> None:
    run = short_run(mass_on_cylinder(extension=SHAKER.format(100)))
    arrays = dict(
        run.arrays, work_dissipated=run.work_dissipated + run.work_input.max() * np.linspace(0, 0.1, len(run.time))
    )
    found = trust(replace(run, arrays=arrays))
    assert found.doubts
    assert "energy balance" in found.doubts[0]


def test_the_shipped_rig_fills_every_section(drilling: Trajectory) -> None:
    found = measure(drilling)
    assert found.survey is not None
    assert found.survey.point == "S"
    assert found.survey.across is not None
    assert found.frequencies is not None
    assert len(found.joints) == 6
    assert len(found.cylinders) == 5
    assert [r.name for r in found.reactions] == ["face.y", "face.z", "rock"]
    assert found.trust.error is not None
    assert found.trust.error < 1e-12
