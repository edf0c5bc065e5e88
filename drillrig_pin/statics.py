"""Static equilibrium at a given configuration: what every locked element carries before drilling starts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from drillrig_pin.assembly import Assembly, least_norm
from drillrig_pin.elements.cylinder import Cylinder
from drillrig_pin.kinematics import Array
from drillrig_pin.rig import Rig
from drillrig_pin.workspace import Workspace


@dataclass(frozen=True)
class Equilibrium:
    """The machine at rest at q, without drilling loads.

    Attributes:
        assembly: the state on the constraints.
        x0: coordinate of every force element there [m or rad], by name.
        held: static force carried by every holding element [N or N m], by name; positive pushes the pins apart.
        pressures: gauge pressures p_A, p_B of every cylinder [Pa], by name.
        reaction: force of the constraints on the machine per row [N or N m], as lambda of a run.
        unbalanced: what nothing carries, per dof [N or N m]; zero if the machine can rest there.
    """

    assembly: Assembly
    x0: dict[str, float]
    held: dict[str, float]
    pressures: dict[str, tuple[float, float]]
    reaction: Array
    unbalanced: Array

    @property
    def at_rest(self) -> bool:
        """True if every dof is in balance up to rounding."""
        return bool(np.abs(self.unbalanced).max(initial=0.0) <= 1e-6)


def find_equilibrium(rig: Rig, assembly: Assembly, space: Workspace | None = None) -> Equilibrium:
    """Holding forces F and reactions lambda with  g(q) = rows^T F + J^T lambda  at zero velocity.

    Pinocchio's g is the generalised gravity that must be carried (the sign mechanics asks for; eq. (6) of [Tram2023]
    prints the opposite). Elements whose force does not come from equilibrium (contact preload, springs with a rest
    length of their own, constant torques) act with it. Holds carry nothing as long as the other elements and the loops
    suffice: the machine carries its own weight before its tip is pinned. Where several solutions remain, the one of
    least norm is taken. ``space``: a workspace with all forces of the rig to use; None: one of its own.
    """
    space = space or Workspace(rig, rig.forces)
    placed = [(e, i) for e, i in zip(space.forces, space.index, strict=True) if not e.load]
    q, zero = assembly.q, np.zeros(rig.model.nv)
    space.update(q, zero)
    x0 = {element.name: float(space.x[i]) for element, i in placed}
    needed = pin.computeGeneralizedGravity(rig.model, space.kinematics.data, q).copy()
    columns = []
    for element, i in placed:
        if element.holding:
            columns.append(space.rows[i])
        else:
            law = element.bind(x0[element.name], 0.0)
            x = space.x[i : i + 1]
            needed -= space.rows[i] * np.ravel(law.force(x, np.zeros(1), 0.0))[0]
    loop = np.array([row.loop for row in rig.rows], dtype=bool)
    carriers = np.array(columns).reshape(len(columns), rig.model.nv)
    solution = _carry(np.vstack([carriers, space.J[loop]]), needed)
    reaction = np.zeros(space.m)
    reaction[loop] = solution[len(columns) :]
    rest = needed - np.vstack([carriers, space.J[loop]]).T @ solution
    if np.abs(rest).max(initial=0.0) > 1e-6:
        solution = _carry(np.vstack([carriers, space.J]), needed)
        reaction = solution[len(columns) :]
        rest = needed - np.vstack([carriers, space.J]).T @ solution
    holding = [element for element, _ in placed if element.holding]
    held = {element.name: float(F) for element, F in zip(holding, solution, strict=False)}
    pressures = {
        element.name: element.rest_pressures(held[element.name]) for element in holding if isinstance(element, Cylinder)
    }
    return Equilibrium(assembly, x0, held, pressures, reaction, rest)


def _carry(rows: Array, needed: Array) -> Array:
    """Least-norm forces with rows^T F nearest to ``needed``."""
    if not len(rows):
        return np.zeros(0)
    return least_norm(rows.T, needed)
