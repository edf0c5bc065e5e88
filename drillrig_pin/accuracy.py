"""How far a run is from the exact solution of its own equations: estimated by solving it once more, tighter."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drillrig_pin.rig import Rig
from drillrig_pin.simulation import Case
from drillrig_pin.trajectory import ESTIMATE, Trajectory

#: Tolerances of the second run are this much smaller: its own error then hardly counts.
TIGHTER = 30.0
#: Tolerances a scenario may ask for, at least; below, rounding rules.
FINEST = 1e-13


def estimate_error(rig: Rig, trajectory: Trajectory) -> Trajectory:
    """The same run with its error beside its cost: max |q - q_finer| over all rows and joints [rad or m].

    Rows are those of the record, unless impacts gave the two runs different ones: then the samples.

    The finer run has tolerances 30 times smaller, and half the steps if that alone changes nothing. For RK4 it has half
    the step, and the difference is multiplied by 16/15 for an error of order four. A run that stopped early, or whose
    tolerance cannot be made smaller, is given back as it is, and so is one whose finer run stops early.

    Args:
        rig: the rig it was run with.
        trajectory: the run.
    """
    scenario, chosen = trajectory.scenario, trajectory.scenario.integrator
    if not trajectory.outcome.completed or (trajectory.method != "RK4" and chosen.rtol < 2 * FINEST):
        return trajectory
    if trajectory.method == "RK4":
        factor, finer = 16 / 15, {"integrator.step": chosen.step / 2}
        again = Case(rig, scenario.changed(finer)).solve()
    else:
        factor = 1.0
        finer = {"integrator.rtol": max(chosen.rtol / TIGHTER, FINEST), "integrator.atol": chosen.atol / TIGHTER}
        again = Case(rig, scenario.changed(finer)).solve()
        if again.method == trajectory.method and again.outcome.steps < 1.1 * trajectory.outcome.steps:
            # Samples and load tables, not the tolerance, held the steps short: they are halved outright.
            half = 0.5 * trajectory.outcome.time / trajectory.outcome.steps
            again = Case(rig, scenario.changed({**finer, "integrator.max_step": half})).solve()
    if not again.outcome.completed:
        return trajectory
    rows, others = trajectory.record, again.record
    if not np.array_equal(rows.time, others.time):
        rows, others = trajectory, again
    error = factor * float(np.abs(rows.q - others.q).max(initial=0.0))
    return replace(trajectory, cost={**trajectory.cost, ESTIMATE: error})
