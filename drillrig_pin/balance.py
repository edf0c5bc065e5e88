"""The balance of energy of a run, looked at behind every run: a bad one is not handed over without a word."""

from __future__ import annotations

import numpy as np

from drillrig_pin.trajectory import Trajectory

#: Beyond this a run should not be used: energy residual relative to its reference.
WORST_ENERGY = 1e-3
#: Energy [J] below which a machine is at rest: the elastic energy of a locked oil column is rounded at about this.
NOTHING = 1e-9


def energy_reference(trajectory: Trajectory) -> tuple[float, str]:
    """Energy the residual is compared with [J], and what it is: see :func:`drillrig_pin.analysis.trust.trust`."""
    work = float(np.abs(trajectory.work_input).max(initial=0.0))
    energies = (trajectory.energy_kinetic, trajectory.energy_potential, trajectory.energy_elastic)
    exchanged = max((float(np.ptp(energy)) for energy in energies if energy.size), default=0.0)
    size = max((float(np.abs(energy).max()) for energy in energies if energy.size), default=0.0)
    rounding = max(100 * float(np.finfo(float).eps) * size, NOTHING)
    if work > rounding:
        return work, "work in"
    if exchanged > rounding:
        return exchanged, "energy exchanged"
    return 0.0, "nothing moved"


def doubt(trajectory: Trajectory) -> str:
    """Why a run that reached its end should not be used, in words; empty for a sound one."""
    if not trajectory.outcome.completed:
        return ""
    record = trajectory.record
    reference, against = energy_reference(record)
    missed = float(np.abs(record.energy_residual).max(initial=0.0))
    if reference == 0 or missed <= WORST_ENERGY * reference:
        return ""
    return (
        f"the computation is not accurate: the energy balance misses {missed / reference:.2g} of the {against}; "
        "take a smaller integrator.rtol, atol or step"
    )
