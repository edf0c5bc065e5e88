"""The command that answers over HTTP."""

from __future__ import annotations

import contextlib
import ctypes
import os
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import typer

from drillrig_pin.cli.output import console
from drillrig_pin.errors import ScenarioError, shown

TOKEN = "DRILLRIG_TOKEN"


def serve(
    host: Annotated[
        str, typer.Option("--host", metavar="ADDRESS", help="Where to listen. Any but this machine asks for a token.")
    ] = "127.0.0.1",
    port: Annotated[
        int, typer.Option("--port", metavar="PORT", min=0, max=65535, help="Port; 0: any free one.")
    ] = 8000,
    data: Annotated[
        Path, typer.Option("--data", metavar="DIR", help="Folder of runs and records; a restart finds them there.")
    ] = Path("drillrig_data"),
    token_file: Annotated[
        Path | None,
        typer.Option("--token-file", metavar="FILE", help=f"First line: the token clients need. Or set {TOKEN}."),
    ] = None,
    workers: Annotated[
        int | None, typer.Option("--workers", metavar="N", min=1, max=256, help="Runs at once. Default: one a core.")
    ] = None,
    queue: Annotated[int, typer.Option("--queue", metavar="N", min=1, max=100_000, help="Jobs that may wait.")] = 200,
    scheduler: Annotated[
        str | None,
        typer.Option("--scheduler", metavar="ADDRESS", help="Run jobs on a Dask cluster, e.g. tcp://host:8786."),
    ] = None,
    models: Annotated[
        Path | None,
        typer.Option("--models", metavar="DIR", help="Folder with models to offer besides the shipped ones."),
    ] = None,
    allow_host: Annotated[
        list[str] | None,
        typer.Option("--allow-host", metavar="NAME", help="Name clients may use for this server. May be repeated."),
    ] = None,
    proxy: Annotated[
        list[str] | None,
        typer.Option(
            "--proxy",
            metavar="ADDRESS",
            help="Proxy in front, or its network (10.0.0.0/8), whose X-Forwarded-* are believed. May be repeated.",
        ),
    ] = None,
    time_limit: Annotated[
        float, typer.Option("--time-limit", metavar="S", min=0.1, help="Seconds a run may take.")
    ] = 600.0,
    memory: Annotated[int, typer.Option("--memory", metavar="MB", min=50, help="Memory a run may take.")] = 2000,
) -> None:
    """Offer models, runs and studies over HTTP, with a page for people. Ctrl-C ends it; nothing is lost.

    It listens on this machine only, unless told otherwise, and then asks for a token.

    Example:  [bold]drillrig serve[/]

    Example:  [bold]DRILLRIG_TOKEN=... drillrig serve --host 0.0.0.0 --data /srv/drillrig[/]
    """
    from drillrig_pin.service.serve import serve as run_server
    from drillrig_pin.service.settings import MEGABYTE, Limits, Settings

    limits = Limits(queue=queue, job_time=time_limit, job_memory=memory * MEGABYTE)
    settings = Settings(
        data=data,
        host=host,
        port=port,
        token=_token(token_file),
        scheduler=scheduler,
        library=models,
        hosts=tuple(allow_host or ()),
        proxies=_proxies(proxy or []),
        limits=limits,
        **({} if workers is None else {"workers": workers}),
    )

    def ready(address: str) -> None:
        console(stderr=True).print(f"drillrig answers at {address} ; Ctrl-C ends it.", markup=False, soft_wrap=True)

    with _hung_up_as_told():
        run_server(settings, ready)


@contextlib.contextmanager
def _hung_up_as_told() -> Iterator[None]:
    """A terminal that was closed ends the server as a polite kill does, which it hears itself; not under `nohup`."""
    hung_up = getattr(signal, "SIGHUP", None)
    if hung_up is None or signal.getsignal(hung_up) is signal.SIG_IGN:
        yield
        return
    before = signal.signal(hung_up, lambda *_: signal.raise_signal(signal.SIGTERM))
    try:
        yield
    finally:
        signal.signal(hung_up, before)


def _proxies(given: list[str]) -> tuple[str, ...]:
    """Addresses and networks, as they were given; ScenarioError for what is neither."""
    from drillrig_pin.service.proxy import networks

    for text in given:
        try:
            networks([text])
        except ValueError:
            raise ScenarioError(
                f"{shown(text)} is no address and no network", where="--proxy", todo="Write 127.0.0.1 or 10.0.0.0/8."
            ) from None
    return tuple(given)


def _token(file: Path | None) -> str | None:
    """The token of a file or of the environment; ScenarioError if it is none.

    The environment is rid of it in either case: workers and whatever they start need not know it.
    """
    given = _taken_from_environment()
    if file is None:
        text = given
        where = TOKEN
        if not text:
            return None
    else:
        where = str(file)
        try:
            with file.open("rb") as stream:
                text = stream.readline(LONGEST + 2).decode()
        except (OSError, UnicodeDecodeError) as error:
            reason = getattr(error, "strerror", None) or error
            raise ScenarioError(f"the token cannot be read ({reason})", where=where) from None
        if len(text) > LONGEST + 1:
            raise ScenarioError(f"the token has more than {LONGEST} letters", where=where)
    token = text.strip()
    if len(token) < SHORTEST or not token.isascii():
        raise ScenarioError(
            f"the token has fewer than {SHORTEST} letters, or others than plain ones",
            where=where,
            todo="Make one with: python -c 'import secrets; print(secrets.token_urlsafe())'",
        )
    return token


def _taken_from_environment() -> str:
    """The variable, which is gone afterwards: for this process, for those it starts, and from ``/proc/PID/environ``.

    The latter shows the memory the system handed the environment over in. What a shell, a container or a service
    manager keeps of its own is beyond reach.
    """
    library = ctypes.CDLL(None)
    library.getenv.restype = ctypes.c_void_p
    place = library.getenv(TOKEN.encode())
    text = os.environ.pop(TOKEN, "")
    if place:
        # Python's own variables lie elsewhere; taking one away leaves the memory as it was.
        ctypes.memset(place, ord("x"), len(os.fsencode(text)))
    return text


#: A shorter token can be guessed, a longer one is some other file.
SHORTEST, LONGEST = 16, 4096
