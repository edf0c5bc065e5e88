"""Run a case: assemble, find equilibrium, integrate, record."""

from __future__ import annotations

import time as clock
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from drillrig_pin.assembly import RANK, Assembly, assemble_state
from drillrig_pin.dynamics import Dynamics
from drillrig_pin.elements.cylinder import Cylinder, LockedOil
from drillrig_pin.elements.loads import Load
from drillrig_pin.errors import (
    AssemblyError,
    Outcome,
    ScenarioError,
    SingularConfigurationError,
    Status,
    legal_names,
)
from drillrig_pin.integrators import Counter, Settings, StoppedError, integrate
from drillrig_pin.kinematics import Array
from drillrig_pin.rig import Rig
from drillrig_pin.scenario import Scenario
from drillrig_pin.stabilization import Correction, automatic_rate, baumgarte, no_correction, sliding_mode
from drillrig_pin.statics import Equilibrium, find_equilibrium
from drillrig_pin.trajectory import Trajectory

Progress = Callable[[float], None]


def simulate(rig: Rig, scenario: Scenario | None = None, progress: Progress | None = None) -> Trajectory:
    """Simulate one case and return everything that happened.

    Args:
        rig: the rig; not changed.
        scenario: the case; None: the default one.
        progress: called now and then with the simulated time [s].

    Returns:
        The trajectory. A run that stops early keeps what it has, with its status; Ctrl-C is one way to stop.

    Raises:
        ScenarioError: the scenario does not fit the rig.
        AssemblyError: the constraints cannot be closed, or a cylinder starts outside its stroke.
    """
    scenario = scenario or Scenario()
    started = clock.perf_counter()
    dynamics = prepare(rig, scenario)
    samples = sample_times(scenario)
    recorder = Recorder(dynamics, samples)
    counter = Counter()
    outcome = _march(dynamics, scenario, samples, recorder, counter, progress)
    cost = {
        "steps": float(counter.steps),
        "evaluations": float(counter.evaluations),
        "switches": float(counter.switches),
        "wall_time": clock.perf_counter() - started,
    }
    return recorder.trajectory(outcome, scenario, cost)


def sample_times(scenario: Scenario) -> Array:
    """Times of the samples: multiples of 1 / output_rate, and the end."""
    count = int(np.floor(scenario.duration * scenario.output_rate * (1 + 1e-12)))
    times = np.arange(count + 1) / scenario.output_rate
    if scenario.duration - times[-1] > 1e-9 * scenario.duration:
        times = np.append(times, scenario.duration)
    return times


def start_state(rig: Rig, scenario: Scenario) -> Equilibrium:
    """The assembled initial state of a scenario and its static equilibrium."""
    pose = scenario.pose
    if pose is None and rig.poses:
        pose = next(iter(rig.poses))
    q = rig.configuration(pose, scenario.positions)
    v = np.zeros(rig.model.nv)
    for name, value in scenario.velocities.items():
        if name not in rig.dof_names:
            raise ScenarioError(f"no dof {name!r}", todo=legal_names(name, rig.dof_names, "dofs"))
        v[rig.dof_names.index(name)] = value
    assembly = assemble_state(rig, q, v, scenario.targets)
    equilibrium = find_equilibrium(rig, assembly)
    for element in rig.forces:
        if isinstance(element, Cylinder):
            _require_stroke(element, equilibrium.x0[element.name])
    return equilibrium


def _require_stroke(cylinder: Cylinder, length: float) -> None:
    shortest, longest = cylinder.length_range
    if not shortest < length < longest:
        raise AssemblyError(
            f"cylinder {cylinder.name!r} would be {length:.4f} m long, "
            f"outside its range of {shortest:.4f} to {longest:.4f} m",
            where="initial state",
            todo="Move a pin, change the cylinder, or start from another pose.",
        )


