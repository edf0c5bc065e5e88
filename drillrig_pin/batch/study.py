"""A study: a model, a base scenario, what is varied and what is measured. The only file that knows its YAML."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import BaseModel, ConfigDict, Field, PrivateAttr, ValidationError, field_validator, model_validator

from drillrig_pin.batch.axes import KINDS, Axis, Holes, HolesAxis
from drillrig_pin.batch.measures import require_known
from drillrig_pin.batch.settings import OptimizeSettings, SensitivitySettings
from drillrig_pin.errors import DrillrigError, FieldError, ModelError, ScenarioError, Source, legal_names, shown
from drillrig_pin.files import shipped_studies
from drillrig_pin.model.modelfile import ModelFile, read_model
from drillrig_pin.scenario import Scenario, load_scenario, model_beside
from drillrig_pin.yamlfile import Lines, read_fields, require_fields

#: More cases than this are a slip of the pen.
MAX_CASES = 1_000_000

DEFAULT_METRICS = ("*.across.rms", "*.rms", "*.p_max", "*.p_min", "hole.*.worst", "*.tension", "trust.*")


class Study(BaseModel):
    """Many cases of one question.

    Axes multiply: every point of the first with every point of the second, the last one changing fastest.

    Raises (on construction and loading): ScenarioError with the field, from a file also with its line.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, str_max_length=10_000)

    name: str = "study"
    text: str = Field("", description="what the study is about")
    model: str | None = Field(None, description="model name or path; none: the scenario's")
    scenario: str | dict[str, Any] = Field("hole_9", description="base: a shipped scenario, a path, or its fields")
    set: dict[str, Any] = Field(default_factory=dict, description="what all cases have changed: model.X, scenario.Y")
    axes: Annotated[list[Axis], Field(description="what is varied")] = []
    metrics: Annotated[list[str], Field(min_length=1, description="names or patterns of what is measured")] = list(
        DEFAULT_METRICS
    )
    worst: str | None = Field(None, description="metric that tells the worst case; none: the first one")
    sensitivity: SensitivitySettings = Field(SensitivitySettings(), description="for drillrig sensitivity")
    optimize: OptimizeSettings = Field(OptimizeSettings(), description="for drillrig optimize")

    _lines: Lines | None = PrivateAttr(None)
    _options: dict[tuple[str | int, ...], str] = PrivateAttr(default_factory=dict)

    def __init__(self, **fields: Any) -> None:
        try:
            super().__init__(**fields)
        except ValidationError as error:
            raise _study_error(error) from None

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        seen: dict[str, int] = {}
        for i, axis in enumerate(self.axes):
            for name in axis.names:
                if name in seen:
                    raise ValueError(f"axes {seen[name] + 1} and {i + 1} both vary {name}")
                if name in self.set:
                    raise ValueError(f"{name} is both varied and set")
                seen[name] = i
        return self

    @field_validator("metrics", "worst")
    @classmethod
    def _known(cls, given: list[str] | str | None) -> list[str] | str | None:
        require_known([given] if isinstance(given, str) else given or [])
        return given

    @property
    def base(self) -> Scenario:
        """The scenario every case starts from, with what all cases have changed."""
        case = load_scenario(self.scenario) if isinstance(self.scenario, str) else Scenario(**self.scenario)
        changes: dict[str, Any] = {} if self.model is None else {"model": self.model}
        changes |= dict(field_change(name, value) for name, value in self.set.items())
        return case.changed(changes) if changes else case

    @property
    def names(self) -> tuple[str, ...]:
        """Everything that is varied, in order."""
        return tuple(name for axis in self.axes for name in axis.names)

    @property
    def holes(self) -> Holes | None:
        """The holes drilled, if the study is about holes."""
        return next((axis.holes for axis in self.axes if isinstance(axis, HolesAxis)), None)

    def changed(self, changes: Mapping[str, Any]) -> Study:
        """A copy in which all cases have more changed, by ``model.X`` and ``scenario.Y``."""
        return self.having(set={**self.set, **changes})

    def having(self, **fields: Any) -> Study:
        """A copy with other fields."""
        study = Study(**({name: getattr(self, name) for name in type(self).model_fields} | fields))
        study._lines, study._options = self._lines, self._options
        return study

    def deciding(self, section: str, **given: Any) -> Study:
        """A copy with settings of ``sensitivity`` or ``optimize`` given anew; None leaves one as it is.

        Raises:
            ScenarioError: a value that cannot be, with the option it was given by.
        """
        given = {name: value for name, value in given.items() if value is not None}
        for goal, other in (("minimize", "maximize"), ("maximize", "minimize")):
            if goal in given and other not in given:
                given = {other: None, **given}
        try:
            study = self.having(**{section: getattr(self, section).model_dump() | given})
        except FieldError as error:
            name = next((str(part) for part in error.way[1:] if part in given), next(iter(given), section))
            what = error.what.removeprefix(f"{section}.").removeprefix(f"{name}: ").removeprefix(f"{section}: ")
            raise ScenarioError(what, where=_option(name), todo=error.todo) from None
        study._options = {(section, name): _option(name) for name in given}
        return study

    def asked(self) -> Iterator[tuple[tuple[str | int, ...], str]]:
        """Every name or pattern of a metric in it, with the way to the entry; the default ones are nobody's wish."""
        if tuple(self.metrics) != DEFAULT_METRICS:
            yield from ((("metrics", i), pattern) for i, pattern in enumerate(self.metrics))
        if self.worst is not None:
            yield ("worst",), self.worst
        for name in ("sensitivity", "optimize"):
            yield from (((name, *way), pattern) for way, pattern in getattr(self, name).asked())

    def all_metrics(self) -> tuple[str, ...]:
        """Patterns of what is measured, everything asked for included."""
        patterns = list(self.metrics)
        for _, asked in self.asked():
            # A name that a pattern covers does not make the cases others than those a sweep has solved.
            if not any(fnmatchcase(asked, pattern) for pattern in patterns):
                patterns.append(asked)
        return tuple(patterns)

    def at(self, *way: str | int) -> Source | str | None:
        """Where an entry was given: as an option of the command line, or in a line of the study's file."""
        if way[:2] in self._options:
            return self._options[way[:2]]
        return self._lines.exactly(way) if self._lines else None


