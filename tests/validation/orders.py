"""Convergence order of every integrator of both engines, measured."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from rigs import double_pendulum

from drillrig_pin import Rig, Scenario, load_rig, load_rig_text, simulate
from drillrig_pin.kinematics import Array
from validation.record import Row
from validation.settings import ENGINES, TIGHT

TEXT = """\
A double pendulum with a spring and damper in its elbow swings freely for 3 s; ExpAdams, made for small vibrations,
runs the shipped rig at hole no. 9 for 2 s. The error is the norm of all joint positions at all samples against
DOP853 at a tolerance of 1e-12 or less; the order is the slope of log(error) over log(1 / step) by least squares. RK4
has a fixed step. DOP853, RODAS and ExpAdams run at their longest allowed step under a tolerance that always accepts
it. SciPy's Radau ties its Newton iteration to its tolerance, so its steps follow from tolerances and are counted.
LSODA changes its order as it goes and has none to measure; its error is compared with its tolerance.
"""
LOOSE = {"integrator.rtol": 1e-2, "integrator.atol": 1e3}
#: Steps that follow from a tolerance alone, not from the rows of the record.
SPANS = {"integrator.max_step": 0.1}
#: Engine, method, order of theory, and steps per 0.1 s. Steps below the millisecond between rows of the record end at
#: them: they divide it, others would be shortened until they do.
FIXED: list[tuple[str, str, int, tuple[int, ...]]] = [
    ("core", "RK4", 4, (50, 100, 200, 400)),
    ("python", "RK4", 4, (50, 100, 200)),
    ("core", "DOP853", 8, (3, 4, 6, 8)),
    ("python", "DOP853", 8, (3, 4, 6, 8)),
    ("core", "RODAS", 4, (10, 20, 40)),
]
RADAU = (1e-6, 1e-7, 1e-8, 1e-9, 1e-10)
#: A slope over finite steps is the order plus what the next power adds.
NEAR = 0.35
#: On the rig the error is the sum of several vibrations, whose slopes scatter by one.
SCATTER = 1.0
QUOTIENTS = (
    "theory takes the exact Jacobian, RODAS forms it by difference quotients; what they err by is the likely cause of "
    "an error proportional to the step that shows once the rest lies below 1e-8"
)


def rows(short: bool) -> Iterator[Row]:
    """One row per engine and method."""
    spring = '<joint_spring name="s" joint="elbow" stiffness="5" damping="0.1" rest="0"/>'
    rig = load_rig_text(double_pendulum(spring))
    case = Scenario(duration=3.0, output_rate=10.0, positions={"shoulder": 0.9, "elbow": 0.5})
    exact = simulate(rig, case.changed({**TIGHT, "integrator.rtol": 1e-13, "integrator.atol": 1e-15})).q
    for engine, method, order, divisions in FIXED:
        if engine in ENGINES:
            runs = [_fixed(rig, case, exact, engine, method, 0.1 / n) for n in divisions[: 3 if short else None]]
            yield _order(f"{method}, {engine}", order, NEAR, np.array(runs))
    if "core" in ENGINES:
        runs = [_fixed(rig, case, exact, "core", "RODAS", 0.1 / n) for n in (200, 400, 800)]
        yield _order("RODAS, core, at errors below 1e-8", 4, NEAR, np.array(runs), miss=QUOTIENTS)
        yield _exponential()
    tolerances = RADAU[:3] if short else RADAU
    runs = [_run(rig, case.changed(_scipy("Radau", rtol)), exact) for rtol in tolerances]
    yield _order("Radau, python", 5, NEAR, np.array(runs))
    for rtol in (1e-8,) if short else (1e-6, 1e-8, 1e-10):
        _, error = _run(rig, case.changed(_scipy("LSODA", rtol)), exact)
        about = f"LSODA, python, tolerance {rtol:g}: error over its tolerance"
        yield Row(about, "errors of some hundred steps add up", error / rtol, high=300.0)


def _exponential() -> Row:
    rig = load_rig("mkz49")
    case = Scenario(duration=2.0, output_rate=200.0)
    exact = simulate(rig, case.changed({**TIGHT, "integrator.rtol": 1e-13, "integrator.atol": 1e-15})).q
    # Whole fractions of the way between rows of the record: all of them end, and are put back onto the constraints, at
    # every row, while longer steps are at fewer. After 2 s the smallest error stands clear of rounding, which is 1e-12.
    steps = [1e-3 / n for n in (1, 2, 3)]
    runs = [_fixed(rig, case, exact, "core", "ExpAdams", step) for step in steps]
    return _order("ExpAdams, core", 8, SCATTER, np.array(runs))


def _fixed(rig: Rig, case: Scenario, exact: Array, engine: str, method: str, step: float) -> tuple[float, float]:
    """1 / step and error."""
    settings = {"integrator.step": step} if method == "RK4" else {"integrator.max_step": step, **LOOSE}
    _, error = _run(rig, case.changed({"engine": engine, "integrator.method": method, **settings}), exact)
    return 1.0 / step, error


def _scipy(method: str, rtol: float) -> dict[str, object]:
    tolerances = {"integrator.rtol": rtol, "integrator.atol": rtol / 100}
    return {"engine": "python", "integrator.method": method, "stabilization.projection": False, **SPANS, **tolerances}


def _run(rig: Rig, case: Scenario, exact: Array) -> tuple[float, float]:
    """Number of steps and error."""
    run = simulate(rig, case)
    return run.cost["steps"], float(np.linalg.norm(run.q - exact))


def _order(about: str, order: int, near: float, runs: Array, miss: str = "") -> Row:
    steps, errors = np.log(runs).T
    slope = float(np.polyfit(-steps, errors, 1)[0])
    reference = f"theory: {order}; errors {runs[0, 1]:.1e} to {runs[-1, 1]:.1e}"
    return Row(f"{about}: order", reference, slope, order - near, order + near, miss=miss)
