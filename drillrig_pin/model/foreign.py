"""Models that a result names. It may come from anybody: looking at it must not run the program its author chose."""

from __future__ import annotations

import os
from pathlib import Path

from drillrig_pin.errors import ModelError
from drillrig_pin.files import shipped_models
from drillrig_pin.model.modelfile import find_model


def is_data(model: str) -> bool:
    """Whether a model may be read because a result names it: a shipped one, or plain URDF, which is only parsed.

    False for a xacro file of one's own, whose expressions would be evaluated, and for one that is not there.
    """
    try:
        path = find_model(model)
    except ModelError:
        return False
    return path.suffix == ".urdf" or any(os.path.samefile(path, shipped) for shipped in shipped_models().values())


def is_program(model: str) -> bool:
    """Whether a result names a xacro file that is not shipped: it is evaluated for nobody who did not ask for it."""
    return Path(model).suffix == ".xacro" and not is_data(model)
