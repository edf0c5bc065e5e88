"""Collect what the equations knew at every sample, and turn it into a trajectory."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from drillrig_pin.arrays import Arrays
from drillrig_pin.dependence import singular_words
from drillrig_pin.dynamics import Dynamics, ForceGroup
from drillrig_pin.elements.cylinder import Cylinder, LockedOil
from drillrig_pin.errors import Outcome
from drillrig_pin.joint_limits import outside_limits
from drillrig_pin.kinematics import Array
from drillrig_pin.plausible import implausible_words
from drillrig_pin.scenario import Scenario
from drillrig_pin.statics import Equilibrium
from drillrig_pin.trajectory import Trajectory
from drillrig_pin.validity import looked_at

#: A change of the initial velocity [rad/s, m/s] that is more than rounding.
NOTICED = 1e-9


class Recorder:
    """Rows of every variable, filled sample by sample."""

    def __init__(self, dynamics: Dynamics, samples: Array, engine: str, method: str) -> None:
        model, space = dynamics.rig.model, dynamics.space
        n = len(samples)
        self.dynamics, self.count = dynamics, 0
        self.engine, self.method = engine, method
        self._time = np.zeros(n)
        self._q, self._v, self._a = np.zeros((n, model.nq)), np.zeros((n, model.nv)), np.zeros((n, model.nv))
        self._work = np.zeros((n, 2))
        self._reaction, self._f, self._f_dot = (np.zeros((n, space.m)) for _ in range(3))
        self._x, self._F = (np.zeros((n, len(dynamics.forces))) for _ in range(2))
        self._points = np.zeros((n, *space.points().shape))
        self._energy = np.zeros((n, 2))

    @property
    def last_time(self) -> float:
        """Time of the last sample."""
        return float(self._time[self.count - 1]) if self.count else 0.0

    def arrays(self) -> list[Array]:
        """The arrays themselves, in the order the compiled core fills them."""
        return [
            self._time,
            self._q,
            self._v,
            self._a,
            self._work,
            self._reaction,
            self._f,
            self._f_dot,
            self._x,
            self._F,
            self._points,
            self._energy,
        ]

    def record(self, t: float, y: Array) -> None:
        """Take over the state last evaluated by the dynamics, which is y at time t."""
        i, dynamics = self.count, self.dynamics
        model, space, equations = dynamics.rig.model, dynamics.space, dynamics.equations
        nq, end = model.nq, model.nq + model.nv
        q, v = y[:nq], y[nq:end]
        self._time[i] = t
        self._q[i], self._v[i], self._work[i] = q, v, y[end:]
        self._a[i], self._reaction[i] = dynamics.a, dynamics.multipliers
        self._f[i], self._f_dot[i] = equations.f, equations.f_dot
        self._x[i], self._F[i] = dynamics.x, dynamics.F
        self._points[i] = space.points()
        self._energy[i] = 0.5 * (v @ equations.M @ v), pin.computePotentialEnergy(model, space.kinematics.data, q)
        self.count = i + 1

    def trajectory(self, outcome: Outcome, scenario: Scenario, cost: dict[str, float]) -> Trajectory:
        """All samples recorded so far."""
        dynamics, n = self.dynamics, self.count
        rig, forces, index = dynamics.rig, dynamics.forces, dynamics.space.index
        x, F, points = self._x[:n], self._F[:n], self._points[:n]
        cylinders = [i for i, e in enumerate(forces) if isinstance(e, Cylinder)]
        loads = [i for i, e in enumerate(forces) if e.load]
        others = [i for i, e in enumerate(forces) if i not in cylinders and not e.load]
        oil = _Oil(dynamics.groups, x, cylinders)
        outcome = looked_at(outcome, dynamics.groups, forces, self._time[:n], x)
        arrays = Arrays(
            {
                "q": self._q[:n],
                "v": self._v[:n],
                "a": self._a[:n],
                "reaction": self._reaction[:n],
                "constraint_error": self._f[:n],
                "constraint_rate": self._f_dot[:n],
                "point_position": points,
                "energy_kinetic": self._energy[:n, 0],
                "energy_potential": self._energy[:n, 1],
                "work_input": self._work[:n, 0],
                "work_dissipated": self._work[:n, 1],
            },
            {
                ("cylinder_length", "cylinder_force"): lambda: (x[:, index[cylinders]], F[:, index[cylinders]]),
                ("pressure_a", "pressure_b"): oil.pressures,
                ("energy_elastic",): oil.energy,
                ("element_coordinate", "element_force"): lambda: (x[:, index[others]], F[:, index[others]]),
                ("point_displacement",): lambda: (points - points[:1],),
                ("load_value",): lambda: (F[:, index[loads]],),
            },
        )
        labels = {
            "joint": rig.coordinate_names,
            "dof": rig.dof_names,
            "constraint": [row.name for row in rig.rows],
            "cylinder": [forces[i].name for i in cylinders],
            "element": [forces[i].name for i in others],
            "point": rig.tracked,
            "load": [forces[i].name for i in loads],
        }
        remarks = (remark.text for element in forces for remark in element.remarks())
        outside = outside_limits(rig, dynamics.equilibrium.assembly.q)
        starts = (f"at the start {row} [rad or m]" for row in outside)
        notes = (*implausible_words(rig), *_notes(dynamics.equilibrium), *starts, *remarks)
        added = tuple(repr(element) for element in forces if element.name not in rig.sources)
        file = rig.file
        origin = (file.text, dict(file.arguments), cost, notes, added, self.engine, self.method)
        folder = str(file.folder or "")
        return Trajectory(self._time[:n], arrays, labels, outcome, scenario, *origin, folder=folder)


class _Oil:
    """Pressures and elastic energy along a run. Two logarithms a cylinder and sample are most of the work: shared."""

    def __init__(self, groups: Sequence[ForceGroup], x: Array, cylinders: list[int]) -> None:
        self._groups, self._x, self._cylinders = [group for group in groups if not group.load], x, cylinders
        self._known: dict[int, tuple[Array, Array]] = {}

    def pressures(self) -> tuple[Array, Array]:
        """Gauge pressures of the chambers A and B, each (n, cylinders) [Pa]."""
        a, b = np.zeros((2, len(self._x), len(self._cylinders)))
        for group in self._groups:
            if isinstance(group.law, LockedOil):
                columns = [self._cylinders.index(i) for i in group.members]
                a[:, columns], b[:, columns] = group.law.pressures(self._x[:, group.where], self._strains(group))
        return a, b

    def energy(self) -> tuple[Array]:
        """Energy stored in all elements, zero at the start (n) [J]."""
        total = np.zeros(len(self._x))
        for group in self._groups:
            law, x = group.law, self._x[:, group.where]
            if isinstance(law, LockedOil):
                total += law.energy(x, self._strains(group)).sum(axis=1)
            elif law.stackable:
                total += law.energy(x).sum(axis=1)
            else:
                total += [float(np.ravel(law.energy(row))[0]) for row in x]
        return (total - total[:1],)

    def _strains(self, group: ForceGroup) -> tuple[Array, Array]:
        assert isinstance(group.law, LockedOil)
        if group.members[0] not in self._known:
            self._known[group.members[0]] = group.law.strains(self._x[:, group.where])
        return self._known[group.members[0]]


def _notes(equilibrium: Equilibrium) -> list[str]:
    assembly = equilibrium.assembly
    notes = []
    moved = {name: value for name, value in assembly.moved.items() if abs(value) > 1e-9}
    if moved:
        notes.append("assembly moved " + ", ".join(f"{name} by {value:+.4g}" for name, value in moved.items()))
    slowed = [
        f"{name} {v - change:.4g} -> {0.0 if abs(v) < NOTICED else v:.4g}"
        for (name, change), v in zip(assembly.slowed.items(), assembly.v.tolist(), strict=False)
        if abs(change) > NOTICED
    ]
    if slowed:
        notes.append(
            f"initial velocity changed by the least that the constraints allow [rad/s or m/s]: {', '.join(slowed)}"
        )
    if assembly.redundant:
        notes.append("redundant constraint rows, solved with least norm: " + ", ".join(assembly.redundant))
    notes += equilibrium.sharing
    if assembly.singular:
        notes.append(f"the start is a singular position: {singular_words(assembly.singular)}")
    elif not equilibrium.at_rest:
        notes.append("the machine does not rest at its initial state: some dofs are carried by nothing")
    return notes
