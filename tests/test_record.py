"""The record of a run: statistics do not depend on the output rate, and a file keeps what they are taken from."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import h5netcdf
import numpy as np
import pytest
from rigs import point_mass

from drillrig_pin import Scenario, Trajectory, load_rig_text, load_trajectory, simulate
from drillrig_pin.trajectory import VARIABLES, Kept


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
    run: Trajectory, frequency: float | None, shown: bool
) -> None:
    assert replace(run, load_frequency=frequency).samples_show_loads is shown
