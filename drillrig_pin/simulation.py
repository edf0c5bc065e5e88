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
