"""What clients send and get, as the OpenAPI description says it."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, create_model

from drillrig_pin.errors import ScenarioError
from drillrig_pin.scenario import Scenario
from drillrig_pin.service.problems import Problem

Id = Annotated[str, Field(pattern="^[0-9a-f]{32}$", description="hash of everything that decides the numbers")]
JobStatus = Literal["queued", "running", "completed", "failed", "cancelled"]
Number = Annotated[float, Field(strict=True)]
Argument = Annotated[Number | str, Field(description="a finite number, or a word where the model takes one")]


class Sent(BaseModel):
    """Base of what clients send."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False, str_max_length=10_000)


def _sound(given: Any) -> Any:
    """The scenario's own reader says what is wrong with it, in the words of the command line."""
    if isinstance(given, dict) and all(isinstance(name, str) for name in given):
        for name in _BESIDE:
            if name in given:
                error = ScenarioError(f"scenario.{name} is given beside the scenario, as {name}")
                error.field = f"scenario.{name}"
                raise error
        Scenario(**given)
    return given


_BESIDE = ("model", "arguments")
_MODEL: str = Scenario.model_fields["model"].default
_FIELDS: dict[str, Any] = {
    name: (item.annotation, item) for name, item in Scenario.model_fields.items() if name not in _BESIDE
}
ScenarioFields = create_model(
    "ScenarioFields", __base__=Sent, __doc__="Fields of a scenario; all have defaults.", **_FIELDS
)
SoundScenario = Annotated[ScenarioFields, BeforeValidator(_sound)]


class RunRequest(Sent):
    """One case: a model, its arguments, and how it is run."""

    model: str = Field(_MODEL, max_length=100, description="name of a model of the library, or upload:ID")
    arguments: dict[str, Argument] = Field(
        default_factory=dict, max_length=1000, description="numbers of the model that differ from its own, by name"
    )
    scenario: SoundScenario = Field(default_factory=ScenarioFields, description="the case; {} is hole no. 9 for 10 s")

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [{"model": "mkz49", "arguments": {"boom_length": 2.1}, "scenario": {"duration": 5.0}}]
        }
    )


class ModelRequest(Sent):
    """Numbers a model is looked at with."""

    arguments: dict[str, Argument] = Field(
        default_factory=dict, max_length=1000, description="numbers of the model that differ from its own, by name"
    )


class ModelView(BaseModel):
    """A model of the library."""

    name: str
    title: str = Field(description="the robot's name")
    summary: str = Field(description="what it is, in a line")
    links: int
    joints: list[str] = Field(description="names of the moving joints")
    poses: list[str] = Field(description="named poses, the first is the default")
    loads: list[str] = Field(description="names of the loads")
    parameters: int
    assumed: int = Field(description="how many of them no source prints")


class UsualRange(BaseModel):
    """Between which values a number is worth trying, in its unit."""

    low: float
    high: float
    source: str = Field(description="where the two come from")


class ParameterView(BaseModel):
    """One number or word of a model."""

    name: str
    value: float | str
    unit: str = Field(description="SI, or deg; `word` for a word")
    source: str = Field(description="paper: ..., derived: ... or assumed: ...")
    assumed: bool = Field(description="printed in no source")
    low: float | None = Field(None, description="least possible value")
    high: float | None = Field(None, description="greatest possible value")
    usual: UsualRange | None = Field(None, description="between which values it is worth trying; advice, no bound")
    choices: list[str] = Field(default_factory=list, description="legal words, if it is one of a few")
    group: str = Field(description="what of the machine it belongs to")
    text: str = Field(description="meaning")


class ProblemView(BaseModel):
    """One finding about a model."""

    severity: Literal["error", "warning"]
    message: str
    file: str
    line: int
    advice: str


class CheckView(BaseModel):
    """Everything wrong or suspicious in a model."""

    model: str
    errors: int
    warnings: int
    problems: list[ProblemView]


class ScenarioView(BaseModel):
    """A shipped scenario."""

    name: str
    text: str
    model: str
    scenario: dict[str, Any] = Field(description="its fields, as a run takes them")


class Card(BaseModel):
    """A number for people."""

    label: str
    value: str = Field(description="with its unit")
    note: str


class Verdict(BaseModel):
    """What the numbers mean, in a sentence."""

    level: str = Field(description="good, note, near the limit, over the limit")
    sentence: str


class Value(BaseModel):
    """A value in SI; pressures absolute."""

    value: float | None
    unit: str


