"""A scene: everything that is drawn of one or several runs, and what must be written beside it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from drillrig_pin.elements.contact import Contact
from drillrig_pin.errors import ResultFileError
from drillrig_pin.kinematics import Array
from drillrig_pin.scene.actor import TAIL, Actor, Scales
from drillrig_pin.scene.colours import GHOSTS
from drillrig_pin.scene.legend import Key, explained, grid_width, sentences
from drillrig_pin.scene.motion import Exaggeration
from drillrig_pin.scene.options import ReplayOptions, round_down
from drillrig_pin.scene.shapes import Part
from drillrig_pin.scene.timing import chosen_speed, frame_times
from drillrig_pin.scene.views import View, named_views, surrounding_box
from drillrig_pin.trajectory import Trajectory

#: Longest arrow of loads and reactions, and of cylinder forces, as parts of the machine's size.
LOAD_ARROW, CYLINDER_ARROW = 0.3, 0.2
#: Room between runs side by side, as part of their width.
GAP = 0.25


@dataclass(frozen=True, slots=True)
class Scene:
    """What a viewer needs.

    Attributes:
        title: what it shows.
        parts: parents before children; the first step of a path names the run.
        frames: times of the frames [s]; equally spaced.
        speed: simulated seconds per second of watching.
        fastest: fastest vibration worth seeing [Hz]; 0: none.
        exaggeration: of the deviations from the mean pose.
        tail: how long the strong end of a trace lasts [frames].
        size: of the machine [m].
        grid: width of a square of the ground grid [m].
        views: named places of the camera; ``view`` is the first one.
        sentences: what anyone who looks at the picture must know.
        keys: what colours and arrows mean.
        notes: what is not drawn, and why.
    """

    title: str
    parts: list[Part]
    frames: Array
    speed: float
    fastest: float
    exaggeration: Exaggeration
    tail: int
    size: float
    grid: float
    views: dict[str, View]
    view: str
    sentences: list[str]
    keys: list[Key]
    notes: list[str]


def build_scene(
    trajectories: Sequence[Trajectory], options: ReplayOptions | None = None, names: Sequence[str] = ()
) -> Scene:
    """Draw runs: the first in full, further ones as ghosts over it or, if asked, beside it.

    Args:
        trajectories: at least one, each of at least two samples.
        options: what is shown; None: the defaults.
        names: of the runs, e.g. their files; empty: the names of their scenarios.

    Raises:
        ResultFileError: nothing to show in a run.
        ModelError: the model a run carries cannot be read, e.g. because a plugin is missing.
    """
    options = options or ReplayOptions()
    if not trajectories:
        raise ResultFileError("no run to replay")
    names = list(names) or [trajectory.scenario.name for trajectory in trajectories]
    actors = [Actor(trajectory, options) for trajectory in trajectories]
    fastest = max(actor.fastest for actor in actors)
    speed = chosen_speed(fastest, options)
    longest = max(actors, key=lambda actor: float(actor.time[-1] - actor.time[0]))
    frames = frame_times(longest.time, options.rate / speed)
    for actor in actors:
        actor.pose(frames)
    exaggeration = min((actor.exaggeration(options) for actor in actors), key=lambda found: found.factor)
    for actor in actors:
        actor.draw(exaggeration.factor)
    scales = _scales(actors, frames, exaggeration.factor, speed)
    forward = _forward(actors[0])
    parts = _parts(actors, scales, options, np.cross((0.0, 0.0, 1.0), forward))
    low, high = surrounding_box(parts)
    return Scene(
        " and ".join(names),
        parts,
        frames,
        speed,
        fastest,
        exaggeration,
        scales.tail,
        actors[0].size,
        grid_width(actors[0].size),
        named_views(forward, _tip(actors[0]), low, high),
        options.view,
        sentences(exaggeration, speed, fastest, frames),
        explained(actors, scales, names, options),
        [note for actor in actors for note in actor.notes],
    )


def _scales(actors: list[Actor], frames: Array, factor: float, speed: float) -> Scales:
    size = actors[0].size
    loads = _strongest([force.vector for actor in actors for force in actor.loads])
    pushes = _strongest([force.vector for actor in actors for force in actor.pushes])
    # 50 bar steps end the scale of pressures a little above the highest.
    pressure = 5e6 * np.ceil(max(actor.highest_pressure() for actor in actors) / 5e6)
    step = float(frames[1] - frames[0])
    return Scales(
        frames,
        factor,
        round_down(LOAD_ARROW * size / loads) if loads else 0.0,
        round_down(CYLINDER_ARROW * size / pushes) if pushes else 0.0,
        max(float(pressure), 1e5),
        max(2, min(len(frames), round(TAIL * speed / step))),
    )


def _strongest(vectors: list[Array]) -> float:
    return max((float(np.linalg.norm(vector, axis=1).max()) for vector in vectors), default=0.0)


def _parts(actors: list[Actor], scales: Scales, options: ReplayOptions, left: Array) -> list[Part]:
    found = actors[0].parts("machine", scales, options)
    right_end = _reach(found, left)[0] if options.side_by_side else 0.0
    for number, actor in enumerate(actors[1:], start=2):
        if not options.side_by_side:
            found += actor.ghost(f"ghost {number - 1}", GHOSTS[(number - 2) % len(GHOSTS)])
            continue
        more = actor.parts(f"machine {number}", scales, options)
        low, high = _reach(more, left)
        move = right_end - high - GAP * (high - low)
        right_end = low + move
        found += [replace(part, position=part.position + move * left) if len(part.path) == 1 else part for part in more]
    return found


def _reach(parts: list[Part], direction: Array) -> tuple[float, float]:
    """How far parts reach along a horizontal direction, back and forth [m]."""
    low, high = surrounding_box(parts)
    ends = sorted((float(low @ direction), float(high @ direction)))
    return ends[0], ends[1]


def _forward(actor: Actor) -> Array:
    """Horizontal direction the machine works in: that of its first contact, else x."""
    for element in actor.rig.forces:
        if isinstance(element, Contact):
            level = np.array([*element.axis[:2], 0.0])
            length = float(np.linalg.norm(level))
            if length > 0.3:
                return np.asarray(level / length)
    return np.array([1.0, 0.0, 0.0])


def _tip(actor: Actor) -> Array | None:
    """Where the machine touches the rock, or its last tracked point."""
    contacts = [element.point for element in actor.rig.forces if isinstance(element, Contact)]
    names = contacts or actor.traced()[-1:]
    return actor.mean_position(names[0]) if names else None
