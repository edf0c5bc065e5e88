"""What a replay shows of a run, and how."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from drillrig_pin.errors import ScenarioError, legal_names

Auto = Literal["auto"]
VIEWS = ("overview", "side", "top", "front", "tip")
#: More frames than this make no smoother picture, only a heavier page.
MAX_FRAMES = 20_000


@dataclass(frozen=True, slots=True)
class ReplayOptions:
    """How a run is shown.

    Attributes:
        exaggeration: factor on all deviations from the mean pose; ``auto``: so that the largest is clearly seen; 1 is
            true scale.
        speed: simulated seconds per second of watching; ``auto``: so slow that the eye can follow the fastest
            vibration of the run.
        rate: frames computed per second of watching [Hz]; the viewer interpolates between them.
        view: where the camera starts, one of :data:`VIEWS`.
        start, end: part of the run that is shown [s]; None: from its start, to its end.
        side_by_side: several runs beside each other instead of the later ones as ghosts over the first.
        holes: other holes on the rock face, as points of the world [m].

    Raises:
        ScenarioError: a value that makes no picture.
    """

    exaggeration: float | Auto = "auto"
    speed: float | Auto = "auto"
    rate: float = 30.0
    view: str = "overview"
    start: float | None = None
    end: float | None = None
    side_by_side: bool = False
    holes: tuple[tuple[float, float, float], ...] = ()

    def __post_init__(self) -> None:
        if self.view not in VIEWS:
            raise ScenarioError(
                f"there is no view {self.view!r}", where="replay", todo=legal_names(self.view, VIEWS, "views")
            )
        if self.exaggeration != "auto" and not 0 <= self.exaggeration < float("inf"):
            raise ScenarioError(
                f"an exaggeration of {self.exaggeration:g} makes no picture",
                where="replay",
                todo="Give a factor from 0 on, 1 for true scale, or auto.",
            )
        if self.speed != "auto" and not 1e-5 <= self.speed <= 100:
            raise ScenarioError(
                f"a speed of {self.speed:g} cannot be played",
                where="replay",
                todo="Give a factor from 0.00001 to 100, 1 for real time, or auto.",
            )
        if not 1 <= self.rate <= 240:
            raise ScenarioError(
                f"{self.rate:g} frames per second cannot be played", where="replay", todo="Give 1 to 240."
            )


def round_down(value: float) -> float:
    """The next number of the series 1, 2, 5, 10, ... below a positive value."""
    import math

    decade = 10.0 ** math.floor(math.log10(value) + 1e-9)
    return float(f"{max(step for step in (1, 2, 5) if step * decade <= value * (1 + 1e-9)) * decade:.1e}")
