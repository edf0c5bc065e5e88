"""The rig: a tree, points on it, forces and constraints between them. Immutable; every run makes its own workspace."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import pinocchio as pin
from pydantic import BaseModel, ValidationError

from drillrig_pin.constraints import CONSTRAINTS, Constraint, GearPair, Row, gears_of_mimics
from drillrig_pin.coordinates import Gear, JointCoordinate
from drillrig_pin.declarations import DECLARATIONS, Gravity, Lock, Point, Pose
from drillrig_pin.elements.base import Element
from drillrig_pin.elements.friction import JointFriction, friction_of_joints
from drillrig_pin.elements.problems import model_error
from drillrig_pin.elements.registry import FORCES, force_class, plugin_tags
from drillrig_pin.errors import LockedError, ModelError, ScenarioError, Source, legal_names
from drillrig_pin.kinematics import Anchor, Array
from drillrig_pin.locks import locked_positions, without
from drillrig_pin.model.modelfile import ModelFile, read_model, read_model_text
from drillrig_pin.model.nodes import Node
from drillrig_pin.model.problem import Problem
from drillrig_pin.model.tree_text import UNLIMITED
from drillrig_pin.model.urdfcheck import check_urdf
from drillrig_pin.tree import load_tree, massless_joints

T = TypeVar("T")


@dataclass(frozen=True)
class Rig:
    """One design, ready to be simulated.

    Attributes:
        name: the robot's name.
        file: the model file, expanded, with its parameter table.
        model: Pinocchio model; never changed after loading.
        points: named points.
        forces: force elements in file order.
        constraints: holds and loops in file order.
        poses: named configurations.
        sources: file and line of every extension element, by name.
        locked: joints that do not move in this study, and where they stand [rad or m], by name.
    """

    name: str
    file: ModelFile
    model: Any = field(repr=False)
    points: dict[str, Point] = field(repr=False)
    forces: tuple[Element, ...] = field(repr=False)
    constraints: tuple[Constraint, ...] = field(repr=False)
    poses: dict[str, Pose] = field(repr=False)
    sources: dict[str, Source] = field(repr=False)
    locked: dict[str, float] = field(default_factory=dict, repr=False)

    @cached_property
    def joints(self) -> list[str]:
        """Names of the moving joints."""
        return list(self.model.names)[1:]

    @cached_property
    def coordinate_names(self) -> list[str]:
        """A name for every entry of q."""
        return _expand(self.model, "nq", {7: ("x", "y", "z", "qx", "qy", "qz", "qw")})

    @cached_property
    def sliding(self) -> frozenset[str]:
        """Names of the prismatic joints, locked ones too."""
        joints = self.file.root.named("joint")
        return frozenset(j.attributes.get("name", "") for j in joints if j.attributes.get("type") == "prismatic")

    @cached_property
    def endless(self) -> tuple[int, ...]:
        """Entries of q that are angles of continuous joints: they count on over whole turns."""
        kinds = {node.attributes.get("name"): node.attributes.get("type") for node in self.file.root.named("joint")}
        return tuple(i for i, name in enumerate(self.coordinate_names) if kinds.get(name) == "continuous")

    @cached_property
    def dof_names(self) -> list[str]:
        """A name for every entry of v."""
        return _expand(self.model, "nv", {6: ("vx", "vy", "vz", "wx", "wy", "wz")})

    @cached_property
    def rows(self) -> tuple[Row, ...]:
        """All scalar constraint rows, sorted as the coordinates of a run: translations, rotations, gears."""
        rows = [row for constraint in self.constraints for row in constraint.rows(self)]
        return tuple(sorted(rows, key=lambda row: 2 if isinstance(row.coordinate, Gear) else row.unit != "m"))

    @cached_property
    def tracked(self) -> list[str]:
        """Names of the points reported over time."""
        return [name for name, point in self.points.items() if point.track]

    def point(self, name: str) -> Anchor:
        """Anchor of a named point; ModelError with the legal names if there is none."""
        joint, placement = self._placed(name)
        return Anchor(joint, tuple(placement.translation.tolist()))

    def once(self, what: str, make: Callable[[], T]) -> T:
        """Something that follows from the rig alone, made when first asked for and then kept with it."""
        if what not in self._made:
            self._made[what] = make()
        made: T = self._made[what]
        return made

    @cached_property
    def _made(self) -> dict[str, Any]:
        return {}

    def direction(self, point: str, axis: tuple[float, float, float], frame: str) -> Anchor:
        """A direction in the axes of a point ('body') or of the world ('world')."""
        if frame == "world":
            return Anchor(0, axis, 0)
        joint, placement = self._placed(point)
        return Anchor(joint, tuple((placement.rotation @ np.array(axis)).tolist()), 0)

    def joint(self, name: str) -> JointCoordinate:
        """Coordinate of a joint with one dof; ModelError with the legal names otherwise."""
        if not self.model.existJointName(name):
            if name in self.locked:
                raise ModelError(f"joint {name!r} is locked", todo="Leave out the element, or unlock the joint.")
            raise ModelError(f"no moving joint {name!r}", todo=legal_names(name, self.joints, "joints"))
        joint = self.model.joints[self.model.getJointId(name)]
        if joint.nv != 1:
            raise ModelError(f"joint {name!r} has {joint.nv} dofs, not one", todo="Use a spring between points.")
        return JointCoordinate(joint.idx_q, joint.idx_v)

    def slides(self, joint: str) -> bool:
        """True if the position of a joint with one dof is a distance."""
        return "P" in str(self.model.joints[self.model.getJointId(joint)].shortname())

    def limits(self, joint: Any) -> tuple[float, float]:
        """Least and greatest position of a joint of the model with one dof [rad or m]; infinite where it has none."""
        low, high = self.model.lowerPositionLimit[joint.idx_q], self.model.upperPositionLimit[joint.idx_q]
        return (-math.inf if low <= -UNLIMITED else float(low)), (math.inf if high >= UNLIMITED else float(high))

    def configuration(self, pose: str | None = None, positions: Mapping[str, Any] | None = None) -> Array:
        """q of a named pose with some joints given otherwise.

        Raises:
            ScenarioError: unknown pose or joint, or a wrong number of values for a joint.
        """
        q: Array = pin.neutral(self.model)
        given: set[str] = set()
        if pose is not None:
            if pose not in self.poses:
                raise ScenarioError(f"the model has no pose {pose!r}", todo=legal_names(pose, self.poses, "poses"))
            for entry in self.poses[pose].joints:
                # A joint that is given otherwise does not stand where the pose puts it, locked or not.
                if entry.name not in (positions or {}):
                    self._set(q, entry.name, entry.position)
                    given.add(entry.name)
        for name, value in (positions or {}).items():
            self._set(q, name, tuple(np.atleast_1d(np.asarray(value, dtype=float)).tolist()))
            given.add(name)
        return self._followed(q, given)

    def _followed(self, q: Array, given: set[str]) -> Array:
        """q with the followers of gears, unless they are ``given``, where their leaders put them; chains too."""
        gears = [c for c in self.constraints if isinstance(c, GearPair) and c.joint not in given]
        for _ in gears:
            for gear in gears:
                if self.model.existJointName(gear.joint) and self.model.existJointName(gear.mimics):
                    follower, leader = self.joint(gear.joint), self.joint(gear.mimics)
                    q[follower.index_q] = gear.ratio * q[leader.index_q] + gear.offset
        return q

    def _set(self, q: Array, name: str, position: tuple[float, ...]) -> None:
        if name in self.locked:
            if position != (self.locked[name],):
                raise LockedError(
                    f"joint {name!r} is locked at {self.locked[name]:g}",
                    todo="Set the position of its <lock>, or do not lock it.",
                )
            return
        if not self.model.existJointName(name):
            raise ScenarioError(f"no moving joint {name!r}", todo=legal_names(name, self.joints, "joints"))
        joint = self.model.joints[self.model.getJointId(name)]
        if len(position) != joint.nq:
            how = "Give its position alone: an angle [rad] (no cosine and sine), or a distance [m]."
            raise ScenarioError(
                f"joint {name!r} takes {joint.nq} values, not {len(position)}",
                todo=how if joint.nq == 1 else "Give x y z [m] and the quaternion qx qy qz qw.",
            )
        if joint.nq == 7:
            length = math.hypot(*position[3:])
            if length == 0:
                raise ScenarioError(f"joint {name!r}: the quaternion is zero")
            position = (*position[:3], *(c / length for c in position[3:]))
        q[joint.idx_q : joint.idx_q + joint.nq] = position

    def _placed(self, name: str) -> tuple[int, Any]:
        """Joint that carries a point, and the point's frame in the joint's."""
        placed: tuple[int, Any] = self.once(f"point {name}", lambda: self._place(name))
        return placed

    def _place(self, name: str) -> tuple[int, Any]:
        if name not in self.points:
            raise ModelError(f"no point {name!r}", todo=legal_names(name, self.points, "points"))
        point = self.points[name]
        if not self.model.existBodyName(point.link):
            links = [f.name for f in self.model.frames if f.type == pin.FrameType.BODY]
            raise ModelError(
                f"point {name!r}: no link {point.link!r}",
                where=self.sources.get(name),
                todo=legal_names(point.link, links, "links"),
            )
        frame = self.model.frames[self.model.getBodyId(point.link)]
        local = pin.SE3(pin.rpy.rpyToMatrix(*point.rpy), np.array(point.xyz))
        return frame.parentJoint, frame.placement * local


def load_rig(
    path_or_name: str | Path,
    *,
    elements: Iterable[Element] = (),
    packages: Mapping[str, str | Path] | None = None,
    **arguments: Any,
) -> Rig:
    """Load a model file, or a shipped model by name.

    Args:
        path_or_name: ``mkz49``, or the path of a ``.xacro`` or ``.urdf`` file.
        elements: further force elements made in Python.
        packages: folders of packages that the model names as ``$(find NAME)``, by name, where they are not found
            upwards from the file, in ROS_PACKAGE_PATH or in AMENT_PREFIX_PATH.
        **arguments: xacro arguments, e.g. ``boom_length=2.1``.

    Raises:
        ModelError: the first thing wrong with the file; ``drillrig check`` lists all.
    """
    return build_rig(read_model(path_or_name, arguments, packages), elements)


def load_rig_text(text: str, name: str = "<text>", *, elements: Iterable[Element] = ()) -> Rig:
    """Load a model from URDF text, e.g. the expanded model kept in a result file."""
    return build_rig(read_model_text(text, name), elements)


def build_rig(file: ModelFile, elements: Iterable[Element] = ()) -> Rig:
    """Make a rig of a model file that was read; raises the first error found."""
    for problem in check_urdf(file.root):
        if problem.severity == "error":
            raise ModelError(problem.message, where=problem.source, todo=problem.advice)
    rig, problems = assemble_rig(file, elements)
    for problem in problems:
        raise ModelError(problem.message, where=problem.source, todo=problem.advice)
    return rig


def assemble_rig(file: ModelFile, elements: Iterable[Element] = ()) -> tuple[Rig, list[Problem]]:
    """Build a rig of whatever is usable, and list what is not. The URDF part must be sound."""
    parsed, sources, problems = parse_elements(file)
    problems += _read_joints(file, parsed, sources)
    for element in elements:
        if element.name in sources:
            raise ModelError(f"{element.name!r} is already defined", where=sources[element.name], todo="Rename one.")
        parsed.append(element)
    points = {item.name: item for item in parsed if isinstance(item, Point)}
    gravity = next((item.xyz for item in parsed if isinstance(item, Gravity)), (0.0, 0.0, -9.81))
    poses = {item.name: item for item in parsed if isinstance(item, Pose)}
    tree = load_tree(file)
    nodes = [node.source for node in file.elements() if node.tag == Lock.tag]
    locks = [item for item in parsed if isinstance(item, Lock)]
    try:
        placed = zip(locks, nodes if len(nodes) == len(locks) else [Source(file.path)] * len(locks), strict=True)
        locked = locked_positions(tree, placed, next(iter(poses.values()), None))
    except ModelError as error:
        where = error.where if isinstance(error.where, Source) else Source(file.path)
        problems.append(Problem("error", error.what, where, error.todo))
        locked = {}
    parsed = [item for item in parsed if not _idle(item, sources, locked)]
    rig = Rig(
        file.name,
        file,
        _moving(without(tree, locked), file, gravity),
        points,
        tuple(item for item in parsed if isinstance(item, Element)),
        tuple(item for item in parsed if isinstance(item, Constraint)),
        poses,
        sources,
        locked,
    )
    problems += massless_joints(rig.model, file)
    return _resolvable(rig, problems)


def _read_joints(file: ModelFile, parsed: list[BaseModel], sources: dict[str, Source]) -> list[Problem]:
    """Add what <dynamics> and <mimic> of the joints say; problems where it cannot be."""
    problems = []
    try:
        found: list[tuple[Element | Constraint, Node]] = [*friction_of_joints(file.root), *gears_of_mimics(file.root)]
        for element, node in found:
            if element.name in sources:
                raise ModelError(f"{element.name!r} is already defined at {sources[element.name]}", where=node.source)
            fault = element.fault()
            if fault:
                raise ModelError(f"<{node.tag}> of {element.name!r}: {fault}", where=node.source)
            parsed.append(element)
            sources[element.name] = node.source
    except ModelError as error:
        where = error.where if isinstance(error.where, Source) else Source(file.path)
        problems.append(Problem("error", error.what, where, error.todo))
    return problems


def parse_elements(file: ModelFile) -> tuple[list[BaseModel], dict[str, Source], list[Problem]]:
    """Read every extension element on its own: what could be read, where each name stands, and what is wrong."""
    problems: list[Problem] = []
    parsed: list[BaseModel] = []
    sources: dict[str, Source] = {}
    for node in file.elements():
        try:
            item = _element(node)
            name = getattr(item, "name", None)
            if name is not None and node.tag != "parameter":
                if name in sources:
                    raise ModelError(f"{name!r} is already defined at {sources[name]}", where=node.source)
                sources[name] = node.source
            parsed.append(item)
        except ModelError as error:
            where = error.where if isinstance(error.where, Source) else node.source
            problems.append(Problem("error", error.what, where, error.todo))
    return parsed, sources, problems


def _element(node: Node) -> BaseModel:
    cls = DECLARATIONS.get(node.tag) or CONSTRAINTS.get(node.tag) or force_class(node.tag)
    if cls is None:
        legal = [*DECLARATIONS, *CONSTRAINTS, *FORCES, *plugin_tags()]
        advice = legal_names(node.tag, legal, "elements")
        raise ModelError(f"unknown element <{node.tag}>", where=node.source, todo=advice)
    try:
        item = cls.from_node(node)
    except ValidationError as error:
        raise model_error(error, cls, node) from None
    fault = item.fault() if isinstance(item, Element | Constraint) else None
    if fault:
        raise ModelError(f"<{node.tag} {node.attributes.get('name', '')!r}>: {fault}", where=node.source)
    return item


def _idle(item: BaseModel, sources: dict[str, Source], locked: dict[str, float]) -> bool:
    """Whether locks leave nothing to do: to the friction of a joint's own <dynamics>, or to a gear that fits them."""
    if isinstance(item, GearPair) and item.joint in locked and item.mimics in locked:
        return math.isclose(locked[item.joint], item.ratio * locked[item.mimics] + item.offset, abs_tol=1e-9)
    own = isinstance(item, JointFriction) and item.name == f"{item.joint}.friction" and item.name in sources
    return own and getattr(item, "joint", "") in locked


