"""Commands about model files: what is shipped, what numbers they carry, what they expand to."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from drillrig_pin.cli.case import (
    Json,
    Locks,
    ModelName,
    ModelSettings,
    Packages,
    model_arguments,
    read_rig,
    read_scenario,
)
from drillrig_pin.cli.output import console, print_json, table, working
from drillrig_pin.cli.targets import Force, console_beside, require_target


def params(
    model: ModelName,
    assumed: Annotated[bool, typer.Option("--assumed", help="Only what no source prints.")] = False,
    effect: Annotated[
        bool,
        typer.Option(
            "--effect", help="Say which links, joints and elements each enters; takes a minute for 200 numbers."
        ),
    ] = False,
    settings: ModelSettings = None,
    packages: Packages = None,
    json: Json = False,
) -> None:
    """List the numbers of a model with unit and source.

    Every name is an argument: set it with --set model.NAME=VALUE.

    With --effect the model is expanded once more for each number, changed by a thousandth, and compared: what follows
    it is named, and whether that acts on the machine at all.

    Example:  [bold]drillrig params mkz49 --assumed[/]
    """
    from drillrig_pin.model.modelfile import read_model

    arguments = model_arguments(settings)
    file = read_model(model, arguments)
    rows = [row for row in file.parameters().values() if row.assumed or not assumed]
    entered = {}
    if effect:
        from drillrig_pin.model.reach import reach

        with working(f"expanding the model {len(rows)} times"):
            entered = {row.name: reach(file, row.name, model, arguments) for row in rows if row.unit != "word"}
    if json:
        print_json(
            {
                "model": file.path,
                "parameters": [
                    {
                        **(
                            {"enters": entered[row.name].acts, "idle": entered[row.name].idle}
                            if row.name in entered
                            else {}
                        ),
                        **{key: getattr(row, key) for key in ("name", "value", "default", "unit", "source", "text")},
                        "assumed": row.assumed,
                        "changed": row.changed,
                    }
                    for row in rows
                ],
            }
        )
        return
    out = console()
    if not rows:
        what = "no assumed numbers" if assumed else "no parameter table"
        out.print(f"{file.path} carries {what}.", markup=False)
        return
    marks = {(True, False): "changed", (False, True): "assumed", (False, False): ""}
    cells = [
        (row.name, row.value, row.unit, marks[row.changed, row.assumed], _source(row.source, row.text)) for row in rows
    ]
    if effect:
        cells = [(*cell[:4], str(entered[cell[0]]) if cell[0] in entered else "a word, not tried") for cell in cells]
    last = "enters" if effect else "meaning and source"
    out.print(table("", ("name", "value", "unit", "", last), cells, text=5))
    counts = (
        f"{len(rows)} numbers, {sum(row.assumed for row in rows)} assumed, {sum(row.changed for row in rows)} changed"
    )
    if effect:
        idle = sum(found.none for found in entered.values())
        counts += f"; {idle} of {len(entered)} tried act on nothing and change no result"
    else:
        counts += ". Which of them change no result: --effect"
    out.print(f"\n{counts}. Change one with --set model.NAME=VALUE.", markup=False)


def _source(source: str, text: str) -> str:
    return f"{text} ({source})" if source and text else text or source


def expand(
    model: ModelName,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="FILE", help="Where to write. Default: to the screen.")
    ] = None,
    settings: ModelSettings = None,
    packages: Packages = None,
    lock: Locks = None,
    force: Force = False,
    json: Json = False,
) -> None:
    """Write the expanded URDF: one file without xacro that other robotics tools open.

    Example:  [bold]drillrig expand mkz49 -o mkz49.urdf[/]
    """
    import sys

    from drillrig_pin.cli.files import write_text
    from drillrig_pin.model.modelfile import read_model

    arguments = model_arguments(settings)
    file = read_rig(read_scenario(model, None, settings, lock)).file if lock else read_model(model, arguments)
    if output is not None:
        # The same text once more is no loss.
        same = output.is_file() and output.read_bytes() == file.text.encode()
        require_target(output, "expanded model", reads=file.files, force=force or same)
        write_text(output, file.text)
    if json:
        document = {"model": file.path, "arguments": file.arguments, "output": str(output) if output else None}
        print_json(document if output else {**document, "text": file.text})
    elif output is None:
        # The bytes that -o writes: XML that declares no encoding is UTF-8, whatever the terminal's is.
        sys.stdout.flush()
        sys.stdout.buffer.write(file.text.encode())
    else:
        console_beside(output).print(f"{output} written ({len(file.text.splitlines())} lines).", markup=False)


def models(json: Json = False) -> None:
    """List the models that come with the package.

    Example:  [bold]drillrig models[/]
    """
    from drillrig_pin.files import shipped_models
    from drillrig_pin.model.nodes import short_path

    found = {name: short_path(path) for name, path in shipped_models().items()}
    if json:
        print_json({"models": found})
        return
    console().print(table("", ("model", "file"), list(found.items()), text=2))


def scenarios(json: Json = False) -> None:
    """List the scenarios that come with the package.

    Example:  [bold]drillrig scenarios[/]
    """
    from drillrig_pin.files import shipped_scenarios
    from drillrig_pin.model.nodes import short_path
    from drillrig_pin.scenario import load_scenario

    found = {name: (load_scenario(name), short_path(path)) for name, path in shipped_scenarios().items()}
    if json:
        print_json({"scenarios": {name: {"file": path, **case.model_dump()} for name, (case, path) in found.items()}})
        return
    rows = [(name, case.model, f"{case.duration:g} s", case.text or path) for name, (case, path) in found.items()]
    console().print(table("", ("scenario", "model", "duration", "what it is"), rows, text=4))
