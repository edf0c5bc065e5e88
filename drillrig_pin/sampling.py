"""At which times a run has rows: the samples asked for, and a record close enough for every load, whatever is asked."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from drillrig_pin.dynamics import Dynamics
from drillrig_pin.errors import ResultSizeError, ScenarioError
from drillrig_pin.kinematics import Array
from drillrig_pin.memory import available_memory
from drillrig_pin.scenario import Scenario
from drillrig_pin.stepping import Plan, plan_of

#: Rows of the record a second, at least [Hz]; more of them come in multiples of it.
LEAST_RATE = 1000.0
#: Rows of the record in a period of every load, at least.
PER_PERIOD = 10
#: Different phases of a period seen in time, at least: an extreme is missed by no more than 1 - cos(pi / 20) = 1.2 %.
PHASES = 20
#: Rows whose phase moves on by less than this share of a period each time the pattern repeats show no more of it.
DRIFT = 2e-3
#: Steps in a period of every load, at least, for a user who asks for steps longer than the rows of the record.
STEPS_PER_PERIOD = 8
#: Rows of the record a second from which no run is long enough to be worth the search for other phases [Hz].
FASTEST = 1e12
#: Steps of a fixed or longest length that a run may ask for: days of computation.
MOST_STEPS = 1e9
#: Rows of the record between the stops of such a run.
COARSE = 100


def sample_times(scenario: Scenario) -> Array:
    """Times of the samples: multiples of 1 / output_rate, and the end."""
    return _multiples(scenario.duration, scenario.output_rate)


def load_frequencies(dynamics: Dynamics) -> Array:
    """Frequencies of all loads that act and vary with time, increasing [Hz]."""
    loads = (law.frequencies() for element, law in zip(dynamics.forces, dynamics.laws, strict=True) if element.load)
    return np.unique(np.concatenate([np.zeros(0), *loads]))


def record_rate(frequencies: Iterable[float]) -> float:
    """Rows of the record a second [Hz], for loads of these frequencies [Hz].

    The least multiple of 1000 Hz that gives every period at least ten rows, and rows at no fewer than twenty different
    phases of it: at 1000 Hz a load of 96 Hz is seen at 125 phases within 0.1 s, one of 100 Hz at the same ten for ever.
    """
    frequencies = sorted(f for f in frequencies if f > 0)
    if not frequencies:
        return LEAST_RATE
    rate = LEAST_RATE * max(1.0, np.ceil(PER_PERIOD * frequencies[-1] / LEAST_RATE * (1 - 1e-12)))
    # Beyond, thousands of rows more or less are one number: such a run is refused for its size.
    while rate < FASTEST and any(_repeats(f / rate) for f in frequencies):
        rate += LEAST_RATE
    return float(rate)


def _repeats(turn: float) -> bool:
    """True if steps of ``turn`` periods come back to the same few phases."""
    for count in range(1, PHASES):
        distance = abs(count * turn - round(count * turn))
        if round(count * turn) >= 1 and distance < DRIFT:
            return True
    return False


def plan_rows(scenario: Scenario, dynamics: Dynamics, method: str) -> Plan:
    """All rows of a case, and where its steps end.

    The record does not depend on the output rate, nor do the steps: they end at its rows, so that none is longer. Only
    who asks for longer ones, by ``integrator.max_step`` or the fixed ``step`` of RK4, gets them.
    """
    rate = record_rate(load_frequencies(dynamics))
    chosen = scenario.integrator
    stride = 1
    if method == "RK4" and chosen.step * rate > 1 + 1e-9:
        stride = 0
    elif method != "RK4" and (chosen.max_step or 0.0) * rate > 1 + 1e-9:
        stride = COARSE
    record = _multiples(scenario.duration, rate)
    return plan_of(sample_times(scenario), record, dynamics.breakpoints(), dynamics.jumps(), stride)


def require_memory(scenario: Scenario, dynamics: Dynamics) -> None:
    """Refuse a case whose rows would not fit the memory there is.

    Raises:
        ResultSizeError: with the size, the memory there is and what to change.
    """
    rate = record_rate(load_frequencies(dynamics))
    shared = rate % scenario.output_rate == 0 or scenario.output_rate % rate == 0
    rows = scenario.duration * (max(rate, scenario.output_rate) if shared else rate + scenario.output_rate)
    rows += len(dynamics.breakpoints())
    # As recorded, and once more what is computed of it: pressures, displacements, energies.
    model, space = dynamics.rig.model, dynamics.space
    columns = 5 + model.nq + 2 * model.nv + 3 * space.m + 6 * len(dynamics.forces) + 2 * space.points().size
    needed, available = 8.0 * rows * columns, available_memory()
    if needed <= available:
        return
    largest = "output_rate" if scenario.output_rate > rate else "duration"
    error = ResultSizeError(
        f"the result would take {needed / 1e9:.3g} GB of memory ({rows:.3g} rows of {columns} numbers), "
        f"{available / 1e9:.3g} GB are available",
        todo=f"Lower scenario.{largest}; statistics are taken from {rate:g} rows a second whatever the output_rate.",
    )
    error.needed, error.available, error.field = needed, available, f"scenario.{largest}"
    raise error


def require_steps(scenario: Scenario, method: str) -> None:
    """Refuse a case that asks for more steps than anybody would wait for.

    Raises:
        ScenarioError: with their number and the field that asks for them.
    """
    chosen = scenario.integrator
    name, step = ("step", chosen.step) if method == "RK4" else ("max_step", chosen.max_step)
    count = scenario.duration / step if step else 0.0
    if count > MOST_STEPS:
        field = f"scenario.integrator.{name}"
        error = ScenarioError(
            f"{field} = {step:g} s asks for {count:.3g} steps in {scenario.duration:g} s, {MOST_STEPS:g} are the most",
            todo=f"Lengthen {field}, or shorten scenario.duration.",
        )
        error.field = field
        raise error


def longest_step(scenario: Scenario, dynamics: Dynamics, method: str) -> float:
    """Longest step an adaptive method may take [s]: no load is stepped over."""
    frequencies = load_frequencies(dynamics)
    longest = scenario.integrator.max_step
    if longest is None:
        # Stops hold the steps of the others; LSODA passes them.
        return 1.0 / record_rate(frequencies) if method == "LSODA" else np.inf
    return min(longest, 1.0 / (STEPS_PER_PERIOD * float(frequencies[-1]))) if len(frequencies) else longest


def _multiples(duration: float, rate: float) -> Array:
    count = int(np.floor(duration * rate * (1 + 1e-12)))
    times = np.arange(count + 1) / rate
    if duration - times[-1] > 1e-9 * duration:
        times = np.append(times, duration)
    return times
