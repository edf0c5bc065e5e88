"""Turn a hole on the rock face into a pose: inverse kinematics within joint limits and strokes.

Unknowns are the positions of the joints that are free to aim. With p the tip, a the feed axis, both in the world, h the
hole and n its direction:

    p(q) = h,    a(q) = n,    lower <= q <= upper,    shortest <= x_c(q) <= longest for every cylinder c
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any, Self

import numpy as np
import pinocchio as pin
from pydantic import BaseModel, ConfigDict, Field, model_validator

from drillrig_pin.elements.contact import Contact
from drillrig_pin.elements.cylinder import Cylinder
from drillrig_pin.errors import AssemblyError, ScenarioError, legal_names
from drillrig_pin.finite import require_finite
from drillrig_pin.kinematics import Array, anchor_matrix
from drillrig_pin.rig import Rig
from drillrig_pin.workspace import Workspace

#: A hole is reached when tip and axis are nearer than this [m, and m at one metre along the axis].
REACHED = 1e-9
#: A cylinder keeps this share of its stroke from either end: at the very end it has no oil column to speak of.
CLEARANCE = 1e-3
#: Starts of the search when that from the pose fails: middle of the limits, then random ones, always the same.
FURTHER_STARTS = 8

Vector = tuple[float, float, float]


class Hole(BaseModel):
    """One hole: a position on the face, or a named pose of the machine taken as it is."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    at: Vector | None = Field(None, description="position of the hole on the face in the world [m]")
    pose: str | None = Field(None, description="pose of the model that drills it, instead of a position")
    pitch: float = Field(0.0, description="direction turned upwards [deg]", gt=-90, lt=90)
    yaw: float = Field(0.0, description="direction turned to the left, seen from above [deg]", gt=-180, le=180)
    source: str = Field("", description="where the position comes from; 'assumed: ...' marks it wherever it is shown")

    @model_validator(mode="after")
    def _one_of_both(self) -> Self:
        if (self.at is None) == (self.pose is None):
            raise ValueError("a hole has either at: [x, y, z] or pose: NAME")
        if self.pose is not None and (self.pitch or self.yaw):
            raise ValueError("a hole given by its pose takes no pitch or yaw")
        return self


