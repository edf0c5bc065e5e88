"""A measurement beside a run: read with its unit, shifted to where it belongs, and judged."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

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
