"""What a figure shows, free of any drawing library: curves in panels on a sheet.

The same sheet is printed (PNG, SVG), drawn in a page to zoom into, and laid over that of another run.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from drillrig_pin.kinematics import Array

#: Label of an axis over time.
TIME = "time [s]"


class Ink(Enum):
    """Colours that stay apart for colour-blind eyes and in grey print (Okabe and Ito); INK is the colour of text."""

    INK = "#000000"
    BLUE = "#0072B2"
    VERMILION = "#D55E00"
    GREEN = "#009E73"
    PURPLE = "#CC79A7"
    ORANGE = "#E69F00"
    SKY = "#56B4E9"
    GREY = "#8A8A8A"


#: Colours of the world axes x, y, z.
AXIS_INKS = (Ink.VERMILION, Ink.GREEN, Ink.BLUE)
#: Colours of things that come in any number.
CYCLE = (Ink.BLUE, Ink.VERMILION, Ink.GREEN, Ink.PURPLE, Ink.ORANGE, Ink.SKY, Ink.INK, Ink.GREY)


@dataclass(frozen=True, slots=True)
class Curve:
    """A line through (n) points; ``name`` stands in the legend if the panel has more than one."""

    name: str
    x: Array
    y: Array
    ink: Ink = Ink.BLUE
    dashed: bool = False
    #: A path in a plane, which may turn back; otherwise x increases.
    path: bool = False

    def between(self, low: float, high: float) -> Curve:
        """The part with low <= x <= high."""
        inside = (self.x >= low) & (self.x <= high)
        return replace(self, x=self.x[inside], y=self.y[inside])


@dataclass(frozen=True, slots=True)
class Level:
    """A limit: a dashed horizontal line with its name."""

    name: str
    value: float


@dataclass(frozen=True, slots=True)
class Band:
    """A shaded range of x with its name."""

    name: str
    low: float
    high: float
    ink: Ink


@dataclass(frozen=True, slots=True)
class Mark:
    """A vertical line at x with its name on top."""

    name: str
    x: float


@dataclass(frozen=True, slots=True)
class Panel:
    """One pair of axes.

    Attributes:
        key: short name, by which ``FIGURE.KEY`` asks for this panel alone.
        title: what is shown; units stand on the axes.
        x_label, y_label: quantity and unit.
        log: logarithmic y axis.
        floor: lowest y shown on a logarithmic axis.
        x_range: limits of x; None: as the curves.
        square: equal scales on both axes.
        bars: curves are drawn as bars, x the middle of each bar.
        note: a short result, written into the panel.
    """

    key: str
    title: str
    x_label: str
    y_label: str
    curves: tuple[Curve, ...]
    levels: tuple[Level, ...] = ()
    bands: tuple[Band, ...] = ()
    marks: tuple[Mark, ...] = ()
    log: bool = False
    floor: float | None = None
    x_range: tuple[float, float] | None = None
    square: bool = False
    bars: bool = False
    note: str = ""

    def is_upper(self, level: Level) -> bool:
        """Whether a limit lies above most of the curves."""
        middles = [float(np.median(curve.y)) for curve in self.curves if len(curve.y)]
        return level.value >= (sum(middles) / len(middles) if middles else 0.0)


@dataclass(frozen=True, slots=True)
class Sheet:
    """One figure.

    Attributes:
        name: its name on the command line and of its file.
        title: a few words.
        caption: one or two sentences: what is shown and how to read it.
        panels: from top to bottom; they share x if ``shared``.
    """

    name: str
    title: str
    caption: str
    panels: tuple[Panel, ...]
    shared: bool = True

    def alone(self, key: str) -> Sheet | None:
        """The sheet with one of its panels only, named ``sheet.panel``; None if it has no such panel."""
        for panel in self.panels:
            if panel.key == key:
                return replace(self, name=f"{self.name}.{key}", panels=(panel,))
        return None

    def between(self, start: float, end: float) -> Sheet:
        """The sheet with its panels over time cut to start <= t <= end [s], without those that are empty there.

        Panels over anything else stay as they are.
        """

        def cut(panel: Panel) -> Panel:
            if panel.x_label != TIME:
                return panel
            curves = (curve.between(start, end) for curve in panel.curves)
            return replace(panel, curves=tuple(curve for curve in curves if len(curve.x) > 1))

        return replace(self, panels=tuple(panel for panel in map(cut, self.panels) if panel.curves))
