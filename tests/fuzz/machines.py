"""Machines as the grammar allows them: trees, loops, every element, plain numbers and extreme ones."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pinocchio as pin

from fuzz.extremes import Numbers, attributes
from fuzz.forces import FORCES

#: Of a hundred joints.
JOINTS = ("revolute",) * 42 + ("prismatic",) * 25 + ("continuous",) * 15 + ("fixed",) * 11 + ("floating",) * 7


@dataclass
class Machine:
    """A model file that is being written, and what a scenario may name of it.

    Attributes:
        parts, extension: elements of URDF and of the extension.
        links: names; the first is the world.
        joints: kind by name of the joints that move.
        points: names.
        placed: where links stand in the world with every joint at zero; None where a number is too large to say.
        loads, rows: names a scenario can choose or set.
    """

    numbers: Numbers
    parts: list[str] = field(default_factory=lambda: ['<link name="world"/>'])
    extension: list[str] = field(default_factory=list)
    links: list[str] = field(default_factory=lambda: ["world"])
    joints: dict[str, str] = field(default_factory=dict)
    points: list[str] = field(default_factory=list)
    at: dict[str, tuple[str, np.ndarray]] = field(default_factory=dict)
    placed: dict[str, pin.SE3] = field(default_factory=lambda: {"world": pin.SE3.Identity()})
    loads: list[str] = field(default_factory=list)
    rows: list[str] = field(default_factory=list)
    poses: list[str] = field(default_factory=list)
    duration: float = 0.01

    @property
    def text(self) -> str:
        """The file."""
        return f'<robot name="m">{"".join(self.parts)}<drillrig>\n{chr(10).join(self.extension)}\n</drillrig></robot>'

    @property
    def single(self) -> list[str]:
        """Joints of one dof."""
        return [name for name, kind in self.joints.items() if kind != "floating"]

    def point(self, link: str | None = None, at: np.ndarray | None = None) -> str:
        """A new point on a link; ``at``: where it lies in the world with every joint at zero."""
        n, name = self.numbers, f"p{len(self.points)}"
        link = link or n.one_of(*self.links)
        xyz, rpy = n.vector(0.8), n.angles()
        placement = self.placed.get(link)
        if at is not None and placement is not None:
            xyz = " ".join(repr(float(c)) for c in placement.inverse() * at)
        if placement is not None:
            self.at[name] = (link, placement * _vector(xyz))
        track = n.one_of(None, None, "false")
        self.extension.append(f"<point{attributes(name=name, link=link, xyz=xyz, rpy=rpy, track=track)}/>")
        self.points.append(name)
        return name

    def some_point(self) -> str:
        """A point there is, or a new one."""
        if self.points and self.numbers.chance(0.5):
            return self.numbers.one_of(*self.points)
        return self.point()


def machine(numbers: Numbers, duration: float) -> Machine:
    """A random one; tables of its loads cover ``duration`` [s]."""
    made = Machine(numbers, duration=duration)
    if numbers.chance(0.25):
        gravity = " ".join(numbers.number(-12, 12) for _ in range(3))
        made.extension.append(f'<gravity xyz="{numbers.one_of(gravity, "0 0 0")}"/>')
    for _ in range(_size(numbers)):
        _body(made)
    for _ in range(numbers.one_of(0, 1, 1, 2, 3, 5)):
        numbers.one_of(*FORCES)(made)
    for _ in range(numbers.one_of(0, 0, 0, 1, 1, 2)):
        numbers.one_of(_hold, _loop, _loop, _gear)(made)
    for _ in range(numbers.one_of(0, 0, 0, 1, 2)):
        _pose(made)
    if numbers.chance(0.06) and made.single:
        position = numbers.one_of(None, numbers.number(-1, 1))
        made.extension.append(f"<lock{attributes(joints=numbers.one_of(*made.single, 'j[12]'), position=position)}/>")
    if numbers.chance(0.1):
        made.point()
    return made


def chain(numbers: Numbers, links: int, loops: int) -> Machine:
    """A long chain, or a few links with very many loops."""
    made = Machine(numbers)
    for _ in range(links):
        _body(made, parent=made.links[-1], kind=numbers.one_of("revolute", "prismatic", "continuous"))
    for _ in range(loops):
        _loop(made)
    return made


def _size(n: Numbers) -> int:
    return n.one_of(1, 1, 2, 2, 2, 3, 3, 4, 5, 7)


def _vector(text: str) -> np.ndarray:
    return np.array([float(word) for word in text.split()])


def _body(made: Machine, parent: str | None = None, kind: str | None = None) -> None:
    """A link and the joint it hangs on."""
    n, i = made.numbers, len(made.links)
    name, parent = f"l{i}", parent or n.one_of(*made.links, made.links[-1], made.links[-1])
    kind = kind or n.one_of(*JOINTS)
    xyz, rpy = n.vector(0.8), n.angles()
    inside = f"<origin{attributes(xyz=xyz, rpy=rpy)}/>" if n.chance(0.9) else ""
    if not inside:
        xyz = rpy = "0 0 0"
    if kind not in ("fixed", "floating"):
        inside += f'<axis xyz="{n.direction()}"/>'
        inside += _limit(n, kind) + _friction(n) + _mimic(made)
    ends = f'<parent link="{parent}"/><child link="{name}"/>'
    made.parts.append(f'{_link(n, name)}<joint name="j{i}" type="{kind}">{ends}{inside}</joint>\n')
    made.links.append(name)
    if kind != "fixed":
        made.joints[f"j{i}"] = kind
    with np.errstate(all="ignore"):
        base, values = made.placed.get(parent), np.concatenate([_vector(xyz), _vector(rpy)])
        if base is not None and np.abs(values).max() < 1e6:
            made.placed[name] = base * pin.SE3(pin.rpy.rpyToMatrix(*values[3:]), values[:3])


def _link(n: Numbers, name: str) -> str:
    if n.chance(0.05):
        return f'<link name="{name}"/>'
    mass = n.positive(0.1, 1e3)
    moments = [n.plain(0.05, 0.09) for _ in range(3)]
    if n.chance(n.wild):
        moments = [n.edge(signed=False)] * 3 if n.chance(0.7) else [n.edge(signed=False) for _ in range(3)]
    products = [n.number(-0.01, 0.01) if n.chance(0.2) else "0" for _ in range(3)]
    keys = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
    inertia = attributes(**dict(zip(keys, (*moments, *products), strict=True)))
    origin = f"<origin{attributes(xyz=n.vector(0.3), rpy=n.angles())}/>" if n.chance(0.7) else ""
    return f'<link name="{name}"><inertial>{origin}<mass value="{mass}"/><inertia{inertia}/></inertial></link>'


def _limit(n: Numbers, kind: str) -> str:
    low, high = (n.number(-3, -1), n.number(1, 3)) if n.chance(0.3) else ("-100", "100")
    # A revolute or prismatic joint must have one; of a continuous joint it is left out.
    return "" if kind == "continuous" else f"<limit{attributes(lower=low, upper=high, effort='1', velocity='1')}/>"


def _friction(n: Numbers) -> str:
    if not n.chance(0.08):
        return ""
    return f"<dynamics{attributes(damping=n.positive(0.1, 100), friction=n.positive(0.1, 100))}/>"


def _mimic(made: Machine) -> str:
    n = made.numbers
    if not made.single or not n.chance(0.04):
        return ""
    offset = n.one_of(None, n.number(-1, 1))
    return f"<mimic{attributes(joint=n.one_of(*made.single), multiplier=n.number(-3, 3), offset=offset)}/>"


def _hold(made: Machine) -> None:
    n = made.numbers
    axes = n.one_of("x", "z", "y z", "x z", "x y z")
    point = made.some_point()
    target = None
    if n.chance(0.3):
        place = made.at[point][1] if point in made.at else np.zeros(3)
        target = " ".join(n.number(place["xyz".index(a)] - 0.05, place["xyz".index(a)] + 0.05) for a in axes.split())
    name = f"c{len(made.extension)}"
    made.rows += [f"{name}.{axis}" for axis in axes.split()]
    made.extension.append(f"<hold{attributes(name=name, point=point, axes=axes, target=target)}/>")


def _loop(made: Machine) -> None:
    """Two points joined; mostly where they meet anyway, else wherever they are, be it on one link."""
    n = made.numbers
    first = made.some_point()
    if first in made.at and n.chance(0.8):
        second = made.point(n.one_of(*made.links), made.at[first][1])
    else:
        second = made.some_point()
    rows = attributes(
        translations=n.one_of("x", "x y", "x z", "x y z", "x y z", None), rotations=n.one_of(None, None, "x y", "x y z")
    )
    made.extension.append(f'<loop name="c{len(made.extension)}" from="{first}" to="{second}"{rows}/>')


def _gear(made: Machine) -> None:
    n = made.numbers
    if len(made.single) < 2 and n.chance(0.9):
        return
    names = made.single or ["j1"]
    joint, mimics = n.one_of(*names), n.one_of(*names)
    ratio, offset = n.number(-4, 4), n.one_of(None, n.number(-0.5, 0.5))
    pair = attributes(name=f"c{len(made.extension)}", joint=joint, mimics=mimics, ratio=ratio, offset=offset)
    made.extension.append(f"<gear{pair}/>")


def _pose(made: Machine) -> None:
    n, name = made.numbers, f"pose{len(made.poses)}"
    rows = "".join(
        f'<joint name="{joint}" position="{position(n, kind)}"/>'
        for joint, kind in made.joints.items()
        if n.chance(0.6)
    )
    made.extension.append(f'<pose name="{name}">{rows}</pose>')
    made.poses.append(name)


def position(n: Numbers, kind: str) -> str:
    """Of a joint of a kind."""
    if kind == "floating":
        return " ".join(n.number(-1, 1) for _ in range(7))
    return n.number(-1, 1)
