"""Run under LD_PRELOAD of count_allocations: prints how often memory was asked for by short and by long runs.

The long run takes ten times the steps and keeps ten times the samples of the short one.
"""

from __future__ import annotations

import ctypes
import json
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent.parent))
from rigs import bennett, floating_body, joint, link, point, point_mass, robot, slider_crank, tree

from drillrig_pin import Rig, Scenario, load_rig, load_rig_text
from drillrig_pin.core import CompiledDynamics
from drillrig_pin.recorder import Recorder
from drillrig_pin.scenario import CORE_METHODS
from drillrig_pin.simulation import prepare
from drillrig_pin.stepping import Settings, plan_of

HOLD = '<hold name="h" point="R" axes="x z"/>'
GROUND = '<contact name="g" point="P" axis="0 0 -1" stiffness="2e4" preload="19.62" damping="40" mode="unilateral"/>'
BENNETT = {"positions": {"j1": 1.0, "j2": 2.0, "j3": -1.0}, "velocities": {"j1": 2.0}}


def geared() -> str:
    """Two sliders, one led by the other, braked by dry friction, driven by a table of each reading and by harmonics."""
    loads = "".join(
        f'<load name="{reading}" kind="force" point="P" axis="1 0 0"><table reading="{reading}">'
        "time,force\n0,0\n0.02,9\n0.05,-7\n0.1,3\n</table></load>"
        for reading in ("linear", "hold", "spline")
    )
    harmonics = '<harmonics mean="1" ramp="0.05"><term amplitude="4" frequency="30"/></harmonics>'
    loads += f'<load name="shake" kind="force" point="P" axis="1 0 0">{harmonics}</load>'
    led = joint("led", "prismatic", "first", "second", axis=(1, 0, 0))
    lead = joint("lead", "prismatic", "world", "first", axis=(1, 0, 0))
    return robot(
        link("first", 2.0),
        lead.replace("</joint>", '<dynamics damping="2" friction="0.5"/></joint>'),
        link("second", 1.0),
        led.replace("</joint>", '<mimic joint="lead" multiplier="-0.5"/></joint>'),
        extension='<joint_spring name="s" joint="lead" stiffness="800" damping="3"/>' + point("P", "second") + loads,
    )


MACHINES: dict[str, tuple[Rig, dict[str, object]]] = {
    "mkz49": (load_rig("mkz49"), {}),
    "redundant": (load_rig_text(bennett()), BENNETT),
    "continuous": (load_rig_text(slider_crank()), {"velocities": {"crank_joint": 20.0}}),
    "floating": (load_rig_text(tree(HOLD)), {}),
    "free": (load_rig_text(floating_body()), {}),
    "contact": (load_rig_text(point_mass(extension=GROUND)), {"velocities": {"z": 1.0}}),
    "geared, with friction and tables": (load_rig_text(geared()), {"duration": 0.1}),
}
SHORT, LONG, DURATION = 200, 2000, 0.1


def counts(dynamics: CompiledDynamics, method: str, projection: bool) -> list[int]:
    """Requests during a run of few steps and of many."""
    inner = dynamics.dynamics
    answer = []
    for steps in (SHORT, LONG):
        step, samples = DURATION / steps, np.linspace(0.0, DURATION, steps // 2 + 1)
        # Some rows lie inside a step.
        inside = samples[10::20] - 0.3 * step
        plan = plan_of(inside, samples, inner.breakpoints(), inner.jumps())
        arrays = Recorder(inner, plan, "core", method).arrays()
        settings = Settings(method, step, 1e-6, np.full(inner.size, 1e-3), step, projection)
        least = 1 << 60
        # The first call fills caches of Python; the least of the others is the run's own.
        for _ in range(4):
            report = dynamics.run(inner.initial(), settings, plan, arrays, None)
            least = min(least, dynamics.rig.asked)
        assert report.status.name == "COMPLETED", report
        assert report.steps >= steps
        answer.append(least)
    return answer


class Counted:
    """A compiled rig whose runs are counted from the call of C++ to its return."""

    def __init__(self, rig: object) -> None:
        self.rig, self.asked = rig, 0

    def run(self, **arguments: object) -> object:
        before = allocations()
        answer = self.rig.run(**arguments)
        self.asked = allocations() - before
        return answer


allocations = ctypes.CDLL(None).allocations
allocations.restype = ctypes.c_ulong
result = {}
for name, (rig, changes) in MACHINES.items():
    for formulation in ("multipliers", "null_space", "damped"):
        dynamics = CompiledDynamics(prepare(rig, Scenario(formulation=formulation, **changes)))
        dynamics.rig = Counted(dynamics.rig)
        for method in CORE_METHODS:
            for projection in (True, False):
                key = f"{name}, {formulation}, {method}, {'with' if projection else 'without'} projection"
                result[key] = counts(dynamics, method, projection)
print(json.dumps(result))