class Aim(BaseModel):
    """How a machine is aimed at holes."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    point: str | None = Field(None, description="the tip; none: the point of the first contact")
    axis: Vector = Field((0.0, 0.0, 1.0), description="feed axis in the axes of that point")
    direction: Vector | None = Field(None, description="drilling direction in the world; none: axis of that contact")
    fixed: Annotated[tuple[str, ...], Field(description="joints that keep their position")] = ()
    pose: str | None = Field(None, description="pose the search starts from; none: the first one")


class UnreachableError(AssemblyError):
    """No pose within the limits of the machine drills the hole."""


@dataclass(frozen=True)
class Aimed:
    """A pose that drills a hole.

    Attributes:
        positions: by joint, as a scenario takes them [rad, m].
        tip: position of the tip [m].
        axis: feed axis, unit vector in the world.
        error: what is left of |p - h| and |a - n|, the larger.
    """

    positions: dict[str, float | list[float]]
    tip: Vector
    axis: Vector
    error: float


def aim_at(rig: Rig, hole: Hole, aim: Aim | None = None) -> Aimed:
    """The pose that drills a hole.

    Args:
        rig: the machine.
        hole: where, and at which angle.
        aim: tip, feed axis, drilling direction, fixed joints.

    Raises:
        UnreachableError: the hole lies out of reach; says how far, and the limits the machine stands at.
        ScenarioError: unknown joint, point or pose; no contact to take the tip from.
    """
    search = _Search(rig, aim or Aim())
    if hole.pose is not None:
        return search.aimed(rig.configuration(hole.pose), None)
    assert hole.at is not None
    goal = np.array(hole.at), turned(search.direction, hole.pitch, hole.yaw)
    best = None
    for start in search.starts():
        step, size = search.from_(start, *goal)
        if best is None or size < best[2] - REACHED:
            best = start, step, size
        if size < REACHED:
            break
    assert best is not None
    start, step, _ = best
    if best[2] >= REACHED:
        raise search.unreachable(start, step, *goal)
    return search.aimed(search.moved(start, step), goal)


def turned(direction: Array, pitch: float, yaw: float) -> Array:
    """A direction turned upwards and to the left by angles in degrees, seen along it; unit vector."""
    n = direction / np.linalg.norm(direction)
    if _vertical(n):
        if pitch or yaw:
            raise ScenarioError("a vertical drilling direction has no pitch or yaw", todo="Give direction instead.")
        return n
    left, up = across(n)
    p, y = math.radians(pitch), math.radians(yaw)
    return math.cos(p) * (math.cos(y) * n + math.sin(y) * left) + math.sin(p) * up


def across(direction: Array) -> tuple[Array, Array]:
    """Unit vectors to the left and up, seen along a direction; along a vertical one +y is left."""
    n = direction / np.linalg.norm(direction)
    left = np.array([0.0, 1.0, 0.0]) if _vertical(n) else np.cross([0.0, 0.0, 1.0], n)
    left = left / np.linalg.norm(left)
    return left, np.cross(n, left)


def _vertical(n: Array) -> bool:
    return bool(np.linalg.norm(np.cross([0.0, 0.0, 1.0], n)) < 1e-9)


class _Search:
    """Residuals of one rig over the steps of its free dofs."""

    def __init__(self, rig: Rig, aim: Aim) -> None:
        self.rig, self.space = rig, Workspace(rig, rig.forces)
        contact = next((e for e in rig.forces if isinstance(e, Contact)), None)
        if contact is None and (aim.point is None or aim.direction is None):
            raise ScenarioError(
                "the model has no contact that tells where its tip is", todo="Give point and direction."
            )
        self.point = aim.point or contact.point  # type: ignore[union-attr]
        self.direction = np.array(aim.direction or contact.axis, dtype=float)  # type: ignore[union-attr]
        if not self.direction.any() or not any(aim.axis):
            raise ScenarioError("a direction of length zero", todo="Give a direction such as [1, 0, 0].")
        axis = np.array(aim.axis) / np.linalg.norm(aim.axis)
        anchors = [rig.point(self.point), rig.direction(self.point, tuple(axis.tolist()), "body")]
        self.anchors = anchor_matrix(rig.model, anchors)
        for name in aim.fixed:
            # What is locked is fixed already.
            if name not in rig.joints and name not in rig.locked:
                raise ScenarioError(f"no moving joint {name!r}", todo=legal_names(name, rig.joints, "joints"))
        self.free = [
            i
            for name, joint in self._joints()
            if name not in aim.fixed
            for i in range(joint.idx_v, joint.idx_v + joint.nv)
        ]
        self.pose = rig.configuration(aim.pose or next(iter(rig.poses), None))
        self.cylinders = [
            (element, index)
            for element, index in zip(self.space.forces, self.space.index, strict=True)
            if isinstance(element, Cylinder)
        ]
        self.still = np.zeros(rig.model.nv)

    def _joints(self) -> Iterator[tuple[str, Any]]:
        return zip(self.rig.joints, list(self.rig.model.joints)[1:], strict=True)

    def starts(self) -> Iterator[Array]:
        """The pose, the middle of the limits, then random configurations between them."""
        yield self.pose
        random = np.random.default_rng(0)
        for i in range(FURTHER_STARTS):
            step = self.still.copy()
            lower, upper = self.bounds(self.pose)
            within = np.isfinite(lower) & np.isfinite(upper)
            share = np.full(len(lower), 0.5) if i == 0 else random.uniform(size=len(lower))
            step[np.array(self.free)[within]] = (lower + share * (upper - lower))[within]
            yield pin.integrate(self.rig.model, self.pose, step)

    def bounds(self, q: Array) -> tuple[Array, Array]:
        """Least and greatest step of every free dof from q; infinite for joints without a scalar position."""
        lower, upper = np.full(self.rig.model.nv, -np.inf), np.full(self.rig.model.nv, np.inf)
        for _, joint in self._joints():
            if joint.nq == joint.nv == 1:
                at, (low, high) = q[joint.idx_q], self.rig.limits(joint)
                lower[joint.idx_v], upper[joint.idx_v] = low - at, high - at
        return lower[self.free], upper[self.free]

    def moved(self, q: Array, step: Array) -> Array:
        """q after a step of the free dofs."""
        whole = self.still.copy()
        whole[self.free] = step
        moved: Array = pin.integrate(self.rig.model, q, whole)
        return moved

    def place(self, q: Array) -> tuple[Array, Array]:
        """Tip and feed axis in the world."""
        self.space.update(q, self.still)
        tip, axis = self.anchors @ self.space.kinematics.frames
        return tip, axis

    def overrun(self, share: float = CLEARANCE) -> Array:
        """How far every cylinder is outside its stroke at the last placed state [m], negative when short."""
        found = []
        for cylinder, index in self.cylinders:
            (shortest, longest), margin = cylinder.length_range, share * cylinder.stroke
            length = float(self.space.x[index])
            found.append(min(0.0, length - shortest - margin) + max(0.0, length - longest + margin))
        return np.array(found)

    def residual(self, q: Array, step: Array, hole: Array, direction: Array) -> Array:
        """What has to vanish: tip [m], axis [m at one metre], cylinders outside their strokes [m]."""
        tip, axis = self.place(self.moved(q, step))
        return np.concatenate([tip - hole, axis - direction, self.overrun()])

    def from_(self, q: Array, hole: Array, direction: Array) -> tuple[Array, float]:
        """The best step from q and the largest residual it leaves."""
        from scipy.optimize import least_squares

        lower, upper = self.bounds(q)
        inside = np.clip(np.zeros(len(lower)), lower + 1e-9, upper - 1e-9)
        require_finite(self.residual(q, inside, hole, direction))
        found = least_squares(
            lambda step: self.residual(q, step, hole, direction),
            inside,
            bounds=(lower, upper),
            jac="3-point",
            xtol=1e-15,
            ftol=1e-15,
            gtol=1e-15,
            max_nfev=200,
        )
        return found.x, float(np.abs(found.fun).max())

    def aimed(self, q: Array, goal: tuple[Array, Array] | None) -> Aimed:
        """The pose as a result."""
        tip, axis = self.place(q)
        error = 0.0 if goal is None else max(float(np.abs(tip - goal[0]).max()), float(np.abs(axis - goal[1]).max()))
        positions: dict[str, float | list[float]] = {}
        for name, joint in self._joints():
            values = q[joint.idx_q : joint.idx_q + joint.nq].tolist()
            positions[name] = values[0] if joint.nq == 1 else values
        return Aimed(positions, tuple(tip.tolist()), tuple(axis.tolist()), error)

    def unreachable(self, q: Array, step: Array, hole: Array, direction: Array) -> UnreachableError:
        """Says how far the best pose is from the hole and which limits it stands at."""
        lower, upper = self.bounds(q)
        end = self.moved(q, step)
        tip, axis = self.place(end)
        limits = []
        for k, i in enumerate(self.free):
            for bound, word in ((lower[k], "lower"), (upper[k], "upper")):
                if abs(step[k] - bound) < 1e-6:
                    name, joint = next((n, j) for n, j in self._joints() if j.idx_v == i)
                    prismatic = "P" in joint.shortname()
                    at = float(end[joint.idx_q])
                    told = f"{at:.4g} m" if prismatic else f"{math.degrees(at):.4g} deg"
                    limits.append(f"{name} stands at its {word} limit of {told}")
        for (cylinder, _), overrun in zip(self.cylinders, self.overrun(2 * CLEARANCE), strict=True):
            if overrun:
                shortest, longest = cylinder.length_range
                end_ = f"longest, {longest:.4g} m" if overrun > 0 else f"shortest, {shortest:.4g} m"
                limits.append(f"{cylinder.name} stands at its {end_}")
        off = float(np.linalg.norm(tip - hole))
        angle = math.degrees(math.acos(float(np.clip(axis @ direction, -1, 1))))
        return UnreachableError(
            f"the tip stays {off:.3g} m and the feed {angle:.3g} deg off; "
            + ("; ".join(limits) if limits else "no limit is met, the arm is too short or has too few joints"),
            where=f"hole at ({', '.join(f'{x:.4g}' for x in hole)})",
        )
