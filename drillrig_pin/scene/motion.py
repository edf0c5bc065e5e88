"""The poses that are drawn: the mean pose, and deviations from it made as large as the eye needs.

Deviations are multiplied in the coordinates of the joints, q_drawn = q_mean + k (q - q_mean), so that links stay joined
whatever the factor. Where that opens a loop or lifts a held point off its axes by more than a hair, the pose is put
back onto the constraints by Gauss-Newton steps.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin

from drillrig_pin.coordinates import Gear, Line, Slide
from drillrig_pin.errors import DrillrigError
from drillrig_pin.kinematics import Anchor, Array, anchor_matrix, velocity_map_is_identity
from drillrig_pin.rig import Rig
from drillrig_pin.scene.options import Auto, round_down
from drillrig_pin.tree_data import make_data
from drillrig_pin.workspace import Workspace

#: ``auto`` makes the largest deviation this part of the machine's size.
VISIBLE = 0.05
#: A drawn deviation larger than this part of the machine's size no longer shows the machine.
LARGEST = 0.3
#: Largest turn of a joint that is drawn [rad].
LARGEST_TURN = 0.6
#: A constraint may be drawn open by this part of the machine's size.
OPEN = 1.5e-3
ITERATIONS = 4
#: Poses looked at to find the largest deviation.
LOOKED_AT = 1500


@dataclass(frozen=True, slots=True)
class Poses:
    """A run of configurations.

    Attributes:
        q: configurations (frames, nq).
        axes: world axes of every joint as rows, then its origin, (frames, 4 njoints, 3).
    """

    q: Array
    axes: Array

    def world(self, model: Any, anchors: list[Anchor]) -> Array:
        """World coordinates of anchors, (frames, anchors, 3)."""
        return np.asarray(anchor_matrix(model, anchors) @ self.axes)

    def rotation(self, joint: int) -> Array:
        """World axes of a joint as rows, (frames, 3, 3): it turns world vectors into the joint's frame."""
        return self.axes[:, 4 * joint : 4 * joint + 3]

    def origin(self, joint: int) -> Array:
        """World origin of a joint, (frames, 3)."""
        return self.axes[:, 4 * joint + 3]


@dataclass(frozen=True, slots=True)
class Exaggeration:
    """What was done to the deviations.

    Attributes:
        factor: by which they are multiplied.
        asked: the factor asked for, if it was too large to be drawn.
        largest: largest deviation of a joint or point from its mean position [m], true scale.
    """

    factor: float
    asked: float | None
    largest: float


