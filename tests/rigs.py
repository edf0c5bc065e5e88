"""Small machines as URDF text: each the smallest one that shows a law or a kind of joint.

Lengths in m, masses in kg, angles in rad. The world is the first link of every machine.
"""

from __future__ import annotations

from collections.abc import Sequence

from drillrig_pin import Rig, load_rig_text

Vec = Sequence[float]


def _v(values: Vec) -> str:
    return " ".join(repr(float(value)) for value in values)


def link(name: str, mass: float = 1.0, com: Vec = (0, 0, 0), inertia: Vec = (0.01, 0.02, 0.025)) -> str:
    """A link with the principal moments ``inertia`` about its centre of mass."""
    xx, yy, zz = inertia
    return (
        f'<link name="{name}"><inertial><origin xyz="{_v(com)}" rpy="0 0 0"/><mass value="{mass!r}"/>'
        f'<inertia ixx="{xx!r}" ixy="0" ixz="0" iyy="{yy!r}" iyz="0" izz="{zz!r}"/></inertial></link>\n'
    )


def joint(
    name: str, kind: str, parent: str, child: str, xyz: Vec = (0, 0, 0), axis: Vec = (0, 0, 1), rpy: Vec = (0, 0, 0)
) -> str:
    """A joint of any type; limits wide open."""
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{_v(xyz)}" rpy="{_v(rpy)}"/><axis xyz="{_v(axis)}"/>'
        '<limit lower="-100" upper="100" effort="1e6" velocity="1e3"/></joint>\n'
    )


def point(name: str, on: str, xyz: Vec = (0, 0, 0), rpy: Vec = (0, 0, 0)) -> str:
    """A named point."""
    return f'<point name="{name}" link="{on}" xyz="{_v(xyz)}" rpy="{_v(rpy)}"/>\n'


def robot(*parts: str, extension: str = "", name: str = "machine") -> str:
    """The whole file: links and joints, then the extension elements."""
    return f'<robot name="{name}"><link name="world"/>\n{"".join(parts)}<drillrig>\n{extension}</drillrig></robot>'


def rig(*parts: str, extension: str = "") -> Rig:
    """The machine of these parts."""
    return load_rig_text(robot(*parts, extension=extension))


NO_GRAVITY = '<gravity xyz="0 0 0"/>\n'

#: A cylinder as number 4 of [Tram2023] table 5, between points `pin_a` and `pin_b`.
CYLINDER = (
    '<cylinder name="oil" from="pin_a" to="pin_b" bore="0.063" rod="0.030" length_retracted="0.472" '
    'dead_length_a="0.040" dead_length_b="0.060" bulk_modulus="2.85e9" {}/>\n'
)


def mass_on_cylinder(
    mass: float = 500.0, length: float = 0.65, options: str = "", extension: str = "", gravity: bool = True
) -> str:
    """A mass that slides up and down on one locked cylinder of the given length."""
    return robot(
        link("mass", mass),
        joint("slide", "prismatic", "world", "mass"),
        extension=("" if gravity else NO_GRAVITY)
        + point("pin_a", "world", (0, 0, -length))
        + point("pin_b", "mass")
        + CYLINDER.format(options)
        + extension,
    )


def point_mass(mass: float = 2.0, extension: str = "") -> str:
    """A mass with three translations along the world axes, point `P` on it."""
    return robot(
        link("a", 0.0, inertia=(0.0, 0.0, 0.0)),
        link("b", 0.0, inertia=(0.0, 0.0, 0.0)),
        link("mass", mass),
        joint("x", "prismatic", "world", "a", axis=(1, 0, 0)),
        joint("y", "prismatic", "a", "b", axis=(0, 1, 0)),
        joint("z", "prismatic", "b", "mass", axis=(0, 0, 1)),
        extension=point("P", "mass") + extension,
    )


def pendulum(length: float = 0.7, mass: float = 3.0, extension: str = "") -> str:
    """A bar on a hinge about world y; at q = 0 it lies along +x, its tip `P` at ``length``."""
    return robot(
        link("bar", mass, (length / 2, 0, 0), (1e-4, mass * length**2 / 12, mass * length**2 / 12)),
        joint("hinge", "revolute", "world", "bar", axis=(0, 1, 0)),
        extension=point("P", "bar", (length, 0, 0)) + extension,
    )