def field_change(name: str, value: Any) -> tuple[str, Any]:
    """``model.X`` and ``scenario.Y`` as the scenario's own field; ScenarioError for anything else."""
    kind, dot, rest = name.partition(".")
    if dot and rest and kind == "model":
        return f"arguments.{rest}", value
    if dot and rest and kind == "scenario":
        return rest, value
    raise ScenarioError(f"{shown(name)} names nothing", todo="Write model.ARGUMENT or scenario.FIELD.")


def load_study(path_or_name: str | Path) -> Study:
    """Read a study from YAML, by path or by the name of a shipped one.

    Raises:
        ScenarioError: no such study, not YAML, unknown field, value out of range, each with file and line.
        ModelError: the model cannot be read, or has no argument an axis names.
    """
    path = find_study(path_or_name)
    content, lines = read_fields(path, "a study")
    require_fields(content, path, "a study")
    content.setdefault("name", path.stem)
    _resolve_beside(content, path)
    try:
        study = Study(**content)
    except FieldError as error:
        raise ScenarioError(error.what, where=lines.at(error.way), todo=error.todo) from None
    study._lines = lines
    require_names(study)
    return study


def study_text(study: Study) -> str:
    """The study as YAML that :func:`load_study` reads, from any folder."""
    import yaml

    content = study.model_dump(mode="json", exclude_defaults=True) | {"scenario": study.scenario}
    for field in ("model", "scenario"):
        given = content.get(field)
        if isinstance(given, str) and Path(given).is_file():
            content[field] = str(Path(given).resolve())
    order = [name for name in Study.model_fields if name in content]
    ordered = {name: content[name] for name in order}
    text: str = yaml.safe_dump(ordered, sort_keys=False, allow_unicode=True, width=120, default_flow_style=None)
    return text


def find_study(path_or_name: str | Path) -> Path:
    """The file a study's name or path stands for."""
    path = Path(path_or_name)
    if path.suffix in (".yaml", ".yml") or path.parent != Path():
        return path
    shipped = shipped_studies()
    if path.name in shipped:
        return shipped[path.name]
    advice = legal_names(path.name, shipped, "studies") + " One of your own is given by its path."
    raise ScenarioError(f"no study named {path.name!r}", todo=advice)


