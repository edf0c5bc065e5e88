"""Static equilibrium at a given configuration: what every locked element carries before drilling starts."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pinocchio as pin

from drillrig_pin.assembly import Assembly
from drillrig_pin.elements.cylinder import Cylinder
from drillrig_pin.errors import AssemblyError
from drillrig_pin.finite import require_named, require_near
from drillrig_pin.kinematics import Array
from drillrig_pin.rig import Rig
from drillrig_pin.sharing import share
from drillrig_pin.workspace import Workspace

#: Part of the largest generalised weight, at least a newton, below which a spread of reactions is rounding.
WIDE = 1e-9


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
        shared: elements that share their load by stiffness, because balance alone does not tell their forces.
        spread: least and greatest reaction of constraint rows among which neither balance nor stiffness decides, if
            one of them carried nothing; by row [N or N m].
    """

    assembly: Assembly
    x0: dict[str, float]
    held: dict[str, float]
    pressures: dict[str, tuple[float, float]]
    reaction: Array
    unbalanced: Array
    shared: tuple[str, ...] = ()
    spread: dict[str, tuple[float, float]] = field(default_factory=dict)

    @property
    def sharing(self) -> list[str]:
        """What balance alone does not decide, in sentences without their full stop."""
        words = []
        if self.shared:
            words.append(
                f"statically indeterminate: {', '.join(self.shared)} share their load by stiffness, as if locked while "
                "loaded; how the machine was set down may share it otherwise"
            )
        if self.spread:
            rows = ", ".join(f"{name} {low:.4g} to {high:.4g}" for name, (low, high) in self.spread.items())
            words.append(
                f"statically indeterminate: reactions of rigid rows at rest are one choice of many [N or N m]: {rows}"
            )
        return words

    @property
    def at_rest(self) -> bool:
        """True if every dof is in balance up to rounding."""
        return bool(np.abs(self.unbalanced).max(initial=0.0) <= 1e-6)


@np.errstate(all="ignore")
def find_equilibrium(rig: Rig, assembly: Assembly, space: Workspace | None = None) -> Equilibrium:
    """Holding forces F and reactions lambda with  g(q) = rows^T F + J^T lambda  at zero velocity.

    Pinocchio's g is the generalised gravity that must be carried (the sign mechanics asks for; eq. (6) of [Tram2023]
    prints the opposite). Elements whose force does not come from equilibrium (contact preload, springs with a rest
    length of their own, constant torques) act with it. Holds carry nothing as long as the other elements and the loops
    suffice: the machine carries its own weight before its tip is pinned. Where several solutions remain, elements share
    by stiffness (:mod:`drillrig_pin.sharing`). ``space``: a workspace with all forces of the rig to use; None: one of
    its own.

    Raises:
        AssemblyError: a position or force at rest is no number of a machine; says which.
    """
    space = space or Workspace(rig, rig.forces)
    placed = [(e, i) for e, i in zip(space.forces, space.index, strict=True) if not e.load]
    q, zero = assembly.q, np.zeros(rig.model.nv)
    space.update(q, zero)
    require_near(_places(rig, space))
    for element, i in zip(space.forces, space.index, strict=True):
        if not np.isfinite(space.rows[i]).all():
            raise AssemblyError(
                f"{element.name!r} has no direction at the start, its row holds no finite numbers",
                todo="The two points that it joins coincide: move one.",
            )
    x0 = {element.name: float(space.x[i]) for element, i in placed}
    require_named(x0, "length or angle")
    needed = pin.computeGeneralizedGravity(rig.model, space.kinematics.data, q).copy()
    columns = []
    for element, i in placed:
        if element.holding:
            columns.append(space.rows[i])
        else:
            law = element.bind(x0[element.name], 0.0)
            x = space.x[i : i + 1]
            force = float(np.ravel(law.force(x, np.zeros(1), 0.0))[0])
            require_named({element.name: force}, "force")
            needed -= space.rows[i] * force
    loop = np.array([row.loop for row in rig.rows], dtype=bool)
    carriers = np.array(columns).reshape(len(columns), rig.model.nv)
    holding = [element for element, _ in placed if element.holding]
    stiffness = np.array([element.hold_stiffness(x0[element.name]) for element in holding])
    shares = share(carriers, stiffness, space.J[loop], needed)
    forces, reaction, spread = shares.elastic, np.zeros(space.m), np.zeros((space.m, 2))
    reaction[loop], spread[loop] = shares.rigid, shares.spread
    rest = needed - carriers.T @ forces - space.J.T @ reaction
    if np.abs(rest).max(initial=0.0) > 1e-6:
        shares = share(carriers, stiffness, space.J, needed)
        forces, reaction, spread = shares.elastic, shares.rigid, shares.spread
        rest = needed - carriers.T @ forces - space.J.T @ reaction
    held = {element.name: float(F) for element, F in zip(holding, forces, strict=True)}
    require_named(held, "force")
    pressures = {
        element.name: element.rest_pressures(held[element.name]) for element in holding if isinstance(element, Cylinder)
    }
    for name, both in pressures.items():
        require_named(dict.fromkeys([name], float(np.abs(both).max())), "pressure")
    require_named(dict(zip([row.name for row in rig.rows], reaction.tolist(), strict=True)), "reaction")
    shared = tuple(element.name for element, part in zip(holding, shares.shared, strict=True) if part)
    wide = {
        row.name: (float(low), float(high))
        for row, (low, high) in zip(rig.rows, spread, strict=True)
        if high - low > WIDE * max(1.0, float(np.abs(needed).max(initial=0.0)))
    }
    return Equilibrium(assembly, x0, held, pressures, reaction, rest, shared, wide)


def _places(rig: Rig, space: Workspace) -> dict[str, Array]:
    """Where the joints and tracked points stand, by name."""
    joints = {
        f"joint {name!r}": placement.translation
        for name, placement in zip(rig.joints, list(space.kinematics.data.oMi)[1:], strict=True)
    }
    return joints | {f"point {name!r}": place for name, place in zip(rig.tracked, space.points(), strict=True)}
