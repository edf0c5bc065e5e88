"""The tree of bodies and joints, loaded by Pinocchio from a model file, and held against that file."""

from __future__ import annotations

import os
import re
import sys
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import IO, Any

import numpy as np
import pinocchio as pin

from drillrig_pin.errors import ModelError
from drillrig_pin.model.modelfile import ModelFile
from drillrig_pin.model.nodes import Node
from drillrig_pin.model.numbers import placement
from drillrig_pin.model.problem import Problem
from drillrig_pin.model.tree_text import child, inertial_numbers, tree_text
from drillrig_pin.tree_data import make_data

#: Share by which a mass or inertia of the loaded tree may differ from the file: rounding of a few operations.
ROUNDING = 1e-9
#: Square root of the inertia [kg^0.5 m or kg^0.5] that a dof moves, below which it moves none.
STILL = 1e-9
#: Least eigenvalue of the mass matrix, scaled to ones on its diagonal, of which anything is left beside rounding.
SINGULAR_MASS = 1e-13
# The stream of errors belongs to the whole process.
_STREAM = threading.Lock()
#: How the URDF reader below Pinocchio speaks, and the line after it that names its own source file.
_GRUMBLE = re.compile(r"^(?:\x1b\[[0-9;]*m)?(?:Error|Warning):\s*(.*?)(?:\x1b\[[0-9;]*m)?$")
_ITS_SOURCE = re.compile(r"^\s*at line \d+ in \S+")


def load_tree(file: ModelFile) -> Any:
    """Pinocchio's model of a file whose URDF part is sound.

    Raises:
        ModelError: Pinocchio cannot load it, complains, or has other bodies than the file.
    """
    text = tree_text(file.root)
    with _listening() as words:
        try:
            model = pin.buildModelFromXML(text)
        except Exception as error:
            model, reason = None, " ".join(str(error).split())
    if model is None or words:
        said = "; ".join(words) or reason
        raise ModelError(f"Pinocchio cannot load the model ({said})", where=file.path)
    _compare(model, file)
    return model


def massless_joints(model: Any, file: ModelFile) -> Iterator[Problem]:
    """Joints that move no mass: their acceleration is not determined. Outermost ones only, each with its link.

    Links without mass between others, as in the cross of a universal joint, are none.
    """
    moves = [bool(np.abs(inertia.matrix()).max() > 0.0) for inertia in model.inertias]
    for joint in range(model.njoints - 1, 0, -1):
        moves[model.parents[joint]] = moves[model.parents[joint]] or moves[joint]
    nodes = {node.attributes.get("name", ""): node for node in file.root.named("joint")}
    coupled = {name for name, node in nodes.items() if child(node, "mimic") is not None}
    coupled |= {end.attributes.get("joint", "") for node in nodes.values() for end in node.named("mimic")}
    for joint in range(1, model.njoints):
        parent = int(model.parents[joint])
        node = nodes[model.names[joint]]
        # A joint that follows another is moved by that one, whatever it carries; that one moves what both carry.
        if moves[joint] or (parent > 0 and not moves[parent]) or model.names[joint] in coupled:
            continue
        end = child(node, "child")
        link = end.attributes.get("link", "") if end is not None else ""
        yield Problem(
            "error",
            f"joint {model.names[joint]!r} moves no mass: link {link!r} (and what hangs on it) has no <inertial> with "
            "a mass",
            node.source,
            "Give it its mass, or make the joint fixed.",
        )


def unresisted(model: Any, q: Any) -> list[int]:
    """Entries of v whose acceleration the masses do not determine in a configuration: the mass matrix is singular.

    E.g. a hinge through its only point mass, or two hinges in one line with nothing between them.
    """
    M = pin.crba(model, make_data(model), q)
    M = np.triu(M) + np.triu(M, 1).T
    size = np.sqrt(np.maximum(np.diag(M), 0.0))
    still = size < STILL
    if not still.any() and np.isfinite(M).all():
        values, vectors = np.linalg.eigh(M / np.outer(size, size))
        still = np.abs(vectors[:, 0]) > 0.1 if values[0] < SINGULAR_MASS else still
    return [int(i) for i in np.flatnonzero(still)]


@np.errstate(all="ignore")
def _compare(model: Any, file: ModelFile) -> None:
    """Every link of the file must be in the tree, and every joint must move the mass and inertia of its links.

    Raises:
        ModelError: the first that is not so.
    """
    moved = [np.zeros((6, 6)) for _ in model.inertias]
    first: dict[int, Node] = {}
    for link in file.root.named("link"):
        name = link.attributes.get("name", "")
        if not model.existBodyName(name):
            raise ModelError(f"link {name!r} is missing in the loaded tree", where=link.source)
        frame = model.frames[model.getBodyId(name)]
        # A wrench in the link's frame from a twist in the joint's: I_joint = X* I_link X^-1.
        inverse = frame.placement.inverse().action
        moved[frame.parentJoint] += inverse.T @ _inertia(link) @ inverse
        first.setdefault(frame.parentJoint, link)
    for joint, link in first.items():
        if joint == 0:
            continue  # it does not move
        loaded = model.inertias[joint].matrix()
        if not np.abs(loaded - moved[joint]).max() <= ROUNDING * max(1.0, float(np.abs(moved[joint]).max())):
            raise ModelError(
                f"link {link.attributes.get('name', '')!r}, with what is fixed to it, has {loaded[0, 0]:g} kg in the "
                f"loaded tree and {moved[joint][0, 0]:g} kg in the file, or another inertia",
                where=link.source,
            )


def _inertia(link: Node) -> Any:
    """Spatial inertia (6, 6) of a link about its own frame, from the numbers of the file."""
    inertial = child(link, "inertial")
    if inertial is None:
        return np.zeros((6, 6))
    mass, (xx, xy, xz, yy, yz, zz) = inertial_numbers(inertial)
    xyz, rpy = placement(child(inertial, "origin"))
    R, c = pin.rpy.rpyToMatrix(*rpy), pin.skew(np.array(xyz))
    central = R @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ R.T
    return np.block([[mass * np.eye(3), -mass * c], [mass * c, central - mass * c @ c]])


@contextmanager
def _listening() -> Iterator[list[str]]:
    """What the URDF reader writes to the stream of errors, without its build paths; anything else is passed on."""
    words: list[str] = []
    with _STREAM:
        try:
            sys.stderr.flush()
            kept = os.dup(2)
        except (OSError, AttributeError):
            # There is no stream of errors: nothing to catch.
            yield words
            return
        with tempfile.TemporaryFile() as stream:
            try:
                os.dup2(stream.fileno(), 2)
                try:
                    yield words
                finally:
                    os.dup2(kept, 2)
            finally:
                os.close(kept)
            _sort(stream, words)


def _sort(stream: IO[bytes], words: list[str]) -> None:
    stream.seek(0)
    others = []
    for line in stream.read().decode(errors="replace").splitlines():
        if grumble := _GRUMBLE.match(line):
            words.append(grumble[1].strip())
        elif line.strip() and not _ITS_SOURCE.match(line):
            others.append(line)
    if others:
        os.write(2, ("\n".join(others) + "\n").encode())
