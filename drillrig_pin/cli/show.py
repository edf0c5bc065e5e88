"""The command that shows runs in motion, and what every command with a live page shares."""

from __future__ import annotations

import dataclasses
import os
import signal
import socket
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from drillrig_pin.cli.case import Json
from drillrig_pin.cli.files import write_text
from drillrig_pin.cli.output import console, print_json
from drillrig_pin.cli.targets import Force, console_beside, require_apart, require_target
from drillrig_pin.errors import ScenarioError

if TYPE_CHECKING:
    from drillrig_pin.cli.recall import Run
    from drillrig_pin.replay.server import LiveServer
    from drillrig_pin.scene.options import Auto, ReplayOptions
    from drillrig_pin.scene.scene import Scene

Exaggerate = Annotated[
    str,
    typer.Option(
        "--exaggerate", "-x", metavar="K|auto", help="Multiply deviations from the mean pose. auto: clearly visible."
    ),
]
TrueScale = Annotated[bool, typer.Option("--true-scale", help="Do not exaggerate; the same as --exaggerate 1.")]
Speed = Annotated[
    str,
    typer.Option(
        metavar="S|auto", help="Simulated seconds per second; 1: real time. auto: slow enough to see the percussion."
    ),
]
StartView = Annotated[str, typer.Option("--view", metavar="NAME", help="overview, side, top, front or tip.")]
NoOpen = Annotated[bool, typer.Option("--no-open", help="Only print the address.")]
Host = Annotated[
    str, typer.Option(metavar="ADDRESS", help="Listen here; 0.0.0.0 for a browser outside this container or machine.")
]
Port = Annotated[int | None, typer.Option(metavar="N", help="Listen on this port. Default: a free one from 7000 on.")]


def replay(
    runs: Annotated[
        list[Path],
        typer.Argument(metavar="RUN", help="Result files, or folders of studies; the later ones as ghosts."),
    ],
    case: Annotated[
        list[int] | None,
        typer.Option("--case", metavar="N", help="Case of the study. May be given many times. Default: the worst."),
    ] = None,
    exaggerate: Exaggerate = "auto",
    true_scale: TrueScale = False,
    speed: Speed = "auto",
    start: Annotated[float | None, typer.Option("--from", metavar="T", help="Begin here, in seconds.")] = None,
    end: Annotated[float | None, typer.Option("--to", metavar="T", help="End here, in seconds.")] = None,
    view: StartView = "overview",
    side_by_side: Annotated[
        bool, typer.Option("--side-by-side", help="Several runs beside each other, not as ghosts.")
    ] = False,
    html: Annotated[
        Path | None, typer.Option("--html", metavar="FILE", help="Write one page that opens without network instead.")
    ] = None,
    video: Annotated[
        Path | None, typer.Option("--video", metavar="FILE", help="Write an MP4 film instead (Chromium and ffmpeg).")
    ] = None,
    no_open: NoOpen = False,
    host: Host = "127.0.0.1",
    port: Port = None,
    run_model: Annotated[
        bool,
        typer.Option("--run-model", help="Compute a case again with the xacro file that the study names: a program."),
    ] = False,
    force: Force = False,
    json: Json = False,
) -> None:
    """Show runs in the browser: the machine in motion, exaggerated so that it can be seen, forces as arrows.

    Space plays and pauses. Ctrl-C ends it. Over ssh:  ssh -L 7000:localhost:7000 HOST

    Example:  [bold]drillrig replay run.nc[/]

    Example:  [bold]drillrig replay soft.nc stiff.nc --view tip --exaggerate 100 --html both.html[/]

    Example:  [bold]drillrig replay holes --case 4 --case 8[/]  (cases of a study; one not kept is computed again)
    """
    from drillrig_pin.cli.recall import recalled
    from drillrig_pin.scene.options import ReplayOptions

    options = ReplayOptions(
        exaggeration=1.0 if true_scale else factor(exaggerate, "--exaggerate"),
        speed=factor(speed, "--speed"),
        view=view,
        start=start,
        end=end,
        side_by_side=side_by_side,
    )
    require_apart(html, video)
    for target, kind in ((html, "page"), (video, "film")):
        if target is not None:
            require_target(target, kind, reads=runs, force=force)
    scene = _scene(recalled(runs, case, run_model=run_model), options)
    for note in scene.notes:
        console(stderr=True).print(f"note: {note}", markup=False, style="yellow", soft_wrap=True)
    if html is not None:
        from drillrig_pin.replay.page import static_page

        write_text(html, static_page(scene))
    if video is not None:
        _film(scene, video)
    written = [str(target) for target in (html, video) if target is not None]
    if written:
        if json:
            print_json({"written": written, **_facts(scene)})
        else:
            console_beside(html, video).print(
                f"Written: {', '.join(written)}. {' '.join(scene.sentences)}", markup=False, soft_wrap=True
            )
        return
    _serve(scene, host, port, no_open=no_open, json=json)


