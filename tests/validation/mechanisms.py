"""Slider-crank, four-bar and double pendulum against closed forms and conservation laws."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pinocchio as pin
from closed_forms import BARS, CRANK, ROD, bar_motion, crank_motion, derivative
from rigs import double_pendulum, four_bar, slider_crank

from drillrig_pin import Scenario, Trajectory, load_rig_text, simulate
from drillrig_pin.kinematics import Array
from validation.record import Row
from validation.settings import ENGINES, TIGHT

TEXT = """\
The crank turns the machine through whole revolutions under gravity. At every sample the other coordinates and their
rates are compared with the closed form at the crank angle of that sample: the slider-crank by the sine law, the
four-bar by Freudenstein's equation, rates as derivatives of these by complex steps. The double pendulum tumbles; its
motion is chaotic and has no closed form, but its energy is conserved, and without gravity so is its angular momentum
about the shoulder.
"""


def rows(short: bool) -> Iterator[Row]:
    """Measure all three on every engine."""
    for engine in ENGINES:
        seconds = 0.4 if short else 5.0 if engine == "core" else 1.0
        yield from _slider_crank(engine, seconds)
        yield from _four_bar(engine, seconds)
        yield from _double_pendulum(engine, 2 * seconds)


def _turns(angle: Array) -> float:
    return float(np.ptp(np.unwrap(angle)) / (2 * np.pi))


def _circle(angle: Array) -> Array:
    """Angles brought into -pi .. pi."""
    return np.arctan2(np.sin(angle), np.cos(angle))


def _slider_crank(engine: str, seconds: float) -> Iterator[Row]:
    rig = load_rig_text(slider_crank(CRANK, ROD))
    case = Scenario(duration=seconds, velocities={"crank_joint": 70.0}, positions={"crank_joint": 0.3}, engine=engine)
    run = simulate(rig, case.changed(TIGHT))
    q, v = run.q, run.v
    theta = q[:, 0]
    rod, slider = crank_motion(theta)
    off = max(np.abs(_circle(q[:, 1] - rod)).max(), np.abs(q[:, 2] - slider).max())
    slopes = np.stack([derivative(lambda s, i=i: crank_motion(s)[i], theta) for i in (0, 1)], axis=1)
    slip = np.abs(v[:, 1:] - slopes * v[:, :1]).max() / np.abs(v[:, 0]).max()
    yield from _kinematics(f"slider-crank, {_turns(theta):.1f} turns, {engine}", "sine law", off, slip)


def _four_bar(engine: str, seconds: float) -> Iterator[Row]:
    start = {"crank_joint": 0.4, "coupler_joint": 0.3, "rocker_joint": 1.2}
    case = Scenario(duration=seconds, velocities={"crank_joint": 30.0}, positions=start, engine=engine)
    run = simulate(load_rig_text(four_bar(BARS)), case.changed(TIGHT))
    q, v = run.q, run.v
    off = max(np.abs(_circle(q[:, i + 1] - bar_motion(q[:, 0])[i])).max() for i in (0, 1))
    slopes = np.stack([derivative(lambda s, i=i: bar_motion(s)[i], q[:, 0]) for i in (0, 1)], axis=1)
    slip = np.abs(v[:, 1:] - slopes * v[:, :1]).max() / np.abs(v[:, 0]).max()
    yield from _kinematics(f"four-bar, {_turns(q[:, 0]):.1f} turns, {engine}", "Freudenstein's equation", off, slip)


def _kinematics(about: str, reference: str, off: float, slip: float) -> Iterator[Row]:
    # A residual of a few roundings of a metre, enlarged where the linkage transmits badly.
    yield Row(f"{about}: positions", reference, float(off), high=1e-12, unit="m, rad")
    yield Row(f"{about}: rates over the crank's", f"{reference}, derivative", float(slip), high=1e-11)


def _double_pendulum(engine: str, seconds: float) -> Iterator[Row]:
    case = Scenario(duration=seconds, engine=engine, velocities={"shoulder": 8.0, "elbow": -3.0}).changed(TIGHT)
    run = simulate(load_rig_text(double_pendulum()), case)
    drift = float(np.abs(run.energy_residual).max() / np.ptp(run.energy_kinetic))
    yield Row(f"double pendulum, {seconds:g} s, {engine}: energy over its exchange", "conservation", drift, high=1e-9)
    free = simulate(load_rig_text(double_pendulum(gravity=False)), case)
    momentum = _momentum(free)
    lost = float(np.ptp(momentum) / np.abs(momentum).max())
    yield Row(f"double pendulum without gravity, {engine}: angular momentum", "conservation", lost, high=1e-9)


def _momentum(run: Trajectory) -> Array:
    """Angular momentum about the world's y axis, the first row of M v for hinges about it."""
    model = load_rig_text(double_pendulum(gravity=False)).model
    data = model.createData()
    return np.array([pin.crba(model, data, q)[0] @ v for q, v in zip(run.q, run.v, strict=True)])
