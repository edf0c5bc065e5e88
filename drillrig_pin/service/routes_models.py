"""Models and scenarios over HTTP."""

from __future__ import annotations

import asyncio
from collections import Counter
from typing import Annotated, Any

from fastapi import APIRouter, Response
from fastapi import Path as InPath

from drillrig_pin.elements.loads import Load
from drillrig_pin.files import shipped_scenarios
from drillrig_pin.model.modelfile import Parameter
from drillrig_pin.model.ranges import Range
from drillrig_pin.scenario import load_scenario
from drillrig_pin.service import rendering
from drillrig_pin.service.answers import PROBLEMS, Served
from drillrig_pin.service.lanes import CHECK
from drillrig_pin.service.library import Entry
from drillrig_pin.service.schemas import (
    CheckView,
    ModelRequest,
    ModelView,
    ParameterView,
    ScenarioFields,
    ScenarioView,
    UsualRange,
)

router = APIRouter(prefix="/v1", tags=["models"], responses=PROBLEMS)
GENERAL = "general"
#: Numbers a group has at least.
SMALLEST = 3
#: Units of what is never below zero: masses, frequencies, times, stiffnesses, dampings, pressures against the air.
NEVER_NEGATIVE = frozenset({"kg", "Hz", "s", "Pa", "N/m", "N*s/m", "N*m/rad", "N*m*s/rad"})
ModelName = Annotated[str, InPath(max_length=100, description="name of a model of the library, or upload:ID")]


@router.get("/models", response_model=list[ModelView])
def list_models(service: Served) -> list[ModelView]:
    """The models of this server's library."""
    return [_view(service.library.entry(name)) for name in service.library.paths()]


@router.get("/models/{name}", response_model=ModelView)
def read_model(name: ModelName, service: Served) -> ModelView:
    """One model."""
    return _view(service.library.entry(name))


@router.get("/models/{name}/parameters", response_model=list[ParameterView])
def model_parameters(name: ModelName, service: Served) -> list[ParameterView]:
    """The numbers of a model with unit, source and meaning. Every name is an argument of a run."""
    entry = service.library.entry(name)
    groups = _groups(entry)
    return [_parameter(row, groups[row.name], entry.ranges.get(row.name)) for row in entry.parameters.values()]


@router.post("/models/{name}/check", response_model=CheckView)
async def check_model(name: ModelName, request: ModelRequest, service: Served) -> Any:
    """Everything wrong or suspicious in a model with these arguments, as `drillrig check` says it."""
    entry = await asyncio.to_thread(service.library.entry, name)
    entry.require(request.arguments)
    key = (name, entry.fingerprint, repr(sorted(request.arguments.items())), "check")
    return await service.desk.make(key, rendering.check, entry.path, entry.text, request.arguments, name, kind=CHECK)


@router.post(
    "/models/{name}/urdf",
    response_class=Response,
    responses={200: {"content": {"application/xml": {}}, "description": "the expanded model"}},
)
async def expand_model(name: ModelName, request: ModelRequest, service: Served) -> Response:
    """The model with these arguments as one plain URDF, which other robotics tools open."""
    entry = await asyncio.to_thread(service.library.entry, name)
    entry.require(request.arguments)
    text = entry.text
    if not text:
        key = (name, entry.fingerprint, repr(sorted(request.arguments.items())), "urdf")
        text = await service.desk.make(key, rendering.expanded, entry.path, request.arguments, kind=CHECK)
    return Response(text, media_type="application/xml")


@router.get("/scenarios", response_model=list[ScenarioView])
def list_scenarios() -> list[ScenarioView]:
    """The shipped scenarios with their fields."""
    found = []
    for name in shipped_scenarios():
        case = load_scenario(name)
        fields = case.model_dump(mode="json", exclude={"model", "arguments"})
        found.append(ScenarioView(name=name, text=case.text, model=case.model, scenario=fields))
    return found


@router.get("/schema/scenario", responses={200: {"description": "JSON Schema"}})
def scenario_schema() -> dict[str, Any]:
    """The fields of a scenario with type, unit, bounds and default, as JSON Schema."""
    return ScenarioFields.model_json_schema()


def _view(entry: Entry) -> ModelView:
    rows = entry.parameters.values()
    root = entry.file.root
    elements = list(entry.file.elements())
    joints = [node.attributes.get("name", "") for node in root.named("joint") if node.attributes.get("type") != "fixed"]
    poses = [node.attributes.get("name", "") for node in elements if node.tag == "pose"]
    loads = [node.attributes.get("name", "") for node in elements if node.tag == Load.tag]
    links = sum(1 for _ in root.named("link"))
    kinds = f"{links} links, {len(joints)} moving joints, {len(loads)} loads"
    return ModelView(
        name=entry.name,
        title=entry.file.name,
        summary=kinds,
        links=links,
        joints=joints,
        poses=poses,
        loads=loads,
        parameters=len(rows),
        assumed=sum(row.assumed for row in rows),
    )


def _parameter(row: Parameter, group: str, known: Range | None) -> ParameterView:
    value: float | str = row.value
    if row.unit != "word":
        value = float(row.value)
    choices = [part.strip().partition(" ")[0] for part in row.text.rpartition(":")[2].split("|")]
    return ParameterView(
        name=row.name,
        value=value,
        unit=row.unit,
        source=row.source,
        assumed=row.assumed,
        low=0.0 if row.unit in NEVER_NEGATIVE else None,
        usual=UsualRange(low=known.low, high=known.high, source=known.source) if known else None,
        choices=choices if row.unit == "word" and len(choices) > 1 else [],
        group=group,
        text=row.text,
    )


def _groups(entry: Entry) -> dict[str, str]:
    """What a model's numbers are about, by the beginning of their names: a joint, link or pose, or their first word.

    What would stand there with less than two others is ``general``.
    """
    root, names = entry.file.root, list(entry.parameters)
    known = {node.attributes.get("name", "") for tag in ("link", "joint") for node in root.named(tag)}
    known |= {node.attributes.get("name", "") for node in entry.file.elements() if node.tag == "pose"}
    known |= {name.partition("_")[0] for name in names}
    while True:
        order = sorted(known - {""}, key=lambda name: (-len(name), name))
        found = {name: next((group for group in order if name.startswith(f"{group}_")), GENERAL) for name in names}
        counts = Counter(found.values())
        small = {group for group in known if counts[group] < SMALLEST}
        if not small:
            return found
        known -= small
