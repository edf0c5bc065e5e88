"""Where a run leaves what its force laws describe: oil that would have to pull, pressures no cylinder holds.

The law of the trapped column (33), (34) goes on below zero, where oil tears and a cavity opens, and to any height. From
the first such moment on a run is not valid, whatever its energy balance says: forces, motion and pressures are those of
another machine. Both engines are looked at here, row by row, by the lengths at which a chamber has its limit.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from drillrig_pin.dynamics import ForceGroup
from drillrig_pin.elements.base import Element
from drillrig_pin.elements.cylinder import ATMOSPHERE, Cylinder, LockedOil
from drillrig_pin.errors import Outcome
from drillrig_pin.kinematics import Array
from drillrig_pin.words import quantity

#: Hoses are made to burst at four times the pressure they work at (SAE J517, ISO 18752: design factor 4:1). Assumed to
#: hold for all that a relief valve protects.
BURST = 4.0


def looked_at(
    outcome: Outcome, groups: Sequence[ForceGroup], forces: Sequence[Element], time: Array, x: Array
) -> Outcome:
    """The outcome with the first moment at which a chamber of a cylinder leaves its law, if there is one.

    Args:
        outcome: how the run ended.
        groups, forces: laws as they were bound, and the elements they belong to.
        time: of the rows (n) [s].
        x: coordinates of all force elements (n, coordinates) [m or rad].
    """
    found = min(_first_moments(groups, forces, time, x), default=None)
    return outcome if found is None else replace(outcome, valid_until=found[0], doubt=found[1])


def _first_moments(
    groups: Sequence[ForceGroup], forces: Sequence[Element], time: Array, x: Array
) -> Iterator[tuple[float, str]]:
    for group in groups:
        cylinders = [forces[i] for i in group.members]
        if not len(time) or not isinstance(group.law, LockedOil):
            continue
        lengths = x[:, group.where]
        low = np.array([c.vapour_pressure if isinstance(c, Cylinder) else 0.0 for c in cylinders])
        high = np.array([BURST * c.relief_pressure if isinstance(c, Cylinder) else np.inf for c in cylinders])
        least, most = np.fmin.reduce(lengths), np.fmax.reduce(lengths)
        a_low, b_low = group.law.lengths_at(low - ATMOSPHERE)
        a_high, b_high = group.law.lengths_at(high)
        # Beyond these lengths a chamber is out of bounds: to the one side, then to the other.
        for bounds, sign, chamber, torn in (
            (a_low, 1.0, "A", True),
            (b_high, 1.0, "B", False),
            (b_low, -1.0, "B", True),
            (a_high, -1.0, "A", False),
        ):
            for j in np.flatnonzero(sign * ((most if sign > 0 else least) - bounds) > 0):
                yield _crossing(time, sign * (lengths[:, j] - bounds[j])), _words(cylinders[j], chamber, torn=torn)


def _crossing(time: Array, beyond: Array) -> float:
    """When a signal first rises above zero: on the straight line before the first row above."""
    i = int(np.argmax(beyond > 0))
    if i == 0:
        return float(time[0])
    low, high = beyond[i - 1], beyond[i]
    part = -low / (high - low) if np.isfinite(low) else 1.0
    return float(time[i - 1] + part * (time[i] - time[i - 1]))


def _words(cylinder: Element, chamber: str, *, torn: bool) -> str:
    assert isinstance(cylinder, Cylinder)
    if torn:
        assumed = "" if "vapour_pressure" in cylinder.model_fields_set else ", assumed"
        limit = f"{quantity(cylinder.vapour_pressure, 'Pa')} absolute (vapour pressure{assumed})"
        return f"chamber {chamber} of {cylinder.name} falls below {limit}, where oil tears and cannot pull"
    limit = f"{quantity(BURST * cylinder.relief_pressure + ATMOSPHERE, 'Pa')} absolute"
    return (
        f"chamber {chamber} of {cylinder.name} rises above {limit}, {BURST:g} x its relief pressure (assumed to burst)"
    )