def double_pendulum(extension: str = "", gravity: bool = True) -> str:
    """Two bars in the x-z plane, hinges about y; tip `P`."""
    return robot(
        link("upper", 2.0, (0.25, 0, 0), (0.001, 0.04, 0.04)),
        link("lower", 1.0, (0.2, 0, 0), (0.001, 0.02, 0.02)),
        joint("shoulder", "revolute", "world", "upper", axis=(0, 1, 0)),
        joint("elbow", "revolute", "upper", "lower", (0.5, 0, 0), (0, 1, 0)),
        extension=("" if gravity else NO_GRAVITY) + point("P", "lower", (0.4, 0, 0)) + extension,
    )


def slider_crank(crank: float = 0.2, rod: float = 0.6, extension: str = "", gravity: bool = True) -> str:
    """Crank about z at the origin, rod on its end, slider along x; rod and slider joined by the loop `wrist`."""
    return robot(
        link("crank", 2.0, (crank / 2, 0, 0), (0.001, 0.01, 0.01)),
        link("rod", 1.0, (rod / 2, 0, 0), (0.001, 0.03, 0.03)),
        link("slider", 3.0),
        joint("crank_joint", "continuous", "world", "crank"),
        joint("rod_joint", "revolute", "crank", "rod", (crank, 0, 0)),
        joint("slide", "prismatic", "world", "slider", axis=(1, 0, 0)),
        extension=('<gravity xyz="0 -9.81 0"/>' if gravity else NO_GRAVITY)
        + point("rod_end", "rod", (rod, 0, 0))
        + point("slider_pin", "slider")
        + '<loop name="wrist" from="slider_pin" to="rod_end" translations="x y"/>\n'
        + extension,
    )


def four_bar(lengths: Vec = (1.0, 0.35, 0.9, 0.7), closure: str = 'translations="x y"', extension: str = "") -> str:
    """Ground (along x), crank, coupler, rocker in the x-y plane, hinges about z; the loop is `closure`."""
    ground, crank, coupler, rocker = lengths
    return robot(
        link("crank", 1.0, (crank / 2, 0, 0), (0.001, 0.012, 0.012)),
        link("coupler", 2.0, (coupler / 2, 0, 0), (0.001, 0.14, 0.14)),
        link("rocker", 1.5, (rocker / 2, 0, 0), (0.001, 0.06, 0.06)),
        joint("crank_joint", "revolute", "world", "crank"),
        joint("coupler_joint", "revolute", "crank", "coupler", (crank, 0, 0)),
        joint("rocker_joint", "revolute", "world", "rocker", (ground, 0, 0)),
        extension='<gravity xyz="0 -9.81 0"/>'
        + point("coupler_end", "coupler", (coupler, 0, 0))
        + point("rocker_end", "rocker", (rocker, 0, 0))
        + f'<loop name="closure" from="rocker_end" to="coupler_end" {closure}/>\n'
        + extension,
    )


def floating_body(extension: str = "", gravity: bool = True) -> str:
    """One free rigid body with three different moments of inertia and its centre of mass off the frame; point `P`."""
    return robot(
        link("body", 4.0, (0.05, -0.02, 0.03), (0.10, 0.17, 0.23)),
        joint("free", "floating", "world", "body"),
        extension=("" if gravity else NO_GRAVITY) + point("P", "body", (0.1, 0.2, -0.3)) + extension,
    )


