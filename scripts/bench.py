"""Measure what the package promises; one JSON object a line.

    python scripts/bench.py            all of it, about a minute
    python scripts/bench.py --quick    without the 10 s run

Medians over several repetitions. The right-hand side is also given as a ratio to a careful plain script on Pinocchio's
API that computes the same accelerations, measured in turn with it: ratios survive a noisy machine, times do not.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pinocchio as pin

from drillrig_pin import Scenario, load_rig
from drillrig_pin.elements.base import Element
from drillrig_pin.simulation import prepare


def per_call(function: Callable[[], object], calls: int) -> float:
    """Microseconds per call."""
    start = time.perf_counter()
    for _ in range(calls):
        function()
    return (time.perf_counter() - start) / calls * 1e6


def wall(command: list[str]) -> float:
    """Seconds of one process."""
    start = time.perf_counter()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    return time.perf_counter() - start


class PlainScript:
    """The same right-hand side as one would write it on Pinocchio's API: frame Jacobians, one force after the other."""

    def __init__(self, rig: object, dynamics: object) -> None:
        self.dynamics = dynamics
        self.model = dynamics.rig.model.copy()
        self.laws = dict(zip([e.name for e in dynamics.forces], dynamics.laws, strict=True))
        for name in dynamics.rig.points:
            anchor = dynamics.rig.point(name)
            placement = pin.SE3(np.eye(3), np.array(anchor.vector))
            self.model.addFrame(pin.Frame(f"point {name}", anchor.joint, 0, placement, pin.FrameType.OP_FRAME))
        self.data = self.model.createData()
        self.id = {name: self.model.getFrameId(f"point {name}") for name in dynamics.rig.points}
        self.axes = {e.name: self._axis(dynamics.rig, e) for e in dynamics.forces if e.tag == "load"}
        self.rows = [(c.point, "xyz".index(axis)) for c in dynamics.rig.constraints for axis in c.axes]

    @staticmethod
    def _axis(rig: object, element: Element) -> tuple[int, np.ndarray]:
        direction = rig.direction(element.point, element.axis, element.frame)
        return direction.joint, np.array(direction.vector)

    def _jacobian(self, name: str) -> np.ndarray:
        return pin.getFrameJacobian(self.model, self.data, self.id[name], pin.LOCAL_WORLD_ALIGNED)

    def __call__(self, t: float, y: np.ndarray) -> np.ndarray:
        model, data, n = self.model, self.data, self.model.nv
        q, v = y[:n], y[n : 2 * n]
        pin.computeAllTerms(model, data, q, v)
        pin.updateFramePlacements(model, data)
        tau = -data.nle
        for e in self.dynamics.forces:
            law = self.laws[e.name]
            if e.tag == "cylinder":
                a, b = data.oMf[self.id[e.start]].translation, data.oMf[self.id[e.end]].translation
                span = b - a
                length = np.linalg.norm(span)
                row = (span / length) @ (self._jacobian(e.end)[:3] - self._jacobian(e.start)[:3])
                tau = tau + row * law.force(length, row @ v, t)
            elif e.tag == "load":
                joint, axis = self.axes[e.name]
                direction = data.oMi[joint].rotation @ axis
                J = self._jacobian(e.point)
                part = J[:3] if e.kind == "force" else J[3:]
                tau = tau + (direction @ part) * law.force(None, None, t)
            elif e.tag == "contact":
                axis = np.array(e.axis)
                row = axis @ self._jacobian(e.point)[:3]
                tau = tau + row * law.force(axis @ data.oMf[self.id[e.point]].translation, row @ v, t)
            else:
                k = model.joints[model.getJointId(e.joint)].idx_v
                tau[k] += law.force(q[k], v[k], t)
        J, bias = [], []
        for point, axis in self.rows:
            J.append(self._jacobian(point)[axis])
            pin.forwardKinematics(model, data, q, v, np.zeros(n))
            drift = pin.getFrameClassicalAcceleration(model, data, self.id[point], pin.LOCAL_WORLD_ALIGNED)
            bias.append(drift.linear[axis])
        J, bias = np.array(J), np.array(bias)
        m = len(J)
        f_dot = J @ v
        K = np.block([[data.M, -J.T], [J, np.zeros((m, m))]])
        a = np.linalg.solve(K, np.concatenate([tau, -bias - 400.0 * f_dot]))[:n]
        return np.concatenate([v, a])


def right_hand_side() -> dict[str, object]:
    """One evaluation of the default rig, ours against the plain script."""
    dynamics = prepare(load_rig("mkz49"), Scenario())
    y = dynamics.initial()
    rng = np.random.default_rng(1)
    y[6:12] = 0.01 * rng.standard_normal(6)
    plain = PlainScript(None, dynamics)
    # On the constraints both must give the same accelerations; the stabilising terms differ off them.
    y = dynamics.project(y)
    difference = float(np.abs(plain(0.5, y)[6:12] - dynamics.rate(0.5, y)[6:12]).max())
    ours, theirs = [], []
    for _ in range(15):
        ours.append(per_call(lambda: dynamics.rate(0.5, y), 2000))
        theirs.append(per_call(lambda: plain(0.5, y), 500))
    return {
        "what": "right-hand side",
        "microseconds": round(statistics.median(ours), 1),
        "bar": 80,
        "plain_script_microseconds": round(statistics.median(theirs), 1),
        "ratio": round(statistics.median(o / t for o, t in zip(ours, theirs, strict=True)), 3),
        "largest_difference_of_acceleration": difference,
    }


def main() -> None:
    """Print one line per promise."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="leave out the 10 s run")
    quick = parser.parse_args().quick
    python, drillrig = sys.executable, str(Path(sys.executable).with_name("drillrig"))
    print(json.dumps(right_hand_side() | {"cores": os.cpu_count()}), flush=True)
    for what, command, bar in [
        ("import drillrig_pin", [python, "-c", "import drillrig_pin"], 0.5),
        ("drillrig --help", [drillrig, "--help"], 0.7),
    ]:
        wall(command)
        seconds = statistics.median(wall(command) for _ in range(7))
        print(json.dumps({"what": what, "seconds": round(seconds, 3), "bar": bar}), flush=True)
    if not quick:
        with tempfile.TemporaryDirectory() as folder:
            command = [drillrig, "run", "-o", str(Path(folder, "run.nc"))]
            seconds = statistics.median(wall(command) for _ in range(3))
        print(json.dumps({"what": "drillrig run, default 10 s", "seconds": round(seconds, 2), "bar": 15}), flush=True)


if __name__ == "__main__":
    main()
