"""Which engine and which integrator run a case."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drillrig_pin.dynamics import Dynamics
from drillrig_pin.elements.base import Law
from drillrig_pin.errors import ScenarioError, SingularConfigurationError
from drillrig_pin.marching import Rates, core_is_installed
from drillrig_pin.scenario import CORE_METHODS, Scenario

#: Decay rate [1/s] from which `auto` takes an implicit method: an explicit one would need steps below 0.2 ms.
STIFF = 3e4
#: Deflection [rad, m] up to which the machine's equations are all but linear and `auto` takes the exponential method.
SMALL = 0.02
#: Relative tolerance down to which its error estimate stands clear of rounding: on the shipped rig its error is 1e-12
#: at 1e-10, and now and then 1e-9 at 3e-11.
FINE = 1e-10
#: Breakpoints of the laws from which the exponential method spends its time on starting anew behind them.
FEW = 20


def engine_of(scenario: Scenario) -> str:
    """The engine that will run a scenario: ``core`` or ``python``.

    Raises:
        ScenarioError: the core is asked for and not installed.
    """
    if scenario.engine == "python":
        return "python"
    if core_is_installed():
        return "core" if scenario.integrator.method in ("auto", *CORE_METHODS) else "python"
    if scenario.engine == "core":
        raise ScenarioError(
            "the compiled core is not installed", todo="Install a C++ compiler and reinstall, or choose engine: python."
        )
    return "python"


def method_of(scenario: Scenario, engine: str, dynamics: Dynamics, rates: Rates) -> str:
    """The integrator of a scenario; ``auto`` looks at the machine at its initial state.

    An explicit method cannot step much beyond 6 / |lambda| with lambda the fastest eigenvalue, whatever the tolerance.
    Where that eigenvalue is a damping far above what the motion needs, an implicit method wins although each of its
    steps pays for a Jacobian. Where the loads deflect the machine so little that its equations are all but linear, the
    exponential method carries the linear part exactly and needs one evaluation a step, where DOP853 needs twelve.
    """
    chosen = scenario.integrator.method
    if chosen != "auto":
        return chosen
    try:
        look = examine(dynamics, rates, scenario.duration)
    except (SingularConfigurationError, np.linalg.LinAlgError):
        return "DOP853"  # the run itself will say what is wrong
    if look.decay > STIFF:
        return "RODAS" if engine == "core" else "Radau"
    if engine == "core" and scenario.integrator.rtol > FINE and look.deflection < SMALL and look.smooth:
        return "ExpAdams"
    return "DOP853"


@dataclass(frozen=True)
class Look:
    """What decides between integrators.

    Attributes:
        decay: largest decay rate [1/s] among the modes.
        deflection: largest static deflection [rad, m] under the loads at some times of the run, by linearisation;
            infinite if something moves already or is held by nothing.
        smooth: no law switches, few have breakpoints, and none is a user's own, which may pulse between two steps.
    """

    decay: float
    deflection: float
    smooth: bool


@np.errstate(all="ignore")
def examine(dynamics: Dynamics, rates: Rates, duration: float) -> Look:
    """Linearise about the initial state by differences: y' = A y + g(t)."""
    y = dynamics.initial()
    n = len(y) - 2
    moved = np.tile(y, (n + 1, 1))
    moved[:n, :n] += 1e-7 * np.eye(n)
    rate = rates(np.zeros(n + 1), moved)[:, :n]
    A = (rate[:n] - rate[n]).T / 1e-7
    if not np.isfinite(A).all():
        return Look(0.0, np.inf, False)
    decay = float(-np.linalg.eigvals(A).real.min(initial=0.0))
    smooth = not dynamics.switching and len(dynamics.breakpoints()) <= FEW and _known(dynamics)
    moving = bool(np.abs(dynamics.equilibrium.assembly.v).max(initial=0.0) > 0.1)
    if moving or not smooth:
        return Look(decay, np.inf, smooth)
    times = np.linspace(0.0, min(duration, 1.0), 5)
    loads = rates(times, np.tile(y, (len(times), 1)))[:, :n]
    try:
        deflection = np.linalg.solve(A, loads.T)[: dynamics.rig.model.nq]
    except np.linalg.LinAlgError:
        return Look(decay, np.inf, smooth)
    return Look(decay, float(np.abs(deflection).max(initial=0.0)), smooth)


def _known(dynamics: Dynamics) -> bool:
    """True if all laws are of this package."""
    package = Law.__module__.rpartition(".")[0]
    return all(type(law).__module__.startswith(package) for law in dynamics.laws)
