"""Vibration of percussive-rotary drilling rigs.

A rig is a URDF/xacro file with cylinders, loads and constraints beside its links; Pinocchio computes its dynamics.

    >>> from drillrig_pin import load_rig, Scenario, simulate
    >>> trajectory = simulate(load_rig("mkz49"), Scenario(duration=1.0))
    >>> trajectory.dataset["point_displacement"].sel(point="S", axis="z")

Names are imported when first used, so that importing the package costs nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from drillrig_pin.accuracy import estimate_error
    from drillrig_pin.errors import (
        AssemblyError,
        DrillrigError,
        EngineError,
        ModelError,
        ResultFileError,
        ScenarioError,
        SimulationError,
        SingularConfigurationError,
        Status,
    )
    from drillrig_pin.rig import Rig, load_rig, load_rig_text
    from drillrig_pin.scenario import Scenario, load_scenario
    from drillrig_pin.simulation import simulate, simulate_many
    from drillrig_pin.trajectory import Trajectory, load_trajectory

_HOMES = {
    "AssemblyError": "errors",
    "DrillrigError": "errors",
    "EngineError": "errors",
    "ModelError": "errors",
    "ResultFileError": "errors",
    "Rig": "rig",
    "Scenario": "scenario",
    "ScenarioError": "errors",
    "SimulationError": "errors",
    "SingularConfigurationError": "errors",
    "Status": "errors",
    "Trajectory": "trajectory",
    "estimate_error": "accuracy",
    "load_rig": "rig",
    "load_rig_text": "rig",
    "load_scenario": "scenario",
    "load_trajectory": "trajectory",
    "simulate": "simulation",
    "simulate_many": "simulation",
}

__all__ = [
    "AssemblyError",
    "DrillrigError",
    "EngineError",
    "ModelError",
    "ResultFileError",
    "Rig",
    "Scenario",
    "ScenarioError",
    "SimulationError",
    "SingularConfigurationError",
    "Status",
    "Trajectory",
    "estimate_error",
    "load_rig",
    "load_rig_text",
    "load_scenario",
    "load_trajectory",
    "simulate",
    "simulate_many",
]


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        return getattr(import_module(f"drillrig_pin.{_HOMES[name]}"), name)
    raise AttributeError(f"module 'drillrig_pin' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
