"""The whole loaded rig in other engines: the same accelerations, and errors that fall as their methods say."""

from __future__ import annotations

import importlib
from collections.abc import Iterator
from importlib.metadata import version
from typing import Any

import numpy as np
from peers import race
from peers.problem import RATE, Engine, Problem, Setting, apart, drilling

from drillrig_pin.kinematics import Array
from validation.record import Row

TEXT = """\
Test hole no. 9 as shipped, drilling for 2 s: locked cylinders, coupling, rock, loads and the held tip. The numbers of
the laws are handed over, everything else is computed by the other engine. Accelerations are compared at rest while the
loads grow (0.2 s) and in motion under all of them (0.5 s), motions at 200 samples a second with this core's DOP853 at a
tolerance of 1e-13; shown is the largest difference of any joint.

- **MuJoCo**: laws in a compiled passive-force callback, the hold as equalities of two tendons from the tip to anchors
  100 km away. MuJoCo's equalities are springs: without the hold its accelerations agree to rounding, with it the error
  of a motion falls with the square of the spring's time constant and is extrapolated to zero.
- **Exudyn**: rigid bodies in redundant coordinates, its joints and hydraulic actuators, whose pressures are states; its
  generalised-alpha method, and the trapezoidal rule on velocities, both of second order.
- **Pinocchio + SciPy**: a right-hand side of NumPy rows and a saddle-point system, written without this package.
- **Drake**: its multibody plant, the laws and multipliers by hand as in the last.
"""
#: Time constants of MuJoCo's hold in steps, halved from one to the next.
SOFT = (8, 4, 2, 1)
FAR = 1e5
NO_COMPILER = "its force laws are written in C and there is no gcc here"
NOT_HERE = "not installed here; `requirements-peers.lock` has it"


def rows(short: bool) -> Iterator[Row]:
    """One engine after the other; Drake, which no other test needs, only in the long form."""
    problem = drilling(0.3 if short else 2.0)
    truth, uncertain = race.reference(problem)
    yield Row("reference: change when tolerance and step are doubled", "itself", uncertain, high=1e-12)
    yield from _mujoco(problem, truth, short)
    yield from _exudyn(problem, truth, short)
    yield from _scipy(problem, truth, short)
    if not short:
        yield from _drake(problem, truth)


def _accelerations(engine: Engine, problem: Problem) -> Row:
    worst = max(apart(engine.acceleration(*state), problem.acceleration(*state)) for state in problem.states())
    return Row(f"{engine.name}: accelerations, relative", _told(engine), worst, high=1e-10)


def _told(engine: Engine) -> str:
    return f"two states under load; {engine.package} {version(engine.package)}"


def _bound(module: str, name: str, problem: Problem, **more: Any) -> Any:
    return getattr(importlib.import_module(f"peers.{module}"), name)(problem, **more)


def _mujoco(problem: Problem, truth: Array, short: bool) -> Iterator[Row]:
    try:
        engine = _bound("mujoco", "Mujoco", problem, far=FAR)
    except OSError:
        yield Row(
            "MuJoCo: accelerations without the hold, relative", "two states", np.nan, high=1e-10, miss=NO_COMPILER
        )
        return
    worst = max(apart(engine.free_acceleration(*s), problem.free_acceleration(*s)) for s in problem.states())
    yield Row("MuJoCo: accelerations without the hold, relative", _told(engine), worst, high=1e-10)
    step = 1.0 / RATE / (20 if short else 40)
    runs = [engine.run(Setting("RK4", step), stiffness)[1] for stiffness in SOFT]
    errors = [float(np.abs(run - truth).max()) for run in runs]
    told = f"time constants {1e3 * SOFT[0] * step:.3g} to {1e3 * SOFT[-1] * step:.3g} ms, errors {_range(errors)}"
    yield Row("MuJoCo: power of the hold's time constant with which the error falls", told, _slope(errors), 1.8, 2.2)
    yield Row("MuJoCo: motion as its hold is made", "stiffest", errors[-1], high=1e-7)
    extrapolated = runs[-1] + (runs[-1] - runs[-2]) / 3.0
    yield Row(
        "MuJoCo: motion extrapolated to a stiff hold",
        "the two stiffest",
        float(np.abs(extrapolated - truth).max()),
        high=2e-9,
    )


def _exudyn(problem: Problem, truth: Array, short: bool) -> Iterator[Row]:
    engine = _bound("exudyn", "Exudyn", problem)
    yield _accelerations(engine, problem)
    counts = (5, 10, 20) if short else (10, 20, 40)
    for method in engine.orders:
        runs = [engine.run(Setting(method, 1.0 / RATE / count, 1e-8))[1] for count in counts]
        errors = [float(np.abs(run - truth).max()) for run in runs]
        told = f"theory: 2; steps {5 / counts[0]:.3g} to {5 / counts[-1]:.3g} ms, errors {_range(errors)}"
        yield Row(f"Exudyn, {method}: order", told, _slope(errors), 1.9, 2.1)
        difference = _extrapolated(runs, truth)
        yield Row(f"Exudyn, {method}: motion extrapolated to a step of zero", "the two finest", difference, high=2e-7)


def _scipy(problem: Problem, truth: Array, short: bool) -> Iterator[Row]:
    engine = _bound("scipy", "Scipy", problem)
    yield _accelerations(engine, problem)
    for method in ("DOP853", "LSODA"):
        _, run = engine.run(Setting(method, rtol=1e-8 if short else 1e-10))
        difference = float(np.abs(run - truth).max())
        about = f"Pinocchio + SciPy, {method}: motion, tolerance {1e-8 if short else 1e-10:.0e}"
        yield Row(about, "reference", difference, high=1e-9 if short else 1e-11)


def _drake(problem: Problem, truth: Array) -> Iterator[Row]:
    try:
        engine = _bound("drake", "Drake", problem)
    except ImportError:
        yield Row("Drake: accelerations, relative", "two states under load", np.nan, high=1e-10, miss=NOT_HERE)
        return
    yield _accelerations(engine, problem)
    _, run = engine.run(Setting("runge_kutta5", rtol=1e-8))
    yield Row("Drake, runge_kutta5: motion, accuracy 1e-08", "reference", float(np.abs(run - truth).max()), high=1e-9)


def _slope(errors: list[float]) -> float:
    """Power of a parameter that is halved from one error to the next, by least squares."""
    return float(-np.polyfit(np.arange(len(errors)), np.log2(errors), 1)[0])


def _extrapolated(runs: list[Array], truth: Array) -> float:
    """Error left when a parameter with second order, halved between the last two runs, is extrapolated to zero."""
    return float(np.abs(runs[-1] + (runs[-1] - runs[-2]) / 3.0 - truth).max())


def _range(errors: list[float]) -> str:
    return f"{errors[0]:.1e} to {errors[-1]:.1e}"
