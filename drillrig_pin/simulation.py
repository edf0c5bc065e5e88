"""Run a case: assemble, find equilibrium, integrate, record."""

from __future__ import annotations

import os
import time as clock
import warnings
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from dataclasses import replace
from typing import Any

import numpy as np

from drillrig_pin.assembly import assemble_state
from drillrig_pin.balance import doubt
from drillrig_pin.beat import listening
from drillrig_pin.budget import Budget
from drillrig_pin.constraint_watch import lost_words
from drillrig_pin.dependence import singular_words
from drillrig_pin.dynamics import Dynamics
from drillrig_pin.elements.cylinder import Cylinder
from drillrig_pin.elements.loads import Load
from drillrig_pin.errors import (
    AccuracyWarning,
    AssemblyError,
    LockedError,
    Outcome,
    ScenarioError,
    SingularConfigurationError,
    Status,
    legal_names,
)
from drillrig_pin.finite import LARGEST, require_named
from drillrig_pin.fitting import fitted, start_configuration
from drillrig_pin.marching import Rates, broken_cylinder, march_core, march_python
from drillrig_pin.methods import engine_of, method_of
from drillrig_pin.modes import modes_of
from drillrig_pin.recorder import Recorder
from drillrig_pin.rig import Rig
from drillrig_pin.sampling import longest_step, plan_rows, require_memory, require_steps
from drillrig_pin.scenario import Scenario
from drillrig_pin.stabilization import Baumgarte, Correction, NoCorrection, SlidingMode, default_rate
from drillrig_pin.statics import Equilibrium, find_equilibrium
from drillrig_pin.stepping import Counter, Settings, StoppedError
from drillrig_pin.stiffness import stiff_words
from drillrig_pin.trajectory import Trajectory
from drillrig_pin.workspace import Workspace

Progress = Callable[[float], None]

#: A run that breaks down while a cylinder is nearer to an end than this fraction of its stroke broke down there.
SPARE = 0.1
#: Time between two looks at whether a run in Python is to end [s].
BEAT = 0.05


def simulate(rig: Rig, scenario: Scenario | None = None, progress: Progress | None = None) -> Trajectory:
    """Simulate one case and return everything that happened.

    Args:
        rig: the rig; not changed. What ``scenario.lock`` names is locked in a copy, and in the result's model.
        scenario: the case; None: the default one.
        progress: called now and then with the simulated time [s]; what it raises ends the run. While the run is
            prepared, only those hear who listen, see :func:`drillrig_pin.beat.listening`.

    Returns:
        The trajectory. A run that stops early keeps what it has, with its status; Ctrl-C is one way to stop. One whose
        energy does not balance is handed over with an :class:`~drillrig_pin.errors.AccuracyWarning` and a note.

    Raises:
        ScenarioError: the scenario does not fit the rig.
        AssemblyError: the constraints cannot be closed, or a cylinder starts outside its stroke.
        ResultSizeError: the result would not fit the memory there is.
    """
    return Case(rig, scenario or Scenario()).run(progress)


def simulate_many(
    cases: Iterable[tuple[Rig, Scenario]],
    threads: int | None = None,
    keep: Callable[[Trajectory], Any] | None = None,
) -> list[Any]:
    """Simulate many cases over threads; the compiled core runs them side by side.

    Args:
        cases: rigs and scenarios, any mixture.
        threads: how many run at once; None: one per core of this machine.
        keep: what to keep of each trajectory, e.g. its metrics; None: all of it.

    Returns:
        Results in the order of the cases. An error of one case is raised when its turn comes.
    """

    def run(case: tuple[Rig, Scenario]) -> Any:
        trajectory = simulate(*case)
        return trajectory if keep is None else keep(trajectory)

    with ThreadPoolExecutor(threads or os.cpu_count() or 1) as pool:
        return list(pool.map(run, cases))


