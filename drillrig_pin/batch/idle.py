"""Axes of a study that vary a number without effect: said before a study runs, and in its report."""

from __future__ import annotations

from drillrig_pin.batch.study import Study
from drillrig_pin.errors import DrillrigError
from drillrig_pin.model.modelfile import read_model
from drillrig_pin.model.reach import reach


def idle_axes(study: Study) -> list[str]:
    """A sentence for every varied number of the model that enters nothing that acts; see ``model.reach``."""
    names = [name.removeprefix("model.") for name in study.names if name.startswith("model.")]
    if not names or "scenario.model" in study.names:
        return []
    try:
        base = study.base
        file = read_model(base.model, base.arguments)
        found = {name: reach(file, name, base.model, base.arguments) for name in names}
    except DrillrigError:
        # The study itself says what is wrong with its model.
        return []
    return [
        f"model.{name} changes nothing that acts on the machine, it enters {entered}: no result depends on it"
        for name, entered in found.items()
        if entered.none
    ]
