"""Scalar coordinates x(q), their rates and their gradient rows, all of a rig at once.

Every coordinate here is the same thing: a unit wrench ``W`` (world origin, world axes) between two bodies, so that

    x_dot = row . v,      row = (S_b - S_a) * (W^T J),      tau = row^T F,

with ``S_a``, ``S_b`` the supports of the two bodies (:mod:`drillrig_pin.kinematics`). The kinds differ in W and x:

=========  =========================================================  ==============================  ================
kind       x                                                          W = (force, moment)             used by
=========  =========================================================  ==============================  ================
joint      q_k, of a continuous joint counted on over whole turns     row is a unit vector            springs, torques
line       \\|P_b - P_a\\|                                            (u, P_b x u), u the unit line   cylinders
turn       none (a torque does not need one)                          (0, n)                          torques
slide      n . (P_b - P_a), n fixed in body a or in a third body      (n, P_b x n)                    contact, hold
angle      m_a . m_b, two directions                                  (0, m_b x m_a)                  hinges
gear       q_k - ratio q_l                                            row is constant                 gears, mimics
=========  =========================================================  ==============================  ================

This is J(q)^T times force of [Tram2023] eqs. (11)-(51) without writing a Jacobian per force.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from drillrig_pin.kinematics import Anchor, Array, Kinematics, anchor_matrix, support_matrix

#: Vectors are kept "wrapped" as (x, y, z, x, y): both cyclic shifts are then views, and a cross product three calls.
WRAP = np.array([0, 1, 2, 0, 1])


def cross(a: Array, b: Array) -> Array:
    """Row-wise cross product of wrapped vectors, (n, 5) and (n, 5) to (n, 3)."""
    product: Array = a[:, 1:4] * b[:, 2:5]
    product -= a[:, 2:5] * b[:, 1:4]
    return product


@dataclass(frozen=True, slots=True)
class JointCoordinate:
    """x = q[index_q] of a joint with one dof; the angle of a continuous one counts on over whole turns."""

    index_q: int
    index_v: int


@dataclass(frozen=True, slots=True)
class Line:
    """Distance between two points; positive rate when they move apart."""

    start: Anchor
    end: Anchor


@dataclass(frozen=True, slots=True)
class Turn:
    """Rotation about a direction: no x of its own, its rate is n . (omega_b - omega_a)."""

    body: int
    direction: Anchor
    base: int = 0


@dataclass(frozen=True, slots=True)
class Slide:
    """Position of ``point`` relative to ``origin`` along ``direction``.

    With a direction fixed in a third, moving body (a load that follows the feed beam) the rate is still n . (v_b - v_a)
    but x is not its integral; laws of such coordinates must not use x.
    """

    point: Anchor
    direction: Anchor
    origin: Anchor


@dataclass(frozen=True, slots=True)
class Angle:
    """Scalar product of a direction on the base and one on the moving body: zero when they are perpendicular."""

    base: Anchor
    moving: Anchor


@dataclass(frozen=True, slots=True)
class Gear:
    """x = q_follower - ratio q_leader of two joints with one dof each; only constraints have such a coordinate."""

    follower: JointCoordinate
    leader: JointCoordinate
    ratio: float


Coordinate = JointCoordinate | Line | Turn | Slide | Angle | Gear
_ORDER: tuple[type, ...] = (JointCoordinate, Turn, Line, Slide, Angle, Gear)


class CoordinateSet:
    """All coordinates of a rig, evaluated together.

    Coordinates are kept sorted by kind; within a kind they stay in the order given. ``position[i]`` tells where the
    i-th given coordinate is found in the arrays.

    Args:
        model: Pinocchio model.
        coordinates: what to evaluate.
        biased: how many coordinates at the sorted end need the bias term (the constraints).
        support: the model's support matrix, where it is at hand.

    Attributes:
        x: coordinates (n).
        rows: their gradients (n, nv).
        W: unit wrenches of all but joints and gears, (wrenches, 6).
        kinds: the coordinates sorted: joints, turns, lines, slides, angles, gears.
    """

    def __init__(
        self, model: Any, coordinates: list[Coordinate], biased: int = 0, support: Array | None = None
    ) -> None:
        order = sorted(range(len(coordinates)), key=lambda i: _ORDER.index(type(coordinates[i])))
        n = self.size = len(coordinates)
        self.position = np.argsort(np.array(order, dtype=int)) if order else np.zeros(0, dtype=int)
        kinds: list[list[Any]] = [[coordinates[i] for i in order if isinstance(coordinates[i], k)] for k in _ORDER]
        self.kinds = kinds
        joints, turns, lines, slides, angles, gears = kinds
        nj, nt, nl, ns, na, ng = map(len, kinds)
        self.x = np.zeros(n)
        self.rows = np.zeros((n, model.nv))
        self.W = np.zeros((n - nj - ng, 6))
        self._joints = _JointPart(joints, self.x, self.rows, ng)
        self._gears = _GearPart(gears, self.x, self.rows)
        support = support_matrix(model) if support is None else support
        bodies = [(c.base, c.body) for c in turns] + [(c.start.joint, c.end.joint) for c in lines]
        bodies += [(c.origin.joint, c.point.joint) for c in slides] + [(c.base.joint, c.moving.joint) for c in angles]
        base, moving = (support[[pair[i] for pair in bodies]].reshape(-1, model.nv) for i in (0, 1))
        self._relative = moving - base

        # World vectors by one product with the joint frames: ends, starts, axes of turns, slides, angles, angle bases.
        anchors = [c.end for c in lines] + [c.point for c in slides]
        anchors += [c.start for c in lines] + [c.origin for c in slides]
        anchors += [c.direction for c in turns] + [c.direction for c in slides]
        anchors += [c.moving for c in angles] + [c.base for c in angles]
        self._matrix = anchor_matrix(model, anchors)
        world = self._world = np.zeros((len(anchors), 5))
        ends, starts, turn_axes, slide_axes, moved, bases = np.split(world, np.cumsum([nl + ns, nl + ns, nt, ns, na]))
        self._ends, self._starts, self._span = ends, starts, np.zeros((nl + ns, 5))
        self._unit = np.zeros((nl + ns, 5))
        self._line_span, self._line_unit = self._span[:nl, :3], self._unit[:nl]
        self._moved, self._bases = moved, bases
        self._slide_axes, self._turn_axes = slide_axes, turn_axes
        self._length = self.x[nj + nt : nj + nt + nl]
        self._slide_x = self.x[nj + nt + nl : n - na - ng]
        self._angle_x = self.x[n - na - ng : n - ng]
        self._acting, self._turning = slice(nt, nt + nl + ns), slice(0, nt)
        self._counts = nl, ns, nt, na

        # Gears have constant rows, and of a machine with nothing else there is no wrench.
        with_wrench = max(0, biased - ng)
        first = len(self.W) - with_wrench
        self._bias_rows = slice(first, len(self.W))
        self._bias_slides = with_wrench - na
        self._unbiased = np.zeros(min(ng, biased))
        self._bias_relative, self._bias_base, self._bias_moving = self._relative[first:], base[first:], moving[first:]
        self._bias_at_rest = not self._bias_base.any()

    def update(self, kinematics: Kinematics, q: Array) -> None:
        """Fill ``x``, ``W`` and ``rows`` from an up-to-date kinematics."""
        self._joints.update(q)
        self._gears.update(q)
        nl, ns, nt, na = self._counts
        W = self.W
        if not len(W):
            return
        np.dot(self._matrix, kinematics.frames.take(WRAP, 1), out=self._world)
        if nl or ns:
            ends, span, unit = self._ends, self._span, self._unit
            np.subtract(ends, self._starts, out=span)
            if nl:
                line = self._line_span
                np.sqrt(np.vecdot(line, line), out=self._length)
                np.divide(span[:nl], self._length[:, None], out=self._line_unit)
            if ns:
                unit[nl:] = self._slide_axes
                np.vecdot(unit[nl:, :3], span[nl:, :3], out=self._slide_x)
            W[self._acting, :3] = unit[:, :3]
            W[self._acting, 3:] = cross(ends, unit)
        if nt:
            W[self._turning, 3:] = self._turn_axes[:, :3]
        if na:
            np.vecdot(self._bases[:, :3], self._moved[:, :3], out=self._angle_x)
            W[nt + nl + ns :, 3:] = cross(self._moved, self._bases)
        np.multiply(np.dot(W, kinematics.J), self._relative, out=self._joints.others)

    def bias(self, kinematics: Kinematics, v: Array) -> Array:
        """row_dot . v of the biased coordinates: the second derivative of x at zero acceleration, (biased,).

        gamma = W . (A_b - A_a) + W_dot . (V_b - V_a), with V = J v and A = dJ v the spatial velocity and acceleration
        of the two bodies. For a slide W_dot = (n_dot, v_P x n + P x n_dot), n_dot = omega_a x n.
        """
        W = self.W[self._bias_rows]
        moved = self._bias_relative * v
        gamma: Array = np.vecdot(W, np.dot(moved, kinematics.dJ.T))
        V = np.dot(moved, kinematics.J.T)
        V_b = V if self._bias_at_rest else np.dot(self._bias_moving * v, kinematics.J.T)
        omega_b = V_b[:, 3:].take(WRAP, 1)
        base_omega = None if self._bias_at_rest else np.dot(self._bias_base * v, kinematics.J.T)[:, 3:].take(WRAP, 1)
        ns = self._bias_slides
        if ns > 0:
            n, P = self._unit[-ns:], self._ends[-ns:]
            velocity = cross(omega_b[:ns], P)
            velocity += V_b[:ns, :3]
            rate = cross(velocity.take(WRAP, 1), n)
            if base_omega is not None:
                n_dot = cross(base_omega[:ns], n)
                gamma[:ns] += np.vecdot(n_dot, V[:ns, :3])
                rate += cross(P, n_dot.take(WRAP, 1))
            gamma[:ns] += np.vecdot(rate, V[:ns, 3:])
        if ns < len(gamma):
            # W_dot = (0, m_b_dot x m_a + m_b x m_a_dot)
            rate = cross(cross(omega_b[ns:], self._moved).take(WRAP, 1), self._bases)
            if base_omega is not None:
                rate += cross(self._moved, cross(base_omega[ns:], self._bases).take(WRAP, 1))
            gamma[ns:] += np.vecdot(rate, V[ns:, 3:])
        return np.concatenate([gamma, self._unbiased]) if len(self._unbiased) else gamma


class _JointPart:
    """The rows that are unit vectors: filled once."""

    def __init__(self, joints: list[JointCoordinate], x: Array, rows: Array, gears: int) -> None:
        self._x = x[: len(joints)]
        self.others = rows[len(joints) : len(rows) - gears]
        self._index_q = np.array([c.index_q for c in joints], dtype=int)
        for i, c in enumerate(joints):
            rows[i, c.index_v] = 1.0

    def update(self, q: Array) -> None:
        if len(self._x):
            self._x[:] = q[self._index_q]


class _GearPart:
    """The rows that join two joints: filled once."""

    def __init__(self, gears: list[Gear], x: Array, rows: Array) -> None:
        first = len(x) - len(gears)
        self._x = x[first:]
        self._follower = np.array([gear.follower.index_q for gear in gears], dtype=int)
        self._leader = np.array([gear.leader.index_q for gear in gears], dtype=int)
        self._ratio = np.array([gear.ratio for gear in gears])
        for row, gear in zip(rows[first:], gears, strict=True):
            row[gear.follower.index_v] += 1.0
            row[gear.leader.index_v] -= gear.ratio

    def update(self, q: Array) -> None:
        if len(self._x):
            self._x[:] = q[self._follower] - self._ratio * q[self._leader]
