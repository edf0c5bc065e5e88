"""The case to simulate: where from, how long, which loads, how solved. The only file that knows its YAML."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ValidationError,
    field_validator,
    model_validator,
)

from drillrig_pin.elements.fields import sized
from drillrig_pin.errors import FieldError, ScenarioError, legal_names, shown
from drillrig_pin.files import shipped_scenarios
from drillrig_pin.yamlfile import read_fields, require_fields

MAX_SAMPLES = 50_000_000

#: Integrators of the compiled core.
CORE_METHODS = ("RK4", "DOP853", "RODAS", "ExpAdams")
#: Integrators of the Python engine.
PYTHON_METHODS = ("RK4", "DOP853", "Radau", "LSODA")

Positive = Annotated[float, Field(gt=0)]
AutoOrPositive = Literal["auto"] | Positive


def require_no_switch(cls: type[BaseModel], given: Any) -> Any:
    """Refuse `true` and `false` for a field that is none: they would count as 1 and 0.

    Among arguments of a model they are the words that xacro takes.
    """
    if not isinstance(given, dict):
        return given
    found = dict(given)
    for name, value in given.items():
        field = cls.model_fields.get(name)
        if field is None or field.annotation in (bool, Any):
            continue
        if name == "arguments" and isinstance(value, dict):
            found[name] = {key: str(item).lower() if isinstance(item, bool) else item for key, item in value.items()}
            continue
        for key, item in value.items() if isinstance(value, dict) else [("", value)]:
            if isinstance(item, bool) and (not key or name in _OPEN):
                place = f"{name}.{key}" if key else name
                raise ValueError(f"{place} = {str(item).lower()} is a truth value; write a number or a word")
    return found


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, str_max_length=10_000)

    _sized = field_validator("*")(sized)

    @model_validator(mode="before")
    @classmethod
    def _no_switch_for_a_number(cls, given: Any) -> Any:
        return require_no_switch(cls, given)


class Stabilization(_Part):
    """How f(q) = 0 is kept: a term in the equations, a projection after accepted steps, or both."""

    method: Literal["none", "baumgarte", "sliding_mode"] = Field(
        "baumgarte", description="term added to the acceleration constraint"
    )
    alpha: AutoOrPositive = Field(
        "auto", description="Baumgarte alpha [1/s]; auto: 5 1/s, with RK4 no more than 0.2 / step"
    )
    beta: AutoOrPositive = Field("auto", description="Baumgarte beta [1/s]; auto: equal to alpha (critical damping)")
    rate: AutoOrPositive = Field(
        "auto", description="sliding mode: decay rate of f on the surface [1/s]; auto: as alpha"
    )
    gain: Positive = Field(1e-3, description="sliding mode: largest correcting acceleration [m/s^2]")
    width: Positive = Field(1e-5, description="sliding mode: half width of the boundary layer [m/s]")
    projection: bool = Field(
        True, description="project q and v onto the constraints after every accepted step (not possible with LSODA)"
    )


class Integrator(_Part):
    """Which integrator, how tight."""

    method: Literal["auto", "RK4", "DOP853", "RODAS", "ExpAdams", "Radau", "LSODA"] = Field(
        "auto", description="auto: DOP853, or for stiff machines RODAS (core) or Radau (Python)"
    )
    step: Positive = Field(2.5e-4, description="step of RK4 [s]")
    rtol: Annotated[float, Field(ge=1e-13, le=1e-2)] = Field(1e-8, description="relative tolerance of the others")
    atol: Positive = Field(1e-10, description="absolute tolerance on q [rad, m]")
    max_step: Positive | None = Field(None, description="longest step [s]; none: no bound")
    budget: Positive | None = Field(
        3600.0,
        description="processor time a run may take [s]; one that would clearly take longer stops soon; none: no bound",
    )


def _words(given: Any) -> Any:
    return given.split() if isinstance(given, str) else given


class Scenario(_Part):
    """One case. Every field has a default; the default is test hole no. 9 for 10 s.

    Raises (on construction and loading): ScenarioError with the field and what it takes.
    """

    name: str = "hole_9"
    text: str = Field("", description="what the case is about")
    model: str = Field("mkz49", description="model name or path")
    arguments: dict[str, str | float | int] = Field(default_factory=dict, description="arguments of the model")
    pose: str | None = Field(None, description="named pose of the model; none: its first pose, or all joints at zero")
    positions: dict[str, float | list[float]] = Field(default_factory=dict, description="joints set otherwise [rad, m]")
    lock: Annotated[list[str], BeforeValidator(_words)] = Field(
        default_factory=list,
        description="joints that do not move, by name or regular expression; they stand where pose and positions say",
    )
    velocities: dict[str, float] = Field(default_factory=dict, description="initial velocity by dof [rad/s, m/s]")
    targets: dict[str, float] = Field(default_factory=dict, description="held coordinates by row, e.g. face.y [m]")
    loads: Literal["all", "none"] | list[str] = Field("all", description="which loads act")
    duration: Positive = Field(10.0, description="simulated time [s]")
    output_rate: Positive = Field(1000.0, description="samples per second of the result [Hz]")
    engine: Literal["auto", "core", "python"] = Field(
        "auto", description="compiled core, readable Python, or the core where it is installed and has the method"
    )
    formulation: Literal["multipliers", "null_space", "damped"] = Field(
        "multipliers", description="how constraints are solved; damped: passes singular positions along the smooth path"
    )
    stabilization: Stabilization = Field(default_factory=Stabilization)
    integrator: Integrator = Field(default_factory=Integrator)

    def __init__(self, **fields: Any) -> None:
        try:
            super().__init__(**fields)
        except ValidationError as error:
            raise _scenario_error(error) from None

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        if self.integrator.method == "LSODA" and self.stabilization.projection:
            raise ValueError(
                "LSODA keeps a history of steps that a projection would break; "
                "set stabilization.projection to false or choose another integrator"
            )
        legal = {"core": CORE_METHODS, "python": PYTHON_METHODS}.get(self.engine)
        if legal is not None and self.integrator.method not in ("auto", *legal):
            raise ValueError(
                f"engine {self.engine} has the methods {', '.join(legal)}, not {self.integrator.method}; "
                "choose one of them, or engine: auto"
            )
        if self.duration * self.output_rate > MAX_SAMPLES:
            raise ValueError(f"duration x output_rate asks for more than {MAX_SAMPLES} samples")
        return self

    def changed(self, changes: Mapping[str, Any]) -> Scenario:
        """A copy with some fields changed, by dotted name (``integrator.rtol``)."""
        return Scenario(**merged(self.model_dump(), changes))


#: Fields that are dictionaries of the user's own names, which may hold dots themselves (``face.y``).
_OPEN = ("arguments", "positions", "velocities", "targets")


def merged(fields: dict[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """``fields`` with values put at dotted names; a dictionary such as ``positions`` takes any name."""
    for name, value in changes.items():
        place = fields
        first, _, rest = name.partition(".")
        *parents, last = (first, rest) if first in _OPEN and rest else name.split(".")
        for parent in parents:
            inner = place.setdefault(parent, {})
            if not isinstance(inner, dict):
                raise ScenarioError(f"scenario.{name}: {parent!r} has no fields", where="--set")
            place = inner
        place[last] = value
    return fields


def load_scenario(path_or_name: str | Path, **changes: Any) -> Scenario:
    """Read a scenario from YAML, by path or by the name of a shipped one; its model may stand beside it.

    Raises:
        ScenarioError: no such scenario, not YAML, unknown field, value out of range.
    """
    path = Path(path_or_name)
    if path.suffix not in (".yaml", ".yml") and path.parent == Path():
        shipped = shipped_scenarios()
        if path.name not in shipped:
            raise ScenarioError(
                f"no scenario named {path.name!r}",
                todo=legal_names(path.name, shipped, "scenarios") + " One of your own is given by its path.",
            )
        path = shipped[path.name]
    fields, lines = read_fields(path, "a scenario")
    require_fields(fields, path, "a scenario")
    fields.setdefault("name", path.stem)
    try:
        case = Scenario(**fields)
    except FieldError as error:
        raise ScenarioError(error.what, where=lines.at(error.way), todo=error.todo) from None
    case = case.changed({"model": model_beside(case.model, path)}) if "model" in fields else case
    return case.changed(changes) if changes else case


def model_beside(model: str, file: Path) -> str:
    """The model that ``file`` names: a relative path is looked for beside that file first, a plain name is kept."""
    path = Path(model)
    if path.is_absolute() or (path.parent == Path() and path.suffix not in (".xacro", ".urdf")):
        return model
    near = (folder / path for folder in dict.fromkeys((file.parent, file.resolve().parent)))
    return next((str(place) for place in near if os.path.isfile(place)), model)


def _scenario_error(error: ValidationError) -> FieldError:
    findings = error.errors(include_url=False)
    first = findings[0]
    branches = ("literal[", "float", "constrained", "list[")
    way = tuple(part for part in first["loc"] if not str(part).startswith(branches))
    names = [str(part) for part in way]
    field = ".".join(names)
    if first["type"] == "extra_forbidden":
        part: Any = Scenario
        for name in names[:-1]:
            part = part.model_fields[name].annotation
        what, todo = f"the scenario has no field {field!r}", legal_names(names[-1], part.model_fields, "fields")
    else:
        message = first["msg"].removeprefix("Value error, ").removeprefix("Input ")
        what = f"scenario.{field} = {shown(first.get('input'))} {message}" if field else message
        todo = ""
    told = FieldError(what, todo=todo, way=way)
    told.field = f"scenario.{field}" if field else None
    return told