def require_names(study: Study) -> ModelFile:
    """Make sure that base, axes and ``set`` fit the model; gives the model of the base scenario.

    Raises:
        ScenarioError, ModelError: with the line of what does not fit.
    """

    lines = study._lines

    def at(*way: Any) -> Source | None:
        return lines.at(way) if lines else None

    with_line: Mapping[str, Any] = study.set
    for name, value in with_line.items():
        _try(lambda name=name, value=value: field_change(name, value), study.at("set", name))
    base: Scenario = _try(lambda: study.base, at("scenario"))
    try:
        file = read_model(base.model, {})
    except ModelError as error:
        raise ModelError(error.what, where=error.where or at("model"), todo=error.todo) from None
    known = file.declared
    for name in base.arguments:
        _require_argument(name, known, study.at("set", f"model.{name}"))
    for i, axis in enumerate(study.axes):
        kind = next(kind for kind, cls in KINDS.items() if isinstance(axis, cls))
        for name, value in axis.sample().items():
            if name == "hole":
                continue
            where = at("axes", i, "name") if kind in ("list", "range") else at("axes", i, kind, "bounds", name)
            field, value = _try(lambda name=name, value=value: field_change(name, value), where)
            if field.startswith("arguments."):
                # Another model of the study may have other arguments; each case is checked as it is run.
                if "scenario.model" not in study.names:
                    _require_argument(field.removeprefix("arguments."), known, where)
            else:
                _try(lambda field=field, value=value: base.changed({field: value}), where)
    return file


def _option(setting: str) -> str:
    return "--constraint" if setting == "constraints" else f"--{setting}"


def _require_argument(name: str, known: frozenset[str], where: Source | str | None) -> None:
    if name not in known:
        raise ModelError(f"the model has no argument {name!r}", where=where, todo=legal_names(name, known, "arguments"))


def _try(make: Any, where: Source | str | None) -> Any:
    try:
        return make()
    except DrillrigError as error:
        raise type(error)(error.what, where=where or error.where, todo=error.todo) from None


def _resolve_beside(content: dict[str, Any], path: Path) -> None:
    """Files that a study names by a relative path are looked for beside the study first."""
    for field in ("model", "scenario"):
        given = content.get(field)
        if isinstance(given, str):
            near = path.parent / given
            if os.path.isfile(near) and near.suffix in (".xacro", ".urdf", ".yaml", ".yml"):
                content[field] = str(near)
    for fields, key in ((content.get("scenario"), "model"), (content.get("set"), "scenario.model")):
        if isinstance(fields, dict) and isinstance(fields.get(key), str):
            fields[key] = model_beside(fields[key], path)
    for axis in content["axes"] if isinstance(content.get("axes"), list) else ():
        if isinstance(axis, dict):
            _models_beside(axis, path)


def _models_beside(axis: dict[str, Any], path: Path) -> None:
    """The same for an axis that varies the model."""
    columns = [axis[kind] for kind in ("zip", "grid") if isinstance(axis.get(kind), dict)]
    lists = [column.get("scenario.model") for column in columns]
    lists += [axis.get("list")] if axis.get("name") == "scenario.model" else []
    for values in lists:
        if isinstance(values, list):
            values[:] = [model_beside(value, path) if isinstance(value, str) else value for value in values]


def _study_error(error: ValidationError) -> FieldError:
    first = error.errors(include_url=False)[0]
    # Names of variants that pydantic puts between are no words of the study.
    way = tuple(part for part in first["loc"] if not str(part).startswith(("list[", "function", "constrained")))
    place = ".".join(str(part + 1 if isinstance(part, int) else part) for part in way)
    message = first["msg"].removeprefix("Value error, ").removeprefix("Input ")
    todo = ""
    if first["type"] == "extra_forbidden":
        what = f"there is no field {place!r}"
        parts: dict[str, type[BaseModel]] = {"sensitivity": SensitivitySettings, "optimize": OptimizeSettings}
        part = parts.get(str(way[0])) if way[1:] else Study
        todo = legal_names(str(way[-1]), part.model_fields, "fields") if part and len(way) <= 2 else ""
    elif first["type"] in ("value_error", "axis", "missing"):
        what = f"{place}: {message}" if place else message
    else:
        what = f"{place} = {shown(first.get('input'))} {message}"
    return FieldError(what, where="study", todo=todo, way=way)
