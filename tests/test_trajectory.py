"""A result and its files: saved and loaded without loss, run again from the file alone, readable by other tools."""

from __future__ import annotations

import csv
from pathlib import Path

import h5netcdf
import numpy as np
import pytest
import xarray
from rigs import floating_body, four_bar
from scipy.io import loadmat

from drillrig_pin import ResultFileError, Rig, Scenario, Trajectory, load_rig_text, load_trajectory, simulate
from drillrig_pin.trajectory import DIMENSIONS, VARIABLES

#: As the requirements list them, and what reports need beside: coordinates of the elements that are no cylinders.
REQUIRED = {
    "q": ("joint",),
    "v": ("dof",),
    "a": ("dof",),
    "reaction": ("constraint",),
    "constraint_error": ("constraint",),
    "constraint_rate": ("constraint",),
    "cylinder_length": ("cylinder",),
    "cylinder_force": ("cylinder",),
    "pressure_a": ("cylinder",),
    "pressure_b": ("cylinder",),
    "point_position": ("point", "axis"),
    "point_displacement": ("point", "axis"),
    "load_value": ("load",),
    "energy_kinetic": (),
    "energy_potential": (),
    "energy_elastic": (),
    "work_input": (),
    "work_dissipated": (),
}


@pytest.fixture(scope="module")
def run(mkz49: Rig) -> Trajectory:
    return simulate(mkz49, Scenario(duration=0.05, text="für ¼ drehung"))


@pytest.fixture(scope="module")
def bare() -> Trajectory:
    """A run without cylinders, loads or elements: empty dimensions."""
    start = {"crank_joint": 0.4, "coupler_joint": 0.3, "rocker_joint": 1.2}
    return simulate(load_rig_text(four_bar()), Scenario(duration=0.02, positions=start))


@pytest.mark.parametrize("which", ["run", "bare"])
def test_a_saved_trajectory_comes_back_bit_by_bit(which: str, tmp_path: Path, request: pytest.FixtureRequest) -> None:
    saved: Trajectory = request.getfixturevalue(which)
    saved.save(tmp_path / "run.nc")
    loaded = load_trajectory(tmp_path / "run.nc")
    np.testing.assert_array_equal(loaded.time, saved.time)
    assert set(loaded.arrays) == set(saved.arrays) == set(VARIABLES)
    for name, values in saved.arrays.items():
        np.testing.assert_array_equal(loaded.arrays[name], values, err_msg=name)
        assert loaded.arrays[name].shape == values.shape, name
    for attribute in ("labels", "outcome", "scenario", "model", "arguments", "cost", "notes", "content_hash"):
        assert getattr(loaded, attribute) == getattr(saved, attribute), attribute


def test_a_run_repeated_from_its_file_alone_is_bit_identical(run: Trajectory, tmp_path: Path) -> None:
    run.save(tmp_path / "run.nc")
    file = load_trajectory(tmp_path / "run.nc")
    again = simulate(load_rig_text(file.model), file.scenario)
    for name, values in run.arrays.items():
        np.testing.assert_array_equal(again.arrays[name], values, err_msg=name)
    assert again.content_hash == run.content_hash


def test_the_content_hash_changes_with_model_and_case_and_nothing_else(run: Trajectory, mkz49: Rig) -> None:
    short = {"duration": 0.002}
    reference = simulate(mkz49, Scenario(**short)).content_hash
    assert simulate(mkz49, Scenario(**short)).content_hash == reference
    assert simulate(mkz49, Scenario(duration=0.003)).content_hash != reference
    assert simulate(mkz49, Scenario(**short, integrator={"rtol": 1e-9})).content_hash != reference
    other = load_rig_text(mkz49.file.text.replace('stiffness="2000000.0"', 'stiffness="2000001.0"'))
    assert other.file.text != mkz49.file.text
    assert simulate(other, Scenario(**short)).content_hash != reference


def test_the_dataset_has_the_required_dimensions_variables_and_units(run: Trajectory) -> None:
    dataset = run.dataset
    assert {*DIMENSIONS, "axis", "time"} == set(dataset.sizes)
    for name, dims in REQUIRED.items():
        assert dataset[name].dims == ("time", *dims), name
    for name in dataset.data_vars:
        assert dataset[name].attrs["units"], name
        assert dataset[name].attrs["long_name"], name
    assert dataset["time"].attrs["units"] == "s"
    assert list(dataset["point"].values) == ["E", "T", "S"]
    assert list(dataset["constraint"].values) == ["face.y", "face.z"]
    chosen = dataset["point_displacement"].sel(point="S", axis="z")
    np.testing.assert_array_equal(chosen.values, run.of("point_displacement", "S", "z"))


