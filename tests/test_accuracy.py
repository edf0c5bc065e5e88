"""The estimated error is the true one: every shipped scenario against a reference at the tightest tolerance."""

from __future__ import annotations

from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from drillrig_pin import Rig, Scenario, Trajectory, load_rig, load_scenario, simulate
from drillrig_pin.accuracy import estimate_error
from drillrig_pin.analysis.trust import trust
from drillrig_pin.files import shipped_scenarios

SCENARIOS = sorted(shipped_scenarios())
#: Promised: the estimate and the true error lie within this factor of each other.
FACTOR = 3.0


@cache
def shipped(name: str) -> tuple[Rig, Scenario]:
    scenario = load_scenario(name)
    return load_rig(scenario.model, **scenario.arguments), scenario


@cache
def reference(name: str, duration: float) -> Trajectory:
    rig, scenario = shipped(name)
    tight = {"integrator.method": "DOP853", "integrator.rtol": 1e-13, "integrator.atol": 1e-15, "duration": duration}
    return simulate(rig, scenario.changed(tight))


def true_error(name: str, run: Trajectory) -> float:
    return float(np.abs(run.q - reference(name, run.scenario.duration).q).max())


@pytest.mark.parametrize("name", SCENARIOS)
def test_shipped_scenario_is_converged_and_knows_its_error(name: str) -> None:
    rig, scenario = shipped(name)
    run = estimate_error(rig, simulate(rig, scenario))
    true, moved = true_error(name, run), float(np.ptp(run.q, axis=0).max())
    assert run.estimated_error is not None
    assert true / FACTOR < run.estimated_error < FACTOR * true
    # Converged: the reference itself is good to 1e-13, and nobody reads more than five digits of a vibration.
    assert 1e-12 < true < 1e-5 * moved


@pytest.mark.parametrize("name", SCENARIOS)
@pytest.mark.parametrize(
    "changes",
    [
        *({"integrator.rtol": rtol, "integrator.atol": rtol / 100} for rtol in (1e-6, 1e-7, 1e-9)),
        *({"integrator.method": "DOP853", "integrator.rtol": r, "integrator.atol": r / 100} for r in (1e-6, 1e-8)),
        *({"integrator.method": "RK4", "integrator.step": step} for step in (5e-4, 2.5e-4)),
        {"integrator.method": "RODAS", "integrator.rtol": 1e-6, "integrator.atol": 1e-8},
    ],
    ids=lambda changes: " ".join(map(str, changes.values())),
)
def test_estimate_follows_the_error_over_methods_and_tolerances(name: str, changes: dict[str, object]) -> None:
    rig, scenario = shipped(name)
    run = estimate_error(rig, simulate(rig, scenario.changed({"duration": 1.0, **changes})))
    true = true_error(name, run)
    assert run.estimated_error is not None
    assert true / FACTOR < run.estimated_error < FACTOR * true


def test_error_falls_with_step_and_tolerance() -> None:
    rig, scenario = shipped("hole_9")

    def error(**changes: object) -> float:
        asked = {f"integrator.{key}": value for key, value in changes.items()}
        return true_error("hole_9", simulate(rig, scenario.changed({"duration": 1.0, **asked})))

    steps = [error(method="RK4", step=step) for step in (5e-4, 2.5e-4, 1.25e-4)]
    # Order four: a factor of 16 a halving; load samples that fall inside steps of this size blur it by a third.
    assert all(12 < coarse / fine < 22 for coarse, fine in pairwise(steps))
    tolerances = [error(rtol=rtol, atol=rtol / 100) for rtol in (1e-5, 1e-7, 1e-9)]
    assert tolerances[0] > tolerances[1] > tolerances[2]


def test_run_without_an_estimate_says_none_and_a_bad_one_is_doubted() -> None:
    rig, scenario = shipped("hole_9")
    plain = simulate(rig, scenario.changed({"duration": 0.2}))
    assert plain.estimated_error is None
    assert trust(plain).estimated is None
    finest = simulate(rig, scenario.changed({"duration": 0.2, "integrator.rtol": 1e-13}))
    assert estimate_error(rig, finest).estimated_error is None
    coarse = {"integrator.method": "RK4", "integrator.step": 2e-3, "duration": 0.5}
    found = trust(estimate_error(rig, simulate(rig, scenario.changed(coarse))))
    assert found.estimated is not None
    assert any("joint positions" in doubt for doubt in found.doubts) == (found.estimated > 0.01 * found.moved)


def test_estimate_is_saved_with_the_run(tmp_path: object) -> None:
    from pathlib import Path

    from drillrig_pin import load_trajectory

    rig, scenario = shipped("hole_9")
    run = estimate_error(rig, simulate(rig, scenario.changed({"duration": 0.2})))
    path = Path(str(tmp_path), "run.nc")
    run.save(path)
    assert load_trajectory(path).estimated_error == run.estimated_error
