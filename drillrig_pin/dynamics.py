"""The equations of motion: assemble them, solve them, as separate steps ([Tram2023] eqs. (8), (9), (52)-(63)).

    M(q) a + C(q, v) v + g(q) = Q + J^T lambda,      J a = -J_dot v + correction(f, f_dot).

Here lambda is the force of the surroundings on the machine (the paper's lambda with the opposite sign: it writes
Q - Phi_q^T lambda); for a hold of the tip it is the force of the face on the tip in world axes [N].
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any, Literal

import numpy as np
import pinocchio as pin

from drillrig_pin.elements.base import Element, Law
from drillrig_pin.errors import SingularConfigurationError
from drillrig_pin.kinematics import Array, configuration_rate, velocity_map_is_identity
from drillrig_pin.rig import Rig
from drillrig_pin.stabilization import Correction, NoCorrection
from drillrig_pin.statics import Equilibrium
from drillrig_pin.workspace import Workspace

#: Fraction of the largest singular value below which a direction of the constraints counts as weak.
WEAK = 0.05
#: Of a weak direction's bound: how much the damped formulation lets it give way. The error of a passage grows with its
#: square, the noise of the multipliers with its inverse.
DAMPING = 1e-5
Formulation = Literal["multipliers", "null_space", "damped"]


@dataclass(slots=True)
class Equations:
    """The index-1 system at one state, eq. (57): M a = p1 + J^T lambda, J a = p2.

    Attributes:
        M: mass matrix (nv, nv).
        p1: applied generalised forces less bias, Q - C v - g (nv).
        J: constraint Jacobian Phi_q (m, nv).
        p2: -J_dot v plus the stabilising correction (m).
        f, f_dot: constraint residuals and rates (m).
    """

    M: Array
    p1: Array
    J: Array
    p2: Array
    f: Array
    f_dot: Array

    @property
    def finite(self) -> bool:
        """True if all that is to be solved is finite numbers."""
        return all(bool(np.isfinite(part).all()) for part in (self.M, self.p1, self.J, self.p2))


class ForceGroup:
    """Force elements whose laws are one class: evaluated in one go."""

    def __init__(self, members: list[int], laws: list[Law], where: Any, load: bool) -> None:
        self.members = members
        self.load = load
        self.law = type(laws[0]).stack(laws) if laws[0].stackable else laws[0]
        index = where[members]
        contiguous = len(index) == 0 or bool((np.diff(index) == 1).all())
        self.where: Any = slice(int(index[0]), int(index[-1]) + 1) if contiguous else index


class Dynamics:
    """A rig bound to its equilibrium: evaluates forces, assembles and solves the equations. One per run and thread.

    Args:
        rig: the rig.
        equilibrium: state at which cylinders were locked and springs relaxed.
        loads: names of the loads that act; None: all.
        formulation: ``multipliers`` (KKT, eq. (57)), ``null_space`` (multipliers eliminated, eq. (58)) or ``damped``
            (multipliers that let go of what the constraints nearly cannot hold, to pass singular positions).
        correction: stabilising term of the acceleration constraint; None: none.
        space: a workspace of the rig to take over, if it has the forces that act; None: one of its own.
    """

    def __init__(
        self,
        rig: Rig,
        equilibrium: Equilibrium,
        *,
        loads: frozenset[str] | None = None,
        formulation: Formulation = "multipliers",
        correction: Correction | None = None,
        space: Workspace | None = None,
    ) -> None:
        self.rig = rig
        self.equilibrium = equilibrium
        self.formulation = formulation
        self.correction: Correction = correction or NoCorrection()
        self.forces: tuple[Element, ...] = tuple(
            e for e in rig.forces if not e.load or loads is None or e.name in loads
        )
        self.space = space if space and space.forces == self.forces else Workspace(rig, self.forces)
        self.laws = [e.bind(equilibrium.x0.get(e.name, 0.0), equilibrium.held.get(e.name, 0.0)) for e in self.forces]
        self.groups = self._group()
        self.targets = equilibrium.assembly.targets
        # Counted once: a step off the constraints may make redundant rows seem independent, the watch sees real losses.
        self.rank = self.space.m - len(equilibrium.assembly.redundant) - len(equilibrium.assembly.singular)
        self.redundant = self.rank < self.space.m
        self.F = np.zeros(len(self.forces))
        self.x = self.space.x
        self.x_dot = np.zeros(len(self.forces))
        self.equations: Equations
        self.a = np.zeros(rig.model.nv)
        self.multipliers = np.zeros(self.space.m)
        self._responding = np.array([not e.load for e in self.forces], dtype=bool)
        self._simple = velocity_map_is_identity(rig.model)
        self._nq, self._nv = rig.model.nq, rig.model.nv
        self._kkt = np.zeros((self._nv + self.space.m,) * 2, order="F")

    def _group(self) -> list[ForceGroup]:
        classes: dict[Any, list[int]] = {}
        for i, (element, law) in enumerate(zip(self.forces, self.laws, strict=True)):
            key = (type(law), element.load) if law.stackable else (i, element.load)
            classes.setdefault(key, []).append(i)
        return [
            ForceGroup(members, [self.laws[i] for i in members], self.space.index, load)
            for (_, load), members in classes.items()
        ]

    @property
    def size(self) -> int:
        """Length of the integrated vector: q, v, work of the loads, dissipated work."""
        return int(self._nq + self._nv + 2)

    def initial(self) -> Array:
        """The integrated vector at the start."""
        return np.concatenate([self.equilibrium.assembly.q, self.equilibrium.assembly.v, np.zeros(2)])

    def evaluate_forces(self, t: float, q: Array, v: Array) -> None:
        """Update the workspace, ``x``, ``x_dot`` and the scalar forces ``F`` at a state."""
        self.space.update(q, v)
        np.dot(self.space.rows, v, out=self.x_dot)
        F, x, x_dot = self.F, self.x, self.x_dot
        for group in self.groups:
            where = group.where
            F[where] = group.law.force(x[where], x_dot[where], t)

    def powers(self) -> tuple[float, float]:
        """Power of the loads and dissipated power at the state last evaluated [W]."""
        supplied = lost = 0.0
        for group in self.groups:
            where = group.where
            if group.load:
                supplied += float(self.F[where] @ self.x_dot[where])
            else:
                lost += float(np.add.reduce(group.law.dissipation(self.x[where], self.x_dot[where])))
        return supplied, lost

    def assemble(self, t: float, q: Array, v: Array) -> Equations:
        """M by CRBA, bias by RNEA, forces, constraint Jacobian and bias at a state; eqs. (52), (56), (62)."""
        self.evaluate_forces(t, q, v)
        space = self.space
        model, data = self.rig.model, space.kinematics.data
        M = pin.crba(model, data, q)
        p1 = self.F @ space.rows - pin.nonLinearEffects(model, data, q, v)
        f = space.x_constraint - self.targets
        f_dot = space.J @ v
        p2 = self.correction(f, f_dot) - space.bias(v) if space.m else f
        return Equations(M, p1, space.J, p2, f, f_dot)

    def solve(self, equations: Equations) -> tuple[Array, Array]:
        """Accelerations a (nv) and multipliers lambda (m) of assembled equations, in the chosen formulation."""
        if self.formulation == "multipliers" and not self.redundant:
            return solve_multipliers(equations, self._kkt)
        if not equations.finite:
            # Decompositions of what is no number fail in many ways, or do not come back.
            return np.full(self._nv, np.nan), np.full(self.space.m, np.nan)
        if self.formulation == "null_space":
            return solve_null_space(equations, self.rank)
        if self.formulation == "damped":
            return solve_damped(equations)
        return solve_least_norm(equations, self.rank)

    def rate(self, t: float, y: Array) -> Array:
        """Right-hand side dy/dt of the integrated vector y = (q, v, work in, work dissipated)."""
        nq, end = self._nq, self._nq + self._nv
        q, v = y[:nq], y[nq:end]
        self.equations = self.assemble(t, q, v)
        a, self.multipliers = self.solve(self.equations)
        self.a = a
        rate = np.empty_like(y)
        rate[:nq] = self.rate_of_configuration(y)
        rate[nq:end] = a
        rate[end], rate[end + 1] = self.powers()
        return rate

    def rate_of_configuration(self, y: Array) -> Array:
        """dq/dt (nq) of the integrated vector."""
        q, v = y[: self._nq], y[self._nq : self._nq + self._nv]
        return v if self._simple else configuration_rate(self.rig.model, q, v)

    def project(self, y: Array) -> Array:
        """Put y back onto f = 0 and J v = 0 with the smallest kinetic-energy-weighted change; unit quaternions too."""
        nq, end = self._nq, self._nq + self._nv
        q, v = y[:nq], y[nq:end]
        model, space = self.rig.model, self.space
        if not self._simple:
            q = pin.normalize(model, q)
        y = y.copy()
        if space.m:
            M = pin.crba(model, space.kinematics.data, q).copy()
            space.update(q, v)
            for _ in range(2):
                f = space.x_constraint - self.targets
                if max(f.max(), -f.min()) < 1e-15:
                    break
                q = pin.integrate(model, q, -self._smallest(M, f))
                space.update(q, v)
            v = v - self._smallest(M, space.J @ v)
        y[:nq], y[nq:end] = q, v
        return y

    def _smallest(self, M: Array, violation: Array) -> Array:
        """Step with J step = violation that is smallest in the metric M: eq. (57) without forces."""
        equations = Equations(M, np.zeros(self._nv), self.space.J, violation, violation, violation)
        if not equations.finite:
            return np.full(self._nv, np.nan)
        if self.formulation == "damped":
            return solve_damped(equations)[0]
        if self.redundant:
            return solve_least_norm(equations, self.rank)[0]
        return solve_multipliers(equations, self._kkt)[0]

    def switches(self, y: Array) -> Array:
        """Switching functions of all laws at a state, in a fixed order."""
        nq, end = self._nq, self._nq + self._nv
        self.space.update(y[:nq], y[nq:end])
        x_dot = self.space.rows @ y[nq:end]
        values = [group.law.switches(self.x[group.where], x_dot[group.where]) for group in self.groups]
        return np.concatenate([value for value in values if value is not None] or [np.zeros(0)])

    def responses(self) -> Array:
        """Forces of all elements that are no loads, at the state last evaluated [N or N m]."""
        return np.asarray(self.F[self._responding])

    @property
    def switching(self) -> bool:
        """True if some law has switching functions."""
        return any(
            group.law.switches(self.x[group.where], self.x_dot[group.where]) is not None for group in self.groups
        )

    def breakpoints(self) -> Array:
        """Times at which some law is not smooth."""
        return np.unique(np.concatenate([np.zeros(0), *(group.law.breakpoints() for group in self.groups)]))

    def jumps(self) -> Array:
        """Those of them at which a force may jump."""
        return np.unique(np.concatenate([np.zeros(0), *(group.law.jumps() for group in self.groups)]))


def solve_multipliers(equations: Equations, workspace: Array | None = None) -> tuple[Array, Array]:
    """The saddle-point system [[M, -J^T], [J, 0]] [a; lambda] = [p1; p2], eq. (57).

    Raises:
        SingularConfigurationError: J has lost rank.
    """
    nv, m = len(equations.p1), len(equations.p2)
    K = np.zeros((nv + m, nv + m), order="F") if workspace is None else workspace
    K[:nv, :nv] = equations.M
    if m:
        K[nv:, :nv] = equations.J
        K[:nv, nv:] = -equations.J.T
        K[nv:, nv:] = 0.0
        right = np.concatenate([equations.p1, equations.p2])
    else:
        right = equations.p1
    _, _, solution, info = _dgesv()(K, right, overwrite_a=True)
    if info:
        raise SingularConfigurationError("the constraints have lost rank at this configuration")
    return solution[:nv], solution[nv:]


@cache
def _dgesv() -> Any:
    """LAPACK's solver. SciPy takes a third of a second to import, which a run in the core need not wait for."""
    from scipy.linalg.lapack import dgesv

    return dgesv


