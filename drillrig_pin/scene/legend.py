"""What is written beside the picture: how much it exaggerates, how fast it plays, what colours and arrows mean."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from drillrig_pin.kinematics import Array
from drillrig_pin.scene.actor import Actor, Scales
from drillrig_pin.scene.colours import CYLINDER_FORCE, GHOSTS, LOAD, REACTION, SCALE, TRACES, web
from drillrig_pin.scene.motion import Exaggeration
from drillrig_pin.scene.options import ReplayOptions, round_down

#: A vibration with fewer frames than this in a period is not seen for what it is.
FRAMES_PER_PERIOD = 4.0


@dataclass(frozen=True, slots=True)
class Key:
    """One row of the legend: its mark, the colours of the mark from left to right, and the words."""

    mark: Literal["arrow", "line", "patch", "scale", "grid"]
    colours: tuple[str, ...]
    text: str


def sentences(exaggeration: Exaggeration, speed: float, fastest: float, frames: Array) -> list[str]:
    """What anyone who looks at the picture must know."""
    found = [_scale_sentence(exaggeration)]
    if speed == 1:
        found.append("Real time.")
    else:
        seen = f": {fastest:.3g} Hz is seen as {fastest * speed:.2g} Hz" if fastest > 0 else ""
        found.append(f"{speed:g} × real time{seen}.")
    step = float(frames[1] - frames[0])
    if fastest > 0 and 1 / step < FRAMES_PER_PERIOD * fastest:
        found.append(f"Each frame is the mean over {1e3 * step:.3g} ms: vibration at {fastest:.3g} Hz is averaged out.")
    return found


def _scale_sentence(exaggeration: Exaggeration) -> str:
    largest, factor = exaggeration.largest, exaggeration.factor
    if factor == 1:
        return f"True scale; the largest deviation from the mean pose is {length(largest)}."
    drawn = length(largest * factor)
    text = f"Deviations from the mean pose × {factor:g}: the largest, {length(largest)}, is drawn {drawn}."
    if exaggeration.asked is not None:
        text += f" (× {exaggeration.asked:g} was asked for; beyond × {factor:g} the machine would lose its shape.)"
    return text


def length(metres: float) -> str:
    """A length in the unit that suits it."""
    for unit, factor in (("m", 1.0), ("mm", 1e3), ("µm", 1e6)):
        if abs(metres) * factor >= 1:
            return f"{metres * factor:.3g} {unit}"
    return f"{metres * 1e6:.2g} µm"


def explained(actors: Sequence[Actor], scales: Scales, names: Sequence[str], options: ReplayOptions) -> list[Key]:
    """The legend."""
    found: list[Key] = []
    first = actors[0]
    if len(actors) > 1 and not options.side_by_side:
        found.append(Key("patch", ("#d98a2b",), f"{names[0]}, in its own colours"))
        for number, name in enumerate(names[1:]):
            found.append(Key("patch", (web(GHOSTS[number % len(GHOSTS)]),), f"{name}, about its own mean pose"))
    elif len(actors) > 1:
        found.append(Key("patch", ("#d98a2b",), "from left to right, seen from behind: " + ", ".join(names)))
    if any(not force.arrives for force in first.loads):
        loads = ", ".join(_words(force.name) for force in first.loads if not force.arrives)
        found.append(Key("arrow", (web(LOAD),), f"{loads}{_per_force(scales.load)}"))
    if any(force.arrives for force in first.loads):
        found.append(Key("arrow", (web(REACTION),), f"force of the face on the machine{_per_force(scales.load)}"))
    if first.pushes:
        found.append(Key("arrow", (web(CYLINDER_FORCE),), f"cylinder on its rod{_per_force(scales.cylinder)}"))
        highest = scales.pressure / 1e5
        text = f"pressure of a chamber: 0 to {highest:g} bar absolute"
        found.append(Key("scale", tuple(web(row) for row in SCALE), text))
    for point, colour in zip(first.traced(), TRACES, strict=False):
        found.append(Key("line", (web(colour),), f"path of {point}"))
    ground = f"ground, squares of {length(grid_width(first.size))}; axes x red, y green, z blue"
    found.append(Key("grid", ("#8a8f96",), ground))
    return found


def _words(name: str) -> str:
    return name.replace("_", " ")


def _per_force(metres: float) -> str:
    """Length of an arrow in words, for a force of a round number."""
    if metres <= 0:
        return ""
    unit, newtons = next(((u, n) for u, n in (("N", 1.0), ("kN", 1e3)) if metres * n >= 0.01), ("MN", 1e6))
    return f", {length(metres * newtons)} per {unit}"


def grid_width(size: float) -> float:
    """Width of the squares of the ground grid for a machine of this size [m]."""
    return max(0.05, round_down(size / 10))
