"""One measured figure beside what it is compared with, and a section of such figures."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass


@dataclass(frozen=True)
class Row:
    """One claim and what was measured of it.

    Attributes:
        claim: what should hold.
        reference: what it is compared with, and where that comes from.
        measured: the figure of this run.
        low, high: bounds it must keep, both included; infinite where there is none.
        unit: of figure and bounds; empty for a ratio.
        miss: for a claim known not to hold: why. It then must *not* hold, so that the entry goes when it does.
    """

    claim: str
    reference: str
    measured: float
    low: float = -math.inf
    high: float = math.inf
    unit: str = ""
    miss: str = ""

    @property
    def met(self) -> bool:
        """Whether the figure lies within its bounds; what is not a number does not."""
        return self.low <= self.measured <= self.high

    @property
    def bar(self) -> str:
        """The bounds in words."""
        if self.low == -math.inf:
            return f"≤ {self.high:.3g}"
        if self.high == math.inf:
            return f"≥ {self.low:.3g}"
        return f"{self.low:.3g} … {self.high:.3g}"


@dataclass(frozen=True)
class Section:
    """A part of the page.

    Attributes:
        title: its heading.
        text: what is done and how it is measured, as Markdown.
        rows: measures; the argument is True for the short form of a few seconds.
    """

    title: str
    text: str
    rows: Callable[[bool], Iterable[Row]]
