"""The result of a run: plain arrays with declared meaning, labels, status and provenance."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from pydantic import TypeAdapter

from drillrig_pin.columns import unit_of
from drillrig_pin.errors import Outcome, ResultFileError, Status, legal_names
from drillrig_pin.kinematics import Array
from drillrig_pin.model.nodes import short_path
from drillrig_pin.older import count_turns
from drillrig_pin.scenario import Scenario
from drillrig_pin.storage import Column, damaged, read_netcdf, write_csv, write_mat, write_netcdf

if TYPE_CHECKING:
    import xarray

AXES = ("x", "y", "z")
FORMAT = "drillrig trajectory 2"
#: Name of the estimated error among the costs of a run.
ESTIMATE = "estimated_error"
#: Where a file keeps the rows of statistics: nowhere else than the samples, or in a group of their own.
SAMPLES, GROUP = "samples", "record"
#: Samples per period of the fastest load from which its vibration can be told from a slower one.
SHOWING = 2.5


class Variable(NamedTuple):
    """Meaning of one array: dimensions after time, unit, description."""

    dims: tuple[str, ...]
    unit: str
    text: str


#: Every array of a result, declared once. The unit of joint quantities depends on the joint: rad or m.
VARIABLES: dict[str, Variable] = {
    "q": Variable(("joint",), "rad or m", "joint positions"),
    "v": Variable(("dof",), "rad/s or m/s", "joint velocities"),
    "a": Variable(("dof",), "rad/s^2 or m/s^2", "joint accelerations"),
    "reaction": Variable(
        ("constraint",), "N or N*m", "multipliers: force on a held point in world axes; in a loop, on link 2"
    ),
    "constraint_error": Variable(("constraint",), "m or 1", "residual f(q)"),
    "constraint_rate": Variable(("constraint",), "m/s or 1/s", "rate of the residual, J v"),
    "cylinder_length": Variable(("cylinder",), "m", "pin to pin length"),
    "cylinder_force": Variable(("cylinder",), "N", "force of the cylinder; positive pushes the pins apart"),
    "pressure_a": Variable(("cylinder",), "Pa", "gauge pressure of the piston chamber A"),
    "pressure_b": Variable(("cylinder",), "Pa", "gauge pressure of the annulus chamber B"),
    "element_coordinate": Variable(("element",), "rad or m", "coordinate of every other force element"),
    "element_force": Variable(("element",), "N or N*m", "force along that coordinate"),
    "point_position": Variable(("point", "axis"), "m", "position of the tracked points in the world"),
    "point_displacement": Variable(("point", "axis"), "m", "position less initial position"),
    "load_value": Variable(("load",), "N or N*m", "value of the loads along their axes"),
    "energy_kinetic": Variable((), "J", "kinetic energy"),
    "energy_potential": Variable((), "J", "potential energy of gravity"),
    "energy_elastic": Variable((), "J", "energy stored in oil, springs and rock, zero at the initial state"),
    "work_input": Variable((), "J", "work done by the loads since the start"),
    "work_dissipated": Variable((), "J", "work lost in dampers and piston friction since the start"),
}
DIMENSIONS = ("joint", "dof", "constraint", "cylinder", "element", "point", "load")


class Mode(NamedTuple):
    """One of the machine's own vibrations about its start: frequency [Hz] and decay d of exp(-d t) [1/s].

    The frequency of a motion that creeps back without swinging is 0.
    """

    frequency: float
    decay: float


@lru_cache(maxsize=1)
def versions() -> dict[str, str]:
    """Versions of what decides the numbers, looked up once: reading them takes longer than a short run."""
    return {name: version(name) for name in ("drillrig-pin", "pin", "numpy", "scipy")}


class Kept(NamedTuple):
    """Rows of a run other than its samples: times (n) [s] and the variables of :data:`VARIABLES`."""

    time: Array
    arrays: Mapping[str, Array]


@dataclass(frozen=True)
class Trajectory:
    """One run: its samples, and behind ``record`` the rows its statistics are taken from.

    The samples are what the scenario asked for, multiples of 1 / output_rate. Extremes, RMS, load cycles and shares of
    time belong to the ``record``: rows close enough to show every load, and every impact, whatever the output rate.

    Attributes:
        time: sample times (n) [s].
        arrays: the variables of :data:`VARIABLES`, first dimension time; also as attributes, ``trajectory.q``.
        labels: names along every dimension.
        outcome: how the run ended.
        scenario: the case.
        model: expanded model text; with the scenario all that is needed to run again.
        arguments: arguments the model was expanded with.
        cost: steps, evaluations, switches, wall time [s].
        notes: assembly and equilibrium in words, warnings.
        engine, method: which engine ran, ``core`` or ``python``, and which integrator.
        added: force elements made in Python, as text; to run again they must be given again.
        made_with: versions of the software that computed it, which need not be those that read it.
        kept: the rows of the record where they are not the samples themselves; None: the samples are the record.
        load_frequency: highest frequency of a load that acted [Hz]; 0: none varies; None: not known (an older file).
        folder: where the model file lay; relative names of meshes count from it. A hint: it need not exist here.
        sampled_only: True if nothing but samples was kept (an older file): then ``record`` holds no more than they do.
        modes: own vibrations about the start, the slowest to decay first; empty where nobody knows them.
    """

    time: Array
    arrays: Mapping[str, Array] = field(repr=False)
    labels: dict[str, list[str]] = field(repr=False)
    outcome: Outcome
    scenario: Scenario = field(repr=False)
    model: str = field(repr=False)
    arguments: dict[str, Any] = field(repr=False)
    cost: dict[str, float] = field(repr=False)
    notes: tuple[str, ...] = ()
    added: tuple[str, ...] = ()
    engine: str = "python"
    method: str = ""
    made_with: dict[str, str] = field(default_factory=lambda: dict(versions()), repr=False)
    kept: Kept | None = field(default=None, repr=False, compare=False)
    load_frequency: float | None = field(default=None, repr=False)
    sampled_only: bool = field(default=False, repr=False)
    modes: tuple[Mode, ...] = field(default=(), repr=False)
    folder: str = field(default="", repr=False, compare=False)

    @property
    def record(self) -> Trajectory:
        """The same run with the rows its statistics are taken from; the very same object where those are its samples.

        Times increase and need not be equally spaced: rows stand at the multiples of a fixed time, at breakpoints of
        the loads, and, where contact is made and broken, wherever a straight line between rows would miss a force.
        """
        if self.kept is None:
            return self
        return replace(self, time=self.kept.time, arrays=self.kept.arrays, kept=None)

    @property
    def samples_show_loads(self) -> bool:
        """False if the output rate is below 2.5 x the highest load frequency: samples then show a slower motion."""
        return self.load_frequency is None or self.scenario.output_rate >= SHOWING * self.load_frequency

    def __getattr__(self, name: str) -> Array:
        arrays: Mapping[str, Array] = self.__dict__.get("arrays", {})
        if name in arrays:
            return arrays[name]
        raise AttributeError(f"a trajectory has no {name!r}; variables: {', '.join(VARIABLES)}")

    def of(self, variable: str, *names: str) -> Array:
        """One column by name, e.g. ``trajectory.of("point_displacement", "S", "z")`` -> (n,)."""
        dims = VARIABLES[variable].dims
        column: Array = self.arrays[variable]
        for dim, name in zip(dims, names, strict=False):
            legal = list(AXES) if dim == "axis" else self.labels[dim]
            if name not in legal:
                raise ResultFileError(f"the run has no {dim} {name!r}", todo=legal_names(name, legal, dim + "s"))
            column = column[:, legal.index(name)]
        return column

    @property
    def energy_residual(self) -> Array:
        """Total energy less its start less work in plus work dissipated, (n) [J]: zero for an exact solution."""
        total: Array = self.energy_kinetic + self.energy_potential + self.energy_elastic
        residual: Array = total - total[0] - self.work_input + self.work_dissipated
        return residual

    @property
    def estimated_error(self) -> float | None:
        """Estimated greatest error of the joint positions [rad or m], None if nobody estimated it."""
        return self.cost.get(ESTIMATE)

    @property
    def dataset(self) -> xarray.Dataset:
        """The same as a labelled dataset with units and descriptions (made anew at each call)."""
        import xarray

        coords: dict[str, Any] = {dim: self.labels[dim] for dim in DIMENSIONS}
        coords["axis"] = list(AXES)
        coords["time"] = ("time", self.time, {"units": "s", "long_name": "time"})
        variables = {
            name: (("time", *meaning.dims), self.arrays[name], {"units": meaning.unit, "long_name": meaning.text})
            for name, meaning in VARIABLES.items()
        }
        about = {"title": self.scenario.name, "content_hash": self.content_hash}
        return xarray.Dataset(variables, coords, about | self._doubt())

    def _doubt(self) -> dict[str, str | float]:
        """From when on the run is not valid and why, as files say it; empty if nothing speaks against it."""
        outcome = self.outcome
        return {} if outcome.valid_until is None else {"valid_until": outcome.valid_until, "doubt": outcome.doubt}

    @property
    def content_hash(self) -> str:
        """SHA-256 of model, scenario and versions: equal hashes mean the same question asked of the same software."""
        return content_hash(self.model, self.scenario, self.added, self.made_with)

    def save(self, path: str | Path) -> None:
        """Write everything to one NetCDF-4 file; nothing is left behind if that fails (ResultFileError).

        The samples stand at the top, as readers of such files expect; rows of the record that are not the samples stand
        in the group ``record`` under the same names.
        """
        groups = {GROUP: _columns(self.kept.time, self.kept.arrays)} if self.kept is not None else {}
        outcome = self.outcome
        attributes: dict[str, str | float] = {
            "format": FORMAT,
            "title": self.scenario.name,
            "model": self.model,
            "arguments": json.dumps(self.arguments),
            "scenario": self.scenario.model_dump_json(),
            "versions": json.dumps(self.made_with),
            "content_hash": self.content_hash,
            "status": outcome.status.name,
            "end_time": float(outcome.time),
            "steps": float(outcome.steps),
            "cause": outcome.cause,
            **self._doubt(),
            "cost": json.dumps(self.cost),
            "notes": json.dumps(self.notes),
            "added": json.dumps(self.added),
            "engine": self.engine,
            "method": self.method,
            "modes": json.dumps(self.modes),
            "folder": self.folder,
        }
        if not self.sampled_only:
            attributes["record"] = GROUP if groups else SAMPLES
        if self.load_frequency is not None:
            attributes["load_frequency"] = self.load_frequency
        write_netcdf(Path(path), _columns(self.time, self.arrays), {**self.labels, "axis": AXES}, attributes, groups)

    def to_csv(self, path: str | Path) -> None:
        """Write all variables as one table, a column each, named ``variable.label [unit]``.

        A run that is not valid to its end has a column more: 1 while it is, 0 from then on. So has one whose samples
        are too few to show its loads, see :attr:`samples_show_loads`: 0 in every row.
        """
        names, table = self._flat()
        write_csv(Path(path), names, table)

    def to_mat(self, path: str | Path) -> None:
        """Write arrays, labels and units to a MATLAB 5 file, and whether the samples are enough to show the loads."""
        content: dict[str, Any] = {"time": self.time[:, None], **self.arrays}
        content["labels"] = {dim: np.array(words, dtype=object) for dim, words in self.labels.items()}
        content["units"] = {name: meaning.unit for name, meaning in VARIABLES.items()}
        content |= {"content_hash": self.content_hash, **self._doubt()}
        content["samples_show_loads"] = float(self.samples_show_loads)
        write_mat(Path(path), content)

    def _flat(self) -> tuple[list[str], Array]:
        names, columns = ["time [s]"], [self.time[:, None]]
        of_joints = {"joint", "dof", "element"}
        for name, meaning in VARIABLES.items():
            suffixes = [""]
            for dim in meaning.dims:
                words = AXES if dim == "axis" else self.labels[dim]
                suffixes = [f"{suffix}.{word}" for suffix in suffixes for word in words]
            model = self.model if of_joints & set(meaning.dims) else ""
            names += [f"{name}{suffix} [{unit_of(meaning.unit, suffix[1:], model)}]" for suffix in suffixes]
            columns.append(self.arrays[name].reshape(len(self.time), len(suffixes)))
        if self.outcome.valid_until is not None:
            names.append("valid [1 or 0]")
            columns.append((self.time[:, None] < self.outcome.valid_until).astype(float))
        if not self.samples_show_loads:
            names.append("samples_show_loads [1 or 0]")
            columns.append(np.zeros((len(self.time), 1)))
        return names, np.hstack(columns)


def _columns(time: Array, arrays: Mapping[str, Array]) -> dict[str, Column]:
    """Every array of some rows as it is written."""
    columns = {"time": Column(("time",), time, "s", "time")}
    for name, meaning in VARIABLES.items():
        columns[name] = Column(("time", *meaning.dims), arrays[name], meaning.unit, meaning.text)
    return columns


def load_trajectory(path: str | Path) -> Trajectory:
    """Read a result file back.

    Raises:
        ResultFileError: not there, not a result file of this package, or damaged.
    """
    path = Path(path)
    arrays, labels, attributes = read_netcdf(path, ["time", *VARIABLES], DIMENSIONS)
    if str(attributes.get("format")) != FORMAT:
        raise ResultFileError("not a result file of drillrig", where=short_path(path))
    try:
        _require_shapes(arrays, labels)
        kept, names = None, {**labels}
        if attributes.get("record") == GROUP:
            rows = read_netcdf(path, ["time", *VARIABLES], (), GROUP)[0]
            _require_shapes(rows, labels)
            count_turns(rows, names)
            kept = Kept(rows.pop("time"), rows)
        count_turns(arrays, labels)
        frequency, until = attributes.get("load_frequency"), attributes.get("valid_until")
        outcome = Outcome(
            Status[attributes["status"]],
            float(attributes["end_time"]),
            int(attributes["steps"]),
            str(attributes["cause"]),
            None if until is None else float(until),
            str(attributes.get("doubt", "")),
        )
        return Trajectory(
            arrays.pop("time"),
            arrays,
            labels,
            outcome,
            Scenario(**json.loads(attributes["scenario"])),
            str(attributes["model"]),
            _told(attributes["arguments"], dict[str, Any]),
            _told(attributes["cost"], dict[str, float]),
            _told(attributes["notes"], tuple[str, ...]),
            _told(attributes["added"], tuple[str, ...]),
            str(attributes["engine"]),
            str(attributes["method"]),
            _told(attributes["versions"], dict[str, str]),
            kept,
            None if frequency is None else float(frequency),
            "record" not in attributes,
            _told(attributes.get("modes", "[]"), tuple[Mode, ...]),
            str(attributes.get("folder", "")),
        )
    except Exception as error:
        raise damaged(path, error) from None


def _require_shapes(arrays: dict[str, Array], labels: dict[str, list[str]]) -> None:
    """ValueError for an array that has not one entry for every sample and every name."""
    sizes = {dim: len(words) for dim, words in labels.items()} | {"axis": len(AXES)}
    samples = arrays["time"].shape
    for name, meaning in VARIABLES.items():
        shape = (*samples, *(sizes[dim] for dim in meaning.dims))
        if len(samples) != 1 or arrays[name].shape != shape:
            raise ValueError(f"{name} has the shape {arrays[name].shape}, not {shape}")


def _told(text: Any, kind: Any) -> Any:
    """What a text of JSON says; pydantic's ValidationError if it is of another kind."""
    return TypeAdapter(kind).validate_json(text)


def content_hash(
    model: str, scenario: Scenario, added: tuple[str, ...] = (), made_with: dict[str, str] | None = None
) -> str:
    """SHA-256 over the expanded model, elements added to it, the scenario and the versions (None: those installed).

    The scenario's own `model` and `arguments` only say where the model came from; its expanded text counts.
    """
    case = scenario.model_dump(mode="json", exclude={"model", "arguments"})
    content = {"model": model, "added": added, "scenario": case, "versions": made_with or versions()}
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