def test_the_file_is_plain_netcdf_for_other_tools(run: Trajectory, tmp_path: Path) -> None:
    run.save(tmp_path / "run.nc")
    with xarray.open_dataset(tmp_path / "run.nc", engine="h5netcdf") as dataset:
        # Decoded values stay numbers and seconds stay seconds only if units mean no calendar.
        xarray.testing.assert_allclose(dataset["q"].drop_attrs(), run.dataset["q"].drop_attrs())
        assert dataset["pressure_a"].attrs["units"] == "Pa"
        assert dataset.attrs["content_hash"] == run.content_hash


def test_csv_holds_every_number_with_all_its_digits(run: Trajectory, tmp_path: Path) -> None:
    run.to_csv(tmp_path / "run.csv")
    with (tmp_path / "run.csv").open() as stream:
        rows = list(csv.reader(stream))
    table = np.array(rows[1:], dtype=float)
    assert table.shape == (len(run.time), len(rows[0]))
    assert len(set(rows[0])) == len(rows[0])
    np.testing.assert_array_equal(table[:, rows[0].index("time [s]")], run.time)
    np.testing.assert_array_equal(table[:, rows[0].index("point_position.S.z [m]")], run.of("point_position", "S", "z"))
    np.testing.assert_array_equal(table[:, rows[0].index("reaction.face.z [N or N*m]")], run.of("reaction", "face.z"))


def test_mat_holds_every_array_with_labels_and_units(run: Trajectory, tmp_path: Path) -> None:
    run.to_mat(tmp_path / "run.mat")
    mat = loadmat(tmp_path / "run.mat", simplify_cells=True)
    np.testing.assert_array_equal(mat["time"], run.time)
    for name, values in run.arrays.items():
        np.testing.assert_array_equal(np.asarray(mat[name]).reshape(values.shape), values, err_msg=name)
    assert list(mat["labels"]["point"]) == ["E", "T", "S"]
    assert mat["units"]["pressure_a"] == "Pa"


def test_columns_and_arrays_are_had_by_name(run: Trajectory) -> None:
    np.testing.assert_array_equal(run.of("q", "boom_lift"), run.q[:, 1])
    with pytest.raises(ResultFileError, match=r"no cylinder 'lift'.*lift_cylinder"):
        run.of("cylinder_force", "lift")
    with pytest.raises(ResultFileError, match="no axis 'w'"):
        run.of("point_position", "S", "w")
    with pytest.raises(AttributeError, match=r"'pressure'.*pressure_a"):
        _ = run.pressure


def test_its_repr_says_how_the_run_ended(run: Trajectory) -> None:
    assert "completed" in repr(run)
    assert len(repr(run)) < 2000


def test_free_bodies_have_a_name_for_every_coordinate(tmp_path: Path) -> None:
    run = simulate(load_rig_text(floating_body()), Scenario(duration=0.01))
    assert run.labels["joint"] == [f"free.{c}" for c in ("x", "y", "z", "qx", "qy", "qz", "qw")]
    assert run.labels["dof"] == [f"free.{c}" for c in ("vx", "vy", "vz", "wx", "wy", "wz")]


def test_a_file_that_is_no_result_is_refused_in_one_sentence(run: Trajectory, tmp_path: Path) -> None:
    with pytest.raises(ResultFileError, match="no such result file"):
        load_trajectory(tmp_path / "none.nc")
    (tmp_path / "text.nc").write_text("hello")
    with pytest.raises(ResultFileError, match="not readable as a result file"):
        load_trajectory(tmp_path / "text.nc")
    with h5netcdf.File(tmp_path / "other.nc", "w") as file:
        file.dimensions = {"x": 3}
    with pytest.raises(ResultFileError, match=r"not .* result file"):
        load_trajectory(tmp_path / "other.nc")
    run.save(tmp_path / "run.nc")
    whole = (tmp_path / "run.nc").read_bytes()
    (tmp_path / "half.nc").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(ResultFileError, match="not readable as a result file"):
        load_trajectory(tmp_path / "half.nc")


@pytest.mark.parametrize("method", ["save", "to_csv", "to_mat"])
def test_a_failed_write_says_so_and_leaves_nothing(run: Trajectory, tmp_path: Path, method: str) -> None:
    with pytest.raises(ResultFileError, match="cannot be written"):
        getattr(run, method)(tmp_path / "no_such_folder" / "run")
    assert not list(tmp_path.iterdir())
    # A write that breaks halfway: neither a half file nor a scrap, and the older result stays.
    target = tmp_path / "run"
    target.write_text("older result")
    broken = Trajectory(**{**run.__dict__, "arrays": {**run.arrays, "q": None}})
    with pytest.raises(Exception, match=r".+"):
        getattr(broken, method)(target)
    assert target.read_text() == "older result"
    assert list(tmp_path.iterdir()) == [target]
