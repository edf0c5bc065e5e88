"""What keeps the constraints takes no method its order: closed loops with the settings that nobody chose."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
from rigs import bricard, four_bar, slider_crank

from drillrig_pin import Rig, Scenario, Trajectory, load_rig_text, simulate
from drillrig_pin.kinematics import Array
from drillrig_pin.stabilization import RATE, Baumgarte, default_rate

LINKAGES: dict[str, tuple[str, dict[str, Any]]] = {
    "slider-crank": (slider_crank(), {"positions": {"crank_joint": 0.3}, "velocities": {"crank_joint": 20.0}}),
    "four-bar": (
        four_bar(),
        {
            "positions": {"crank_joint": 0.4, "coupler_joint": 0.3, "rocker_joint": 1.2},
            "velocities": {"crank_joint": 8.0},
        },
    ),
    "Bricard": (bricard(), {"velocities": {"h0": 12.0}}),
}
#: Every step is accepted, so that the longest step allowed is the step.
LOOSE = {"integrator.rtol": 1e-2, "integrator.atol": 1e3}
NO_TERM = {"stabilization.method": "none"}


@cache
def _rig(name: str) -> tuple[Rig, Scenario]:
    text, start = LINKAGES[name]
    return load_rig_text(text), Scenario(duration=0.4, output_rate=5.0, **start)


def _run(name: str, **changes: Any) -> Trajectory:
    rig, case = _rig(name)
    run = simulate(rig, case.changed(changes))
    assert run.outcome.completed, run.outcome
    return run


@cache
def _exact(name: str) -> Array:
    """Without a stabilising term, by DOP853 near rounding."""
    tight = {"integrator.method": "DOP853", "integrator.rtol": 1e-13, "integrator.atol": 1e-15}
    return _run(name, **tight, **NO_TERM).q


def _error(name: str, **changes: Any) -> float:
    return float(np.abs(_run(name, **changes).q - _exact(name)).max())


#: Steps of 0.2 s / n, chosen so that the errors lie between what the method resolves and rounding.
STEPS = {
    ("RK4", "slider-crank"): (50, 100, 200),
    ("RK4", "four-bar"): (50, 100, 200),
    ("RK4", "Bricard"): (25, 50, 100),
    ("DOP853", "slider-crank"): (6, 8, 12),
    ("DOP853", "four-bar"): (4, 6, 8),
    ("DOP853", "Bricard"): (3, 4, 6),
    ("RODAS", "slider-crank"): (40, 80, 160),
    ("RODAS", "four-bar"): (20, 40, 80),
    ("RODAS", "Bricard"): (7, 10, 14),
}


@pytest.mark.parametrize("linkage", LINKAGES)
@pytest.mark.parametrize(
    ("engine", "method", "order"),
    [("core", "RK4", 4), ("python", "RK4", 4), ("core", "DOP853", 8), ("python", "DOP853", 8), ("core", "RODAS", 4)],
)
def test_a_method_keeps_its_order_on_a_closed_loop(engine: str, method: str, order: int, linkage: str) -> None:
    steps = [0.2 / n for n in STEPS[method, linkage]]
    settings = {"engine": engine, "integrator.method": method}
    step = "integrator.step" if method == "RK4" else "integrator.max_step"
    errors = [_error(linkage, **settings, **({} if method == "RK4" else LOOSE), **{step: h}) for h in steps]
    slope = float(np.polyfit(np.log(steps), np.log(errors), 1)[0])
    # Over finite steps the next powers add to the slope, by less than one; with a rate of 0.2 / step it is one.
    assert slope > order - 1, errors


@pytest.mark.parametrize("linkage", LINKAGES)
@pytest.mark.parametrize(("engine", "method"), [("core", "DOP853"), ("core", "RODAS"), ("python", "Radau")])
def test_the_stabilising_term_costs_hardly_a_step(engine: str, method: str, linkage: str) -> None:
    settings = {"engine": engine, "integrator.method": method}
    with_term, without = _run(linkage, **settings), _run(linkage, **settings, **NO_TERM)
    # A rate of 200 1/s took DOP853 four to twenty-eight times the steps.
    assert with_term.cost["steps"] <= 1.2 * without.cost["steps"] + 2


@pytest.mark.parametrize("linkage", LINKAGES)
@pytest.mark.parametrize("method", ["DOP853", "RODAS", "ExpAdams", "Radau"])
def test_the_error_on_a_closed_loop_follows_the_tolerance(method: str, linkage: str) -> None:
    # Local errors of 1e-8 add up over some hundred steps at most and grow with the motion.
    assert _error(linkage, **{"integrator.method": method}) < 1e-6


@pytest.mark.parametrize("rate", [10.0, 5000.0])
@pytest.mark.parametrize("method", ["DOP853", "auto"])
def test_the_automatic_rate_is_no_matter_of_the_output_rate(method: str, rate: float) -> None:
    from drillrig_pin.simulation import correction_of

    case = Scenario(output_rate=rate, integrator={"method": method})
    assert correction_of(case) == Baumgarte(RATE, RATE)


def test_a_long_fixed_step_gets_a_rate_that_it_can_follow() -> None:
    # RK4 is stable to 2.78 / step on a double real eigenvalue -alpha.
    assert default_rate(0.1) == pytest.approx(2.0)
    assert default_rate(1e-3) == RATE