def _moving(model: Any, file: ModelFile, gravity: tuple[float, float, float]) -> Any:
    if model.nv == 0:
        raise ModelError("the model has no moving joint", where=file.path, todo="Nothing of it could vibrate.")
    model.gravity.linear = np.array(gravity)
    return model


def _resolvable(rig: Rig, problems: list[Problem]) -> tuple[Rig, list[Problem]]:
    """Drop what names points or joints that do not exist, one problem each."""

    def usable(item: Any) -> bool:
        try:
            if isinstance(item, Element):
                item.coordinate(rig)
            elif isinstance(item, Constraint):
                list(item.rows(rig))
            elif isinstance(item, Point):
                rig.point(item.name)
            else:
                rig.configuration(item.name)
        except LockedError:
            # A machine locked at work may have other poses; one that contradicts is refused where it is used.
            return True
        except (ModelError, ScenarioError) as error:
            source = rig.sources.get(item.name, Source(rig.file.path))
            problems.append(Problem("error", f"<{item.tag} {item.name!r}>: {error.what}", source, error.todo))
            return False
        return True

    points = {name: point for name, point in rig.points.items() if usable(point)}
    forces = tuple(filter(usable, rig.forces))
    constraints = tuple(filter(usable, rig.constraints))
    poses = {name: pose for name, pose in rig.poses.items() if usable(pose)}
    return Rig(rig.name, rig.file, rig.model, points, forces, constraints, poses, rig.sources, rig.locked), problems


def _expand(model: Any, count: str, suffixes: dict[int, tuple[str, ...]]) -> list[str]:
    names: list[str] = []
    for name, joint in zip(list(model.names)[1:], list(model.joints)[1:], strict=True):
        n = getattr(joint, count)
        names += [name] if n == 1 else [f"{name}.{s}" for s in suffixes[n]]
    return names
