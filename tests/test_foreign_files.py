"""Files of somebody else are data: what they declare is bounded before it is read, and they lead to no other file."""

from __future__ import annotations

import json
import os
import shutil
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pyarrow
import pyarrow.parquet
import pytest
import rigs

from drillrig_pin.analysis.measured import read_measurement
from drillrig_pin.batch.cases import model_fingerprint
from drillrig_pin.batch.importance import FILE, FORMAT, load_sensitivity
from drillrig_pin.batch.parquet import for_spreadsheets
from drillrig_pin.batch.runner import run_study
from drillrig_pin.batch.store import TABLE, recorded
from drillrig_pin.batch.study import Study
from drillrig_pin.batch.table import read_table
from drillrig_pin.errors import ResultFileError
from drillrig_pin.rig import load_rig_text
from drillrig_pin.scenario import Scenario
from drillrig_pin.simulation import simulate
from drillrig_pin.trajectory import load_trajectory

MANY = 500_000_000
Change = Callable[[h5py.File, Path], None]


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("good") / "run.nc"
    simulate(load_rig_text(rigs.mass_on_cylinder()), Scenario(duration=0.02)).save(path)
    return path


def instead(file: h5py.File, name: str, **settings: Any) -> h5py.Dataset:
    del file[name]
    return file.create_dataset(name, **settings)


def nobody_wrote(file: h5py.File, _: Path) -> None:
    instead(file, "time", shape=(MANY,), chunks=(1 << 16,), compression="gzip", dtype="f8")


def filled(file: h5py.File, _: Path) -> None:
    instead(file, "time", shape=(MANY,), chunks=(1 << 16,), fillvalue=1.0, dtype="i1")


def in_one_piece(file: h5py.File, _: Path) -> None:
    instead(file, "time", shape=(20,), maxshape=(None,), chunks=(1 << 28,), dtype="f8")


def unfolding(file: h5py.File, _: Path) -> None:
    data = instead(file, "time", shape=(20,), chunks=(20,), compression="gzip", dtype="f8")
    data.id.write_direct_chunk((0,), zlib.compress(bytes(10_000_000)))


def of_objects(file: h5py.File, _: Path) -> None:
    instead(file, "time", shape=(20,), dtype=h5py.string_dtype())


def a_group(file: h5py.File, _: Path) -> None:
    del file["time"]
    file.create_group("time")


def linked(file: h5py.File, folder: Path) -> None:
    del file["time"]
    file["time"] = h5py.ExternalLink(str(folder / "secret.h5"), "time")


def linked_within(file: h5py.File, _: Path) -> None:
    file.move("time", "when")
    file["time"] = h5py.SoftLink("/when")


def group_linked(file: h5py.File, folder: Path) -> None:
    file.attrs["record"] = "record"
    if "record" in file:
        del file["record"]
    file["record"] = h5py.ExternalLink(str(folder / "secret.h5"), "/")


def virtual(file: h5py.File, folder: Path) -> None:
    layout = h5py.VirtualLayout(shape=(20,), dtype="f8")
    layout[:] = h5py.VirtualSource(str(folder / "secret.h5"), "time", shape=(20,))
    del file["time"]
    file.create_virtual_dataset("time", layout)


def outside(file: h5py.File, folder: Path) -> None:
    instead(file, "time", shape=(20,), dtype="f8", external=[(str(folder / "secret.h5"), 0, 160)])


def filtered(file: h5py.File, _: Path) -> None:
    # Declared, not applied: no such filter need be installed to say that a reader must have it.
    settings = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    settings.set_chunk((20,))
    settings.set_filter(h5py.h5z.FILTER_LZF, h5py.h5z.FLAG_OPTIONAL, ())
    del file["time"]
    space = h5py.h5s.create_simple((20,))
    h5py.h5d.create(file.id, b"time", h5py.h5t.NATIVE_DOUBLE, space, dcpl=settings)


def many_names(file: h5py.File, _: Path) -> None:
    instead(file, "joint", shape=(MANY,), chunks=(1 << 16,), dtype=h5py.string_dtype())


def wide_names(file: h5py.File, _: Path) -> None:
    instead(file, "joint", shape=(1,), dtype=f"S{MANY}", chunks=(1,))


def many_attributes(file: h5py.File, _: Path) -> None:
    for i in range(300):
        file.attrs[f"a{i}"] = i


def deep_words(file: h5py.File, _: Path) -> None:
    file.attrs["scenario"] = "[" * 50_000


CHANGES = [
    *(nobody_wrote, filled, in_one_piece, unfolding, of_objects, a_group, linked, linked_within, group_linked),
    *(virtual, outside, filtered, many_names, wide_names, many_attributes, deep_words),
]


