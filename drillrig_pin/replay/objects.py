"""A scene as commands of Meshcat's viewer: what stands where at the first frame."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from drillrig_pin.kinematics import Array
from drillrig_pin.scene.shapes import Ball, Box, Mesh, Part, Round, Trace
from drillrig_pin.scene.views import placement_of

if TYPE_CHECKING:
    from meshcat.geometry import Geometry

#: Three's cylinders lie along y, ours along z.
Y_TO_Z = np.array([[1.0, 0, 0, 0], [0, 0, -1.0, 0], [0, 1.0, 0, 0], [0, 0, 0, 1.0]])
FRONT_ONLY, BOTH_SIDES = 0, 2


def commands(parts: list[Part]) -> Iterator[bytes]:
    """Meshcat commands, packed as its viewer takes them."""
    import umsgpack

    for part in parts:
        path = node_path(part)
        if part.shape is not None:
            for name, lowered in _lowered(part):
                yield umsgpack.packb({"type": "set_object", "path": path + name, "object": lowered})
        yield umsgpack.packb({"type": "set_transform", "path": path, "matrix": _column_major(placement_of(part))})


def node_path(part: Part) -> str:
    """Where Meshcat keeps a part; a slash in a name would put it into another part, and move it along."""
    return "/" + "/".join(name.replace("/", "\u2215") for name in part.path)


def _column_major(placement: Array) -> list[float]:
    return [float(value) for value in placement.T.ravel()]


def _lowered(part: Part) -> Iterator[tuple[str, dict[str, Any]]]:
    """Name below the part's path and Meshcat's own form of its object."""
    import meshcat.geometry as g

    red, green, blue, opacity = part.colour
    colour = sum(round(255 * value) << shift for value, shift in ((red, 16), (green, 8), (blue, 0)))
    if isinstance(part.shape, Trace):
        points = g.PointsGeometry(part.shape.points.T.astype(np.float32))
        for name, strength in (("", 0.25), ("/now", 1.0)):
            material = g.LineBasicMaterial(color=colour, opacity=strength, transparent=True)
            yield name, g.Line(points, material).lower()
        return
    assert part.shape is not None
    one_sided = isinstance(part.shape, Mesh) and part.shape.one_sided
    extra = {"depthTest": False} if part.on_top else {}
    material = g.MeshLambertMaterial(
        color=colour,
        opacity=opacity,
        transparent=opacity < 1 or part.on_top,
        side=FRONT_ONLY if one_sided or opacity < 1 else BOTH_SIDES,
        **extra,
    )
    lowered = g.Mesh(_geometry(part.shape), material).lower()
    along = Y_TO_Z if isinstance(part.shape, Round) else np.eye(4)
    lowered["object"]["matrix"] = _column_major(part.placement @ along)
    yield "", lowered


def _geometry(shape: Box | Round | Ball | Mesh) -> Geometry:
    import meshcat.geometry as g

    if isinstance(shape, Box):
        return g.Box(list(shape.size))
    if isinstance(shape, Round):
        if shape.top is None:
            return g.Cylinder(shape.length, shape.radius)
        return g.Cylinder(shape.length, radiusTop=shape.top, radiusBottom=shape.radius)
    if isinstance(shape, Ball):
        return g.Sphere(shape.radius)
    return g.TriangularMeshGeometry(shape.vertices, shape.faces)
