"""Mass and inertia of every link: possible, and of the size of its shapes?"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from drillrig_pin.errors import ModelError
from drillrig_pin.model.nodes import Node
from drillrig_pin.model.numbers import numbers, placement
from drillrig_pin.model.problem import Problem
from drillrig_pin.model.tree_text import INERTIA, child, inertial_numbers
from drillrig_pin.series import LARGEST as BEYOND

#: Relative slack of the triangle inequality: thin rods meet it with equality up to printed digits.
TRIANGLE_SLACK = 1e-3
#: Moments of inertia [kg m^2] below this are zero: rounding of the program that wrote the file.
NO_INERTIA = 1e-15
#: No body within a box has a radius of gyration above half its diagonal (two halves in opposite corners); shapes may
#: leave out a part of the body, so a fifth more is let pass.
LARGEST = 0.6
#: A slender uniform bar has 0.29 of its length; a body with a fiftieth of it is a point with a long decoration.
SMALLEST = 0.02
#: So many links of one and the same tensor are suspicious if their masses or shapes differ.
ALIKE = 3
#: Shares by which masses and sizes of links made alike may differ.
SAME = 0.01


def check_inertias(root: Node) -> Iterator[Problem]:
    """Findings about every <inertial> in file order, then about tensors that many links share."""
    tensors: dict[tuple[float, ...], list[tuple[Node, float, float]]] = {}
    for link in root.named("link"):
        inertial = child(link, "inertial")
        if inertial is None:
            continue
        yield from _inertia(link, inertial)
        try:
            mass, tensor = inertial_numbers(inertial)
        except ModelError:
            continue
        if any(tensor):
            tensors.setdefault(tensor, []).append((link, mass, math.hypot(*extent(link))))
    for tensor, alike in tensors.items():
        if len(alike) >= ALIKE and _differ(alike):
            names = ", ".join(repr(link.attributes.get("name", "")) for link, _, _ in alike[:6])
            more = f" and {len(alike) - 6} more" if len(alike) > 6 else ""
            yield Problem(
                "warning",
                f"{len(alike)} links of different mass or shape have the very same inertia, ixx = {tensor[0]:g} "
                f"kg m^2: {names}{more}",
                alike[0][0].source,
                "Such numbers are often placeholders: give each link its own.",
            )


def _differ(alike: list[tuple[Node, float, float]]) -> bool:
    masses, sizes = [mass for _, mass, _ in alike], [size for _, _, size in alike]
    return max(_spread(masses), _spread(sizes)) > SAME


def _inertia(link: Node, inertial: Node) -> Iterator[Problem]:
    name = link.attributes.get("name", "")
    if child(inertial, "mass") is None:
        yield Problem("error", f"link {name!r} has an <inertial> without <mass>", inertial.source, "Write both.")
        return
    tensor = child(inertial, "inertia")
    if tensor is None:
        yield Problem("error", f"link {name!r} has a mass but no <inertia>", inertial.source)
        return
    said = [
        node.attributes.get(key, "")
        for node, keys in ((child(inertial, "mass"), ("value",)), (tensor, INERTIA))
        for key in keys
        if node is not None
    ]
    if not all(map(numbers, said)):
        return  # what is missing or no number is named by itself
    try:
        mass, (xx, xy, xz, yy, yz, zz) = inertial_numbers(inertial)
        placement(child(inertial, "origin"))
    except ModelError:
        return
    if any(abs(value) > BEYOND for value in (mass, xx, xy, xz, yy, yz, zz)):
        return  # said where it is read
    if mass < 0:
        yield Problem("error", f"link {name!r} has the negative mass {mass:g} kg", inertial.source)
        return
    if mass == 0 and any(child(link, tag) is not None for tag in ("visual", "collision")):
        yield Problem("warning", f"link {name!r} has geometry but no mass", inertial.source, "Give it its mass.")
    small, middle, large = map(float, np.linalg.eigvalsh(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])))
    if small < -max(TRIANGLE_SLACK * large, NO_INERTIA):
        yield Problem(
            "error", f"link {name!r}: a principal moment of inertia is negative ({small:g} kg m^2)", tensor.source
        )
    elif large > (small + middle) * (1 + TRIANGLE_SLACK) + NO_INERTIA:
        yield Problem(
            "warning",
            f"link {name!r}: principal moments {small:.4g}, {middle:.4g}, {large:.4g} kg m^2 break the triangle "
            "inequality: no body has them",
            tensor.source,
            "Check the tensor and the axes it is given in.",
        )
    elif mass > 0:
        yield from gyration(link, extent(link))
    elif large > NO_INERTIA:
        yield Problem("warning", f"link {name!r} has {large:.4g} kg m^2 and no mass: no body has them", tensor.source)


def gyration(link: Node, edges: Sequence[float]) -> Iterator[Problem]:
    """Compare the radius of gyration k = sqrt(I / m) about the centre of mass with the box around the shapes.

    Args:
        link: a link whose mass is positive and whose inertia is sound.
        edges: of the box [m]; zeros: not known, nothing is compared.
    """
    inertial = child(link, "inertial")
    tensor = child(inertial, "inertia") if inertial is not None else None
    if inertial is None or tensor is None:
        return
    mass, (xx, xy, xz, yy, yz, zz) = inertial_numbers(inertial)
    if not mass > 0:
        return
    moment = float(np.linalg.eigvalsh(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))[-1])
    diagonal, longest = math.hypot(*edges), max(edges)
    if not longest > 0:
        return
    radius = math.sqrt(max(moment, 0.0) / mass)
    if SMALLEST * longest <= radius <= LARGEST * diagonal:
        return
    size = "larger than its shape" if radius > longest else "too large for its shape"
    size = size if radius > LARGEST * diagonal else "far smaller than its shape"
    yield Problem(
        "warning",
        f"link {link.attributes.get('name', '')!r}: {mass:g} kg with {moment:g} kg m^2 means a radius of gyration of "
        f"{radius:.2g} m, {size} ({longest:.2g} m)",
        tensor.source,
        "Such numbers are often placeholders; a slender uniform bar has 0.29 of its length.",
    )


def extent(link: Node) -> tuple[float, float, float]:
    """Edges [m] of the box, along the link's axes, around its visual shapes (else its collision shapes).

    Zero where a shape is a mesh or cannot be read: its size is then not known.
    """
    for tag in ("visual", "collision"):
        parts = list(link.named(tag))
        if parts:
            try:
                corners = np.vstack([_corners(part) for part in parts])
            except (ModelError, ValueError):
                return 0.0, 0.0, 0.0
            x, y, z = (float(edge) for edge in np.ptp(corners, axis=0))
            return x, y, z
    return 0.0, 0.0, 0.0


def _corners(part: Node) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    import pinocchio as pin

    xyz, rpy = placement(child(part, "origin"))
    half = _half_size(part)
    signs = np.array([[(i >> k) & 1 for k in range(3)] for i in range(8)]) * 2.0 - 1.0
    return np.asarray(signs * half @ pin.rpy.rpyToMatrix(*rpy).T + np.array(xyz))


def _half_size(part: Node) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """Half the edges of the box around the one shape of a part; ValueError if they are not known."""
    geometry = child(part, "geometry")
    for shape in geometry.children if geometry is not None else ():
        size = numbers(shape.attributes.get("size", ""))
        radius, length = (numbers(shape.attributes.get(key, "")) for key in ("radius", "length"))
        if shape.tag == "box" and size is not None and len(size) == 3:
            return np.abs(size) / 2
        if shape.tag == "sphere" and radius:
            return np.full(3, abs(radius[0]))
        if shape.tag in ("cylinder", "capsule") and radius and length:
            end = abs(radius[0]) if shape.tag == "capsule" else 0.0
            return np.array([abs(radius[0]), abs(radius[0]), abs(length[0]) / 2 + end])
    raise ValueError("no shape of known size")


def _spread(values: list[float]) -> float:
    low, high = min(values), max(values)
    return (high - low) / high if high > 0 else 0.0
