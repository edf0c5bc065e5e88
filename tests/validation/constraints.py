"""What drift does to a constraint and what holds it; both formulations near a singular configuration."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from rigs import double_pendulum, four_bar
from scipy.integrate import solve_ivp

from drillrig_pin import Scenario, load_rig_text, simulate
from drillrig_pin.dynamics import Equations, solve_multipliers, solve_null_space
from drillrig_pin.kinematics import Array
from drillrig_pin.simulation import prepare
from drillrig_pin.stabilization import Baumgarte, Correction, NoCorrection, SlidingMode
from validation.record import Row
from validation.settings import ENGINES

DRIFT = """\
The tip of a double pendulum is held at its height while every acceleration of the constraint is falsified by a
constant ε = 1 mm/s². Theory: uncorrected f = ε t² / 2; Baumgarte's terms let f settle at ε / β²; the sliding mode at
s = w artanh(ε / gain), f = s / rate. In whole runs of a four-bar with coarse RK4 steps the error of the method plays
the part of ε: uncorrected, what drifts in a given time must fall with the fourth power of the step; projection leaves
rounding.
"""
SINGULAR = """\
A parallelogram four-bar is closed exactly at an angle δ from its stretched position, where its constraint Jacobian
loses rank. Accelerations and reactions by multipliers (57) and with multipliers eliminated (58) are solved from the
same equations. Backward stable solutions may differ by rounding times the condition number of the system: shown is
|difference| / (2.2e-16 × cond). The condition number of the saddle-point matrix, its rows and columns scaled to M = 1
by Cholesky's factor, is measured at each angle.
"""
ERROR = 1e-3


@dataclass(frozen=True)
class Falsified:
    """A correction to which a constant error of acceleration [m/s^2] is added."""

    honest: Correction
    error: float = ERROR
    parameters = (0, [0.0, 0.0, 0.0])

    def __call__(self, f: Array, f_dot: Array) -> Array:
        """What the honest one says, plus the error."""
        return self.honest(f, f_dot) + self.error


def _falsified(honest: Correction, seconds: float) -> tuple[Array, Array]:
    """Times and residual of the held row."""
    text = double_pendulum('<hold name="face" point="P" axes="z"/>')
    dynamics = prepare(load_rig_text(text), Scenario(positions={"shoulder": 0.4, "elbow": 0.9}))
    dynamics.correction = Falsified(honest)
    t = np.linspace(0.0, seconds, 41)
    y = solve_ivp(dynamics.rate, (0, seconds), dynamics.initial(), "DOP853", t, rtol=1e-12, atol=1e-14).y.T
    f = [float(dynamics.assemble(s, state[:2], state[2:4]).f[0]) for s, state in zip(t.tolist(), y, strict=True)]
    return t, np.array(f)


def drift_rows(short: bool) -> Iterator[Row]:
    """Growth without correction, the level each correction holds, and whole runs."""
    t, f = _falsified(NoCorrection(), 0.4)
    power = float(np.polyfit(np.log(t[1:]), np.log(f[1:]), 1)[0])
    yield Row("uncorrected: power of time with which the error grows, off theory", "2", abs(power - 2), high=1e-6)
    off = float(np.abs(f[1:] / (ERROR * t[1:] ** 2 / 2) - 1).max())
    yield Row("uncorrected: error against its law", "ε t² / 2", off, high=1e-6)
    _, f = _falsified(Baumgarte(60.0, 40.0), 1.0)
    yield Row("Baumgarte, α = 60, β = 40 1/s: level held", "ε / β²", abs(f[-1] / (ERROR / 40.0**2) - 1), high=1e-4)
    mode = SlidingMode(rate=40.0, gain=2e-3, width=1e-4)
    level = mode.width * np.arctanh(ERROR / mode.gain) / mode.rate
    _, f = _falsified(mode, 1.0)
    yield Row("sliding mode: level held", "w artanh(ε / gain) / rate", float(abs(f[-1] / level - 1)), high=1e-4)
    for engine in ENGINES:
        yield from _whole_runs(engine, short)


def _whole_runs(engine: str, short: bool) -> Iterator[Row]:
    rig = load_rig_text(four_bar())
    start = {"crank_joint": 0.4, "coupler_joint": 0.3, "rocker_joint": 1.2}
    case = Scenario(
        duration=2.0 if short else 10.0,
        output_rate=100,
        positions=start,
        velocities={"crank_joint": 8.0},
        engine=engine,
        integrator={"method": "RK4", "step": 5e-3},
    )

    def errors(method: str, projection: bool, step: float = 5e-3) -> Array:
        chosen = {"integrator.step": step, "stabilization.method": method, "stabilization.projection": projection}
        return np.abs(simulate(rig, case.changed(chosen)).constraint_error).max(axis=1)

    def growth(error: Array) -> float:
        quarter = len(error) // 4
        return float(error[-quarter:].max() / error[:quarter].max())

    about = f"four-bar, RK4, {engine}"
    steps = np.array([5e-3, 2.5e-3, 1.25e-3])
    drifts = [errors("none", False, step) for step in steps.tolist()]
    early = [float(drift[:200].max()) for drift in drifts]
    order = float(np.polyfit(np.log(steps), np.log(early), 1)[0])
    reference = f"theory: 4; {early[0]:.1e} to {early[-1]:.1e} m"
    yield Row(f"{about}, uncorrected: power of the step, first 2 s", reference, order, 3.65, 4.35)
    if not short:
        # A quarter of the run is too short a time for a drift to show in the short form.
        grown = "last quarter of 10 s over the first"
        yield Row(f"{about}, uncorrected: error, {grown}", "grows", growth(drifts[0]), low=3.0)
        for method in ("baumgarte", "sliding_mode"):
            yield Row(f"{about}, {method}: error, {grown}", "does not grow", growth(errors(method, False)), high=2.0)
    for method in ("none", "baumgarte", "sliding_mode"):
        left = float(errors(method, True).max())
        yield Row(f"{about}, {method} and projection: error", "rounding", left, high=1e-14, unit="m")


def singular_rows(short: bool) -> Iterator[Row]:
    """The two formulations ever nearer to the stretched position."""
    rig = load_rig_text(four_bar((1.0, 0.4, 1.0, 0.4)))
    for angle in (1e-1, 1e-4) if short else (1.0, 1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6):
        start = {"crank_joint": angle, "coupler_joint": -angle, "rocker_joint": angle}
        dynamics = prepare(rig, Scenario(positions=start, stabilization={"method": "none"}))
        equations = dynamics.assemble(0.0, dynamics.equilibrium.assembly.q, np.array([1.0, -1.0, 1.0]))
        condition = _condition(equations)
        both = solve_multipliers(equations), solve_null_space(equations)
        for i, what in enumerate(("accelerations", "reactions")):
            a, b = (solution[i] for solution in both)
            difference = float(np.abs(a - b).max() / np.abs(a).max())
            explained = difference / (np.finfo(float).eps * condition)
            reference = f"difference {difference:.1e}, condition {condition:.1e}"
            yield Row(
                f"δ = {angle:g} rad: {what}, difference over rounding × condition", reference, explained, high=10.0
            )


def _condition(equations: Equations) -> float:
    """Condition number of [[1, -B^T], [B, 0]] with B = J L^-T, M = L L^T."""
    L = np.linalg.cholesky(equations.M)
    B = np.linalg.solve(L, equations.J.T).T
    m, n = B.shape
    return float(np.linalg.cond(np.block([[np.eye(n), -B.T], [B, np.zeros((m, m))]])))
