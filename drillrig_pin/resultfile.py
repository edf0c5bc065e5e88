"""Result files: NetCDF-4 that holds all that is needed to run again; CSV and MATLAB for other tools."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np

from drillrig_pin.errors import Outcome, ResultFileError, Status
from drillrig_pin.files import write_aside
from drillrig_pin.model.nodes import short_path
from drillrig_pin.scenario import Scenario
from drillrig_pin.trajectory import AXES, DIMENSIONS, VARIABLES, Trajectory, flat_columns, versions

FORMAT = "drillrig trajectory 1"


def save(trajectory: Trajectory, path: Path) -> None:
    """Write a trajectory to NetCDF-4.

    Raises:
        ResultFileError: the folder does not exist or cannot be written.
    """
    import h5netcdf

    try:
        with write_aside(path) as aside, h5netcdf.File(aside, "w") as file:
            file.dimensions = {"time": len(trajectory.time), "axis": len(AXES)} | {
                dim: len(trajectory.labels[dim]) for dim in DIMENSIONS
            }
            _put(file, "time", ("time",), trajectory.time, "s", "time")
            for name, meaning in VARIABLES.items():
                _put(file, name, ("time", *meaning.dims), trajectory.arrays[name], meaning.unit, meaning.text)
            for dim, labels in [*trajectory.labels.items(), ("axis", list(AXES))]:
                variable = file.create_variable(dim, (dim,), dtype=_text_type())
                if labels:
                    variable[:] = np.array(labels, dtype=object)
            file.attrs.update(_attributes(trajectory))
    except OSError as error:
        raise ResultFileError(
            f"cannot be written ({error.strerror or error})", where=short_path(path), todo="Check folder and free space."
        ) from None


def _text_type() -> Any:
    import h5py

    return h5py.string_dtype()


def _put(file: Any, name: str, dims: tuple[str, ...], values: Any, unit: str, text: str) -> None:
    variable = file.create_variable(name, dims, dtype="f8")
    if values.size:
        variable[...] = values
    variable.attrs["units"] = unit
    variable.attrs["long_name"] = text


def _attributes(trajectory: Trajectory) -> dict[str, str | float]:
    outcome = trajectory.outcome
    return {
        "format": FORMAT,
        "title": trajectory.scenario.name,
        "model": trajectory.model,
        "arguments": json.dumps(trajectory.arguments),
        "scenario": trajectory.scenario.model_dump_json(),
        "versions": json.dumps(versions()),
        "content_hash": trajectory.content_hash,
        "status": outcome.status.name,
        "end_time": float(outcome.time),
        "steps": float(outcome.steps),
        "cause": outcome.cause,
        "cost": json.dumps(trajectory.cost),
        "notes": json.dumps(trajectory.notes),
    }


def load_trajectory(path: str | Path) -> Trajectory:
    """Read a result file back.

    Raises:
        ResultFileError: not there, not a result file of this package, or damaged.
    """
    import h5netcdf

    where = short_path(path)
    try:
        with h5netcdf.File(path, "r") as file:
            attributes = dict(file.attrs)
            if attributes.get("format") != FORMAT:
                raise ResultFileError("not a result file of drillrig", where=where)
            arrays = {name: np.asarray(file.variables[name][...], dtype=float) for name in VARIABLES}
            labels = {dim: [_text(word) for word in file.variables[dim][...]] for dim in DIMENSIONS}
            time = np.asarray(file.variables["time"][...], dtype=float)
        outcome = Outcome(
            Status[attributes["status"]],
            float(attributes["end_time"]),
            int(attributes["steps"]),
            str(attributes["cause"]),
        )
        return Trajectory(
            time,
            arrays,
            labels,
            outcome,
            Scenario(**json.loads(attributes["scenario"])),
            str(attributes["model"]),
            json.loads(attributes["arguments"]),
            json.loads(attributes["cost"]),
            tuple(json.loads(attributes["notes"])),
        )
    except ResultFileError:
        raise
    except FileNotFoundError:
        raise ResultFileError("no such result file", where=where, todo="Check the path.") from None
    except Exception as error:
        # Whatever a damaged file makes the reader trip over, to the user it is a damaged file.
        reason = " ".join(str(error).split())[:200] or type(error).__name__
        raise ResultFileError(f"not readable as a result file ({reason})", where=where) from None


def _text(word: Any) -> str:
    return word.decode() if isinstance(word, bytes) else str(word)


def to_csv(trajectory: Trajectory, path: Path) -> None:
    """One wide table; ResultFileError if it cannot be written."""
    names, table = flat_columns(trajectory)
    try:
        with write_aside(path) as aside, aside.open("w", newline="") as stream:
            csv.writer(stream).writerow(names)
            np.savetxt(stream, table, fmt="%.17g", delimiter=",")
    except OSError as error:
        raise ResultFileError(f"cannot be written ({error.strerror})", where=short_path(path)) from None


def to_mat(trajectory: Trajectory, path: Path) -> None:
    """MATLAB 5 file with every variable, ``time``, ``labels`` and ``units``; ResultFileError if not writable."""
    from scipy.io import savemat

    content: dict[str, Any] = {"time": trajectory.time[:, None], **trajectory.arrays}
    content["labels"] = {dim: np.array(words, dtype=object) for dim, words in trajectory.labels.items()}
    content["units"] = {name: meaning.unit for name, meaning in VARIABLES.items()}
    content["content_hash"] = trajectory.content_hash
    try:
        with write_aside(path) as aside, aside.open("wb") as stream:
            savemat(stream, content, long_field_names=True)
    except OSError as error:
        raise ResultFileError(f"cannot be written ({error.strerror})", where=short_path(path)) from None