def prepare(rig: Rig, scenario: Scenario) -> Dynamics:
    """The equations of a case at its start, ready to be evaluated or integrated."""
    names = [element.name for element in rig.forces if element.load]
    chosen = {"all": names, "none": []}
    acting = frozenset(chosen[scenario.loads] if isinstance(scenario.loads, str) else scenario.loads)
    for name in acting:
        if name not in names:
            raise ScenarioError(f"the model has no load {name!r}", todo=legal_names(name, names, "loads"))
    for element in rig.forces:
        if isinstance(element, Load) and element.name in acting:
            _require_covered(element, scenario.duration)
    return Dynamics(
        rig,
        start_state(rig, scenario),
        loads=acting,
        formulation=scenario.formulation,
        correction=correction_of(scenario),
    )


def _require_covered(load: Load, duration: float) -> None:
    if load.start_of_table() > 0 or load.end_of_table() < duration:
        raise ScenarioError(
            f"load {load.name!r} is known from {load.start_of_table():g} to {load.end_of_table():g} s, "
            f"the run lasts from 0 to {duration:g} s",
            todo="Shorten scenario.duration or lengthen the table.",
        )


def correction_of(scenario: Scenario) -> Correction:
    """The stabilising term a scenario asks for, with automatic values filled in."""
    given = scenario.stabilization
    # The other methods choose their steps; they are rarely longer than a millisecond on a machine that vibrates.
    chosen = scenario.integrator
    automatic = automatic_rate(chosen.step if chosen.method == "RK4" else min(1.0 / scenario.output_rate, 1e-3))
    if given.method == "baumgarte":
        alpha = automatic if given.alpha == "auto" else given.alpha
        return baumgarte(alpha, alpha if given.beta == "auto" else given.beta)
    if given.method == "sliding_mode":
        return sliding_mode(automatic if given.rate == "auto" else given.rate, given.gain, given.width)
    return no_correction


