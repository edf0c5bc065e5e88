"""Collect what the equations knew at every row, and turn it into a trajectory."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin

from drillrig_pin.arrays import Arrays
from drillrig_pin.dependence import singular_words
from drillrig_pin.dynamics import Dynamics, ForceGroup
from drillrig_pin.elements.cylinder import Cylinder, LockedOil
from drillrig_pin.errors import Outcome, Status
from drillrig_pin.finite import STRAYED, TURNED, first_unsound
from drillrig_pin.fitting import locked_words
from drillrig_pin.joint_limits import outside_limits
from drillrig_pin.kinematics import Array
from drillrig_pin.plausible import implausible_words
from drillrig_pin.sampling import load_frequencies
from drillrig_pin.scenario import Scenario
from drillrig_pin.statics import Equilibrium
from drillrig_pin.stepping import Flags, Plan
from drillrig_pin.trajectory import AXES, Kept, Trajectory
from drillrig_pin.validity import looked_at

#: A change of the initial velocity [rad/s, m/s] that is more than rounding.
NOTICED = 1e-9
#: How names of coordinates end that are positions of a floating joint.
FLOATING = (".x", ".y", ".z")


class Recorder:
    """Rows of every variable, filled row by row.

    Attributes:
        plan: the rows to be filled.
        count: rows filled so far.
        extra: further rows, all arrays of a row behind one another: any number of rows in each entry.
    """

    def __init__(self, dynamics: Dynamics, plan: Plan, engine: str, method: str) -> None:
        model, space = dynamics.rig.model, dynamics.space
        n = len(plan.times)
        self.dynamics, self.plan, self.count = dynamics, plan, 0
        self.extra: list[Array] = []
        self.engine, self.method = engine, method
        self._shapes: list[tuple[int, ...]] = [
            *((), (model.nq,), (model.nv,), (model.nv,), (2,), (space.m,), (space.m,), (space.m,)),
            *((len(dynamics.forces),), (len(dynamics.forces),), space.points().shape, (2,)),
        ]
        self._arrays = [np.zeros((n, *shape)) for shape in self._shapes]

    @property
    def last_time(self) -> float:
        """Time of the last row."""
        return float(self._arrays[0][self.count - 1]) if self.count else 0.0

    def arrays(self) -> list[Array]:
        """The arrays themselves, in the order the compiled core fills them.

        time, q, v, a, work, reaction, f, f_dot, x, F, points, energy.
        """
        return self._arrays

    def record(self, t: float, y: Array, *, extra: bool = False) -> None:
        """Take over the state last evaluated by the dynamics, y at time t, as the next row or a further one."""
        dynamics = self.dynamics
        model, space, equations = dynamics.rig.model, dynamics.space, dynamics.equations
        nq, end = model.nq, model.nq + model.nv
        q, v = y[:nq], y[nq:end]
        energy = 0.5 * (v @ equations.M @ v), pin.computePotentialEnergy(model, space.kinematics.data, q)
        row: tuple[Any, ...] = (
            *(t, q, v, dynamics.a, y[end:], dynamics.multipliers, equations.f, equations.f_dot),
            *(dynamics.x, dynamics.F, space.points(), energy),
        )
        if extra:
            self.extra.append(np.concatenate([np.ravel(value) for value in row]))
            return
        for array, value in zip(self._arrays, row, strict=True):
            array[self.count] = value
        self.count += 1

    def _rows(self) -> tuple[list[Array], Flags, Flags]:
        """All arrays in order of time, and which of their rows were asked for and which belong to the record."""
        n = self.count
        asked, kept = self.plan.asked[:n], self.plan.kept[:n]
        arrays = [array[:n] for array in self._arrays]
        further = np.concatenate([np.zeros(0), *self.extra])
        if not len(further):
            return arrays, asked, kept
        widths = [int(np.prod(shape)) for shape in self._shapes]
        further = further.reshape(-1, sum(widths))
        asked = np.concatenate([asked, np.zeros(len(further), bool)])
        kept = np.concatenate([kept, np.ones(len(further), bool)])
        order = np.argsort(np.concatenate([arrays[0], further[:, 0]]), kind="stable")
        columns = np.split(further, np.cumsum(widths)[:-1], axis=1)
        arrays = [
            np.concatenate([array, column.reshape(len(further), *shape)])[order]
            for array, column, shape in zip(arrays, columns, self._shapes, strict=True)
        ]
        return arrays, asked[order], kept[order]

    def _unsound(self, *arrays: Array) -> tuple[int, str] | None:
        """The first row that holds what no machine shows, and what: of the arrays in order, then of elastic energy."""
        rig, forces, index = self.dynamics.rig, self.dynamics.forces, self.dynamics.space.index
        by_coordinate = [forces[i].name for i in np.argsort(index)]
        rows = tuple(row.name for row in rig.rows)
        points = tuple(f"{name} along {axis}" for name in rig.tracked for axis in AXES)
        names: list[tuple[str, tuple[str, ...]]] = [
            ("time", ()),
            ("position", tuple(rig.coordinate_names)),
            ("velocity", tuple(rig.dof_names)),
            ("acceleration", tuple(rig.dof_names)),
            ("work", ("the loads", "friction and damping")),
            ("reaction", rows),
            ("constraint error", rows),
            ("rate of the constraint error", rows),
            ("length or angle", tuple(by_coordinate)),
            ("force", tuple(by_coordinate)),
            ("position of point", points),
            ("energy", ("motion", "height")),
            ("elastic energy", ()),
        ]
        reach = [STRAYED if name in rig.sliding or name.endswith(FLOATING) else TURNED for name in rig.coordinate_names]
        bounds = {"position": np.array(reach), "position of point": np.full(len(points), STRAYED)}
        return first_unsound({n: (a, c) for (n, c), a in zip(names, arrays, strict=True)}, bounds)

    @np.errstate(all="ignore")
    def trajectory(self, outcome: Outcome, scenario: Scenario, cost: dict[str, float]) -> Trajectory:
        """All rows recorded so far, up to the first that holds what no machine shows: from there on it has diverged."""
        dynamics = self.dynamics
        (time, q, v, a, work, reaction, f, f_dot, x, F, points, energy), asked, kept = self._rows()
        rig, forces, index = dynamics.rig, dynamics.forces, dynamics.space.index
        cylinders = [i for i, e in enumerate(forces) if isinstance(e, Cylinder)]
        loads = [i for i, e in enumerate(forces) if e.load]
        others = [i for i, e in enumerate(forces) if i not in cylinders and not e.load]
        oil = _Oil(dynamics.groups, x, cylinders)
        unsound = self._unsound(time, q, v, a, work, reaction, f, f_dot, x, F, points, energy, oil.energy()[0])
        if unsound is not None:
            row, words = unsound
            outcome = Outcome(Status.DIVERGED, float(time[row]), outcome.steps, words)
            time, q, v, a, work, reaction, f, f_dot, x, F, points, energy = (
                array[:row] for array in (time, q, v, a, work, reaction, f, f_dot, x, F, points, energy)
            )
            asked, kept = asked[:row], kept[:row]
            oil = _Oil(dynamics.groups, x, cylinders)
        of_record: Any = slice(None) if kept.all() else kept  # a copy of every row only where it is needed
        outcome = looked_at(outcome, dynamics.groups, forces, time[of_record], x[of_record])
        arrays = Arrays(
            {
                "q": q,
                "v": v,
                "a": a,
                "reaction": reaction,
                "constraint_error": f,
                "constraint_rate": f_dot,
                "point_position": points,
                "energy_kinetic": energy[:, 0],
                "energy_potential": energy[:, 1],
                "work_input": work[:, 0],
                "work_dissipated": work[:, 1],
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
        notes = (
            *locked_words(rig),
            *rig.once("implausible", lambda: implausible_words(rig)),
            *_notes(dynamics.equilibrium),
            *starts,
            *remarks,
        )
        added = tuple(repr(element) for element in forces if element.name not in rig.sources)
        file = rig.file
        origin = (file.text, dict(file.arguments), cost, notes, added, self.engine, self.method)
        frequencies = load_frequencies(dynamics)
        highest = float(frequencies[-1]) if len(frequencies) else 0.0
        samples, record = Kept(time, arrays), None
        if not np.array_equal(asked, kept):
            samples, record = _selected(samples, asked), _selected(samples, kept)
        run = Trajectory(samples.time, samples.arrays, labels, outcome, scenario, *origin)
        return replace(run, kept=record, load_frequency=highest, folder=str(file.folder or ""))


def _selected(rows: Kept, flags: Flags) -> Kept:
    """Some of the rows: themselves if all, a view if every k-th, else copied one variable at a time when asked for."""
    where: Any = np.flatnonzero(flags)
    if len(where) == len(flags):
        return rows
    strides = np.unique(np.diff(where))
    if len(strides) == 1:
        where = slice(int(where[0]), int(where[-1]) + 1, int(strides[0]))

    def column(name: str) -> Callable[[], tuple[Array]]:
        return lambda: (rows.arrays[name][where],)

    return Kept(rows.time[where], Arrays({}, {(name,): column(name) for name in rows.arrays}))


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