class Case:
    """A scenario bound to its rig: assembled, in equilibrium and, for the core, compiled. Runs as often as asked.

    Attributes:
        engine: ``core`` or ``python``.
        method: the integrator chosen.
        modes: the machine's own vibrations about its start.
    """

    @np.errstate(all="ignore")
    def __init__(self, rig: Rig, scenario: Scenario) -> None:
        self.scenario = scenario
        self.dynamics = prepare(rig, scenario)
        self.engine = engine_of(scenario)
        self._march, rates = march_python(self.dynamics) if self.engine == "python" else march_core(self.dynamics)
        _require_accelerations(self.dynamics, rates)
        self.method = method_of(scenario, self.engine, self.dynamics, rates)
        self.modes = modes_of(self.dynamics, rates)
        self._settings = _settings(self.dynamics, scenario, self.method)
        require_steps(scenario, self.method)
        require_memory(scenario, self.dynamics)
        self._plan = plan_rows(scenario, self.dynamics, self.method)

    def run(self, progress: Progress | None = None) -> Trajectory:
        """Simulate; see :func:`simulate`."""
        run = self.solve(progress)
        doubtful = doubt(run)
        if doubtful:
            warnings.warn(doubtful, AccuracyWarning, stacklevel=3)
            run = replace(run, notes=(*run.notes, doubtful))
        return run

    def solve(self, progress: Progress | None = None) -> Trajectory:
        """The same without a look at its balance of energy: for a run that is only compared with another."""
        started = clock.perf_counter()
        recorder = Recorder(self.dynamics, self._plan, self.engine, self.method)
        counter = Counter()
        budget = Budget(self.scenario.integrator.budget, self.scenario.duration)

        heard = clock.perf_counter()

        def reached(t: float) -> None:
            nonlocal heard
            heard = clock.perf_counter()
            budget.spend(t)
            if progress is not None:
                progress(t)

        def waiting() -> None:
            if clock.perf_counter() - heard > BEAT:
                reached(recorder.last_time)

        # The core asks by itself; in Python a row may be long in coming.
        with listening(waiting) if self.engine == "python" else nullcontext():
            outcome = self._outcome(recorder, counter, reached)
        cost = {
            "steps": float(counter.steps),
            "evaluations": float(counter.evaluations),
            "switches": float(counter.switches),
            "wall_time": clock.perf_counter() - started,
        }
        return replace(recorder.trajectory(outcome, self.scenario, cost), modes=self.modes)

    @np.errstate(all="ignore")
    def _outcome(self, recorder: Recorder, counter: Counter, progress: Progress) -> Outcome:
        dynamics = self.dynamics
        status, cause = Status.COMPLETED, ""
        singular = dynamics.equilibrium.assembly.singular
        try:
            if singular and dynamics.formulation != "damped":
                # The start itself is known; the equations do not say how it goes on.
                dynamics.rate(0.0, dynamics.initial())
                recorder.record(0.0, dynamics.initial())
                return Outcome(Status.SINGULAR, 0.0, 0, f"already at the start: {singular_words(singular)}")
            self._march(self._settings, recorder, counter, progress)
        except StoppedError as stopped:
            status, cause = stopped.status, stopped.cause
            if status is Status.TOO_LONG:
                stiff = stiff_words(dynamics, stopped.state)
                return Outcome(status, stopped.time, counter.steps, f"{cause}; {stiff}" if stiff else cause)
            if status not in (Status.SINGULAR, Status.DRIFTED):
                dynamics.evaluate_forces(stopped.time, *np.split(stopped.state[:-2], [dynamics.rig.model.nq]))
                broken = broken_cylinder(dynamics, SPARE)
                if broken:
                    status, cause = Status.DIVERGED, broken
            return Outcome(status, stopped.time, counter.steps, cause)
        except (SingularConfigurationError, np.linalg.LinAlgError):
            status, cause = Status.SINGULAR, lost_words(dynamics)
        except KeyboardInterrupt:
            status = Status.INTERRUPTED
        return Outcome(status, recorder.last_time, counter.steps, cause)


@np.errstate(all="ignore")
def start_state(rig: Rig, scenario: Scenario, space: Workspace | None = None) -> Equilibrium:
    """The assembled initial state of a scenario and its static equilibrium; the rig as :func:`fitted` makes it."""
    rig = fitted(rig, scenario)
    space = space or Workspace(rig, rig.forces)
    q = start_configuration(rig, scenario)
    v = np.zeros(rig.model.nv)
    for name, value in scenario.velocities.items():
        if name in rig.locked:
            if value:
                raise LockedError(f"joint {name!r} is locked and has a velocity", todo="Leave out one of both.")
            continue
        if name not in rig.dof_names:
            raise ScenarioError(f"no dof {name!r}", todo=legal_names(name, rig.dof_names, "dofs"))
        v[rig.dof_names.index(name)] = value
    assembly = assemble_state(rig, q, v, scenario.targets, space)
    equilibrium = find_equilibrium(rig, assembly, space)
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


