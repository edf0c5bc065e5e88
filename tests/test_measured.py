"""A measurement beside a run: read with its unit, shifted to where it belongs, and judged."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drillrig_pin import ResultFileError
from drillrig_pin.analysis.measured import Measurement, compare_with, read_measurement

TIME = np.arange(5001) / 1000.0


def signal(t: np.ndarray) -> np.ndarray:
    """Never the same twice: a chirp that grows and dies."""
    return 1e-3 * np.sin(2 * math.pi * (3 * t + 1.3 * t**2)) * np.exp(-((t - 2.5) ** 2))


@pytest.mark.parametrize("shift", [0.0, 0.7342, -1.2001, 41.5])
def test_a_shifted_and_scaled_signal_is_recovered(shift: float) -> None:
    t = np.arange(1.0, 4.2, 1 / 743)
    found = compare_with(TIME, signal(TIME) + 0.01, Measurement(t + shift, 1.25 * signal(t) - 0.3, "gauge.csv"))
    assert found is not None
    assert found.shift == pytest.approx(-shift, abs=2e-4)
    assert found.correlation == pytest.approx(1.0, abs=1e-3)
    assert found.peak_error == pytest.approx(1 / 1.25 - 1, abs=2e-3)
    assert found.rms_error == pytest.approx(1 - 1 / 1.25, abs=5e-3)


def test_of_the_fits_of_a_periodic_signal_the_longest_wins() -> None:
    t = np.arange(1.0, 4.0, 1e-3)
    wave = np.sin(2 * math.pi * 2 * TIME)
    noise = 0.05 * np.random.default_rng(3).standard_normal(len(t))
    found = compare_with(TIME, wave, Measurement(t, np.sin(2 * math.pi * 2 * t) + noise, ""))
    assert found is not None
    assert len(found.time) > 2950
    assert found.shift % 0.5 == pytest.approx(0, abs=2e-3) or found.shift % 0.5 == pytest.approx(0.5, abs=2e-3)


def test_what_does_not_move_or_hardly_overlaps_is_not_compared() -> None:
    assert compare_with(TIME, signal(TIME), Measurement(TIME, 0 * TIME, "")) is None
    assert compare_with(TIME, 0 * TIME, Measurement(TIME, signal(TIME), "")) is None


def test_a_gap_of_days_does_not_fill_the_memory() -> None:
    t = np.append(TIME, 1e7)
    compare_with(TIME, signal(TIME), Measurement(t, np.append(signal(TIME), 0.0), ""))


@pytest.mark.parametrize(
    ("text", "unit"),
    [
        ("time [s],S_z [mm]\n0,0\n{rows}", None),
        ("t (ms);value (mm)\n{milli}", None),
        ("# a gauge\n\n{rows}", "mm"),
        ("time,z [m]\n{rows}", "mm"),
    ],
)
def test_units_come_from_the_header_or_from_the_option(tmp_path: Path, text: str, unit: str | None) -> None:
    rows = "\n".join(f"{i / 100},{i * i}" for i in range(1, 12))
    milli = "\n".join(f"{i * 10};{i * i}" for i in range(1, 12))
    path = tmp_path / "gauge.csv"
    path.write_text(text.format(rows=rows, milli=milli))
    found = read_measurement(path, unit)
    assert found.time[-1] == pytest.approx(0.11)
    assert found.value[-1] == pytest.approx(0.121)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("0,0\n" * 3, "increase"),
        ("0,0\n1,1\n", "2 samples"),
        ("0,0\n1,x\n", ":2"),
        ("".join(f"{i},1\n" for i in range(9)), "--measured-unit"),
        ("t [s],z [bar]\n" + "".join(f"{i},1\n" for i in range(9)), "no unit of length"),
        ("t [h],z [mm]\n" + "".join(f"{i},1\n" for i in range(9)), "'h'"),
        ("0,0\n1,nan\n", "finite"),
        ("", "0 samples"),
    ],
)
def test_a_file_that_cannot_be_used_is_one_sentence(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "gauge.csv"
    path.write_text(text)
    with pytest.raises(ResultFileError, match=words):
        read_measurement(path)


def test_a_file_that_is_not_there_or_not_text(tmp_path: Path) -> None:
    with pytest.raises(ResultFileError, match="cannot be read"):
        read_measurement(tmp_path / "nowhere.csv")
    (tmp_path / "noise.csv").write_bytes(b"\xff\xfe\x00\x81")
    with pytest.raises(ResultFileError, match="UTF-8"):
        read_measurement(tmp_path / "noise.csv")


def drilling(t: np.ndarray) -> np.ndarray:
    """A start that is never repeated, then 48 Hz with its harmonic and a slow turn [m]."""
    slow = 4e-4 * np.sin(2 * math.pi * 2 * t + 0.3)
    blows = 1e-3 * np.sin(2 * math.pi * 48 * t) + 3e-5 * np.sin(2 * math.pi * 96 * t + 1)
    return (1 - np.exp(-((t / 0.4) ** 2))) * (slow + blows) + 2e-4 * np.exp(-t) * np.sin(7 * t)


@pytest.mark.parametrize("rate", [1000, 500, 250, 200, 150, 125, 100, 97])
def test_a_perfect_measurement_of_any_rate_that_holds_the_vibration_agrees(rate: int) -> None:
    t = np.arange(int(5 * rate)) / rate
    found = compare_with(TIME, drilling(TIME), Measurement(t, drilling(t), ""))
    assert found is not None
    # Straight lines between samples lost 18 % of 48 Hz at 200 Hz, all of it at 100 Hz. What is left is the error of the
    # spline through 1000 Hz: (2 pi 96 / 1000)^4 / 384 of the harmonic, and the shift, found to 1e-7 s.
    assert found.rms_error < 2e-3
    assert abs(found.peak_error) < 2e-3
    assert abs(found.shift) < 1e-5
    assert found.correlation > 0.99999
    assert not found.reversed


@pytest.mark.parametrize("rate", [125, 100])
def test_an_instrument_that_filters_before_it_samples_agrees_too(rate: int) -> None:
    def filtered(t: np.ndarray) -> np.ndarray:
        return 4e-4 * np.sin(2 * math.pi * 2 * t + 0.3) + 1e-3 * np.sin(2 * math.pi * 44 * t) + 2e-4 * np.sin(0.9 * t)

    t = np.arange(int(5 * rate)) / rate
    run = filtered(TIME) + 1e-4 * np.sin(2 * math.pi * 88 * TIME + 1)
    found = compare_with(TIME, run, Measurement(t, filtered(t), ""), 0.0)
    assert found is not None
    assert any("compared without it" in note and "half the rate" in note for note in found.notes)
    # 1e-4 of 1e-3: 9 % were left without the filter; what is left is its ringing at the two ends of the run.
    assert found.rms_error < 0.02
    again = compare_with(TIME, run, Measurement(t, np.interp(t, TIME, run), ""), 0.0)
    assert again is not None
    assert any("compared with it" in note for note in again.notes)


def test_means_and_errors_are_those_of_the_overlap() -> None:
    late = TIME >= 2.0
    found = compare_with(TIME, drilling(TIME), Measurement(TIME[late], drilling(TIME)[late] + 0.4, ""), 0.0)
    assert found is not None
    assert found.correlation == pytest.approx(1.0, abs=1e-9)
    assert found.rms_error < 1e-9


def test_a_reversed_sign_is_said_with_the_error_it_hides() -> None:
    t = TIME[::5]
    free = compare_with(TIME, drilling(TIME), Measurement(t, -drilling(t), ""))
    fixed = compare_with(TIME, drilling(TIME), Measurement(t, -drilling(t), ""), shift=0.0)
    for found in (free, fixed):
        assert found is not None
        assert found.reversed
        assert any("sign (polarity) of the measurement seems reversed" in note for note in found.notes)
    assert any("RMS error is then 0.0 %" in note for note in free.notes)
    assert fixed.rms_error == pytest.approx(2.0, abs=1e-6)


def test_of_a_sine_neither_the_shift_nor_the_sign_can_be_told_and_that_is_said() -> None:
    wave = np.sin(2 * math.pi * 5 * TIME)
    found = compare_with(TIME, wave, Measurement(TIME[1000:4000], wave[1000:4000], ""))
    assert found is not None
    assert any("other shifts fit as well" in note and "--shift" in note for note in found.notes)
    assert any("with its sign turned it fits as well" in note for note in found.notes)
    assert not found.reversed


def test_a_shift_that_is_given_is_kept() -> None:
    t = np.arange(1.0, 4.0, 1 / 500)
    found = compare_with(TIME, signal(TIME), Measurement(t + 10.0, signal(t), ""), shift=-10.0)
    assert found is not None
    assert found.shift == -10.0
    assert found.rms_error < 1e-6
    off = compare_with(TIME, signal(TIME), Measurement(t + 10.0, signal(t), ""), shift=-9.9)
    assert off is not None
    assert off.rms_error > 0.3


def test_gaps_are_left_out_and_said() -> None:
    there = (TIME < 1.5) | (TIME > 3.5)
    found = compare_with(TIME, drilling(TIME), Measurement(TIME[there][::5], drilling(TIME)[there][::5], ""))
    assert found is not None
    assert found.rms_error < 1e-6
    assert len(found.gaps) == 1
    np.testing.assert_allclose(found.gaps[0], [1.495, 3.505], atol=0.011)
    assert any("gaps of the measurement are left out: 1" in note for note in found.notes)


def test_samples_outside_the_run_are_counted() -> None:
    t = np.arange(0.0, 8.0, 1e-2)
    found = compare_with(TIME, drilling(TIME), Measurement(t, np.where(t <= 5, drilling(np.minimum(t, 5)), 0), ""), 0.0)
    assert found is not None
    assert found.excluded == 299
    assert any("299 of 800 measured samples lie outside the run" in note for note in found.notes)


def test_a_unit_asked_for_against_the_header_is_said(tmp_path: Path) -> None:
    path = tmp_path / "gauge.csv"
    path.write_text("time [s],z [m]\n" + "".join(f"{i},{i}\n" for i in range(9)))
    assert any("mm, as asked, although the header says m" in note for note in read_measurement(path, "mm").notes)
    assert read_measurement(path, "m").notes == ()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("t [s];z [mm]\n" + "".join(f"{i},5;1,5\n" for i in range(9)), "decimal comma"),
        ("t [s],x [mm],z [mm]\n" + "".join(f"{i},1,2\n" for i in range(9)), "3 columns"),
        ("t [s],z [mm]\n" + "".join(f"{i} {i}\n" for i in range(9)), "comma, a semicolon or a tab"),
    ],
)
def test_a_file_that_could_be_misread_is_refused(tmp_path: Path, text: str, words: str) -> None:
    (tmp_path / "gauge.csv").write_text(text)
    with pytest.raises(ResultFileError, match=words):
        read_measurement(tmp_path / "gauge.csv")


@settings(max_examples=30, deadline=None)
@given(
    rate=st.integers(100, 900),
    shift=st.floats(-50, 50),
    gain=st.sampled_from([-3.0, -1.0, 0.5, 1.0, 2.0]),
    start=st.floats(0.0, 1.0),
)
def test_of_a_perfect_measurement_shift_gain_and_sign_are_found_at_any_rate(
    rate: int, shift: float, gain: float, start: float
) -> None:
    t = start + np.arange(int(3.5 * rate)) / rate
    found = compare_with(TIME, signal(TIME), Measurement(t - shift, gain * signal(t) + 0.2, ""))
    assert found is not None
    assert found.reversed == (gain < 0)
    if gain > 0:
        # Of the shift 1e-6 s: 1e-7 asked for, over a signal of 13 Hz.
        assert found.shift == pytest.approx(shift, abs=2e-6)
        assert found.rms_error == pytest.approx(abs(1 / gain - 1), abs=1e-3)
