"""Mesh files that a model names: which file a name stands for, and where it was looked for."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple
from urllib.parse import unquote
from xml.dom import minidom

from drillrig_pin.errors import ModelError
from drillrig_pin.model.beside import folders
from drillrig_pin.model.nodes import STAMP, read_stamp
from drillrig_pin.model.packages import find_package

#: A model or a result of somebody else's names files of this machine: only meshes are opened, none of absurd size.
SUFFIXES = (".stl", ".stlb", ".dae", ".obj", ".ply", ".off", ".glb")
MAX_BYTES = 100_000_000
TO_FIND = (
    "Put it beside the model as it is named, or say where its package is: ROS_PACKAGE_PATH or --package NAME=FOLDER."
)


class Place(NamedTuple):
    """The file a name stands for; None with the places looked at if there is none."""

    path: Path | None
    looked: str = ""


def find_mesh(name: str, near: Sequence[Path] = (), shares: Iterable[Path] | None = None) -> Place:
    """The file a URDF's mesh name stands for: ``package://NAME/PATH``, ``file://PATH``, or a path.

    A relative path counts from the folders ``near``, then from those that hold packages of robots. Packages are found
    as :func:`drillrig_pin.model.packages.find_package` says, from the first of ``near`` upwards.

    Args:
        name: as in the model file.
        near: folder of the file that names it, folder of the model.
        shares: folders that hold installed packages; None: those of this installation.

    Raises:
        ModelError: no name of a mesh file, or a file that is too large.
    """
    scheme, separator, rest = name.partition("://")
    if not separator:
        scheme, rest = "", name
    if scheme not in ("", "package", "file", "model"):
        raise ModelError(f"the mesh {name!r} is not on this machine", todo="Name a file.")
    if Path(rest).suffix.lower() not in SUFFIXES:
        raise ModelError(f"{name!r} is no mesh file", todo=f"Known: {', '.join(SUFFIXES)}.")
    rest = (unquote(rest) if scheme == "file" else rest).replace("\\", "/")
    if scheme in ("package", "model"):
        package, _, path = rest.partition("/")
        try:
            folder = find_package(package, near[0] if near else Path(os.sep), shares=shares)
        except ModelError as error:
            return Place(None, error.what)
        candidates = [folder / path]
    elif Path(rest).is_absolute():
        candidates = [Path(rest)]
    else:
        candidates = [folder / rest for folder in (*near, *_ros(), *(shares or ()))]
    for candidate in candidates:
        if _is_file(candidate):
            if candidate.stat().st_size > MAX_BYTES:
                raise ModelError(f"the mesh {name!r} is larger than {MAX_BYTES // 1_000_000} MB")
            return Place(candidate)
    places = list(dict.fromkeys(str(os.path.normpath(candidate.parent)) for candidate in candidates[: len(near) or 1]))
    return Place(None, "looked in " + ", ".join(places) if places else "the model's folder is not known")


def settle_meshes(robot: minidom.Element, folder: Path) -> None:
    """Let relative names of meshes count from the model's folder, also those that stand in an include elsewhere.

    A name that stands for no file beside the include is left as it is.
    """
    for mesh in robot.getElementsByTagName("mesh"):
        name = mesh.getAttribute("filename")
        if not name or "://" in name or os.path.isabs(name) or _is_file(folder / name):
            continue
        for near in folders(read_stamp(mesh.getAttribute(STAMP)).file):
            if _is_file(Path(near) / name):
                mesh.setAttribute("filename", os.path.relpath(Path(near) / name, folder))
                break


def _ros() -> Iterator[Path]:
    return (Path(folder) for folder in os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep) if folder)


def _is_file(path: Path) -> bool:
    # Path.is_file raises where a name is too long or holds a zero byte; this says no.
    try:
        return os.path.isfile(path)
    except ValueError:
        return False
