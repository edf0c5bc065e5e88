"""Is one pose of a machine sound: joint limits, strokes, lever arms, constraints, static balance, pressures."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from drillrig_pin.assembly import Assembly, assemble_state
from drillrig_pin.dependence import singular_words
from drillrig_pin.elements.cylinder import ATMOSPHERE, Cylinder
from drillrig_pin.errors import AssemblyError, LockedError, Source
from drillrig_pin.fitting import fitted, start_configuration
from drillrig_pin.joint_limits import outside_limits
from drillrig_pin.kinematics import Array
from drillrig_pin.model.document_text import escaped
from drillrig_pin.model.problem import Problem
from drillrig_pin.rig import Rig
from drillrig_pin.scenario import Scenario
from drillrig_pin.statics import find_equilibrium
from drillrig_pin.tree import unresisted
from drillrig_pin.words import listed
from drillrig_pin.workspace import Workspace

#: Share of its stroke a cylinder should have to spare at both ends.
SPARE = 0.1
#: Shortest lever arm [m] with which a cylinder should turn a joint.
LEVER_ARM = 0.1
#: A cylinder whose length follows a slide by more than this [m/m] drives the slide; its lever arms do not matter.
DRIVES_SLIDE = 0.5
#: Pins closer than this [m] are one point: the line between them has no direction.
COINCIDENT = 1e-6
#: Absolute pressure [Pa] below which oil releases its air.
GAS_RELEASE = 1e5
#: What to do where only the zero position can be judged.
NO_POSE = "The model names no pose: add one, or judge the start of a scenario with drillrig check MODEL --scenario S."
#: Gauge pressure [Pa] a chamber should at least have at rest, for what drilling takes off it.
SPARE_PRESSURE = 1e5
#: Unbalanced static forces below this [N or N m] are rounding.
BALANCED = 1e-6
SINGULAR_ADVICE = (
    "The machine cannot move there, or may go on in more than one way; a run that starts there stops at once. "
    "Start from another pose, hold fewer axes, or pass it with scenario.formulation=damped."
)


def check_pose(rig: Rig, pose: str | None, *, statics: bool = True) -> list[Problem]:
    """Findings about a named pose; None: all joints at zero. Statics only for a model without errors so far."""
    label = f"pose {pose!r}" if pose is not None else "the zero position"
    where = rig.sources.get(pose or "", Source(rig.file.path))
    try:
        q = rig.configuration(pose)
    except LockedError as error:
        # A run starts in the first pose unless it is told another.
        severity = "error" if pose == next(iter(rig.poses), None) else "warning"
        return [Problem(severity, f"{label} cannot be taken: {error.what}", where, error.todo)]
    return _check_state(rig, q, label, where, {}, named=pose is not None, statics=statics)


def check_start(rig: Rig, scenario: Scenario, *, statics: bool = True) -> list[Problem]:
    """Findings about the state in which a scenario starts.

    Raises:
        ScenarioError: the scenario does not fit the rig.
    """
    label, where = f"the start of {scenario.name!r}", Source(rig.file.path)
    rig = fitted(rig, scenario)
    q = start_configuration(rig, scenario)
    return _check_state(rig, q, label, where, scenario.targets, named=True, statics=statics)


def _check_state(
    rig: Rig, q: Array, label: str, where: Source, targets: dict[str, float], *, named: bool, statics: bool
) -> list[Problem]:
    problems = list(_limits(rig, q, label, where, named=named))
    with np.errstate(all="ignore"):
        try:
            assembly = assemble_state(rig, q, np.zeros(rig.model.nv), targets)
        except (AssemblyError, np.linalg.LinAlgError) as error:
            what = error.what if isinstance(error, AssemblyError) else "the constraints cannot be evaluated"
            todo = error.todo if isinstance(error, AssemblyError) else ""
            return [
                *problems,
                Problem("error", f"{label}: {what}", where, todo if named else f"{todo} {NO_POSE}".strip()),
            ]
        if statics:
            problems += _without_inertia(rig, assembly.q, label, where)
        problems += _dependent(rig, assembly, label, where, named=named)
        problems += _cylinders(rig, assembly.q, label)
        if statics and not assembly.singular and not any(problem.severity == "error" for problem in problems):
            try:
                problems += _statics(rig, assembly, label, where)
            except AssemblyError as error:
                problems.append(Problem("error", f"{label}: {error.what}", where, error.todo))
    return problems


def _limits(rig: Rig, q: Array, label: str, where: Source, *, named: bool) -> Iterator[Problem]:
    outside = outside_limits(rig, q)
    if named:
        for row in outside:
            # A scenario may start anywhere, and its run says so; a pose that the model itself names contradicts it.
            severity = "error" if label.startswith("pose ") else "warning"
            yield Problem(severity, f"{label}: {row}", where, "Change the pose or the joint's <limit>.")
    elif outside:
        joints = "".join(f'<joint name="{escaped(row.joint)}" position="{row.within:g}"/>' for row in outside)
        yield Problem(
            "warning",
            f"the model names no pose, and in its zero position {'; '.join(map(str, outside[:4]))}"
            + (f"; and {len(outside) - 4} more" if len(outside) > 4 else ""),
            where,
            f'Add to a <drillrig> block: <pose name="start">{joints}</pose>.',
        )


def _without_inertia(rig: Rig, q: Array, label: str, where: Source) -> Iterator[Problem]:
    """Dofs whose acceleration the masses do not determine, e.g. a hinge through its only point mass."""
    found = unresisted(rig.model, q)
    if found:
        names = ", ".join(repr(rig.dof_names[i]) for i in found)
        yield Problem(
            "error",
            f"{label}: no mass or inertia resists a motion of {names}",
            where,
            "Give the links moved by it their inertia, or make a joint fixed.",
        )


def _dependent(rig: Rig, assembly: Assembly, label: str, where: Source, *, named: bool) -> Iterator[Problem]:
    if assembly.redundant:
        constraints = dict.fromkeys(row.rpartition(".")[0] for row in assembly.redundant)
        many = f" of {len(constraints)} constraints" if len(constraints) > 1 else ""
        # Without the pose: what holds all along the motion is one finding for all poses.
        yield Problem(
            "warning",
            f"redundant constraint rows {listed(assembly.redundant)}{many}: each follows from the rows before it",
            rig.sources.get(next(iter(constraints)), Source(rig.file.path)),
            "The motion is right; how the reaction is shared among dependent rows is a least-norm choice.",
        )
    if assembly.singular:
        # A scenario may start a machine without named poses anywhere.
        yield Problem(
            "error" if named else "warning",
            f"{label} is a singular position: {singular_words(assembly.singular)}",
            where if named else rig.sources.get(assembly.singular[0].rpartition(".")[0], where),
            SINGULAR_ADVICE,
        )


def _cylinders(rig: Rig, q: Array, label: str) -> Iterator[Problem]:
    cylinders = [element for element in rig.forces if isinstance(element, Cylinder)]
    space = Workspace(rig, cylinders)
    space.update(q, np.zeros(rig.model.nv))
    for cylinder, i in zip(cylinders, space.index, strict=True):
        where = rig.sources.get(cylinder.name, Source(rig.file.path))
        length = float(space.x[i])
        if not length > COINCIDENT:
            yield Problem(
                "error",
                f"{label}: pins {cylinder.start!r} and {cylinder.end!r} of cylinder {cylinder.name!r} coincide",
                where,
                "Move one of them: the cylinder has no direction.",
            )
            continue
        yield from _stroke(cylinder, length, label, where)
        yield from _lever_arm(rig, cylinder, space.rows[i], label, where)


def _stroke(cylinder: Cylinder, length: float, label: str, where: Source) -> Iterator[Problem]:
    shortest, longest = cylinder.length_range
    used = (length - shortest) / cylinder.stroke
    facts = f"{length:.4f} m long, its stroke runs from {shortest:.4f} to {longest:.4f} m"
    if not 0 < used < 1:
        yield Problem(
            "error",
            f"{label}: cylinder {cylinder.name!r} is outside its stroke: {facts}",
            where,
            "Move a pin, change length_retracted or the dead lengths, or change the pose.",
        )
    elif not SPARE <= used <= 1 - SPARE:
        yield Problem(
            "warning",
            f"{label}: cylinder {cylinder.name!r} is within {100 * SPARE:g} % of an end of its stroke: {facts}",
            where,
        )


def _lever_arm(rig: Rig, cylinder: Cylinder, row: Array, label: str, where: Source) -> Iterator[Problem]:
    if not row.any():
        return  # between points of one body, which is said
    kinds = {node.attributes.get("name"): node.attributes.get("type") for node in rig.file.root.named("joint")}
    turned = [(abs(float(arm)), name) for arm, name in zip(row, rig.dof_names, strict=True) if _turns(kinds.get(name))]
    slides = [abs(float(rate)) for rate, name in zip(row, rig.dof_names, strict=True) if kinds.get(name) == "prismatic"]
    if max(slides, default=0.0) > DRIVES_SLIDE:
        return
    arm, joint = max(turned, default=(0.0, ""))
    if joint and arm < LEVER_ARM:
        yield Problem(
            "warning",
            f"{label}: cylinder {cylinder.name!r} has a lever arm of {arm:.3g} m on joint {joint!r}, "
            f"less than {LEVER_ARM:g} m",
            where,
            "Small arms mean large forces; move a pin away from the joint's axis.",
        )


def _turns(kind: str | None) -> bool:
    return kind in ("revolute", "continuous")


def _statics(rig: Rig, assembly: Assembly, label: str, where: Source) -> Iterator[Problem]:
    equilibrium = find_equilibrium(rig, assembly)
    for words in equilibrium.sharing:
        advice = "Check the stiffness of what shares it, or leave out what is not there when it is loaded."
        yield Problem("warning", f"{label}: {words}", where, advice)
    loose = [
        f"{name!r} ({force:.3g})"
        for name, force in zip(rig.dof_names, equilibrium.unbalanced, strict=True)
        if not abs(force) <= BALANCED
    ]
    if loose:
        yield Problem(
            "warning",
            f"{label}: nothing carries the weight on {', '.join(loose)} [N or N m]: the machine does not rest here",
            where,
            "Add a cylinder, spring, torque or hold, or expect it to move by itself.",
        )
    for cylinder in rig.forces:
        if not isinstance(cylinder, Cylinder):
            continue
        source = rig.sources.get(cylinder.name, Source(rig.file.path))
        for chamber, pressure in zip("AB", equilibrium.pressures[cylinder.name], strict=True):
            bar = (pressure + ATMOSPHERE) / 1e5
            if 0.0 <= pressure < SPARE_PRESSURE and pressure + ATMOSPHERE >= GAS_RELEASE:
                yield Problem(
                    "warning",
                    f"{label}: chamber {chamber} of cylinder {cylinder.name!r} rests at {bar:.4g} bar absolute: "
                    "as soon as drilling takes load off it, its oil releases air",
                    source,
                    "Give it a precharge, e.g. 2e6 Pa.",
                )
            if pressure + ATMOSPHERE < GAS_RELEASE:
                yield Problem(
                    "warning",
                    f"{label}: chamber {chamber} of cylinder {cylinder.name!r} rests at {bar:.4g} bar absolute, "
                    "below 1 bar: its oil releases air",
                    source,
                    "Raise its precharge.",
                )
            if pressure > cylinder.relief_pressure:
                limit = (cylinder.relief_pressure + ATMOSPHERE) / 1e5
                yield Problem(
                    "warning",
                    f"{label}: chamber {chamber} of cylinder {cylinder.name!r} rests at {bar:.4g} bar absolute, "
                    f"above its relief pressure of {limit:.4g} bar",
                    source,
                    "Take a larger bore or a longer lever arm.",
                )
