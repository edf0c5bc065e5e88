"""Commands that look at a machine at rest: is the model sound, what does it carry."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from drillrig_pin.cli.case import (
    Json,
    Locks,
    ModelName,
    ModelSettings,
    OptionalModelName,
    Packages,
    ScenarioName,
    Settings,
    model_arguments,
    read_rig,
    read_scenario,
)
from drillrig_pin.cli.guard import FAILED
from drillrig_pin.cli.output import console, decimals, number, percent, print_json, table

if TYPE_CHECKING:
    from drillrig_pin.model.problem import Problem
    from drillrig_pin.rig import Rig
    from drillrig_pin.scenario import Scenario
    from drillrig_pin.statics import Equilibrium


def check(
    model: ModelName,
    scenario: Annotated[
        str | None,
        typer.Option(
            "--scenario",
            "-s",
            metavar="S",
            help="Judge the state in which this scenario starts. Default: the poses of the model.",
            show_default=False,
        ),
    ] = None,
    settings: ModelSettings = None,
    packages: Packages = None,
    lock: Locks = None,
    json: Json = False,
) -> None:
    """List everything wrong or suspicious in a model, with file and line.

    Errors keep the model from being used and make the exit code 1; warnings do not. With --lock the start of a run with
    these joints locked is judged.

    Example:  [bold]drillrig check mkz49 --set model.boom_length=2.1[/]
    """
    from drillrig_pin.check import check_document, check_model

    case = read_scenario(model, scenario, settings, lock) if scenario is not None or lock else None
    arguments = case.arguments if case is not None else model_arguments(settings)
    problems = check_model(model, arguments, scenario=case)
    document = check_document(model, problems)
    errors, warnings = document["errors"], document["warnings"]
    if json:
        print_json(document)
    else:
        out = console()
        for problem in problems:
            out.print(
                str(problem), markup=False, style="red" if problem.severity == "error" else "yellow", soft_wrap=True
            )
        verdict = f"{_count(errors, 'error')}, {_count(warnings, 'warning')}"
        out.print(f"{model}: {verdict if problems else 'nothing wrong found'}.", markup=False, soft_wrap=True)
    if errors:
        raise typer.Exit(FAILED)


def _count(n: int, word: str) -> str:
    return f"{n or 'no'} {word}{'' if n == 1 else 's'}"


def static(
    model: OptionalModelName = None,
    scenario: ScenarioName = None,
    settings: Settings = None,
    packages: Packages = None,
    lock: Locks = None,
    json: Json = False,
) -> None:
    """Print what the machine carries at rest, before drilling: holding forces, pressures, reactions.

    Pressures are absolute. Force is positive where a cylinder pushes its pins apart.

    Example:  [bold]drillrig static mkz49 --set model.boom_length=2.1[/]
    """
    from drillrig_pin.check import check_document
    from drillrig_pin.fitting import locked_words
    from drillrig_pin.simulation import start_state

    case = read_scenario(model, scenario, settings, lock)
    rig = read_rig(case)
    rest = start_state(rig, case)
    problems = _findings(rig, case)
    cylinders = _cylinders(rig, rest)
    units = {row.name: "N" if row.unit == "m" else "N m" for row in rig.rows}
    if json:
        print_json(
            {
                "model": rig.file.path,
                "scenario": case.name,
                "q": dict(zip(rig.coordinate_names, rest.assembly.q.tolist(), strict=True)),
                "locked": rig.locked,
                "moved_by_assembly": rest.assembly.moved,
                "redundant": list(rest.assembly.redundant),
                "singular": list(rest.assembly.singular),
                "cylinders": cylinders,
                "elements": {name: {"held": force, "coordinate": rest.x0[name]} for name, force in _others(rig, rest)},
                "reactions": dict(zip(units, rest.reaction.tolist(), strict=True)),
                "unbalanced": dict(zip(rig.dof_names, rest.unbalanced.tolist(), strict=True)),
                "shared_by_stiffness": list(rest.shared),
                "indeterminate_reactions": rest.spread,
                "at_rest": rest.at_rest,
                "problems": check_document(rig.file.path, problems)["problems"],
            }
        )
        return
    out = console()
    out.print(f"[bold]{case.name}[/] at rest, {rig.file.path}")
    for words in locked_words(rig):
        out.print(f"note: {words}", markup=False, soft_wrap=True)
    for line in (*_moved(rest), *rest.sharing):
        out.print(line, markup=False, soft_wrap=True)
    if cylinders:
        rows = [
            (
                name,
                decimals(c["force"] / 1e3, 2),
                decimals(c["length"], 4),
                percent(c["stroke_used"]),
                decimals(c["pressure_a"] / 1e5, 1),
                decimals(c["pressure_b"] / 1e5, 1),
                decimals(c["relief"] / 1e5, 0),
            )
            for name, c in cylinders.items()
        ]
        heads = ("cylinder", "force kN", "length m", "of stroke", "A bar", "B bar", "relief bar")
        out.print(table("Cylinders; pressures are absolute", heads, rows), "")
    others = list(_others(rig, rest))
    if others:
        out.print(table("Held by springs", ("element", "N or N m"), [(n, number(f)) for n, f in others]), "")
    if units:
        carried = [(n, number(float(f)), u) for (n, u), f in zip(units.items(), rest.reaction, strict=True)]
        out.print(table("Reactions of holds and loops on the machine", ("row", "value", "unit"), carried))
    if not (cylinders or others or units):
        out.print("Nothing in this model holds: no cylinders, springs or constraints.")
    if not rest.at_rest:
        loose = [
            f"{name} ({number(float(force))})"
            for name, force in zip(rig.dof_names, rest.unbalanced, strict=True)
            if abs(force) > 1e-6
        ]
        out.print(
            f"\nwarning: nothing carries {', '.join(loose)} [N or N m]: the machine moves by itself.", style="yellow"
        )
    for problem in problems:
        # Said above in the words of this command: what nothing carries, and rows that depend on others.
        if not any(words in problem.message for words in ("nothing carries", "redundant", "singular")):
            style = "red" if problem.severity == "error" else "yellow"
            out.print(str(problem), markup=False, style=style, soft_wrap=True)


def _findings(rig: Rig, case: Scenario) -> list[Problem]:
    """What `check` says of the numbers and of this start."""
    from drillrig_pin.check_pose import check_start
    from drillrig_pin.plausible import implausible

    return [*implausible(rig), *check_start(rig, case)]


def _cylinders(rig: Rig, rest: Equilibrium) -> dict[str, dict[str, Any]]:
    from drillrig_pin.elements.cylinder import ATMOSPHERE, Cylinder

    found = {}
    for element in rig.forces:
        if isinstance(element, Cylinder):
            length = rest.x0[element.name]
            a, b = rest.pressures[element.name]
            found[element.name] = {
                "force": rest.held[element.name],
                "length": length,
                "stroke_used": (length - element.length_range[0]) / element.stroke,
                "pressure_a": a + ATMOSPHERE,
                "pressure_b": b + ATMOSPHERE,
                "relief": element.relief_pressure + ATMOSPHERE,
            }
    return found


def _others(rig: Rig, rest: Equilibrium) -> list[tuple[str, float]]:
    return [(name, force) for name, force in rest.held.items() if name not in rest.pressures]


def _moved(rest: Equilibrium) -> list[str]:
    from drillrig_pin.dependence import singular_words

    moved = {name: value for name, value in rest.assembly.moved.items() if abs(value) > 1e-9}
    lines = []
    if moved:
        words = ", ".join(f"{name} {value:+.4g}" for name, value in moved.items())
        lines.append(f"Assembly moved the pose onto its constraints [rad or m]: {words}.")
    if rest.assembly.redundant:
        lines.append(f"Redundant constraint rows: {', '.join(rest.assembly.redundant)}.")
    if rest.assembly.singular:
        words = singular_words(rest.assembly.singular)
        lines.append(f"Singular position: {words}. Reactions are one choice of many.")
    return lines
