"""From a study to its cases: every combination of its axes, each with the hash of what decides its numbers."""

from __future__ import annotations

import hashlib
import itertools
import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from drillrig_pin.batch.axes import size_of
from drillrig_pin.batch.holes import Aim, Hole
from drillrig_pin.batch.study import MAX_CASES, Study, field_change, require_names
from drillrig_pin.errors import ModelError, ScenarioError
from drillrig_pin.model.modelfile import find_model, read_model
from drillrig_pin.scenario import Scenario
from drillrig_pin.trajectory import versions


@dataclass(frozen=True, slots=True)
class Question:
    """One case, small enough to be sent in great numbers.

    Attributes:
        key: SHA-256 of what decides its numbers.
        changes: fields of the base scenario that it has otherwise, by dotted name.
        hole: the hole it drills; None for the pose of the scenario.
    """

    key: str
    changes: dict[str, Any]
    hole: Hole | None = None


@dataclass(frozen=True, slots=True)
class Case:
    """One row of the table: its number, what is varied in it, the question asked, and what places it in a plan."""

    index: int
    inputs: dict[str, Any]
    question: Question
    tags: dict[str, int] = field(default_factory=dict)


@dataclass(frozen=True)
class Plan:
    """A study unfolded.

    Attributes:
        study: the study.
        base: scenario the cases start from.
        fingerprint: of the model files of all models in the study, by model name.
        cases: in the order of the table.
        purpose: the command that planned the cases.
        text: the expanded model of the base scenario; empty if it cannot be read with the scenario's arguments.
    """

    study: Study
    base: Scenario
    fingerprint: dict[str, str]
    cases: list[Case] = field(repr=False)
    purpose: str = "sweep"
    text: str = field(default="", repr=False)

    @property
    def aim(self) -> Aim | None:
        """How the machine is aimed at the holes."""
        return self.study.holes


class Asker:
    """Makes cases of one study.

    Attributes:
        study, base: the study and the scenario its cases start from.
        file: model of the base scenario.
        fingerprint: of the model files met so far, by model name.

    Raises:
        ScenarioError, ModelError: the study does not fit its model.
    """

    def __init__(self, study: Study) -> None:
        self.study, self.base = study, study.base
        self.file = require_names(study)
        self.fingerprint: dict[str, str] = {}
        fixed = {
            "base": self.base.model_dump(mode="json", exclude={"name", "text"}),
            "versions": versions(),
            "metrics": study.all_metrics(),
        }
        self._start = hashlib.sha256(json.dumps(fixed, sort_keys=True).encode())
        self._text = self.file.text if not self.base.arguments else _expanded(self.base)
        self._aim = ""
        if study.holes is not None:
            self._aim = json.dumps(study.holes.model_dump(mode="json", exclude={"places"}), sort_keys=True)

    def case(self, index: int, inputs: dict[str, Any], tags: dict[str, int] | None = None) -> Case:
        """The case with these values of everything that is varied; ModelError if its model cannot be read."""
        holes = self.study.holes
        hole = holes.places[inputs["hole"]] if holes and "hole" in inputs else None
        changes = dict(field_change(name, value) for name, value in inputs.items() if name != "hole")
        model = str(changes.get("model", self.base.model))
        if model not in self.fingerprint:
            self.fingerprint[model] = model_fingerprint(model)
        content = self._start.copy()
        content.update(json.dumps([changes, self.fingerprint[model]], sort_keys=True).encode())
        if hole is not None:
            content.update((self._aim + hole.model_dump_json(exclude={"source"})).encode())
        return Case(index, inputs, Question(content.hexdigest(), changes, hole), tags or {})

    def plan(self, cases: list[Case], purpose: str = "sweep") -> Plan:
        """These cases as a plan; the list may grow while it is carried out."""
        return Plan(self.study, self.base, self.fingerprint, cases, purpose, self._text)


def unfold(study: Study) -> Plan:
    """All cases of a study.

    Raises:
        ScenarioError, ModelError: the study does not fit its model; two models cannot be read; too many cases.
    """
    # Counted before they are laid out: a grid of two long ranges would fill the memory.
    require_few(study, size_of(study.axes))
    asker = Asker(study)
    points = [list(axis.points()) for axis in study.axes]
    combinations = enumerate(itertools.product(*points))
    return asker.plan([asker.case(i, {k: v for point in row for k, v in point.items()}) for i, row in combinations])


def require_few(study: Study, count: int) -> None:
    """ScenarioError for more cases than anybody can mean."""
    if count > MAX_CASES:
        raise ScenarioError(f"the study has more than {MAX_CASES} cases", where=study.name)


def _expanded(base: Scenario) -> str:
    try:
        return read_model(base.model, base.arguments).text
    except ModelError:
        # Arguments that do not fit together may be set right by what is varied.
        return ""


def model_fingerprint(model: str) -> str:
    """SHA-256 over a model file, the xacro and CSV files beside it, and those with YAML in the folders beside it.

    Which of them an expansion reads depends on its arguments; taking all of them asks no expansion of any case. A
    change that does not matter costs a run again. Files elsewhere that a model may include are not seen.
    """
    path = find_model(model)
    digest = hashlib.sha256()
    _take(digest, path)
    if path.suffix == ".xacro":
        for near in sorted(_readable(path.parent)):
            if near != path:
                digest.update(str(near.relative_to(path.parent)).encode() + b"\0")
                _take(digest, near)
    return digest.hexdigest()


def _take(digest: Any, path: Path) -> None:
    with path.open("rb") as stream:
        while piece := stream.read(1_000_000):
            digest.update(piece)


def _readable(folder: Path) -> set[Path]:
    """Xacro files, and data in folders below: files beside the model may be studies and results."""
    found = set(folder.glob("*.xacro")) | set(folder.glob("*.csv"))
    for inner in folder.iterdir():
        if inner.is_dir() and not inner.name.startswith("."):
            for suffix in ("xacro", "yaml", "yml", "csv"):
                found |= set(inner.glob(f"*.{suffix}"))
    # A pipe or a device would never end.
    return {path for path in found if path.is_file()}
