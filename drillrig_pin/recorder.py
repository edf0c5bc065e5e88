"""Collect what the equations knew at every sample, and turn it into a trajectory."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from drillrig_pin.dynamics import Dynamics
from drillrig_pin.elements.base import Law
from drillrig_pin.elements.cylinder import Cylinder, LockedOil
from drillrig_pin.errors import Outcome
from drillrig_pin.kinematics import Array
from drillrig_pin.scenario import Scenario
from drillrig_pin.statics import Equilibrium
from drillrig_pin.trajectory import Trajectory


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
        x, F = self._x[:n], self._F[:n]
        cylinders = [i for i, e in enumerate(forces) if isinstance(e, Cylinder)]
        loads = [i for i, e in enumerate(forces) if e.load]
        others = [i for i, e in enumerate(forces) if i not in cylinders and not e.load]
        pressure_a, pressure_b = np.zeros((2, n, len(cylinders)))
        elastic = np.zeros(n)
        for group in dynamics.groups:
            if isinstance(group.law, LockedOil):
                # Two logarithms a cylinder and sample are most of the work; pressure and energy share them.
                length, columns = x[:, group.where], [cylinders.index(i) for i in group.members]
                strains = group.law.strains(length)
                pressure_a[:, columns], pressure_b[:, columns] = group.law.pressures(length, strains)
                elastic += group.law.energy(length, strains).sum(axis=1)
            elif not group.load:
                elastic += _energy(group.law, x[:, group.where])
        points = self._points[:n]
        arrays = {
            "q": self._q[:n],
            "v": self._v[:n],
            "a": self._a[:n],
            "reaction": self._reaction[:n],
            "constraint_error": self._f[:n],
            "constraint_rate": self._f_dot[:n],
            "cylinder_length": x[:, index[cylinders]],
            "cylinder_force": F[:, index[cylinders]],
            "pressure_a": pressure_a,
            "pressure_b": pressure_b,
            "element_coordinate": x[:, index[others]],
            "element_force": F[:, index[others]],
            "point_position": points,
            "point_displacement": points - points[:1],
            "load_value": F[:, index[loads]],
            "energy_kinetic": self._energy[:n, 0],
            "energy_potential": self._energy[:n, 1],
            "energy_elastic": elastic - elastic[:1],
            "work_input": self._work[:n, 0],
            "work_dissipated": self._work[:n, 1],
        }
        labels = {
            "joint": rig.coordinate_names,
            "dof": rig.dof_names,
            "constraint": [row.name for row in rig.rows],
            "cylinder": [forces[i].name for i in cylinders],
            "element": [forces[i].name for i in others],
            "point": rig.tracked,
            "load": [forces[i].name for i in loads],
        }
        notes = tuple(_notes(dynamics.equilibrium))
        added = tuple(repr(element) for element in forces if element.name not in rig.sources)
        file = rig.file
        origin = (file.text, dict(file.arguments), cost, notes, added, self.engine, self.method)
        return Trajectory(self._time[:n], arrays, labels, outcome, scenario, *origin)


def _energy(law: Law, x: Array) -> Array:
    """Energy stored in a group of elements with coordinates x (n, members), (n)."""
    if law.stackable:
        return np.asarray(law.energy(x).sum(axis=1))
    return np.array([float(np.ravel(law.energy(row))[0]) for row in x])


def _notes(equilibrium: Equilibrium) -> list[str]:
    assembly = equilibrium.assembly
    notes = []
    moved = {name: value for name, value in assembly.moved.items() if abs(value) > 1e-9}
    if moved:
        notes.append("assembly moved " + ", ".join(f"{name} by {value:+.4g}" for name, value in moved.items()))
    if assembly.redundant:
        notes.append("redundant constraint rows, solved with least norm: " + ", ".join(assembly.redundant))
    if not equilibrium.at_rest:
        notes.append("the machine does not rest at its initial state: some dofs are carried by nothing")
    return notes