class RunView(BaseModel):
    """A run and how it stands."""

    id: Id
    status: JobStatus
    progress: float = Field(ge=0, le=1, description="share that is done")
    name: str = Field(description="of the scenario")
    model: str
    arguments: dict[str, float | str]
    scenario: dict[str, Any] | None = Field(None, description="all its fields; not in lists")
    lock: list[str] = Field(default_factory=list, description="joints locked beyond those of the model")
    created: float = Field(description="seconds since 1970")
    started: float | None
    finished: float | None
    error: Problem | None = Field(None, description="why it failed")
    content_hash: str | None = Field(None, description="the one in the result file")
    outcome: dict[str, Any] | None = Field(None, description="how the simulation ended; it may stop early and be kept")
    verdict: Verdict | None = None
    numbers: dict[str, Value] = Field(default_factory=dict, description="a few numbers by key, for lists")
    headlines: list[Card] = Field(default_factory=list, description="the few numbers a reader looks for first")


class RunPage(BaseModel):
    """Some runs, latest first."""

    items: list[RunView]
    next: Id | None = Field(None, description="give it as `after` to get the next ones; null: these are the last")
    set_apart: list[str] = Field(default_factory=list, description="ids of damaged records, which no list holds")


class StudyRequest(Sent):
    """A study: a model, a base scenario, what is varied and what is measured."""

    name: str = Field("study", max_length=200)
    text: str = Field("", description="what the study is about")
    model: str = Field(_MODEL, max_length=100, description="name of a model of the library")
    scenario: str | dict[str, Any] = Field("hole_9", description="base: a shipped scenario, or fields of one")
    set: dict[str, Any] = Field(default_factory=dict, description="what all cases have changed: model.X, scenario.Y")
    axes: list[dict[str, Any]] = Field(
        default_factory=list,
        max_length=20,
        description="what is varied; every axis has one of list, range, zip, grid, latin_hypercube, sobol, holes",
    )
    metrics: list[str] | None = Field(
        None, min_length=1, max_length=200, description="names or patterns of what is measured; null: the usual ones"
    )
    worst: str | None = Field(None, description="metric that tells the worst case; null: the first one")

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "name": "resonance",
                    "scenario": {"duration": 2.0},
                    "axes": [{"name": "model.percussion_frequency", "range": {"start": 40, "stop": 56, "count": 5}}],
                    "metrics": ["S.across.rms", "*.p_max"],
                }
            ]
        }
    )


class Extreme(BaseModel):
    """The best or the worst case of a study."""

    case: int
    inputs: dict[str, Any]
    value: float = Field(description="of the metric that ranks the cases")


class StudyView(BaseModel):
    """A study and how it stands."""

    id: Id
    status: JobStatus
    progress: float = Field(ge=0, le=1, description="share of the cases that is recorded")
    name: str
    model: str
    study: dict[str, Any] | None = Field(None, description="the document; not in lists")
    cases: int = Field(description="rows of its table")
    done: int = Field(0, description="of them recorded")
    statuses: dict[str, int] = Field(default_factory=dict, description="how many cases ended how")
    metric: str = Field("", description="metric that ranks the cases")
    unit: str = Field("", description="its unit")
    best: Extreme | None = None
    worst: Extreme | None = None
    created: float = Field(description="seconds since 1970")
    started: float | None
    finished: float | None
    error: Problem | None = Field(None, description="why it failed")


class StudyPage(BaseModel):
    """Some studies, latest first."""

    items: list[StudyView]
    next: Id | None = Field(None, description="give it as `after` to get the next ones; null: these are the last")
    set_apart: list[str] = Field(default_factory=list, description="ids of damaged records, which no list holds")


class TableView(BaseModel):
    """The table of a study, a row per case."""

    columns: list[str]
    units: dict[str, str] = Field(description="by column")
    inputs: list[str] = Field(description="columns that were varied")
    metrics: list[str] = Field(description="columns that were measured")
    rows: list[list[Any]]


class UploadView(BaseModel):
    """An uploaded model."""

    id: Id
    model: str = Field(description="its name in runs and checks: upload:ID")
    name: str = Field(description="the robot's name")
    links: int
    joints: int
    elements: int = Field(description="extension elements")
    created: float = Field(description="seconds since 1970")


class FigureView(BaseModel):
    """A figure a run has."""

    name: str
    title: str
    caption: str
    svg: str = Field(description="path of the drawing")
    png: str


class Health(BaseModel):
    """The server lives."""

    status: Literal["ok", "degraded"] = Field(description="degraded: it answers, and something is to be looked after")
    version: str
    waiting: int = Field(description="jobs that wait")
    running: int = Field(description="jobs under way")
    login: bool = Field(description="whether it asks for a token")
    problems: list[str] = Field(default_factory=list, description="what is to be looked after, in sentences")
