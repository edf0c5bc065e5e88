"""Put a nominal configuration onto the constraints with the smallest change ([Tram2023] eq. (59))."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pinocchio as pin

from drillrig_pin.dependence import RANK, dependence
from drillrig_pin.dependence import redundant_rows as redundant_rows
from drillrig_pin.errors import AssemblyError, legal_names
from drillrig_pin.finite import require_finite
from drillrig_pin.kinematics import Array
from drillrig_pin.rig import Rig
from drillrig_pin.workspace import Workspace

#: Assembled when every residual is below this [m or -]: a few rounding errors of a ten-metre machine.
CLOSED = 1e-13
#: A residual that the iteration cannot lower below this [m or -] means that the constraints contradict each other.
OPEN = 1e-10
ITERATIONS = 200


@dataclass(frozen=True)
class Assembly:
    """A state on the constraints.

    Attributes:
        q, v: configuration and velocity with f(q) = 0 and J v = 0.
        targets: value held by every constraint row.
        moved: change of each dof against the nominal configuration [rad or m], by dof name.
        redundant: names of constraint rows that follow from the others here and nearby.
        singular: names of rows that follow from the others here alone: a singular position.
        slowed: change of each velocity against the nominal one [rad/s or m/s], by dof name.
    """

    q: Array
    v: Array
    targets: Array
    moved: dict[str, float]
    redundant: tuple[str, ...]
    singular: tuple[str, ...] = ()
    slowed: dict[str, float] = field(default_factory=dict)


@np.errstate(all="ignore")
def assemble_state(
    rig: Rig, q: Array, v: Array, targets: dict[str, float] | None = None, space: Workspace | None = None
) -> Assembly:
    """Project a nominal state onto the constraints.

    Minimises the Euclidean norm of the change of the dofs (radians and metres alike) subject to f(q) = 0, by
    Gauss-Newton steps; then removes from v what violates J v = 0. Rows held at their initial value take it after
    the others closed.

    Args:
        rig: the rig.
        q: nominal configuration (nq).
        v: nominal velocity (nv).
        targets: values [m] for hold rows by name (``face.y``), replacing those of the model.
        space: a workspace of the rig to use; None: one of its own.

    Raises:
        AssemblyError: unknown row name, or no configuration near q satisfies the constraints.
    """
    rows = rig.rows
    given = dict(targets or {})
    names = [row.name for row in rows]
    for name in given:
        if name not in names:
            raise AssemblyError(f"no constraint row {name!r} to give a target", todo=legal_names(name, names, "rows"))
    wanted = [given.get(row.name, row.target) for row in rows]
    space = space or Workspace(rig, ())
    fixed = np.array([i for i, target in enumerate(wanted) if target is not None], dtype=int)
    goal = np.array([0.0 if target is None else target for target in wanted])
    q0 = q.copy()
    zero = np.zeros(rig.model.nv)
    if fixed.size:
        q = _close(rig, space, q0, fixed, goal[fixed])
    space.update(q, zero)
    goal = np.where([target is None for target in wanted], space.x_constraint, goal)
    J = space.J.copy()
    slowed = -least_norm(J, J @ v) if len(J) and v.any() else zero
    found = dependence(rig, space, q, goal)
    return Assembly(
        q,
        v + slowed,
        goal,
        _by_dof(rig, pin.difference(rig.model, q0, q)),
        found.redundant,
        found.singular,
        _by_dof(rig, slowed),
    )


def _by_dof(rig: Rig, values: Array) -> dict[str, float]:
    return dict(zip(rig.dof_names, values.tolist(), strict=True))


def least_norm(A: Array, b: Array) -> Array:
    """The smallest x with A x nearest to b.

    Raises:
        AssemblyError: A or b is not finite: two points coincide, or numbers are absurdly large.
    """
    require_finite(A, b)
    return np.asarray(np.linalg.lstsq(A, b, rcond=RANK)[0], dtype=float)


def _close(rig: Rig, space: Workspace, q0: Array, which: Array, goal: Array) -> Array:
    """Closest q to q0 with x(q)[which] = goal."""
    q, zero = q0.copy(), np.zeros(rig.model.nv)
    best = np.inf
    for _ in range(ITERATIONS):
        space.update(q, zero)
        f = space.x_constraint[which] - goal
        J = space.J[which]
        error = float(np.abs(f).max())
        # Full step onto the linearised constraints, of all such points the one nearest to q0.
        back = pin.difference(rig.model, q, q0)
        step = back - least_norm(J, J @ back + f)
        if error <= CLOSED and float(np.abs(step).max()) < 1e-9:
            return q
        best = min(best, error)
        longest = float(np.abs(step).max())
        # A radian is the largest turn over which the linearisation can be trusted at all.
        q = pin.integrate(rig.model, q, step * min(1.0, 0.3 / longest) if longest > 0 else step)
    space.update(q, zero)
    f = space.x_constraint[which] - goal
    if float(np.abs(f).max()) <= OPEN:
        return q
    worst = int(np.argmax(np.abs(f)))
    row = rig.rows[int(which[worst])]
    unit = "(cosine)" if row.unit == "1" else row.unit
    raise AssemblyError(
        f"the machine cannot be assembled: {row.name!r} stays {abs(f[worst]):.3g} {unit} open",
        where=rig.file.path,
        todo="Move its target or points within reach, or start from another pose.",
    )