def _march(
    dynamics: Dynamics,
    scenario: Scenario,
    samples: Array,
    recorder: Recorder,
    counter: Counter,
    progress: Progress | None,
) -> Outcome:
    rank = _rank(dynamics.space.J) if dynamics.space.m else 0
    t = 0.0
    status, cause = Status.COMPLETED, ""
    every = max(1, len(samples) // 200)
    try:
        with np.errstate(all="ignore"):
            steps = integrate(
                dynamics, dynamics.initial(), samples, dynamics.breakpoints(), _settings(dynamics, scenario), counter
            )
            for t, y in steps:
                recorder.record(t, y)
                if rank and _rank(dynamics.space.J) < rank:
                    raise SingularConfigurationError("the constraint Jacobian has lost rank")
                if progress is not None and recorder.count % every == 0:
                    progress(t)
    except StoppedError as stopped:
        status, t, cause = stopped.status, stopped.time, stopped.cause
        broken = _broken_cylinder(dynamics)
        if broken:
            status, cause = Status.DIVERGED, broken
    except (SingularConfigurationError, np.linalg.LinAlgError):
        status, cause = Status.SINGULAR, f"constraints {', '.join(row.name for row in dynamics.rig.rows)}"
    except KeyboardInterrupt:
        status = Status.INTERRUPTED
    return Outcome(status, float(t), counter.steps, cause)


def _rank(J: Array) -> int:
    values = np.linalg.svd(J, compute_uv=False)
    return int((values > RANK * values[0]).sum())


def _settings(dynamics: Dynamics, scenario: Scenario) -> Settings:
    chosen = scenario.integrator
    atol = np.full(dynamics.size, chosen.atol)
    # Velocities of a vibration at 100 1/s are that much larger than its displacements; work is counted in joules.
    atol[dynamics.rig.model.nq : -2] *= 100.0
    atol[-2:] *= 1e5
    return Settings(
        chosen.method,
        chosen.step,
        chosen.rtol,
        atol,
        chosen.max_step or np.inf,
        scenario.stabilization.projection and (dynamics.space.m > 0 or dynamics.rig.model.nq != dynamics.rig.model.nv),
    )


def _broken_cylinder(dynamics: Dynamics) -> str:
    for element, i in zip(dynamics.forces, dynamics.space.index, strict=True):
        if isinstance(element, Cylinder):
            shortest, longest = element.length_range
            length = float(dynamics.x[i])
            if not shortest < length < longest:
                return f"cylinder {element.name!r} left its stroke (length {length:.4f} m)"
    return ""


@dataclass
class _Columns:
    """Which force elements go into which dimension of the result."""

    cylinder: list[int]
    load: list[int]
    element: list[int]


class Recorder:
    """Collects what the equations knew at every sample, and turns it into a trajectory."""

    def __init__(self, dynamics: Dynamics, samples: Array) -> None:
        model, space = dynamics.rig.model, dynamics.space
        n = len(samples)
        self.dynamics, self.count = dynamics, 0
        self._time = np.zeros(n)
        self._q, self._v, self._a = np.zeros((n, model.nq)), np.zeros((n, model.nv)), np.zeros((n, model.nv))
        self._work = np.zeros((n, 2))
        self._reaction, self._f, self._f_dot = (np.zeros((n, space.m)) for _ in range(3))
        self._x, self._F = (np.zeros((n, len(dynamics.forces))) for _ in range(2))
        self._points = np.zeros((n, *space.points().shape))
        self._energy = np.zeros((n, 2))

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
        x, F = self._x[:n, index], self._F[:n, index]
        cylinders = [i for i, e in enumerate(forces) if isinstance(e, Cylinder)]
        loads = [i for i, e in enumerate(forces) if e.load]
        others = [i for i, e in enumerate(forces) if i not in cylinders and not e.load]
        pressures = [_pressures(dynamics.laws[i], x[:, i]) for i in cylinders]
        elastic = sum((_energy(dynamics.laws[i], x[:, i]) for i in [*cylinders, *others]), np.zeros(n))
        points = self._points[:n]
        arrays = {
            "q": self._q[:n],
            "v": self._v[:n],
            "a": self._a[:n],
            "reaction": self._reaction[:n],
            "constraint_error": self._f[:n],
            "constraint_rate": self._f_dot[:n],
            "cylinder_length": x[:, cylinders],
            "cylinder_force": F[:, cylinders],
            "pressure_a": np.array([p[0] for p in pressures]).reshape(len(cylinders), n).T,
            "pressure_b": np.array([p[1] for p in pressures]).reshape(len(cylinders), n).T,
            "element_coordinate": x[:, others],
            "element_force": F[:, others],
            "point_position": points,
            "point_displacement": points - points[:1],
            "load_value": F[:, loads],
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
        return Trajectory(
            self._time[:n], arrays, labels, outcome, scenario, file.text, dict(file.arguments), cost, notes, added
        )


def _pressures(law: object, x: Array) -> tuple[Array, Array]:
    assert isinstance(law, LockedOil)
    return law.pressures(x)


def _energy(law: object, x: Array) -> Array:
    energy = law.energy  # type: ignore[attr-defined]
    if getattr(law, "stackable", False):
        return np.asarray(energy(x))
    return np.array([float(np.ravel(energy(x[i : i + 1]))[0]) for i in range(len(x))])


def _notes(equilibrium: Equilibrium) -> list[str]:
    assembly: Assembly = equilibrium.assembly
    notes = []
    moved = {name: value for name, value in assembly.moved.items() if abs(value) > 1e-9}
    if moved:
        notes.append("assembly moved " + ", ".join(f"{name} by {value:+.4g}" for name, value in moved.items()))
    if assembly.redundant:
        notes.append("redundant constraint rows, solved with least norm: " + ", ".join(assembly.redundant))
    if not equilibrium.at_rest:
        notes.append("the machine does not rest at its initial state: some dofs are carried by nothing")
    return notes
