"""One run made into parts: the machine, what pushes it, where its points went."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from drillrig_pin.analysis.design import design_of
from drillrig_pin.analysis.motion import after
from drillrig_pin.analysis.sampling import stored_sampling
from drillrig_pin.analysis.window import window_of
from drillrig_pin.coordinates import Line
from drillrig_pin.elements.base import Element
from drillrig_pin.elements.contact import Contact
from drillrig_pin.elements.cylinder import ATMOSPHERE, Cylinder
from drillrig_pin.errors import DrillrigError
from drillrig_pin.kinematics import Array
from drillrig_pin.model.modelfile import read_model_text
from drillrig_pin.rig import assemble_rig
from drillrig_pin.scene.arrows import Force, arrow_parts
from drillrig_pin.scene.colours import TRACES
from drillrig_pin.scene.cylinders import cylinder_parts, spring_parts
from drillrig_pin.scene.face import face_parts
from drillrig_pin.scene.forces import Recorded, cylinder_forces, load_forces, reaction_forces
from drillrig_pin.scene.links import joint_parts, joint_paths, link_parts, machine_size, part_name, skeleton_parts
from drillrig_pin.scene.motion import Exaggeration, Poses, Posing
from drillrig_pin.scene.options import ReplayOptions
from drillrig_pin.scene.shapes import Ball, Colour, Part, Trace
from drillrig_pin.scene.timing import fastest_line, resampled, usable
from drillrig_pin.scene.visuals import link_visuals, notes_of
from drillrig_pin.trajectory import Trajectory

#: The strong end of a trace lasts this long on the screen [s].
TAIL = 1.5


@dataclass(frozen=True, slots=True)
class Scales:
    """What all runs of a scene share.

    Attributes:
        frames: times of the frames [s].
        factor: of exaggeration.
        load: length of an arrow per newton of a load or reaction [m/N].
        cylinder: the same for cylinder forces.
        pressure: absolute pressure at the upper end of the colours [Pa].
        tail: frames the strong end of a trace lasts.
    """

    frames: Array
    factor: float
    load: float
    cylinder: float
    pressure: float
    tail: int


class Actor:
    """One run: its machine, its poses, its forces.

    Attributes:
        trajectory: the run.
        rig: the machine, from the model the run carries.
        fastest: its fastest vibration worth seeing [Hz].
        shown: samples that are drawn.
        notes: what could not be drawn.
    """

    def __init__(self, trajectory: Trajectory, options: ReplayOptions) -> None:
        self.trajectory = trajectory
        self.rig, problems = assemble_rig(read_model_text(trajectory.model, "the model in the run"))
        self.shown = usable(trajectory, options)
        window = window_of(trajectory, design_of(trajectory))
        steady = after(trajectory, window.start_up)
        steady = slice(steady.start, max(self.shown.stop, steady.start + 2))
        self.fastest = fastest_line(window.record, window.rows)
        self._steady = trajectory.q[steady] if np.isfinite(trajectory.q[steady]).all() else trajectory.q[self.shown]
        folder = Path(trajectory.folder) if trajectory.folder else None
        self.visuals, faults = link_visuals(self.rig.file.root, folder, machine_size(self.rig))
        self.notes = notes_of(faults)
        sampling = stored_sampling(trajectory)
        if not sampling.enough:
            self.notes.append(f"What seems to move is not the machine's motion: {sampling.words}.")
        # A law that was made by a plugin which is not installed here need not keep anyone from seeing the machine.
        self.notes += [f"Not drawn: {problem.message}." for problem in problems]
        if not self.visuals:
            why = "None of the shapes of the links can be drawn" if faults else "The model gives its links no shapes"
            self.notes.append(f"{why}: bones join joints, points and centres of mass.")
        self._elements: list[Element] = list(self.rig.forces)
        if trajectory.added:
            self.notes.append(f"Not drawn, because they were added in Python: {len(trajectory.added)} force elements.")

    @property
    def time(self) -> Array:
        """Times of the samples shown [s]."""
        return np.asarray(self.trajectory.time[self.shown])

    def pose(self, frames: Array) -> None:
        """Take the times of the frames; beyond its end a shorter run stands still."""
        within = np.clip(frames, self.time[0], self.time[-1])
        q = resampled(self.time, self.trajectory.q[self.shown], within) if within[-1] > within[0] else None
        if q is None:
            q = np.repeat(self.trajectory.q[self.shown][:1], len(frames), axis=0)
        self._posing = Posing(self.rig, self._steady, q)
        self._recorded = Recorded(self.trajectory, self.shown, within)

    @property
    def size(self) -> float:
        """Diagonal of the box around the machine's points [m]."""
        return self._posing.size

    def exaggeration(self, options: ReplayOptions) -> Exaggeration:
        """How much its deviations may be multiplied."""
        return self._posing.exaggeration(options.exaggeration)

    def mean_position(self, point: str) -> Array:
        """Position of a point in the mean pose, (3) [m]."""
        return np.asarray(self._posing.home().world(self.rig.model, [self.rig.point(point)])[0, 0])

    def highest_pressure(self) -> float:
        """Highest absolute chamber pressure of the run [Pa]; 0 without cylinders."""
        chambers = [self.trajectory.pressure_a[self.shown], self.trajectory.pressure_b[self.shown]]
        finite = [c[np.isfinite(c)] for c in chambers]
        return max((float(c.max()) + ATMOSPHERE for c in finite if c.size), default=0.0)

    def draw(self, factor: float) -> Poses:
        """Pose all frames and find the forces in them."""
        self._poses = self._posing.drawn(factor)
        arguments = (self.rig, self._elements, self._poses, self._recorded)
        self.loads: list[Force] = [*load_forces(*arguments), *reaction_forces(*arguments)]
        self.pushes: list[Force] = list(cylinder_forces(*arguments))
        return self._poses

    def parts(self, root: str, scales: Scales, options: ReplayOptions) -> list[Part]:
        """Everything that is drawn of this run, below ``root``."""
        paths = joint_paths(self.rig, (root,))
        found = [Part((root,)), *joint_parts(self.rig, self._poses, paths)]
        found += link_parts(self.rig, self.visuals, paths)
        if not self.visuals:
            found += skeleton_parts(self.rig, paths, self.size)
        for element in self._elements:
            found += self._element_parts(element, paths, scales)
        found += self._faces(root, options)
        found += self._traces(root)
        for forces, metres in ((self.loads, scales.load), (self.pushes, scales.cylinder)):
            for force in forces:
                found += arrow_parts(force, self._poses, paths, metres)
        return found

    def ghost(self, root: str, colour: Colour) -> list[Part]:
        """What moves of the machine, in one translucent colour."""
        paths = joint_paths(self.rig, (root,))
        found = [Part((root,)), *joint_parts(self.rig, self._poses, paths)]
        found += link_parts(self.rig, self.visuals, paths, moving=True)
        if not self.visuals:
            found += skeleton_parts(self.rig, paths, self.size)
        return [replace(part, colour=colour) for part in found]

    def _element_parts(self, element: Element, paths: list[tuple[str, ...]], scales: Scales) -> Iterator[Part]:
        if isinstance(element, Cylinder) and self._recorded.has("cylinder", element.name):
            a, b = (self._recorded.of(f"pressure_{chamber}", element.name) + ATMOSPHERE for chamber in "ab")
            yield from cylinder_parts(self.rig, element, self._poses, paths, (a, b), scales.pressure)
            return
        try:
            coordinate = element.coordinate(self.rig)
        except DrillrigError:
            return
        if isinstance(coordinate, Line):
            yield from spring_parts(self.rig, element.name, coordinate, self._poses, paths, self.size)

    def _faces(self, root: str, options: ReplayOptions) -> Iterator[Part]:
        for element in self._elements:
            if isinstance(element, Contact):
                point = self.mean_position(element.point)
                path = (root, f"rock {part_name(element.name)}")
                yield from face_parts(
                    path, point, np.array(element.axis), self.size, [np.array(h) for h in options.holes]
                )

    def _traces(self, root: str) -> Iterator[Part]:
        for name, colour in zip(self.traced(), TRACES, strict=False):
            points = self._poses.world(self.rig.model, [self.rig.point(name)])[:, 0]
            label = part_name(name)
            yield Part((root, f"trace {label}"), Trace(points), colour=colour)
            radius = 0.004 * self.size
            yield Part((root, f"point {label}"), Ball(radius), position=points, colour=colour, on_top=True)

    def traced(self) -> list[str]:
        """Tracked points that move: as many as there are colours to tell their paths apart."""
        names = [name for name in self.rig.tracked if name in self.trajectory.labels["point"]]
        positions = (self.trajectory.of("point_position", name)[self.shown] for name in names)
        moving = [name for name, p in zip(names, positions, strict=True) if np.ptp(p, axis=0).max() > 1e-9]
        return moving[: len(TRACES)]