@pytest.mark.parametrize("change", CHANGES, ids=lambda change: change.__name__)
def test_a_result_file_that_is_no_plain_data_is_refused_in_a_sentence(
    good: Path, change: Change, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with h5py.File(tmp_path / "secret.h5", "w") as secret:
        secret["time"] = np.arange(20.0)
    path = tmp_path / "run.nc"
    shutil.copy(good, path)
    with h5py.File(path, "r+") as file:
        change(file, tmp_path)
    largest = 0

    def counted(given: Any, **named: Any) -> Any:
        nonlocal largest
        found = original(given, **named)
        largest = max(largest, found.nbytes)
        return found

    original = np.asarray
    monkeypatch.setattr(np, "asarray", counted)
    with pytest.raises(ResultFileError, match="not readable as a result file"):
        load_trajectory(path)
    assert largest < 10_000_000


def test_a_packed_file_of_another_tool_is_read(good: Path, tmp_path: Path) -> None:
    path = tmp_path / "run.nc"
    shutil.copy(good, path)
    with h5py.File(path, "r+") as file:
        times = file["time"][...]
        del file["time"]
        file.create_dataset("time", data=times, compression="gzip", shuffle=True, fletcher32=True)
    assert np.array_equal(load_trajectory(path).time, times)


def test_a_pipe_is_no_result_and_holds_nobody_up(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "run.nc")
    with pytest.raises(ResultFileError, match="no regular file"):
        load_trajectory(tmp_path / "run.nc")
    (tmp_path / "journal").mkdir()
    os.mkfifo(tmp_path / "journal" / "000001-a.jsonl")
    with pytest.raises(ResultFileError, match="no regular file"):
        list(recorded(tmp_path))
    os.mkfifo(tmp_path / FILE)
    with pytest.raises(ResultFileError, match="no regular file"):
        load_sensitivity(tmp_path)
    (tmp_path / "m.xacro").write_text("<robot/>")
    os.mkfifo(tmp_path / "beside.csv")
    assert model_fingerprint(str(tmp_path / "m.xacro"))


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("study")
    model = folder / "m.urdf"
    model.write_text(rigs.mass_on_cylinder())
    case = {"model": str(model), "duration": 0.02}
    axes = [{"name": "scenario.output_rate", "list": [500, 1000]}]
    run_study(Study(scenario=case, axes=axes, metrics=["trust.*"]), folder, workers=1)
    return folder


def replaced(table: pyarrow.Table, name: str, values: Any) -> pyarrow.Table:
    column = pyarrow.array(values)
    return table.set_column(table.column_names.index(name), pyarrow.field(name, column.type), column)


def told(table: pyarrow.Table, name: bytes, text: str) -> pyarrow.Table:
    return table.replace_schema_metadata({**table.schema.metadata, name: text})


TABLES: dict[str, Callable[[pyarrow.Table], pyarrow.Table]] = {
    "rows": lambda t: pyarrow.table({"case": pyarrow.nulls(2_000_000)}).replace_schema_metadata(t.schema.metadata),
    "one long word many times": lambda t: replaced(
        pyarrow.concat_tables([t] * 5000), "reason", pyarrow.DictionaryArray.from_arrays([0] * 10_000, ["x" * 10**6])
    ),
    "lists": lambda t: replaced(t, "reason", [["a"], ["b"]]),
    "numbers for words": lambda t: replaced(t, "status", [1, 2]),
    "key of a path": lambda t: replaced(t, "key", ["/../../a", "b"]),
    "no key": lambda t: t.drop_columns(["key"]),
    "units of another kind": lambda t: told(t, b"units", "[1]"),
    "study of another kind": lambda t: told(t, b"study", "[1]"),
    "deep": lambda t: told(t, b"study", "[" * 100_000),
}


@pytest.mark.parametrize("change", TABLES.values(), ids=TABLES)
def test_a_table_that_is_none_of_a_study_is_refused_in_a_sentence(
    study: Path, change: Callable[[pyarrow.Table], pyarrow.Table], tmp_path: Path
) -> None:
    table = change(pyarrow.parquet.read_table(study / TABLE))
    pyarrow.parquet.write_table(table, tmp_path / TABLE)
    assert (tmp_path / TABLE).stat().st_size < 2_000_000
    with pytest.raises(ResultFileError, match="is not a table that can be read here"):
        read_table(tmp_path)


def test_values_that_an_axis_lists_come_back_as_they_were_given(study: Path) -> None:
    table = read_table(study)
    assert table.given == {"scenario.output_rate": {500.0: 500, 1000.0: 1000}}
    assert table.model


def test_indices_of_another_kind_are_refused(tmp_path: Path) -> None:
    (tmp_path / FILE).write_text(json.dumps({"format": FORMAT, "study": 1, "indices": [{"metric": {}}]}))
    with pytest.raises(ResultFileError, match="is not the file of a sensitivity study"):
        load_sensitivity(tmp_path)


def test_a_measurement_without_end_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("drillrig_pin.analysis.measured.MAX_BYTES", 100_000)
    with pytest.raises(ResultFileError, match="larger than"):
        read_measurement(Path("/dev/zero"))


def test_words_of_a_table_are_no_formulas() -> None:
    table = pyarrow.table({"=cmd": ["=cmd|'/c calc'!A1", "-0.5", None], "n": [-1.5, 2.0, None]})
    found = for_spreadsheets(table)
    assert found.column_names == ["'=cmd", "n"]
    assert found.column(0).to_pylist() == ["'=cmd|'/c calc'!A1", "-0.5", None]
    assert found.column(1).to_pylist() == [-1.5, 2.0, None]
