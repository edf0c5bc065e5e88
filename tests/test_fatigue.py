"""Rainflow counts against the worked example of ASTM E1049-85 and sines counted by hand."""

from __future__ import annotations

import numpy as np
import pytest

from drillrig_pin import Rig, Scenario, simulate
from drillrig_pin.analysis.fatigue import cylinder_rainflow, rainflow_ranges

#: Peaks and valleys A to I of the standard's rainflow example (figure 6).
EXAMPLE = np.array([-2.0, 1.0, -3.0, 5.0, -1.0, 3.0, -4.0, 4.0, -2.0])
#: Its counts: range 3: 0.5, 4: 1.5, 6: 0.5, 8: 1.0, 9: 0.5.
COUNTS = {3.0: 0.5, 4.0: 1.5, 6.0: 0.5, 8.0: 1.0, 9.0: 0.5}


def test_the_example_of_the_standard_is_counted_as_printed_there() -> None:
    found = rainflow_ranges("oil", EXAMPLE, duration=8.0)
    assert found.largest == 9.0
    for span, count in COUNTS.items():
        (inside,) = (b for b in found.bins if b.low < span <= b.high + 1e-12)
        assert inside.count == count
    assert sum(b.count for b in found.bins) == sum(COUNTS.values())
    damage = sum(count * span**3 for span, count in COUNTS.items())
    assert found.equivalent == pytest.approx((damage / 8.0) ** (1 / 3))
    assert found.per_hour(1.5) == pytest.approx(1.5 * 3600 / 8)


@pytest.mark.parametrize("exponent", [3.0, 5.0])
def test_a_sine_at_one_hertz_is_equivalent_to_itself(exponent: float) -> None:
    t = np.arange(20_001) / 1000.0
    found = rainflow_ranges("oil", 1500 * np.cos(2 * np.pi * t), 20.0, exponent)
    assert found.largest == pytest.approx(3000)
    assert found.equivalent == pytest.approx(3000)
    assert found.bins[-1].count == pytest.approx(20)


def test_a_force_that_does_not_change_has_no_cycles() -> None:
    found = rainflow_ranges("oil", np.full(100, 7.0), 1.0)
    assert (found.largest, found.equivalent) == (0.0, 0.0)
    assert sum(b.count for b in found.bins) == 0


def test_every_cylinder_of_a_run_is_counted_over_the_time_it_was_counted(mkz49: Rig) -> None:
    run = simulate(mkz49, Scenario(duration=0.5))
    counts = cylinder_rainflow(run, slice(100, None))
    assert [count.cylinder for count in counts] == run.labels["cylinder"]
    for count in counts:
        force = run.of("cylinder_force", count.cylinder)[100:]
        assert count.duration == pytest.approx(0.4)
        # Peaks between the rows count: at 20 rows of the 48 Hz a row misses 1.2 % of them at most.
        assert np.ptp(force) <= count.largest <= 1.012 * np.ptp(force)
