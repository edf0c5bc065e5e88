"""The app: global options, and which command lives where."""

from __future__ import annotations

from typing import Annotated

import typer

from drillrig_pin.cli import (
    compare,
    models,
    optimize,
    results,
    run,
    sensitivity,
    serve,
    show,
    sound,
    sweep,
    sweep_report,
    watch,
)

EPILOG = (
    "Exit codes: 0 done; 1 something given cannot be used, or check found an error; 2 wrong usage; "
    "3 the simulation stopped early (its file is kept); 70 a bug of this program; 130 interrupted."
)

app = typer.Typer(
    name="drillrig",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    add_completion=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog=EPILOG,
)


def _version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        typer.echo(f"drillrig-pin {version('drillrig-pin')}")
        raise typer.Exit


@app.callback()
def drillrig(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and exit.")
    ] = False,
    debug: Annotated[bool, typer.Option("--debug", help="Show the traceback of an error.")] = False,
) -> None:
    """Vibration of percussive-rotary drilling rigs, from a model file to numbers that can be believed.

    Start with  [bold]drillrig run[/]  : test hole no. 9 of the MK-Z49 drill boom, ten seconds.
    """


for command in (
    run.run,
    sound.check,
    sound.static,
    results.plot,
    results.report,
    compare.compare,
    show.replay,
    watch.watch,
    sweep.sweep,
    sweep.holes,
    sensitivity.sensitivity,
    optimize.optimize,
    sweep_report.sweep_report,
    serve.serve,
    results.export,
    models.params,
    models.expand,
    models.models,
    models.scenarios,
):
    app.command()(command)
