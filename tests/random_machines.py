"""Random small machines with every registered force element, under any names, in any order, anywhere in the world."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pinocchio as pin
from hypothesis import strategies as st
from rigs import joint, link, point, robot

from drillrig_pin import Rig, load_rig_text
from drillrig_pin.elements.registry import FORCES
from drillrig_pin.kinematics import Array
from drillrig_pin.workspace import Workspace

#: Tag, attributes, text inside.
Written = tuple[str, dict[str, Any], str]
KINDS = ("revolute", "prismatic", "continuous", "floating")


@dataclass(frozen=True)
class Body:
    """A link and the joint it hangs on; ``parent`` -1 is the world."""

    kind: str
    parent: int
    xyz: Array
    rpy: Array
    axis: Array
    mass: float
    com: Array
    moments: Array


@dataclass(frozen=True)
class Place:
    """A point on body ``on``; -1 is the world."""

    on: int
    xyz: Array
    rpy: Array


@dataclass(frozen=True)
class Held:
    """World axes a point is held on, and where: its position in the world, or None for where it starts."""

    axes: tuple[int, ...]
    at: Array | None

    def moved(self, move: pin.SE3) -> tuple[str, str]:
        """Axes and target after a move of the world, which must take held axes to axes."""
        turned = np.abs(move.rotation[:, list(self.axes)])
        axes = [0, 1, 2] if len(self.axes) == 3 else [int(np.argmax(column)) for column in turned.T]
        words = " ".join("xyz"[axis] for axis in axes)
        if self.at is None:
            return words, "initial"
        return words, _text((move * self.at)[axes])


@dataclass(frozen=True)
class Machine:
    """What a model file says, without its names.

    Attributes:
        bodies, places: the tree and the points on it.
        elements: tag, attributes and text inside; ``{p3}`` and ``{j2}`` stand for names of points and joints, a
            direction in the world is an array, what a hold holds is a :class:`Held`.
        gravity: in the world [m/s^2].
    """

    bodies: tuple[Body, ...]
    places: tuple[Place, ...]
    elements: tuple[Written, ...] = ()
    gravity: Sequence[float] = (0.0, 0.0, -9.81)

    def rig(
        self, name: Callable[[str], str] = str, mixed: np.random.Generator | None = None, move: pin.SE3 | None = None
    ) -> Rig:
        """Load it with every name changed, everything in the file in another order, and the whole world moved."""
        move = move or pin.SE3.Identity()
        named = {f"p{i}": name(f"p{i}") for i in range(len(self.places))}
        named |= {f"j{i}": name(f"j{i}") for i in range(len(self.bodies))}
        parts = []
        for i, body in enumerate(self.bodies):
            xyz, rpy = self._placed(body.parent, body.xyz, body.rpy, move)
            parent = "world" if body.parent < 0 else name(f"b{body.parent}")
            parts.append(link(name(f"b{i}"), body.mass, body.com, body.moments.tolist()))
            parts.append(joint(named[f"j{i}"], body.kind, parent, name(f"b{i}"), xyz, body.axis, rpy))
        extension = [f'<gravity xyz="{_text(move.rotation @ np.asarray(self.gravity))}"/>']
        for i, place in enumerate(self.places):
            xyz, rpy = self._placed(place.on, place.xyz, place.rpy, move)
            extension.append(point(named[f"p{i}"], "world" if place.on < 0 else name(f"b{place.on}"), xyz, rpy))
        for i, (tag, attributes, inside) in enumerate(self.elements):
            words: dict[str, str] = {}
            for key, value in attributes.items():
                if isinstance(value, Held):
                    words["axes"], words["target"] = value.moved(move)
                else:
                    turned = isinstance(value, np.ndarray)
                    words[key] = _text(move.rotation @ value) if turned else str(value).format(**named)
            written = " ".join(f'{key}="{value}"' for key, value in words.items())
            extension.append(f'<{tag} name="{name(f"e{i}")}" {written}>{inside}</{tag}>\n')
        if mixed is not None:
            mixed.shuffle(parts)
            mixed.shuffle(extension)
        return load_rig_text(robot(*parts, extension="".join(extension)))

    @staticmethod
    def _placed(on: int, xyz: Array, rpy: Array, move: pin.SE3) -> tuple[Array, Array]:
        if on >= 0:
            return xyz, rpy
        placement = move * pin.SE3(pin.rpy.rpyToMatrix(*rpy), xyz)
        return placement.translation, pin.rpy.matrixToRpy(placement.rotation)


def _text(vector: Array) -> str:
    return " ".join(repr(float(component)) for component in vector)


@st.composite
def machines(draw: Any, closed: bool = False, held: bool = False) -> Machine:
    """A tree of one to four bodies that carries one element of every registered class.

    Args:
        draw: given by hypothesis.
        closed: with a loop.
        held: on a floating base, a point of which is held on one, two or three world axes.
    """
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    count = draw(st.integers(2 if held else 1, 4))
    bodies = []
    for i in range(count):
        kind = "floating" if held and i == 0 else draw(st.sampled_from(KINDS if i == 0 else KINDS[:3]))
        bodies.append(
            Body(
                kind,
                -1 if held and i == 0 else draw(st.integers(-1, i - 1)),
                rng.uniform(-0.5, 0.5, 3),
                rng.uniform(-1, 1, 3),
                _unit(rng),
                float(rng.uniform(1, 3)),
                rng.uniform(-0.2, 0.2, 3),
                rng.uniform(0.2, 0.3, 3),
            )
        )
    if all(body.kind == "floating" for body in bodies):
        # Joint springs and torques need a joint with one dof.
        bodies[0] = replace(bodies[0], kind="revolute")
    places = [Place(on, rng.uniform(-0.5, 0.5, 3), rng.uniform(-1, 1, 3)) for on in (-1, *range(count))]
    if held:
        places.insert(1, Place(0, rng.uniform(-0.5, 0.5, 3), rng.uniform(-1, 1, 3)))
    bare = Machine(tuple(bodies), tuple(places))
    rig = bare.rig()
    at = _positions(rig, len(places))
    if closed:
        # A point of the world exactly where the last point is: the machine is assembled as it stands.
        places.append(Place(-1, at[-1], rng.uniform(-1, 1, 3)))
    simple = [i for i, body in enumerate(bodies) if body.kind != "floating"]
    elements = _elements(draw, rng, simple, at)
    if closed:
        elements.append(
            ("loop", {"from": f"{{p{len(places) - 1}}}", "to": f"{{p{len(places) - 2}}}", "translations": "x"}, "")
        )
    if held:
        axes = draw(st.sampled_from([(0,), (2,), (1, 2), (2, 0), (0, 1, 2)]))
        elements.append(("hold", {"point": "{p1}", "held": Held(axes, draw(st.sampled_from([None, at[1]])))}, ""))
    return Machine(tuple(bodies), tuple(places), tuple(elements))


def _positions(rig: Rig, count: int) -> Array:
    space = Workspace(rig, rig.forces)
    space.update(rig.configuration(), np.zeros(rig.model.nv))
    every = dict(zip(rig.tracked, space.points(), strict=True))
    return np.array([every[f"p{i}"] for i in range(count)])


def _unit(rng: np.random.Generator) -> Array:
    vector = rng.standard_normal(3)
    return vector / np.linalg.norm(vector)


def _elements(
    draw: Any, rng: np.random.Generator, simple: list[int], at: Array
) -> list[tuple[str, dict[str, Any], str]]:
    last = len(at) - 1
    length = float(np.linalg.norm(at[last] - at[0]))
    ends = {"from": "{p0}", "to": f"{{p{last}}}"}
    hinge = f"{{j{draw(st.sampled_from(simple))}}}"
    rest = draw(st.sampled_from(["initial", "0.1"]))
    made: dict[str, tuple[dict[str, Any], str]] = {
        "spring": ({**ends, "stiffness": 300, "damping": 4}, ""),
        "cylinder": (
            {
                **ends,
                "bore": 0.063,
                "rod": 0.030,
                "length_retracted": 0.7 * length,
                "dead_length_a": 0.0,
                "dead_length_b": 0.0,
                "bulk_modulus": 1e6,
                "friction": 20,
                "precharge": 1e5,
                "law": draw(st.sampled_from(["geometric", "printed"])),
            },
            "",
        ),
        "joint_spring": ({"joint": hinge, "stiffness": 150, "damping": 3, "rest": rest}, ""),
        "joint_torque": ({"joint": hinge, "value": 7.5}, ""),
        "joint_friction": ({"joint": hinge, "damping": 2, "friction": 5, "creep": 0.1}, ""),
        "contact": (
            {
                "point": f"{{p{last}}}",
                "axis": _unit(rng),
                "stiffness": 400,
                "damping": 5,
                "preload": 30,
                "mode": draw(st.sampled_from(["bilateral", "unilateral"])),
            },
            "",
        ),
        "load": (
            {
                "kind": draw(st.sampled_from(["force", "torque"])),
                "point": f"{{p{last}}}",
                "frame": "world",
                "axis": _unit(rng),
            },
            '<harmonics mean="20"><term amplitude="10" frequency="3" phase="0.4"/></harmonics>',
        ),
    }
    assert set(made) == set(FORCES), "a new element belongs here too"
    return [(tag, attributes, inside) for tag, (attributes, inside) in made.items()]
