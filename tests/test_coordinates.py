"""Scalar coordinates against finite differences: rows are gradients, biases are second derivatives."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from rigs import tree

from drillrig_pin import Rig, load_rig_text
from drillrig_pin.coordinates import Angle, Coordinate, CoordinateSet, JointCoordinate, Line, Slide, Turn
from drillrig_pin.kinematics import Anchor, Array, Kinematics, world_direction, world_point

#: Central differences over this step [rad or m] leave 1e-10 of truncation and 1e-10 of rounding.
H = 1e-5
NEAR = 2e-9


@pytest.fixture(scope="module")
def rig() -> Rig:
    return load_rig_text(tree())


def _direction(rig: Rig, point: str, *axis: float) -> Anchor:
    unit = np.array(axis) / np.linalg.norm(axis)
    return rig.direction(point, tuple(unit.tolist()), "body")


def _coordinates(rig: Rig) -> dict[str, Coordinate]:
    origin, B, L, R = (rig.point(name) for name in "OBLR")
    skew = tuple((np.array([1.0, 2.0, -2.0]) / 3).tolist())
    return {
        "joint, revolute": rig.joint("elbow"),
        "joint, prismatic": rig.joint("stretch"),
        "joint, continuous": rig.joint("spin"),
        "line, world to body": Line(origin, L),
        "line, body to world": Line(L, origin),
        "line, body to body": Line(L, R),
        "line, along one branch": Line(B, L),
        "slide, world axis": Slide(L, world_direction(skew), world_point()),
        "slide, world axis and point": Slide(R, world_direction(skew), origin),
        "slide, axis of the base": Slide(L, _direction(rig, "B", 1, 2, 3), B),
        "slide, axis of another branch": Slide(L, _direction(rig, "R", -1, 1, 2), R),
        "slide of a world point in a body": Slide(origin, _direction(rig, "L", 0, 1, 1), L),
        "angle, world to body": Angle(world_direction(skew), _direction(rig, "L", 1, 1, 0)),
        "angle, body to body": Angle(_direction(rig, "R", 1, 0, 2), _direction(rig, "L", 0, 1, -1)),
    }


NAMES = list(_coordinates(load_rig_text(tree())))


def _state(rig: Rig, rng: np.random.Generator) -> tuple[Array, Array]:
    q = pin.integrate(rig.model, pin.neutral(rig.model), rng.uniform(-1.5, 1.5, rig.model.nv))
    return q, rng.uniform(-2, 2, rig.model.nv)


class _Evaluated:
    """One coordinate on its own, evaluated at any state."""

    def __init__(self, rig: Rig, coordinate: Coordinate, biased: bool = False) -> None:
        self.kinematics = Kinematics(rig.model)
        self.set = CoordinateSet(rig.model, [coordinate], int(biased))

    def at(self, q: Array, v: Array) -> tuple[float, Array]:
        self.kinematics.update(q, v)
        self.set.update(self.kinematics, q)
        return float(self.set.x[0]), self.set.rows[0].copy()

    def bias(self, q: Array, v: Array) -> float:
        self.at(q, v)
        return float(self.set.bias(self.kinematics, v)[0])


@pytest.mark.parametrize("name", NAMES)
def test_rows_are_the_gradient_of_x(rig: Rig, name: str, rng: np.random.Generator) -> None:
    evaluated = _Evaluated(rig, _coordinates(rig)[name])
    zero = np.zeros(rig.model.nv)
    for _ in range(5):
        q, _ = _state(rig, rng)
        _, row = evaluated.at(q, zero)
        for k in range(rig.model.nv):
            step = np.zeros(rig.model.nv)
            step[k] = H
            ahead, _ = evaluated.at(pin.integrate(rig.model, q, step), zero)
            behind, _ = evaluated.at(pin.integrate(rig.model, q, -step), zero)
            assert row[k] == pytest.approx((ahead - behind) / (2 * H), abs=NEAR)


@pytest.mark.parametrize("name", [n for n in NAMES if n.startswith(("slide", "angle"))])
def test_bias_is_the_second_derivative_of_x_at_zero_acceleration(rig: Rig, name: str, rng: np.random.Generator) -> None:
    evaluated = _Evaluated(rig, _coordinates(rig)[name], biased=True)
    for _ in range(10):
        q, v = _state(rig, rng)
        # With v constant in the dofs' own frames, q(t) = integrate(q, v t) and d/dt (row . v) is the bias.
        ahead = evaluated.at(pin.integrate(rig.model, q, v * H), v)[1] @ v
        behind = evaluated.at(pin.integrate(rig.model, q, -v * H), v)[1] @ v
        # Second derivatives are up to a hundred times larger than x here.
        assert evaluated.bias(q, v) == pytest.approx((ahead - behind) / (2 * H), abs=100 * NEAR)


def test_bias_of_all_constraint_kinds_together_equals_each_alone(rig: Rig, rng: np.random.Generator) -> None:
    kinds = _coordinates(rig)
    slides = [kinds[n] for n in NAMES if n.startswith("slide")]
    angles = [kinds[n] for n in NAMES if n.startswith("angle")]
    others = [
        kinds["joint, continuous"],
        kinds["line, body to body"],
        Turn(rig.point("L").joint, world_direction((0, 0, 1))),
    ]
    kinematics = Kinematics(rig.model)
    # Forces first, constraints last, as a workspace orders them.
    together = CoordinateSet(rig.model, [*others, *slides, *angles], len(slides) + len(angles))
    q, v = _state(rig, rng)
    kinematics.update(q, v)
    together.update(kinematics, q)
    alone = [_Evaluated(rig, c, biased=True).bias(q, v) for c in [*slides, *angles]]
    # The same products in another order of summation.
    np.testing.assert_allclose(together.bias(kinematics, v), alone, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("base", ["world", "B", "R"])
def test_turn_rows_give_the_relative_angular_velocity(rig: Rig, base: str, rng: np.random.Generator) -> None:
    direction = _direction(rig, "R", 1, -1, 3)
    body, reference = rig.point("L").joint, 0 if base == "world" else rig.point(base).joint
    evaluated = _Evaluated(rig, Turn(body, direction, reference))
    data = rig.model.createData()
    for _ in range(5):
        q, v = _state(rig, rng)
        _, row = evaluated.at(q, v)
        pin.forwardKinematics(rig.model, data, q, v)
        omega = [data.oMi[j].rotation @ data.v[j].angular if j else np.zeros(3) for j in (body, reference)]
        n = data.oMi[direction.joint].rotation @ np.array(direction.vector)
        # Two ways through the same rotations: rounding only.
        assert row @ v == pytest.approx(n @ (omega[0] - omega[1]), rel=1e-12, abs=1e-12)


def test_a_direction_of_a_third_body_gives_the_rate_along_it(rig: Rig, rng: np.random.Generator) -> None:
    # A drilling force along an axis of the feed beam at a point: the row is the point's velocity along that axis.
    direction = _direction(rig, "R", 0, 0, 1)
    evaluated = _Evaluated(rig, Slide(rig.point("L"), direction, world_point()))
    data = rig.model.createData()
    q, v = _state(rig, rng)
    _, row = evaluated.at(q, v)
    pin.forwardKinematics(rig.model, data, q, v)
    L = rig.point("L")
    placement = data.oMi[L.joint]
    velocity = placement.rotation @ (data.v[L.joint].linear + np.cross(data.v[L.joint].angular, L.vector))
    n = data.oMi[direction.joint].rotation @ np.array(direction.vector)
    assert row @ v == pytest.approx(n @ velocity, rel=1e-12, abs=1e-12)


def test_a_continuous_joint_reports_its_angle(rig: Rig) -> None:
    evaluated = _Evaluated(rig, rig.joint("spin"))
    for angle in (-3.0, -1.0, 0.0, 2.5):
        x, _ = evaluated.at(rig.configuration(None, {"spin": angle}), np.zeros(rig.model.nv))
        assert x == pytest.approx(angle, abs=1e-15)


def test_every_coordinate_lands_where_its_position_says(rig: Rig, rng: np.random.Generator) -> None:
    kinds = _coordinates(rig)
    mixed = [kinds[n] for n in rng.permutation(NAMES)]
    kinematics = Kinematics(rig.model)
    together = CoordinateSet(rig.model, mixed)
    q, v = _state(rig, rng)
    kinematics.update(q, v)
    together.update(kinematics, q)
    for given, place in zip(mixed, together.position, strict=True):
        x, row = _Evaluated(rig, given).at(q, v)
        assert together.x[place] == pytest.approx(x, rel=1e-14)
        np.testing.assert_allclose(together.rows[place], row, rtol=1e-13, atol=1e-15)
    assert isinstance(mixed[int(np.flatnonzero(together.position == 0)[0])], JointCoordinate), "joints come first"
