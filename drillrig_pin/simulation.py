"""Run a case: assemble, find equilibrium, integrate, record."""

from __future__ import annotations

import time as clock
from collections.abc import Callable

import numpy as np

from drillrig_pin.assembly import RANK, assemble_state
from drillrig_pin.dynamics import Dynamics
from drillrig_pin.elements.cylinder import Cylinder
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
from drillrig_pin.recorder import Recorder
from drillrig_pin.rig import Rig
from drillrig_pin.scenario import Scenario
from drillrig_pin.stabilization import Correction, automatic_rate, baumgarte, no_correction, sliding_mode
from drillrig_pin.statics import Equilibrium, find_equilibrium
from drillrig_pin.trajectory import Trajectory

Progress = Callable[[float], None]

#: A run that breaks down while a cylinder is nearer to an end than this fraction of its stroke broke down there.
SPARE = 0.1


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
    watch = RankWatch()
    t = 0.0
    status, cause = Status.COMPLETED, ""
    every = max(1, len(samples) // 200)
    try:
        with np.errstate(all="ignore"):
            steps = integrate(
                dynamics, dynamics.initial(), samples, dynamics.breakpoints(), _settings(dynamics, scenario), counter
            )
            for t, y in steps:
                broken = _broken_cylinder(dynamics)
                if broken:
                    raise StoppedError(Status.DIVERGED, t, broken, y)
                watch.look(dynamics.space.J)
                recorder.record(t, y)
                if progress is not None and recorder.count % every == 0:
                    progress(t)
    except StoppedError as stopped:
        status, t, cause = stopped.status, stopped.time, stopped.cause
        dynamics.evaluate_forces(t, *np.split(stopped.state[:-2], [dynamics.rig.model.nq]))
        broken = _broken_cylinder(dynamics, SPARE)
        if broken:
            status, cause = Status.DIVERGED, broken
    except (SingularConfigurationError, np.linalg.LinAlgError):
        rows = ", ".join(row.name for row in dynamics.rig.rows)
        status, cause = Status.SINGULAR, f"constraints {rows}" if rows else "a moving link without mass"
    except KeyboardInterrupt:
        status = Status.INTERRUPTED
    return Outcome(status, float(t), counter.steps, cause)


class RankWatch:
    """Notices that the constraint Jacobian loses rank at a sample, or has passed through a loss since the last one.

    Where it does, its smallest singular value crosses zero: the value itself is positive again behind it, but one of
    its two singular vectors has changed sign, or both have turned because the motion took another path. Beyond such a
    point there is more than one path, and the equations cannot say which one the machine takes.
    """

    #: A singular value below this fraction of the largest may be on its way through zero.
    WEAK = 0.05
    #: Cosine above which the vectors of two samples are those of one smooth motion.
    SAME = 0.5

    def __init__(self) -> None:
        self._rank = 0
        self._largest = 0.0
        self._weakest: tuple[float, Array, Array] | None = None

    def look(self, J: Array) -> None:
        """Take in the Jacobian of the next sample; SingularConfigurationError if rank is or was lost."""
        if not len(J):
            return
        U, values, V = np.linalg.svd(J, full_matrices=False)
        self._largest = max(self._largest, float(values[0]))
        rank = int((values > RANK * self._largest).sum())
        if self._weakest is None:
            self._rank = rank
        if rank < self._rank or rank == 0:
            raise SingularConfigurationError("the constraint Jacobian has lost rank")
        value, left, right = float(values[rank - 1]), U[:, rank - 1], V[rank - 1]
        if self._weakest is not None:
            before, left_before, right_before = self._weakest
            same = float((left @ left_before) * (right @ right_before))
            if max(value, before) < self.WEAK * self._largest and same < self.SAME:
                raise SingularConfigurationError("the constraint Jacobian has passed through a loss of rank")
        self._weakest = value, left, right


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


def _broken_cylinder(dynamics: Dynamics, spare: float = 0.0) -> str:
    """Says which cylinder left its stroke, or moves towards an end that is nearer than ``spare`` of its stroke."""
    for element, i in zip(dynamics.forces, dynamics.space.index, strict=True):
        if isinstance(element, Cylinder):
            shortest, longest = element.length_range
            length, rate = float(dynamics.x[i]), float(dynamics.x_dot[i])
            margin = spare * element.stroke
            if length <= shortest or length >= longest:
                return f"cylinder {element.name!r} left its stroke (length {length:.4f} m)"
            if (length <= shortest + margin and rate < 0) or (length >= longest - margin and rate > 0):
                return f"cylinder {element.name!r} runs against the end of its stroke (length {length:.4f} m)"
    return ""
