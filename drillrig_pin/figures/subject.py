"""A run as the figures see it, and the units that suit its numbers."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from drillrig_pin.analysis.design import Axis, Design, design_of
from drillrig_pin.analysis.limits import Limit
from drillrig_pin.analysis.measured import Measurement
from drillrig_pin.analysis.motion import after
from drillrig_pin.analysis.sampling import Sampling, record_sampling, stored_sampling
from drillrig_pin.analysis.window import Window, window_of
from drillrig_pin.kinematics import Array
from drillrig_pin.trajectory import Trajectory
from drillrig_pin.words import number


@dataclass(frozen=True, slots=True)
class Subject:
    """What a figure is made of.

    Attributes:
        trajectory: a run of at least two samples.
        design: facts of its model.
        window: what statistics are made of, see there.
        stored: whether curves of the stored samples can show the loads.
        limits: what the run is judged by, by name.
        hole: world direction the hole is meant to have; None: that of the feed at the start.
        measurement: a measured displacement of the survey point, if one was given.
        measured_axis: the world axis it is along.
        measured_shift: what is added to its times [s]; None: where it fits best.
    """

    trajectory: Trajectory
    design: Design
    window: Window
    stored: Sampling
    limits: Mapping[str, Limit] = field(default_factory=dict)
    hole: Axis | None = None
    measurement: Measurement | None = None
    measured_axis: str = "z"
    measured_shift: float | None = None

    @property
    def curves(self) -> Trajectory:
        """What curves over time are drawn from: the stored samples, or the record where those cannot show the loads."""
        return self.trajectory if self.stored.enough else self.window.record

    @property
    def steady(self) -> slice:
        """Rows of the curves after the start-up."""
        return after(self.curves, self.window.start_up)

    @property
    def sampled_words(self) -> str:
        """What a reader of curves must know of the samples; empty where they show the loads."""
        if self.stored.enough:
            return ""
        if record_sampling(self.trajectory, self.design).enough:
            return (
                f"Drawn from the rows the statistics are made of: the {number(self.stored.rate, 4)} stored samples a "
                f"second cannot show the {number(self.stored.highest, 4)} Hz of {self.stored.load}."
            )
        return f"Misleading: {self.stored.words}."


def subject_of(trajectory: Trajectory, **options: Any) -> Subject:
    """Read the model the run carries; ``options`` are the other fields of a subject."""
    design = design_of(trajectory)
    window = window_of(trajectory, design)
    return Subject(trajectory, design, window, stored_sampling(trajectory, design), **options)


def length_unit(*values: Array) -> tuple[str, float]:
    """Unit and factor that suit lengths given in metres."""
    largest = _largest(values)
    if largest >= 0.5:
        return "m", 1.0
    return ("mm", 1e3) if largest >= 1e-4 else ("µm", 1e6)


def angle_unit(*values: Array) -> tuple[str, float]:
    """Unit and factor that suit angles given in radians."""
    return ("°", 180 / math.pi) if _largest(values) >= 1e-4 else ("m°", 180e3 / math.pi)


def force_unit(*values: Array, moment: bool = False) -> tuple[str, float]:
    """Unit and factor that suit forces in newtons, or moments in newton metres."""
    unit = "N m" if moment else "N"
    return (f"k{unit}", 1e-3) if _largest(values) >= 1e3 else (unit, 1.0)


def energy_unit(*values: Array) -> tuple[str, float]:
    """Unit and factor that suit energies in joules."""
    largest = _largest(values)
    return ("kJ", 1e-3) if largest >= 1e4 else ("J", 1.0) if largest >= 0.1 else ("mJ", 1e3)


def _largest(values: tuple[Array, ...]) -> float:
    return max((float(np.nanmax(np.abs(v[np.isfinite(v)]), initial=0.0)) for v in values), default=0.0)
