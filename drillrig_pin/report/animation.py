"""The animation of a run inside the report."""

from __future__ import annotations

from importlib import import_module
from importlib.util import find_spec

from drillrig_pin.trajectory import Trajectory


def animation_document(trajectory: Trajectory) -> str | None:
    """A self-contained HTML document that plays the run, or None where the package has no replay."""
    if find_spec("drillrig_pin.replay") is None or find_spec("drillrig_pin.replay.page") is None:
        return None
    options = import_module("drillrig_pin.scene.options").ReplayOptions()
    page: str = import_module("drillrig_pin.replay.page").animation_page([trajectory], options)
    return page