class Posing:
    """Mean pose of a run, and its poses at any exaggeration.

    Args:
        rig: the machine.
        steady: configurations (n, nq) whose mean counts.
        shown: configurations (frames, nq) to be drawn.
        extent: the machine's size where its shapes are not known from its points [m].
    """

    def __init__(self, rig: Rig, steady: Array, shown: Array) -> None:
        self.rig = rig
        self._model = rig.model
        self._identity = velocity_map_is_identity(rig.model)
        self.mean = self._mean(steady)
        self._deviation = self._difference(shown)
        self._space = Workspace(rig, ()) if rig.rows else None
        self._goal = self._rows_at(shown[0])
        self._anchors = looked_at(rig)
        self.size = self._size()

    def exaggeration(self, factor: float | Auto) -> Exaggeration:
        """The factor to draw with: ``auto`` from the largest deviation, a given one bounded."""
        every = max(1, len(self._deviation) // LOOKED_AT)
        true = self._poses(self._integrated(self._deviation[::every]))
        home = self._poses(self.mean[None])
        distance = np.linalg.norm(
            true.world(self._model, self._anchors) - home.world(self._model, self._anchors), axis=2
        )
        largest = float(distance.max(initial=0.0))
        turn = float(np.abs(self._deviation[:, self._turning()]).max(initial=0.0))
        bounds = [LARGEST * self.size / largest if largest > 0 else np.inf, LARGEST_TURN / turn if turn > 0 else np.inf]
        bound = max(1.0, float(min(bounds)))
        if factor == "auto":
            wanted = VISIBLE * self.size / largest if largest > 1e-12 else 1.0
            return Exaggeration(min(round_down(wanted), bound) if wanted > 1 else 1.0, None, largest)
        if factor > bound:
            return Exaggeration(round_down(bound), factor, largest)
        return Exaggeration(float(factor), None, largest)

    def drawn(self, factor: float) -> Poses:
        """All frames with their deviations multiplied."""
        poses = self._poses(self._integrated(factor * self._deviation))
        return poses if factor == 1.0 else self._closed(poses)

    def home(self) -> Poses:
        """The mean pose as the only frame."""
        return self._poses(self.mean[None])

    def _mean(self, q: Array) -> Array:
        if self._identity:
            return np.asarray(q.mean(axis=0))
        first = q[0]
        rows = q[:: max(1, len(q) // LOOKED_AT)]
        moved = np.mean([pin.difference(self._model, first, row) for row in rows], axis=0)
        return np.asarray(pin.integrate(self._model, first, moved))

    def _difference(self, q: Array) -> Array:
        if self._identity:
            return q - self.mean
        return np.array([pin.difference(self._model, self.mean, row) for row in q])

    def _integrated(self, deviation: Array) -> Array:
        if self._identity:
            return self.mean + deviation
        return np.array([pin.integrate(self._model, self.mean, row) for row in deviation])

    def _turning(self) -> Array:
        """Which dofs are angles."""
        turning = np.zeros(self._model.nv, dtype=bool)
        for joint in list(self._model.joints)[1:]:
            start = joint.idx_v
            if joint.nv == 6:
                turning[start + 3 : start + 6] = True
            else:
                turning[start] = not joint.shortname().startswith("JointModelP")
        return turning

    def _size(self) -> float:
        points = self.home().world(self._model, self._anchors)[0]
        return max(float(np.linalg.norm(np.ptp(points, axis=0))), 1e-3)

    def _rows_at(self, q: Array) -> Array:
        if self._space is None:
            return np.zeros(0)
        self._space.update(q, np.zeros(self._model.nv))
        return self._space.x_constraint.copy()

    def _poses(self, q: Array) -> Poses:
        data = make_data(self._model)
        axes = np.empty((len(q), 4 * self._model.njoints, 3))
        for i, row in enumerate(q):
            pin.forwardKinematics(self._model, data, row)
            for joint, placement in enumerate(data.oMi):
                axes[i, 4 * joint : 4 * joint + 3] = placement.rotation.T
                axes[i, 4 * joint + 3] = placement.translation
        return Poses(q, axes)

    def _closed(self, poses: Poses) -> Poses:
        """The same poses, put back onto the constraints where these would be drawn open."""
        space, zero, slack = self._space, np.zeros(self._model.nv), OPEN * self.size
        if space is None:
            return poses
        for i in np.flatnonzero(self._open_by(poses) > slack):
            q = poses.q[i]
            for _ in range(ITERATIONS):
                space.update(q, zero)
                open_by = space.x_constraint - self._goal
                if float(np.abs(open_by).max()) < slack or not np.isfinite(space.J).all():
                    break
                q = pin.integrate(self._model, q, -np.linalg.lstsq(space.J, open_by, rcond=1e-6)[0])
            space.update(q, zero)
            poses.q[i], poses.axes[i] = q, space.kinematics.frames
        return poses

    def _open_by(self, poses: Poses) -> Array:
        """Largest violation of a constraint in every pose, (frames) [m or 1]."""
        values = []
        for row in self.rig.rows:
            c = row.coordinate
            if isinstance(c, Slide):
                point, origin, direction = poses.world(self._model, [c.point, c.origin, c.direction]).transpose(1, 0, 2)
                values.append(np.vecdot(direction, point - origin))
            elif isinstance(c, Gear):
                values.append(poses.q[:, c.follower.index_q] - c.ratio * poses.q[:, c.leader.index_q])
            else:
                values.append(np.vecdot(*poses.world(self._model, [c.base, c.moving]).transpose(1, 0, 2)))
        return np.asarray(np.abs(np.stack(values, axis=1) - self._goal).max(axis=1))


def looked_at(rig: Rig) -> list[Anchor]:
    """Points that tell how far the machine moves and how large it is: joints, links, named points, pins."""
    model = rig.model
    anchors = [Anchor(joint, (0.0, 0.0, 0.0)) for joint in range(1, model.njoints)]
    for frame in model.frames:
        if frame.type == pin.FrameType.BODY and frame.parentJoint:
            anchors.append(Anchor(frame.parentJoint, tuple(frame.placement.translation.tolist())))
    for joint in range(1, model.njoints):
        inertia = model.inertias[joint]
        if inertia.mass > 0:
            anchors.append(Anchor(joint, tuple(inertia.lever.tolist())))
    anchors += [rig.point(name) for name in rig.points]
    for element in rig.forces:
        try:
            coordinate = element.coordinate(rig)
        except DrillrigError:
            continue
        if isinstance(coordinate, Line):
            anchors += [coordinate.start, coordinate.end]
    return anchors
