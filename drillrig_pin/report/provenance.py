"""Where a run came from, and the command that makes it again."""

from __future__ import annotations

import json
import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from drillrig_pin.analysis.differences import flat
from drillrig_pin.errors import DrillrigError
from drillrig_pin.fitting import fitted
from drillrig_pin.model.foreign import is_data, is_program
from drillrig_pin.model.modelfile import read_model
from drillrig_pin.rig import build_rig
from drillrig_pin.scenario import Scenario
from drillrig_pin.trajectory import Trajectory


def command(trajectory: Trajectory) -> str:
    """The command line that asks the same question again, with the same content hash."""
    return command_of(trajectory.scenario, trajectory.arguments)


def command_of(case: Scenario, arguments: Mapping[str, Any]) -> str:
    """The command line that runs a scenario with these arguments of its model."""
    usual = Scenario()
    words = ["drillrig run"]
    if case.model != usual.model:
        # A command line that names a model names the case after it.
        usual = Scenario(name=Path(case.model).name.split(".")[0])
        words.append(shlex.quote(case.model))
    words += [setting(f"model.{name}", value) for name, value in arguments.items()]
    defaults = flat(usual.model_dump(mode="json", exclude={"model", "arguments"}))
    for name, value in flat(case.model_dump(mode="json", exclude={"model", "arguments"})).items():
        if name not in defaults or defaults[name] != value:
            words.append(setting(f"scenario.{name}", value))
    return " ".join(words)


def setting(name: str, value: Any) -> str:
    """``--set NAME=VALUE`` for an argument of the model or a field of the scenario, quoted for a shell."""
    text = value if name.startswith("model.") else _yaml(value)
    return f"--set {shlex.quote(f'{name}={text}')}"


def scenario_rows(case: Scenario) -> list[tuple[str, str, bool, str]]:
    """Every field of a scenario: name, value, whether it differs from the default, and what it means."""
    usual = flat(Scenario().model_dump(mode="json"))
    known = meanings(type(case))
    rows = []
    for name, value in flat(case.model_dump(mode="json")).items():
        meaning = known.get(name) or known.get(name.partition(".")[0], "")
        shown = value if isinstance(value, str) else "–" if value in (None, {}) else _yaml(value)
        rows.append((name, shown, usual.get(name) != value, meaning))
    return rows


def asks_the_same(trajectory: Trajectory) -> bool | None:
    """Whether the model that the command names is still the one the run was made with.

    It is not if its files were changed since, lie elsewhere, or if the rig was made in Python. None: the run names a
    xacro file that is not shipped. Whoever made the result chose that file, and looking at a result runs no program.
    """
    case = trajectory.scenario
    try:
        if trajectory.added:
            return False
        if not is_data(case.model):
            return None if is_program(case.model) else False
        file = read_model(case.model, trajectory.arguments)
        return (fitted(build_rig(file), case).file if case.lock else file).text == trajectory.model
    except DrillrigError:
        return False


def meanings(cls: Any, prefix: str = "") -> dict[str, str]:
    """What every field of a scenario means, by its dotted name."""
    found: dict[str, str] = {}
    for name, field in cls.model_fields.items():
        found[prefix + name] = field.description or ""
        if hasattr(field.annotation, "model_fields"):
            found |= meanings(field.annotation, f"{prefix}{name}.")
    return found


def _yaml(value: Any) -> str:
    """A value as it may be written behind ``--set NAME=``; words that YAML would read otherwise are quoted."""
    if isinstance(value, str) and value[:1].isalpha() and value.replace("_", "").isalnum():
        return value if value.lower() not in ("null", "true", "false", "yes", "no", "on", "off") else json.dumps(value)
    if isinstance(value, float):
        return f"{value:g}" if float(f"{value:g}") == value else repr(value)
    return json.dumps(value, ensure_ascii=False)
