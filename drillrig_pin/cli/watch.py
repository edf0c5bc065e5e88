"""The command that watches a model while it is edited."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from drillrig_pin.cli.case import Locks, OptionalModelName, Packages, ScenarioName, Settings, read_scenario
from drillrig_pin.cli.output import console, table, write_json
from drillrig_pin.cli.show import (
    Exaggerate,
    Host,
    NoOpen,
    Port,
    Speed,
    StartView,
    TrueScale,
    announce,
    factor,
    open_browser,
    until_stopped,
)
from drillrig_pin.errors import DrillrigError

#: Frames per second of watching: fewer than in a replay, so that a save is seen sooner [Hz].
RATE = 20.0

if TYPE_CHECKING:
    from drillrig_pin.replay.design_loop import DesignLoop, Version
    from drillrig_pin.replay.server import LiveServer


def watch(
    model: OptionalModelName = None,
    scenario: ScenarioName = None,
    settings: Settings = None,
    packages: Packages = None,
    lock: Locks = None,
    exaggerate: Exaggerate = "auto",
    true_scale: TrueScale = False,
    speed: Speed = "auto",
    view: StartView = "overview",
    no_open: NoOpen = False,
    host: Host = "127.0.0.1",
    port: Port = None,
    json: Annotated[
        bool, typer.Option("--json", help="Print one JSON document a line: the address, then every version.")
    ] = False,
) -> None:
    """Simulate a model at every save and show it in the browser, with its key numbers and what the save changed.

    Watched are the model file, its includes and tables of numbers, and the scenario file. A file that cannot be used
    is answered with what is wrong and where; the last good machine stays on the screen. Ctrl-C ends it.

    Example:  [bold]drillrig watch my_rig.urdf.xacro[/]

    Example:  [bold]drillrig watch mkz49 --scenario my_case.yaml --view tip[/]
    """
    from drillrig_pin.model.modelfile import find_model
    from drillrig_pin.replay.design_loop import DesignLoop
    from drillrig_pin.replay.server import LiveServer
    from drillrig_pin.scene.options import ReplayOptions

    options = ReplayOptions(
        exaggeration=1.0 if true_scale else factor(exaggerate, "--exaggerate"),
        speed=factor(speed, "--speed"),
        view=view,
        rate=RATE,
    )
    path = Path(scenario) if scenario is not None and Path(scenario).is_file() else None
    loop = DesignLoop(lambda: read_scenario(model, scenario, settings, lock), options, path)
    # A wrong word of the command line ends it at once; what is wrong in a file is waited for.
    case = loop.read()
    find_model(case.model)
    server = LiveServer(case.name, host, port)
    with until_stopped() as stopped:
        loop.stopped = stopped
        if json:
            _print_line({"url": server.url})
        else:
            announce(server)
        _take(loop, server, json=json)
        open_browser(server, no_open=no_open)
        for changed in loop.saves():
            names = ", ".join(sorted(file.name for file in changed))
            if not json:
                console().print(f"\n{names} saved", markup=False, style="bold")
            server.say("busy", f"{names} saved: simulating ...")
            _take(loop, server, json=json)


def _take(loop: DesignLoop, server: LiveServer, *, json: bool) -> None:
    """Make a version of what is on disk and show it, or say what is wrong with it."""
    from drillrig_pin.replay.payload import scene_bytes, scene_words
    from drillrig_pin.replay.values import table as html_table

    try:
        version = loop.version()
    except DrillrigError as error:
        if loop.stopped.is_set():
            return
        server.say("trouble", str(error))
        if json:
            _print_line({"error": str(error)})
            return
        console(stderr=True).print(f"error: {error}", markup=False, style="red", soft_wrap=True)
        return
    if loop.stopped.is_set():
        return
    scene = replace(version.scene, title=version.trajectory.scenario.name)
    server.show(scene_bytes(scene), {**scene_words(scene), "values": html_table(version)})
    if not version.trajectory.outcome.completed:
        server.say("trouble", f"stopped early: {version.trajectory.outcome}")
    if json:
        _print_line(_document(version))
    else:
        _print(version)


def _document(version: Version) -> dict[str, object]:
    outcome = version.trajectory.outcome
    return {
        "content_hash": version.trajectory.content_hash,
        "completed": outcome.completed,
        "cause": outcome.cause,
        "values": {change.now.name: change.now.value for change in version.changes},
        "before": {change.before.name: change.before.value for change in version.changes if change.before is not None},
        "parameters": version.parameters,
        "warnings": version.warnings,
        "seconds": version.seconds,
    }


def _print_line(document: dict[str, object]) -> None:
    write_json(document)
    sys.stdout.flush()


def _print(version: Version) -> None:
    from drillrig_pin.replay.values import rows

    out = console()
    for words in version.parameters:
        out.print(words, markup=False)
    out.print(table("", ("", "now", "change", ""), rows(version)))
    if not version.trajectory.outcome.completed:
        out.print(f"stopped early: {version.trajectory.outcome}", markup=False, style="red", soft_wrap=True)
    for words in version.warnings:
        out.print(f"warning: {words}", markup=False, style="yellow", soft_wrap=True)
    out.print(f"shown after {version.seconds:.2f} s", markup=False, style="dim")
