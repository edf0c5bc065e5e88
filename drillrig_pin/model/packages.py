"""Where a package of robot descriptions lies: ``$(find NAME)`` and ``package://NAME/...`` without an installed ROS."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from drillrig_pin.errors import ModelError
from drillrig_pin.model.nodes import parse_bytes, root_element

#: Environment variable that says where packages are, ``NAME=PATH`` separated by colons; ``--package`` adds to it.
VARIABLE = "DRILLRIG_PACKAGES"
#: How many levels below a folder of ROS_PACKAGE_PATH packages are looked for.
DEPTH = 3
#: A folder with more entries than this is no workspace; its other folders are not opened to read their package.xml.
MANY = 500
MANIFEST = "package.xml"
MANIFEST_BYTES = 1_000_000


def find_package(
    name: str,
    start: str | os.PathLike[str],
    extra: Mapping[str, str | Path] | None = None,
    shares: Iterable[Path] | None = None,
) -> Path:
    """The folder of a package; the first that is found, in this order.

    1. ``extra``, then the environment variable DRILLRIG_PACKAGES (which ``--package NAME=PATH`` fills).
    2. Upwards from ``start``: a folder above it, or a folder beside those, whose ``package.xml`` says this name, or
       that bears it and has no ``package.xml`` that says another.
    3. Folders of ROS_PACKAGE_PATH: packages themselves, or with packages up to three levels below.
    4. ``share/NAME`` in the folders of AMENT_PREFIX_PATH and CMAKE_PREFIX_PATH.
    5. ``share/NAME`` of packages of robots that pip or conda installed.

    Args:
        name: name of the package.
        start: the file that names it (or a folder); the search goes upwards from there.
        extra: folders given by the user, by name of the package.
        shares: folders that hold installed packages; None: :func:`installed_shares`.

    Raises:
        ModelError: not found, with the places looked at, or the folder given for it is none. ``where`` is left to the
            caller, who knows the line.
    """
    given = {**given_packages(), **{key: Path(value) for key, value in (extra or {}).items()}}
    if name in given:
        if not given[name].is_dir():
            raise ModelError(
                f"the package {name!r} is said to be in {str(given[name])!r}, which is no folder",
                todo=f"Correct --package {name}=FOLDER.",
            )
        return given[name].resolve()
    if _is_name(name):
        for folder in _candidates(name, Path(start).absolute()):
            if _is_package(folder, name):
                return folder
        for share in installed_shares() if shares is None else shares:
            # What is installed is known by its folder, whatever its package.xml says.
            if _is_folder(share / name):
                return share / name
    raise ModelError(
        f"the package {name!r} is not found; looked {_places(Path(start).absolute())}",
        todo=f"Say where it is: --package {name}=FOLDER, or set ROS_PACKAGE_PATH or AMENT_PREFIX_PATH.",
    )


def given_packages() -> dict[str, Path]:
    """Folders of DRILLRIG_PACKAGES by package; a relative folder counts from the working directory."""
    rows = (row.partition("=") for row in os.environ.get(VARIABLE, "").split(os.pathsep) if row)
    return {name.strip(): Path(folder).absolute() for name, equals, folder in rows if equals}


def remember_packages(settings: list[str]) -> None:
    """Add ``NAME=PATH`` settings to DRILLRIG_PACKAGES, which processes started from here inherit.

    Raises:
        ModelError: a setting has another form, or names no folder.
    """
    found = given_packages()
    for setting in settings:
        name, equals, folder = setting.partition("=")
        if not (equals and name.strip() and folder.strip()):
            raise ModelError(f"{setting!r} does not say where a package is", where="--package", todo="NAME=FOLDER.")
        if not Path(folder.strip()).is_dir():
            raise ModelError(f"no such folder: {folder.strip()!r}", where="--package", todo="Check the path.")
        found[name.strip()] = Path(folder.strip()).absolute()
    os.environ[VARIABLE] = os.pathsep.join(f"{name}={folder}" for name, folder in found.items())


def installed_shares() -> Iterator[Path]:
    """Folders that hold packages of robots: those ROS and CMake name, and the share folders of this installation."""
    for variable in ("AMENT_PREFIX_PATH", "CMAKE_PREFIX_PATH"):
        yield from (folder / "share" for folder in _listed(variable))
    # Where packages of robots land that are installed with pip, and with conda.
    for entry in sys.path:
        if entry:
            yield Path(entry) / "cmeel.prefix" / "share"
    yield Path(sys.prefix) / "share"


def _listed(variable: str) -> list[Path]:
    return [Path(entry).absolute() for entry in os.environ.get(variable, "").split(os.pathsep) if entry]


def _is_name(name: str) -> bool:
    return bool(name) and name not in (".", "..") and not set(name) & {"/", "\\", "\0"}


def _candidates(name: str, start: Path) -> Iterator[Path]:
    for folder in (start, *start.parents):
        if folder.name == name or (folder / MANIFEST).is_file():
            yield folder
        yield folder / name
        yield from _with_manifest(folder)
    for folder in _listed("ROS_PACKAGE_PATH"):
        yield from (folder, folder / name)
        yield from _below(folder, name, DEPTH)


def _with_manifest(folder: Path) -> Iterator[Path]:
    for child in _subfolders(folder):
        if (child / MANIFEST).is_file():
            yield child


def _below(folder: Path, name: str, depth: int) -> Iterator[Path]:
    for child in _subfolders(folder):
        if child.name == name or (child / MANIFEST).is_file():
            yield child
        elif depth > 1:
            yield from _below(child, name, depth - 1)


def _subfolders(folder: Path) -> list[Path]:
    try:
        entries = sorted(folder.iterdir()) if folder.is_dir() else []
        return [] if len(entries) > MANY else [entry for entry in entries if entry.is_dir()]
    except OSError:
        return []


def _is_folder(path: Path) -> bool:
    try:
        return path.is_dir()
    except OSError:
        return False


def _is_package(folder: Path, name: str) -> bool:
    if not _is_folder(folder):
        return False
    said = _said_name(folder / MANIFEST)
    return said == name if said is not None else folder.name == name


def _said_name(manifest: Path) -> str | None:
    """The name a package.xml says; None if there is none that can be read."""
    try:
        with manifest.open("rb") as stream:
            root = root_element(parse_bytes(stream.read(MANIFEST_BYTES), str(manifest)))
    except (OSError, ModelError):
        return None
    if root.tagName != "package":
        return None
    for child in root.getElementsByTagName("name"):
        if child.parentNode is root:
            return "".join(node.data for node in child.childNodes if node.nodeType == node.TEXT_NODE).strip() or None
    return None


def _places(start: Path) -> str:
    above = start if start.is_dir() else start.parent
    places = [f"upwards from {str(above)!r}"]
    for variable in ("ROS_PACKAGE_PATH", "AMENT_PREFIX_PATH", "CMAKE_PREFIX_PATH"):
        folders = ", ".join(map(str, _listed(variable)))
        if folders or variable != "CMAKE_PREFIX_PATH":
            places.append(f"in {variable} ({folders or 'not set'})")
    return ", ".join([*places, "and among the robots that pip or conda installed"])
