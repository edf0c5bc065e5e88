"""Settings that several sections use."""

from __future__ import annotations

import numpy as np

from drillrig_pin.kinematics import Array
from drillrig_pin.marching import core_is_installed

#: Engines of this installation.
ENGINES = ("core", "python") if core_is_installed() else ("python",)
#: Nothing but rounding is left of the integration.
TIGHT = {"integrator.method": "DOP853", "integrator.rtol": 1e-12, "integrator.atol": 1e-14}


def deviation(measured: Array, reference: Array, threshold: float) -> float:
    """Largest |y - y_ref| / max(|y_ref|, threshold) over all samples and variables."""
    return float((np.abs(measured - reference) / np.maximum(np.abs(reference), threshold)).max())
