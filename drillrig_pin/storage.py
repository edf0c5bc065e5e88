"""Files of arrays: NetCDF-4, CSV and MATLAB, written aside and renamed. Knows nothing of what the arrays mean."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from drillrig_pin import hdf5
from drillrig_pin.errors import ResultFileError
from drillrig_pin.escaping import cell
from drillrig_pin.files import saving
from drillrig_pin.model.nodes import short_path


class Column(NamedTuple):
    """One array with its dimensions, unit and description."""

    dims: tuple[str, ...]
    values: Any
    unit: str
    text: str


def write_netcdf(
    path: Path,
    columns: Mapping[str, Column],
    labels: Mapping[str, Sequence[str]],
    attributes: Mapping[str, str | float],
    groups: Mapping[str, Mapping[str, Column]] | None = None,
) -> None:
    """Write columns, names along dimensions and attributes to NetCDF-4; further columns into groups of their own.

    A dimension of a group is its own if its size is not the one at the top.

    Raises:
        ResultFileError: the folder does not exist, is not writable or is full.
    """
    import h5netcdf
    import h5py

    sizes = {dim: len(words) for dim, words in labels.items()}
    for column in columns.values():
        sizes.update(zip(column.dims, np.shape(column.values), strict=True))
    # Made in memory: a disk that fills up under the library's hands can take the whole process with it.
    content = io.BytesIO()
    with h5netcdf.File(content, "w") as file:
        file.dimensions = sizes
        _write_columns(file, columns)
        for name, inner in (groups or {}).items():
            group = file.create_group(name)
            of_group = {
                dim: n for column in inner.values() for dim, n in zip(column.dims, np.shape(column.values), strict=True)
            }
            group.dimensions = {dim: n for dim, n in of_group.items() if sizes.get(dim) != n}
            _write_columns(group, inner)
        for dim, words in labels.items():
            variable = file.create_variable(dim, (dim,), dtype=h5py.string_dtype())
            if words:
                variable[:] = np.array(words, dtype=object)
        file.attrs.update(attributes)
    with _saving(path) as aside:
        aside.write_bytes(content.getbuffer())


def _write_columns(group: Any, columns: Mapping[str, Column]) -> None:
    for name, column in columns.items():
        variable = group.create_variable(name, column.dims, dtype="f8")
        if np.size(column.values):
            variable[...] = column.values
        variable.attrs["units"] = column.unit
        variable.attrs["long_name"] = column.text


def read_netcdf(
    path: Path, columns: Iterable[str], dims: Iterable[str], group: str = ""
) -> tuple[dict[str, Any], dict[str, list[str]], dict[str, Any]]:
    """Read arrays, names along dimensions and attributes, at the top or in a group.

    Raises:
        ResultFileError: not there, damaged, or declaring more than a file of its size can hold.
    """
    import h5py

    if not os.path.lexists(path):
        raise ResultFileError("no such result file", where=short_path(path), todo="Check the path.")
    try:
        if not os.path.isfile(path):
            raise OSError("it is no regular file")
        # What NetCDF adds to HDF5 is not needed here, and would be read without bounds.
        with h5py.File(path, "r") as whole:
            file = hdf5.member(whole, group) if group else whole
            attributes = {name: _clean(value) for name, value in hdf5.attributes(file).items()}
            arrays = hdf5.arrays(path, file, columns)
            labels = {dim: [_text(word) for word in hdf5.words(file, dim)] for dim in dims}
    except Exception as error:
        raise damaged(path, error) from None
    return arrays, labels, attributes


def damaged(path: Path, error: Exception) -> ResultFileError:
    """Whatever a damaged file makes a reader trip over, to the user it is a damaged file."""
    reason = " ".join(str(error).split())[:200] or type(error).__name__
    return ResultFileError(f"not readable as a result file ({reason})", where=short_path(path))


def write_csv(path: Path, names: Sequence[str], table: Any) -> None:
    """Write a table with a header line; every value with all its digits. ResultFileError if not writable."""
    with _saving(path) as aside, aside.open("w", newline="") as stream:
        csv.writer(stream).writerow(map(cell, names))
        np.savetxt(stream, table, fmt="%.17g", delimiter=",")


def write_mat(path: Path, content: Mapping[str, Any]) -> None:
    """Write a MATLAB 5 file. ResultFileError if not writable."""
    from scipy.io import savemat

    with _saving(path) as aside, aside.open("wb") as stream:
        savemat(stream, dict(content), long_field_names=True)


def _saving(path: Path) -> AbstractContextManager[Path]:
    return saving(path, where=short_path(path), todo="Check folder and free space.")


def _text(word: Any) -> str:
    return str(_clean(word.decode() if isinstance(word, bytes) else str(word)))


def _clean(value: Any) -> Any:
    """ValueError for text of damaged bytes, which h5py hands over in a form that nothing can write again."""
    if isinstance(value, str):
        value.encode()
    return value