def _film(scene: Scene, target: Path) -> None:
    from drillrig_pin.replay.video import RATE, film, pictures

    shown = pictures(scene) / RATE * scene.speed
    last = float(scene.frames[-1])
    if scene.frames[0] + shown < last - scene.speed / RATE:
        console(stderr=True).print(
            f"note: the film ends at {scene.frames[0] + shown:.3g} s of {last:.3g} s; "
            "choose the part with --from and --to, or a higher --speed.",
            markup=False,
            style="yellow",
            soft_wrap=True,
        )
    with _progress(pictures(scene)) as tick:
        film(scene, target, tick)


@contextmanager
def _progress(total: int) -> Iterator[Callable[[int, int], None] | None]:
    """A bar on stderr, if a person reads it, that takes the pictures made."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.progress import Progress

    with Progress(console=console(stderr=True), transient=True) as bar:
        task = bar.add_task("filming", total=total)
        yield lambda made, _: bar.update(task, completed=made)


def factor(text: str, option: str) -> float | Auto:
    """The number a word stands for, or ``auto``; ScenarioError otherwise."""
    if text == "auto":
        return "auto"
    try:
        return float(text)
    except ValueError:
        raise ScenarioError(f"{text!r} is neither a number nor auto", where=option) from None


def _scene(runs: list[Run], options: ReplayOptions) -> Scene:
    from drillrig_pin.scene.scene import build_scene

    shown = dataclasses.replace(options, holes=runs[0].holes)
    return build_scene([run.trajectory for run in runs], shown, [run.name for run in runs])


def _facts(scene: Scene) -> dict[str, object]:
    return {
        "exaggeration": scene.exaggeration.factor,
        "largest_deviation": scene.exaggeration.largest,
        "speed": scene.speed,
        "fastest": scene.fastest,
        "notes": scene.notes,
    }


def _serve(scene: Scene, host: str, port: int | None, *, no_open: bool, json: bool) -> None:
    from drillrig_pin.replay.payload import scene_bytes, scene_words
    from drillrig_pin.replay.server import LiveServer

    server = LiveServer(scene.title, host, port)
    server.show(scene_bytes(scene), scene_words(scene))
    with until_stopped() as stopped:
        if json:
            print_json({"url": server.url, **_facts(scene)})
            sys.stdout.flush()
        else:
            console().print(" ".join(scene.sentences), markup=False, soft_wrap=True)
            announce(server)
        open_browser(server, no_open=no_open)
        stopped.wait()


def announce(server: LiveServer) -> None:
    """Say where the page is, and how to reach it from elsewhere."""
    out = console()
    out.print(f"Open {server.url} in a browser; Ctrl-C ends it.", markup=False, soft_wrap=True)
    if "SSH_CONNECTION" in os.environ:
        here = f"{server.port}:localhost:{server.port} {socket.gethostname()}"
        out.print(f"From the machine you sit at: ssh -L {here}", markup=False, soft_wrap=True)
    sys.stdout.flush()


def open_browser(server: LiveServer, *, no_open: bool) -> None:
    """Open the page, unless there is no screen to show it on."""
    screen = sys.platform in ("darwin", "win32") or os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    if no_open or not screen or "SSH_CONNECTION" in os.environ:
        return
    import webbrowser

    # A browser started from here writes to this terminal and may take its time.
    threading.Thread(target=webbrowser.open, args=(server.url,), daemon=True).start()


@contextmanager
def _handling(handler: Callable[..., None], *names: str) -> Iterator[None]:
    numbers = [getattr(signal, name) for name in names if hasattr(signal, name)]
    before = {number: signal.signal(number, handler) for number in numbers}
    try:
        yield
    finally:
        for number, old in before.items():
            signal.signal(number, old)


@contextmanager
def until_stopped() -> Iterator[threading.Event]:
    """An event that Ctrl-C, a closed terminal or a polite kill set; asked to stop is a normal end."""
    stopped = threading.Event()
    with _handling(lambda *_: stopped.set(), "SIGINT", "SIGTERM", "SIGHUP"):
        yield stopped
