"""Mesh files of a model: where they are, and their triangles."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from drillrig_pin.errors import ModelError
from drillrig_pin.scene.shapes import Mesh


def load_mesh(name: str, folders: tuple[str, ...] = ()) -> Mesh:
    """Read a mesh file (STL, DAE, OBJ) named as in a URDF.

    Raises:
        ModelError: it is not found or cannot be read.
    """
    path = find_mesh(name, folders)
    if path is None:
        raise ModelError(f"the mesh {name!r} is not found here")
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
    return Mesh(vertices, faces)


def find_mesh(name: str, folders: tuple[str, ...] = ()) -> Path | None:
    """The file a URDF's mesh name stands for: ``package://NAME/PATH``, ``file://PATH``, or a path."""
    scheme, separator, rest = name.partition("://")
    if not separator:
        scheme, rest = "", name
    if scheme not in ("", "package", "file", "model"):
        return None
    if scheme in ("", "file") and Path(rest).is_absolute():
        return Path(rest) if Path(rest).is_file() else None
    for folder in (*map(Path, folders), *_shares()):
        for candidate in (folder / rest, *(parent / rest for parent in list(folder.parents)[:3])):
            if candidate.is_file():
                return candidate
    return None


def _shares() -> Iterator[Path]:
    """Folders that hold packages of robots: those ROS names, and the share folders of this installation."""
    for folder in os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep):
        if folder:
            yield Path(folder)
    for variable in ("AMENT_PREFIX_PATH", "CMAKE_PREFIX_PATH"):
        for folder in os.environ.get(variable, "").split(os.pathsep):
            if folder:
                yield Path(folder) / "share"
    # Where packages of robots land that are installed with pip, and with conda.
    for folder in sys.path:
        if folder:
            yield Path(folder) / "cmeel.prefix" / "share"
    yield Path(sys.prefix) / "share"
