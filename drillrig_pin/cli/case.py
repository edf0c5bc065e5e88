"""From the words of a command line to a scenario and a rig."""

from __future__ import annotations

import math
import re
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from drillrig_pin.errors import ScenarioError

if TYPE_CHECKING:
    from drillrig_pin.batch.study import Study
    from drillrig_pin.rig import Rig
    from drillrig_pin.scenario import Scenario

ModelName = Annotated[
    str, typer.Argument(metavar="MODEL", help="Name of a shipped model, or path of a .xacro or .urdf file.")
]
OptionalModelName = Annotated[
    str | None,
    typer.Argument(
        metavar="MODEL", show_default=False, help="Model name or path. Default: the scenario's model, mkz49."
    ),
]
ScenarioName = Annotated[
    str | None,
    typer.Option(
        "--scenario", "-s", metavar="S", help="Name of a shipped scenario, or path of a .yaml file. Default: hole 9."
    ),
]
Settings = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="NAME=VALUE",
        help="Change one thing: model.ARGUMENT or scenario.FIELD. May be given many times.",
    ),
]
ModelSettings = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="NAME=VALUE", help="Change one argument: model.ARGUMENT. May be given many times."),
]


def _remember(packages: list[str] | None) -> list[str] | None:
    from drillrig_pin.model.packages import remember_packages

    if packages:
        remember_packages(packages)
    return packages


Packages = Annotated[
    list[str] | None,
    typer.Option(
        "--package",
        metavar="NAME=DIR",
        callback=_remember,
        help="Folder of a package that the model names, as $(find NAME) or package://NAME. May be given many times.",
    ),
]
Locks = Annotated[
    list[str] | None,
    typer.Option(
        "--lock",
        metavar="PATTERN",
        help="Joints that do not move, by name or regular expression, e.g. 'wheel_.*'. They stay where the start puts "
        "them. May be given many times.",
    ),
]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON document (SI units) instead of text.")]


def parse_settings(settings: Sequence[str] | None) -> tuple[dict[str, Any], dict[str, Any]]:
    """Split ``--set`` options into model arguments and scenario fields, both by name.

    Raises:
        ScenarioError: not of the form ``model.NAME=VALUE`` or ``scenario.NAME=VALUE``.
    """
    arguments: dict[str, Any] = {}
    fields: dict[str, Any] = {}
    given: dict[str, str] = {}
    for setting in settings or ():
        name, equals, text = setting.partition("=")
        if equals and not text.strip():
            todo = "Write NAME=VALUE; null is the value of nothing."
            raise ScenarioError(f"{setting!r} gives no value", where="--set", todo=todo)
        # An argument has two names.
        one = re.sub(r"^scenario\.arguments\.", "model.", name.strip())
        if given.setdefault(one, text.strip()) != text.strip():
            words = f"{one} is given twice, as {given[one]} and {text.strip()}"
            raise ScenarioError(words, where="--set", todo="Give it once.")
        kind, dot, rest = name.strip().partition(".")
        if not (equals and dot and rest) or kind not in ("model", "scenario"):
            raise ScenarioError(
                f"{setting!r} does not say what to set",
                where="--set",
                todo="Write model.NAME=VALUE or scenario.NAME=VALUE, e.g. --set model.boom_length=2.1.",
            )
        if kind == "model":
            arguments[rest] = _number(text) if _number(text) is not None else text.strip()
        else:
            fields[rest] = _value(text, setting)
    return arguments, fields


def model_arguments(settings: Sequence[str] | None) -> dict[str, Any]:
    """Arguments for a command that has no scenario; ScenarioError for a scenario field."""
    arguments, fields = parse_settings(settings)
    for name in fields:
        raise ScenarioError(
            f"scenario.{name} means nothing here", where="--set", todo="Only model.NAME=VALUE can be set."
        )
    return arguments


def read_scenario(
    model: str | None, scenario: str | None, settings: Sequence[str] | None, locks: Sequence[str] | None = None
) -> Scenario:
    """The scenario a command line describes: the named one (default: hole 9), with another model and changes."""
    from drillrig_pin.scenario import Scenario, load_scenario

    arguments, fields = parse_settings(settings)
    if scenario is not None:
        case = load_scenario(scenario)
    else:
        case = Scenario(name=Path(model).name.split(".")[0], model=model) if model is not None else Scenario()
    changes: dict[str, Any] = {} if model is None else {"model": model}
    changes |= fields
    changes |= {f"arguments.{name}": value for name, value in arguments.items()}
    try:
        case = case.changed(changes) if changes else case
    except ScenarioError as error:
        raise ScenarioError(error.what, where="--set", todo=error.todo) from None
    return case.changed({"lock": [*case.lock, *locks]}) if locks else case


def locking(study: Study, locks: Sequence[str] | None) -> Study:
    """A study in which all cases have more joints locked."""
    return study.changed({"scenario.lock": [*study.base.lock, *locks]}) if locks else study


def locks_again(locks: Sequence[str] | None) -> str:
    """The options, for a command that is to be given again."""
    return "".join(f" --lock {shlex.quote(pattern)}" for pattern in locks or ())


def read_rig(case: Scenario) -> Rig:
    """The rig of a scenario, with its locks."""
    from drillrig_pin.fitting import fitted
    from drillrig_pin.model.modelfile import read_model
    from drillrig_pin.rig import build_rig

    return fitted(build_rig(read_model(case.model, case.arguments)), case)


def _number(text: str) -> float | int | None:
    """The number a text stands for; None for words, also for `nan` and `inf`, which no argument takes."""
    for kind in (int, float):
        try:
            value = kind(text)
        except ValueError:
            continue
        return value if math.isfinite(value) else None
    return None


def _value(text: str, setting: str) -> Any:
    from drillrig_pin.yamlfile import parse

    if (value := _number(text)) is not None:
        return value
    try:
        return parse(text, "--set")[0]
    except ScenarioError:
        raise ScenarioError(
            f"the value in {setting!r} is not readable as YAML",
            where="--set",
            todo="Quote it, or write [a, b] for a list.",
        ) from None
