"""A rig at one state: coordinates of all forces and constraints, evaluated together. One per run and thread."""

from __future__ import annotations

from collections.abc import Sequence

from drillrig_pin.beat import beat
from drillrig_pin.coordinates import Coordinate, CoordinateSet
from drillrig_pin.elements.base import Element
from drillrig_pin.kinematics import Array, Kinematics, anchor_matrix, support_matrix
from drillrig_pin.rig import Rig


class Workspace:
    """Kinematics and coordinates of a rig; ``update`` makes all of them true for a state.

    Attributes:
        support: which dofs move which joint, (njoints, nv).
        forces: the force elements evaluated.
        index: where each force's coordinate is found in ``x``.
        rows: gradient rows of all coordinates, forces first, (forces + constraints, nv).
        J: constraint Jacobian Phi_q, (m, nv).
        x, x_constraint: coordinates of the forces and of the constraint rows.
    """

    def __init__(self, rig: Rig, forces: Sequence[Element]) -> None:
        self.rig = rig
        self.forces = tuple(forces)
        constraint_rows = rig.rows
        self.m = len(constraint_rows)
        coordinates: list[Coordinate] = [element.coordinate(rig) for element in self.forces]
        coordinates += [row.coordinate for row in constraint_rows]
        self.kinematics = Kinematics(rig.model)
        self.support = rig.once("support", lambda: support_matrix(rig.model))
        self.coordinates = CoordinateSet(rig.model, coordinates, self.m, self.support)
        n = len(self.forces)
        self.index = self.coordinates.position[:n]
        self.rows = self.coordinates.rows[:n]
        self.J = self.coordinates.rows[n:]
        self.x = self.coordinates.x[:n]
        self.x_constraint = self.coordinates.x[n:]
        self.tracked_points = anchor_matrix(rig.model, [rig.point(name) for name in rig.tracked])

    def update(self, q: Array, v: Array) -> None:
        """Evaluate everything at q (nq), v (nv); a beat of every loop that does."""
        beat()
        self.kinematics.update(q, v)
        self.coordinates.update(self.kinematics, q)

    def bias(self, v: Array) -> Array:
        """J_dot v of the constraint rows, (m,); valid after ``update`` at the same v."""
        return self.coordinates.bias(self.kinematics, v)

    def points(self) -> Array:
        """World positions of the tracked points, (points, 3) [m]."""
        return self.tracked_points @ self.kinematics.frames
