"""The balance of energy of a run, looked at behind every run: a bad one is not handed over without a word."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from drillrig_pin.trajectory import Trajectory

#: Beyond this a run should not be used: energy residual relative to its reference.
WORST_ENERGY = 1e-3
#: Energy [J] below which a machine is at rest: the elastic energy of a locked oil column is rounded at about this.
NOTHING = 1e-9


class Balance(NamedTuple):
    """How well the energy of a run balances.

    Attributes:
        residual: greatest |E - E_0 - W_in + W_out| [J].
        reference: energy it is compared with [J]; 0 if nothing moved.
        against: what that energy is: ``work in``, ``energy exchanged`` or ``nothing moved``.
    """

    residual: float
    reference: float
    against: str

    @property
    def relative(self) -> float | None:
        """Residual / reference; None where nothing moved."""
        return self.residual / self.reference if self.reference > 0 else None


def balance_of(record: Trajectory) -> Balance:
    """The balance over the rows of a record.

    The energy residual is compared with the greatest |work in| so far. A run without loads has none: there it is the
    energy exchanged, the greatest range of kinetic, potential or elastic energy. If that is no more than rounding of
    the total energy or ``NOTHING``, nothing moved and there is no ratio.
    """
    residual = float(np.abs(record.energy_residual).max(initial=0.0))
    work = float(np.abs(record.work_input).max(initial=0.0))
    energies = (record.energy_kinetic, record.energy_potential, record.energy_elastic)
    exchanged = max((float(np.ptp(energy)) for energy in energies if energy.size), default=0.0)
    size = max((float(np.abs(energy).max()) for energy in energies if energy.size), default=0.0)
    rounding = max(100 * float(np.finfo(float).eps) * size, NOTHING)
    if work > rounding:
        return Balance(residual, work, "work in")
    if exchanged > rounding:
        return Balance(residual, exchanged, "energy exchanged")
    return Balance(residual, 0.0, "nothing moved")


def doubt(trajectory: Trajectory) -> str:
    """Why a run that reached its end should not be used, in words; empty for a sound one."""
    if not trajectory.outcome.completed:
        return ""
    found = balance_of(trajectory.record)
    if not np.isfinite(found.residual):
        return "the computation is not accurate: the energy of the run is no finite number"
    if found.relative is None or found.relative <= WORST_ENERGY:
        return ""
    return (
        f"the computation is not accurate: the energy balance misses {found.relative:.2g} of the {found.against}; "
        "take a smaller integrator.rtol, atol or step"
    )
