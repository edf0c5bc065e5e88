"""All force laws of a problem in NumPy, for engines that know where points are but not what pushes them."""

from __future__ import annotations

import math

import numpy as np

from drillrig_pin.elements.loads import HarmonicLaw
from drillrig_pin.kinematics import Anchor, Array
from peers.problem import Problem

OIL = ("x0", "E0", "S_A", "S_B", "l_A", "l_B", "p_A0", "p_B0", "k")
#: Baumgarte's alpha = beta [1/s]: slower than the machine vibrates, so that it costs no steps.
DECAY = 20.0


class Laws:
    """Generalised forces and the saddle-point system, from places and Jacobians that an engine computes.

    Attributes:
        points: places that the laws ask for, in this order: pins of barrels, pins of rods, points on rock, points that
            loads push, the point held.
        pushed: body and direction of every force, in the body's axes.
        turned: body and direction of every torque, in the body's axes.
    """

    def __init__(self, problem: Problem) -> None:
        lines = [line for line, _ in problem.cylinders]
        self.points: list[Anchor] = [line.start for line in lines] + [line.end for line in lines]
        self.points += [slide.point for slide, _ in [*problem.contacts, *problem.forces]]
        self.points.append(problem.holds[0][0].point)
        self.pushed = [(slide.point.joint, np.array(slide.direction.vector)) for slide, _ in problem.forces]
        self.turned = [(turn.body, np.array(turn.direction.vector)) for turn, _ in problem.torques]
        self.oil = np.array([[getattr(law, name) for name in OIL] for _, law in problem.cylinders]).T
        self.springs = [(coordinate.index_v, law) for coordinate, law in problem.springs]
        self.rocks = [(np.array(slide.direction.vector), law) for slide, law in problem.contacts]
        self.loads = [law for _, law in problem.forces]
        self.torques = [law for _, law in problem.torques]
        self.axes = np.array([hold.direction.vector for hold, _ in problem.holds])
        self.targets = np.array([target for _, target in problem.holds])
        self.size = len(problem.v)
        self._K = np.zeros((self.size + len(self.axes),) * 2)

    def forces(self, t: float, q: Array, v: Array, P: Array, J: Array, axes: list[Array], spins: list[Array]) -> Array:
        """Generalised forces (nv).

        Args:
            t: time [s].
            q, v: state.
            P: world places of the points (n, 3).
            J: their translational Jacobians in world axes (n, 3, nv).
            axes: world direction of every force.
            spins: row of every torque, its world direction times the angular Jacobian of its body (nv).
        """
        n = self.oil.shape[1]
        span = P[n : 2 * n] - P[:n]
        length = np.sqrt(np.vecdot(span, span))
        rows = np.vecmat(span / length[:, None], J[n : 2 * n] - J[:n])
        x0, E0, S_A, S_B, l_A, l_B, p_A0, p_B0, k = self.oil
        p_A = p_A0 - E0 * np.log1p((length - x0) / l_A)
        p_B = p_B0 - E0 * np.log1p((x0 - length) / l_B)
        tau: Array = (p_A * S_A - p_B * S_B - k * (rows @ v)) @ rows
        for i, spring in self.springs:
            tau[i] += spring.F0 - spring.c * (q[i] - spring.x0) - spring.k * v[i]
        at = 2 * n
        for axis, rock in self.rocks:
            row = axis @ J[at]
            tau -= (rock.N0 + rock.c * (axis @ P[at] - rock.x0) + rock.k * (row @ v)) * row
            at += 1
        for axis, load in zip(axes, self.loads, strict=True):
            tau += _series(load, t) * (axis @ J[at])
            at += 1
        for row, load in zip(spins, self.torques, strict=True):
            tau += _series(load, t) * row
        return tau

    def solve(self, M: Array, right: Array, v: Array, place: Array, J: Array, drift: Array) -> Array:
        """M a - J^T lambda = right, J a = -drift - 2 d f_dot - d^2 f for the point held; accelerations (nv)."""
        n, J = self.size, self.axes @ J
        K, both = self._K, np.empty(len(self._K))
        both[:n] = right
        both[n:] = -(self.axes @ drift) - 2 * DECAY * (J @ v) - DECAY**2 * (self.axes @ place - self.targets)
        K[:n, :n], K[n:, :n], K[:n, n:] = M, J, -J.T
        return np.asarray(np.linalg.solve(K, both)[:n])


def _series(law: HarmonicLaw, t: float) -> float:
    value = law.mean + float(law.amplitude @ np.sin(2 * math.pi * t * law.frequency + law.phase))
    s = min(t / law.ramp, 1.0)
    return s**3 * (10.0 + s * (6.0 * s - 15.0)) * value