@np.errstate(all="ignore")
def prepare(rig: Rig, scenario: Scenario) -> Dynamics:
    """The equations of a case at its start, ready to be evaluated or integrated.

    Raises:
        ScenarioError: the scenario does not fit the rig.
        AssemblyError: the machine cannot be assembled, or a velocity at its start is none of a machine.
    """
    rig = fitted(rig, scenario)
    names = [element.name for element in rig.forces if element.load]
    chosen = {"all": names, "none": []}
    acting = frozenset(chosen[scenario.loads] if isinstance(scenario.loads, str) else scenario.loads)
    for name in acting:
        if name not in names:
            raise ScenarioError(f"the model has no load {name!r}", todo=legal_names(name, names, "loads"))
    for element in rig.forces:
        if isinstance(element, Load) and element.name in acting:
            _require_covered(element, scenario.duration)
    space = Workspace(rig, rig.forces)
    dynamics = Dynamics(
        rig,
        start_state(rig, scenario, space),
        loads=acting,
        formulation=scenario.formulation,
        correction=correction_of(scenario),
        space=space,
    )
    velocities = dynamics.initial()[rig.model.nq : -2]
    require_named(dict(zip(rig.dof_names, velocities.tolist(), strict=True)), "velocity")
    return dynamics


def _require_accelerations(dynamics: Dynamics, rates: Rates) -> None:
    """Refuse a case whose accelerations at the start, as its engine computes them, are no numbers of a machine.

    A force is to blame more often than not: then that is named.
    """
    rig, start = dynamics.rig, dynamics.initial()
    nq = rig.model.nq
    try:
        rate = rates(np.zeros(1), start[None])[0]
    except (SingularConfigurationError, np.linalg.LinAlgError):
        return  # the run itself says what is wrong
    accelerations = dict(zip(rig.dof_names, rate[nq:-2].tolist(), strict=True))
    if all(abs(value) <= LARGEST for value in accelerations.values()):
        return
    dynamics.evaluate_forces(0.0, start[:nq], start[nq:-2])
    forces = dynamics.F[dynamics.space.index].tolist()
    require_named(dict(zip([element.name for element in dynamics.forces], forces, strict=True)), "force")
    require_named(accelerations, "acceleration")


def _require_covered(load: Load, duration: float) -> None:
    if load.start_of_table() > 0 or load.end_of_table() < duration:
        raise ScenarioError(
            f"load {load.name!r} is known from {load.start_of_table():g} to {load.end_of_table():g} s, "
            f"the run lasts from 0 to {duration:g} s",
            todo=_to_cover(load, duration),
        )


def _to_cover(load: Load, duration: float) -> str:
    """What to write so that a table covers a run."""
    start, end = load.start_of_table(), load.end_of_table()
    if start > 0 and end - start >= duration:
        return f'Write time_offset="auto" in its <table> to start it at t = 0, or time_offset="{-start!r}".'
    if start > 0:
        return (
            'Write time_offset="auto" in its <table> to start it at t = 0, '
            f"and set scenario.duration to {end - start:g} s at most."
        )
    return f"Shorten scenario.duration or lengthen the table: add a row at {duration:g} s."


def correction_of(scenario: Scenario) -> Correction:
    """The stabilising term a scenario asks for, with automatic values filled in."""
    given = scenario.stabilization
    chosen = scenario.integrator
    automatic = default_rate(chosen.step if chosen.method == "RK4" else None)
    if given.method == "baumgarte":
        alpha = automatic if given.alpha == "auto" else given.alpha
        return Baumgarte(alpha, alpha if given.beta == "auto" else given.beta)
    if given.method == "sliding_mode":
        return SlidingMode(automatic if given.rate == "auto" else given.rate, given.gain, given.width)
    return NoCorrection()


def _settings(dynamics: Dynamics, scenario: Scenario, method: str) -> Settings:
    chosen = scenario.integrator
    atol = np.full(dynamics.size, chosen.atol)
    # Velocities of a vibration at 100 1/s are that much larger than its displacements; work is counted in joules.
    atol[dynamics.rig.model.nq : -2] *= 100.0
    atol[-2:] *= 1e5
    endless = dynamics.rig.endless
    atol[list(endless)] += chosen.rtol
    return Settings(
        method,
        chosen.step,
        chosen.rtol,
        atol,
        longest_step(scenario, dynamics, method),
        scenario.stabilization.projection and (dynamics.space.m > 0 or dynamics.rig.model.nq != dynamics.rig.model.nv),
        endless,
    )
