"""Everything wrong or suspicious in a model at once, with file and line."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from drillrig_pin.check_pose import check_pose, check_start
from drillrig_pin.constraints import Loop
from drillrig_pin.elements.cylinder import Cylinder
from drillrig_pin.elements.springs import Spring
from drillrig_pin.errors import ModelError, Source
from drillrig_pin.fitting import fitted
from drillrig_pin.model.inertias import extent, gyration
from drillrig_pin.model.modelfile import ModelFile, read_model, read_model_text
from drillrig_pin.model.problem import Problem
from drillrig_pin.model.urdfcheck import check_urdf
from drillrig_pin.plausible import implausible
from drillrig_pin.rig import Rig, assemble_rig, parse_elements
from drillrig_pin.scenario import Scenario
from drillrig_pin.scene.links import machine_size
from drillrig_pin.scene.shapes import corners
from drillrig_pin.scene.visuals import link_visuals


def check_model(
    path_or_name: str | Path,
    arguments: Mapping[str, Any] | None = None,
    packages: Mapping[str, str | Path] | None = None,
    scenario: Scenario | None = None,
) -> list[Problem]:
    """Findings about a model file: errors first, each kind in the order of the files.

    A file that cannot be read at all is one finding. Otherwise: links, joints and inertias; extension elements and the
    names they use; elements with both ends on one body; numbers that are hardly meant; then every pose (the zero
    position where the model names none): joint limits, strokes, lever arms, assembly, redundant constraints, static
    balance and pressures.

    Args:
        path_or_name: path of a model file, or name of a shipped model.
        arguments: xacro arguments by name.
        packages: folders of packages by name, see :func:`drillrig_pin.model.modelfile.read_model`.
        scenario: the state in which this one starts is judged instead of the poses; its model is not looked at.
    """
    try:
        file = read_model(path_or_name, arguments, packages)
    except ModelError as error:
        return [_as_problem(error, str(path_or_name))]
    return _check(file, scenario)


def check_text(text: str, name: str) -> list[Problem]:
    """The same about a model that is not in a file; it needs no xacro."""
    try:
        file = read_model_text(text, name)
    except ModelError as error:
        return [_as_problem(error, name)]
    return _check(file)


def check_document(model: str, problems: list[Problem]) -> dict[str, Any]:
    """Findings as programs read them."""
    errors = sum(problem.severity == "error" for problem in problems)
    return {
        "model": model,
        "errors": errors,
        "warnings": len(problems) - errors,
        "problems": [
            {
                "severity": problem.severity,
                "message": problem.message,
                "file": problem.source.file,
                "line": problem.source.line,
                "advice": problem.advice,
            }
            for problem in problems
        ],
    }


def _check(file: ModelFile, scenario: Scenario | None = None) -> list[Problem]:
    problems = [*file.warnings, *check_urdf(file.root)]
    if any(problem.severity == "error" for problem in problems):
        # Without a sound tree there is no machine to place, but every element can still be read on its own.
        return _sorted([*problems, *parse_elements(file)[2]])
    return _sorted([*problems, *_check_rig(file, scenario)])


def _check_rig(file: ModelFile, scenario: Scenario | None) -> list[Problem]:
    try:
        rig, problems = assemble_rig(file)
    except ModelError as error:
        return [_as_problem(error, file.path)]
    if scenario is not None and scenario.lock and not problems:
        try:
            rig = fitted(rig, scenario)
        except ModelError as error:
            return [_as_problem(error, file.path)]
    problems = [*problems, *_same_body(rig), *implausible(rig), *_doubtful(rig), *_looks(rig)]
    sound = not any(problem.severity == "error" for problem in problems)
    if scenario is not None:
        return [*problems, *check_start(rig, scenario, statics=sound)]
    for pose in rig.poses or [None]:
        problems += check_pose(rig, pose, statics=sound)
    return problems


def _doubtful(rig: Rig) -> list[Problem]:
    """What elements decided when they were read, where that is doubtful."""
    return [
        Problem("warning", remark.text, rig.sources.get(element.name, Source(rig.file.path)), remark.advice)
        for element in rig.forces
        for remark in element.remarks()
        if remark.advice
    ]


def _looks(rig: Rig) -> list[Problem]:
    """Shapes that are not drawn as the file means them, and inertias that do not fit their meshes."""
    visuals, faults = link_visuals(rig.file.root, rig.file.folder, machine_size(rig))
    # What the tree's own check says of an attribute need not be said again.
    said = {(problem.source, _quoted(problem.message)) for problem in check_urdf(rig.file.root)}
    found = [
        Problem("warning", str(fault), fault.source, fault.todo)
        for fault in faults
        if (fault.source, _quoted(fault.what)) not in said
    ]
    wrong = {fault.link for fault in faults if not fault.drawn}
    for link in rig.file.root.named("link"):
        name = link.attributes.get("name", "")
        if name in visuals and name not in wrong and not any(extent(link)):
            # Meshes: their size is known only now.
            box = np.vstack([corners(visual.shape, visual.placement) for visual in visuals[name]])
            found += gyration(link, np.ptp(box, axis=0).tolist())
    return found


def _quoted(message: str) -> str:
    """What a message is about: attribute and value as in ``rgba = '1 0'``, or a shape that there is not."""
    found = re.search(r"\S+ = '[^']*'|(?<=element )<\S+> in <geometry|(?<=geometry )<\S+>", message)
    return found.group().partition(" in <geometry")[0] if found else message


def _same_body(rig: Rig) -> list[Problem]:
    """Elements between two points of one body can do nothing."""
    found = []
    for item in (*rig.forces, *rig.constraints):
        if isinstance(item, Cylinder | Spring | Loop) and rig.point(item.start).joint == rig.point(item.end).joint:
            found.append(
                Problem(
                    "warning",
                    f"<{item.tag} {item.name!r}>: {item.start!r} and {item.end!r} sit on one body, it moves nothing",
                    rig.sources.get(item.name, Source(rig.file.path)),
                    "Put one end on another link.",
                )
            )
    return found


def _as_problem(error: ModelError, path: str) -> Problem:
    where = error.where
    source = where if isinstance(where, Source) else Source(str(where) if where is not None else path)
    return Problem("error", error.what, source, error.todo)


def _sorted(problems: list[Problem]) -> list[Problem]:
    unique = list(dict.fromkeys(problems))
    return sorted(unique, key=lambda problem: problem.severity != "error")
