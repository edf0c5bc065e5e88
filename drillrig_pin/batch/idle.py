"""Axes of a study that vary a number without effect: said before a study runs, kept with its table, in its report."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from functools import lru_cache

from drillrig_pin.batch.study import Study
from drillrig_pin.errors import DrillrigError
from drillrig_pin.model.modelfile import ModelFile, read_model
from drillrig_pin.model.reach import reach


def idle_axes(study: Study) -> tuple[str, ...]:
    """A sentence for every varied number of the model that enters nothing that acts; see ``model.reach``."""
    names = tuple(name.removeprefix("model.") for name in study.names if name.startswith("model."))
    if not names or "scenario.model" in study.names:
        return ()
    base = study.base
    try:
        file = read_model(base.model, base.arguments)
        return _idle(_Asked(file.text, base.model, json.dumps(base.arguments, sort_keys=True), names, file))
    except DrillrigError:
        # The study itself says what is wrong with its model.
        return ()


@dataclass(frozen=True, slots=True)
class _Asked:
    """What decides the answer, which a command asks for twice: before the study and when it writes the table."""

    text: str
    model: str
    arguments: str
    names: tuple[str, ...]
    file: ModelFile = field(compare=False)


@lru_cache(maxsize=4)
def _idle(asked: _Asked) -> tuple[str, ...]:
    found = {name: reach(asked.file, name, asked.model, asked.file.arguments) for name in asked.names}
    return tuple(
        f"model.{name} changes nothing that acts on the machine, it enters {entered}: no result depends on it"
        for name, entered in found.items()
        if entered.none
    )
