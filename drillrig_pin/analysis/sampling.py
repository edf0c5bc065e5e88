"""Whether stored samples can show what the loads do: samples a second against the highest frequency of a load.

A sine of frequency f needs more than 2 f samples a second not to be taken for another one, and some more for its peaks
to be met. Below ``ENOUGH`` samples a period no curve, spectrum or peak made of them says anything of that load.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from drillrig_pin.analysis.design import Design, design_of
from drillrig_pin.kinematics import Array
from drillrig_pin.trajectory import Trajectory
from drillrig_pin.words import number

#: Samples in a period of the highest load frequency, at least.
ENOUGH = 2.5


@dataclass(frozen=True, slots=True)
class Sampling:
    """How rows lie in time against the loads.

    Attributes:
        rate: rows a second [Hz]; of rows at unequal distances that of the widest.
        highest: highest frequency of a load that acted [Hz]; 0 without one.
        load: the load that has it.
        what: the rows, in words: ``stored samples``.
    """

    rate: float
    highest: float
    load: str
    what: str

    @property
    def enough(self) -> bool:
        """Whether the rows can show the loads."""
        return self.rate >= ENOUGH * self.highest * (1 - 1e-9)

    @property
    def words(self) -> str:
        """What cannot be shown and what to do; empty where all can."""
        if self.enough:
            return ""
        return (
            f"{number(self.rate, 4)} {self.what} a second cannot show the {number(self.highest, 4)} Hz of "
            f"{self.load}: run with scenario.output_rate of {number(ENOUGH * self.highest, 4)} or more, better "
            f"{number(10 * self.highest, 4)}"
        )


def stored_sampling(trajectory: Trajectory, design: Design | None = None) -> Sampling:
    """The samples that curves, replays and exported tables are made of."""
    return _sampling(trajectory.time, design or design_of(trajectory), "stored samples")


def record_sampling(trajectory: Trajectory, design: Design | None = None) -> Sampling:
    """The rows that statistics and spectra are made of."""
    design = design or design_of(trajectory)
    record = trajectory.record
    return _sampling(record.time, design, "rows of the statistics" if record is not trajectory else "stored samples")


def _sampling(time: Array, design: Design, what: str) -> Sampling:
    # The last step may be shorter; extra rows within blows are only to the good.
    widest = float(np.diff(time).max(initial=0.0))
    highest, load = max(_highest(design), default=(0.0, ""))
    return Sampling(1.0 / widest if widest > 0 else np.inf, highest, load, what)


def _highest(design: Design) -> Iterator[tuple[float, str]]:
    for load, frequencies in design.sines.items():
        if frequencies:
            yield max(frequencies), load
    for load, frequency in design.tables.items():
        yield frequency, load
