"""Mesh files of a model: their triangles, and the colours a DAE brings along."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from drillrig_pin.errors import ModelError
from drillrig_pin.kinematics import Array
from drillrig_pin.model.meshes import TO_FIND, find_mesh
from drillrig_pin.model.packages import installed_shares
from drillrig_pin.scene.shapes import Colour, Mesh

#: Sizes of two readings of one file agree to this part; otherwise one of them has turned or scaled it.
ALIKE = 1e-3


class MissingMeshError(ModelError):
    """A mesh is not found."""


def load_mesh(name: str, near: Sequence[Path] = ()) -> list[tuple[Mesh, Colour | None]]:
    """Read a mesh file (STL, DAE, OBJ, PLY) named as in a URDF: its parts, each with its own colour if it has one.

    Args:
        name: as in the model file.
        near: folders a relative name counts from.

    Raises:
        MissingMeshError: it is not found.
        ModelError: it cannot be read, or the name is none of a mesh.
    """
    path, looked = find_mesh(name, near, list(_shares()))
    if path is None:
        raise MissingMeshError(f"the mesh {name!r} is not found here; {looked}", todo=TO_FIND)
    try:
        import coal

        model = coal.MeshLoader().load(str(path), np.ones(3))
        triangles = (model.tri_indices(i) for i in range(model.num_tris))
        faces = np.array([(t[0], t[1], t[2]) for t in triangles], dtype=np.int64).reshape(-1, 3)
        vertices = np.array(model.vertices(), dtype=float)
    except Exception as error:
        # The reader raises whatever its own libraries raise; a mesh that cannot be read is not drawn.
        raise ModelError(f"the mesh {name!r} cannot be read ({' '.join(str(error).split())[:120]})") from None
    if not len(faces):
        raise ModelError(f"the mesh {name!r} holds no triangle")
    if not np.isfinite(vertices).all():
        raise ModelError(f"the mesh {name!r} holds numbers that are not finite")
    whole = Mesh(vertices, faces)
    if path.suffix.lower() == ".dae":
        return _coloured(path, whole)
    return [(whole, None)]


def _coloured(path: Path, whole: Mesh) -> list[tuple[Mesh, Colour | None]]:
    """A DAE by the colours of its materials; in one if they cannot be laid over the triangles already read."""
    try:
        import trimesh

        parts = list(_painted(trimesh.load(str(path), force="scene", skip_materials=False)))
    except Exception:
        # Colours are a nicety: whatever the reader stumbles over, the shape is there.
        return [(whole, None)]
    colours = {colour for _, colour in parts}
    if not parts or colours == {None}:
        return [(whole, None)]
    if len(colours) == 1:
        return [(whole, colours.pop())]
    ours, theirs = np.ptp(whole.vertices, axis=0), np.ptp(np.vstack([part.vertices for part, _ in parts]), axis=0)
    if np.allclose(ours, theirs, rtol=ALIKE, atol=ALIKE * float(ours.max())):
        return parts
    return [(whole, max(parts, key=lambda part: len(part[0].faces))[1])]


def _painted(scene: Any) -> Iterator[tuple[Mesh, Colour | None]]:
    for part in scene.dump():
        if len(getattr(part, "faces", ())):
            colour = getattr(getattr(part.visual, "material", None), "main_color", None)
            if colour is None and part.visual.kind in ("face", "vertex"):
                colour = part.visual.main_color
            yield Mesh(np.array(part.vertices, dtype=float), np.array(part.faces)), _colour(colour)


def _colour(bytes_of: Any) -> Colour | None:
    if bytes_of is None:
        return None
    red, green, blue, opacity = (float(value) / 255 for value in np.asarray(bytes_of).ravel()[:4])
    # Exporters write an opacity of nought for what is opaque.
    return red, green, blue, opacity or 1.0


def diagonal(mesh: Mesh, scale: Array) -> float:
    """Of the box around a mesh, in metres once it is scaled."""
    return float(np.linalg.norm(np.ptp(mesh.vertices, axis=0) * scale))


def _shares() -> Iterator[Path]:
    """Folders that hold packages of robots."""
    return installed_shares()