def solve_least_norm(equations: Equations, rank: int) -> tuple[Array, Array]:
    """As :func:`solve_multipliers` with only ``rank`` independent rows: of all multipliers those of least norm."""
    M, J = equations.M, equations.J
    free = np.linalg.solve(M, equations.p1)
    Z = np.linalg.solve(M, J.T)
    values, vectors = _eigen(J @ Z)
    values, vectors = values[len(values) - rank :], vectors[:, len(values) - rank :]
    multipliers: Array = vectors @ ((vectors.T @ (equations.p2 - J @ free)) / values)
    return np.asarray(free + Z @ multipliers, dtype=float), multipliers


def _eigen(S: Array) -> tuple[Array, Array]:
    """Eigenvalues and vectors of a symmetric matrix; none that are numbers if it holds what is none."""
    if np.isfinite(S).all():
        values, vectors = np.linalg.eigh(S)
        return values, vectors
    return np.full(len(S), np.nan), np.full(S.shape, np.nan)


def solve_damped(equations: Equations) -> tuple[Array, Array]:
    """As :func:`solve_multipliers`, but a direction that the constraints hardly hold any more is let go smoothly.

    With S = J M^-1 J^T, its eigenvalues s and eigenvectors w, each part of lambda is w (w . r) s / (s^2 + d^2) in place
    of w (w . r) / s, where d = DAMPING s_0 (1 - (s / s_0)^2) below s_0 = WEAK^2 s_max and d = 0 above: the filter of
    A. A. Maciejewski and C. A. Klein, J. Robotic Systems 5 (1988) 527-552. Away from singular positions nothing
    changes; through one, inertia carries the machine along the smooth path. Redundant rows drop out.
    """
    M, J = equations.M, equations.J
    free = np.linalg.solve(M, equations.p1)
    if not len(J):
        return np.asarray(free, dtype=float), np.zeros(0)
    Z = np.linalg.solve(M, J.T)
    s, w = _eigen(J @ Z)
    weak = WEAK**2 * s[-1]
    d = DAMPING * weak * np.maximum(0.0, 1.0 - (s / weak) ** 2)
    multipliers: Array = w @ ((w.T @ (equations.p2 - J @ free)) * s / (s**2 + d**2))
    return np.asarray(free + Z @ multipliers, dtype=float), multipliers


def solve_null_space(equations: Equations, rank: int | None = None) -> tuple[Array, Array]:
    """Multipliers eliminated by R with J R = 0: [R^T M; J] a = [R^T p1; p2], eq. (58).

    R comes from a pivoted QR of J^T, whose first ``rank`` rows are kept (None: all), so redundant ones drop out;
    lambda is recovered with least norm from J^T lambda = M a - p1.
    """
    from scipy.linalg import qr

    M, J, p1 = equations.M, equations.J, equations.p1
    if not len(J):
        return np.asarray(np.linalg.solve(M, p1)), np.zeros(0)
    rank = len(J) if rank is None else rank
    Q, _, pivots = qr(J.T, pivoting=True)
    R, kept = Q[:, rank:], pivots[:rank]
    a: Array = np.linalg.solve(np.vstack([R.T @ M, J[kept]]), np.concatenate([R.T @ p1, equations.p2[kept]]))
    U, values, V = np.linalg.svd(J, full_matrices=False)
    multipliers: Array = U[:, :rank] @ ((V[:rank] @ (M @ a - p1)) / values[:rank])
    return a, multipliers