def tree(extension: str = "") -> str:
    """Every kind of joint: a floating base carries two arms, revolute + prismatic and continuous + revolute.

    Points: `O` in the world, `B` on the base, `L` and `R` at the ends of the arms, each with axes of its own.
    """
    return robot(
        link("base", 5.0, (0.1, 0.0, -0.05), (0.3, 0.4, 0.5)),
        link("left", 2.0, (0.2, 0.0, 0.0), (0.02, 0.05, 0.05)),
        link("telescope", 1.0, (0.1, 0.05, 0.0), (0.01, 0.02, 0.02)),
        link("wheel", 1.5, (0.0, 0.03, 0.0), (0.03, 0.03, 0.05)),
        link("right", 1.2, (0.0, 0.2, 0.1), (0.03, 0.01, 0.03)),
        joint("free", "floating", "world", "base"),
        joint("elbow", "revolute", "base", "left", (0.3, 0.1, 0.2), (0.6, 0.0, 0.8), (0.1, 0.2, 0.3)),
        joint("stretch", "prismatic", "left", "telescope", (0.4, 0.0, 0.1), (1, 0, 0), (0.0, -0.3, 0.2)),
        joint("spin", "continuous", "base", "wheel", (-0.3, 0.2, 0.0), (0, 1, 0), (0.4, 0.0, 0.1)),
        joint("wrist", "revolute", "wheel", "right", (0.1, 0.3, 0.0), (0, 0, 1), (0.0, 0.7, 0.0)),
        extension=point("O", "world", (0.5, -1.0, 0.3), (0.3, -0.2, 0.5))
        + point("B", "base", (0.2, 0.3, -0.1), (0.0, 0.4, -0.3))
        + point("L", "telescope", (0.3, 0.1, -0.2), (0.5, 0.1, 0.9))
        + point("R", "right", (-0.1, 0.4, 0.2), (-0.6, 0.2, 0.1))
        + extension,
    )


def bennett(a: float = 0.5, alpha: float = 0.6, beta: float = 1.1, extension: str = "") -> str:
    """Bennett's linkage: four skewed hinges that by the count of dofs could not move, and do.

    Opposite sides are equal, a / sin(alpha) = b / sin(beta). Four revolute axes close it, three as joints of the tree
    and the fourth as the loop `last`, a hinge of 3 + 2 rows on three dofs.
    """
    from math import sin

    b = a * sin(beta) / sin(alpha)
    # A fixed piece of each link carries the constant part Trans(x, a) Rot(x, alpha) of its Denavit-Hartenberg matrix.
    return robot(
        link("one", 1.0, (a / 2, 0, 0), (0.01, 0.05, 0.05)),
        link("two", 1.0, (b / 2, 0, 0), (0.01, 0.08, 0.08)),
        link("three", 1.0, (a / 2, 0, 0), (0.01, 0.05, 0.05)),
        joint("j1", "revolute", "world", "one"),
        joint("j2", "revolute", "one", "two", (a, 0, 0), rpy=(alpha, 0, 0)),
        joint("j3", "revolute", "two", "three", (b, 0, 0), rpy=(beta, 0, 0)),
        extension=point("end", "three", (a, 0, 0), (alpha, 0, 0))
        # The last side runs from hinge 4 back to hinge 1: seen from the ground, hinge 4 lies at -Trans(b) Rot(beta).
        + point("ground", "world", (-b, 0, 0), (-beta, 0, 0))
        + '<loop name="last" from="ground" to="end" translations="x y z" rotations="x y"/>\n'
        + extension,
    )


def bricard() -> str:
    """Bricard's linkage along the edges of a cube of 1 m: six hinges, each across its two rods, five rods of 1 kg.

    Problem A04 of the IFToMM library of benchmark problems. Five hinges are joints of the tree; the loop `last` is the
    sixth, 3 + 2 rows on five dofs, one of them redundant. Gravity along -y.
    """
    rods = [(1, 0, 0), (0, -1, 0), (0, 0, 1), (-1, 0, 0), (0, 1, 0)]
    axes = [(0, 1, 0), (0, 0, 1), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
    parts, last, place = [], "world", (0.0, 0.0, 0.0)
    for i, (rod, axis) in enumerate(zip(rods, axes, strict=True)):
        middle = (rod[0] / 2, rod[1] / 2, rod[2] / 2)
        moments = tuple(0.0 if along else 1 / 12 for along in rod)
        parts.append(link(f"rod_{i}", 1.0, middle, moments))
        parts.append(joint(f"h{i}", "revolute", last, f"rod_{i}", place, axis))
        last, place = f"rod_{i}", rod
    quarter = 1.5707963267948966
    return robot(
        *parts,
        extension='<gravity xyz="0 -9.81 0"/>'
        + point("ground", "world", (0, 0, 1), (0, quarter, 0))
        + point("end", last, (0, 1, 0), (0, quarter, 0))
        + '<loop name="last" from="ground" to="end" translations="x y z" rotations="x y"/>\n',
    )
