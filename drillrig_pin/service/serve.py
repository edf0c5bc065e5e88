"""Run the server until it is told to stop."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import socket
from collections.abc import Callable
from typing import TYPE_CHECKING

from drillrig_pin.errors import DrillrigError
from drillrig_pin.service.settings import Settings

if TYPE_CHECKING:
    from drillrig_pin.service.gate import Gate

#: Answers under way when the server is told to stop get this long [s].
GRACE = 3


class ServeError(DrillrigError):
    """The server cannot listen, or may not."""


def require_safe(settings: Settings) -> None:
    """ServeError for an address that others can reach without a token."""
    if settings.proxies and settings.token is None:
        raise ServeError(
            "others reach this server through its proxy, and no token is set",
            where="--proxy",
            todo="Give --token-file FILE or the environment variable DRILLRIG_TOKEN.",
        )
    if not settings.local and settings.token is None:
        raise ServeError(
            f"{settings.host} can be reached from other machines, and no token is set",
            where="--host",
            todo="Give --token-file FILE or the environment variable DRILLRIG_TOKEN, or stay on 127.0.0.1.",
        )


def listen(settings: Settings) -> socket.socket:
    """The socket it will answer on. Port 0: any free one. ServeError if it is taken."""
    family = socket.AF_INET6 if ":" in settings.host else socket.AF_INET
    listener = socket.socket(family, socket.SOCK_STREAM)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((settings.host, settings.port))
        listener.listen(2048)
    except OSError as error:
        listener.close()
        raise ServeError(
            f"cannot listen on {settings.host} port {settings.port} ({error.strerror})",
            where="--port",
            todo="Choose another port.",
        ) from None
    return listener


def serve(settings: Settings, ready: Callable[[str], None]) -> None:
    """Serve until SIGINT or SIGTERM; ``ready`` is told the address.

    Raises:
        ServeError: the address may not or cannot be used.
        ResultFileError: the data folder cannot be used.
    """
    require_safe(settings)
    listener = listen(settings)
    try:
        _serve(settings, listener, ready)
    finally:
        listener.close()


def _serve(settings: Settings, listener: socket.socket, ready: Callable[[str], None]) -> None:
    import uvicorn

    from drillrig_pin.service.app import create_app

    app = create_app(settings)
    logging.getLogger("uvicorn").setLevel(logging.CRITICAL)
    config = uvicorn.Config(
        app,
        log_config=None,
        access_log=False,
        server_header=False,
        proxy_headers=False,
        timeout_graceful_shutdown=GRACE,
        lifespan="on",
        http=_connections(settings, app),
        ws="none",
        h11_max_incomplete_event_size=32_768,
    )
    host, port = listener.getsockname()[:2]

    class Server(uvicorn.Server):
        async def startup(self, sockets: list[socket.socket] | None = None) -> None:
            await super().startup(sockets)
            ready(f"http://{f'[{host}]' if ':' in host else host}:{port}")

    server = Server(config)
    # uvicorn leaves through SystemExit if the application could not start, and passes Ctrl-C on when all is closed.
    with contextlib.suppress(KeyboardInterrupt, SystemExit):
        server.run(sockets=[listener])
    if app.failure is not None:
        raise app.failure


def _connections(settings: Settings, app: Gate) -> type[asyncio.Protocol]:
    """Connections that are counted together, and told of in the server's log."""
    from drillrig_pin.service.connection import PromptConnection
    from drillrig_pin.service.crowd import Crowd, files
    from drillrig_pin.service.proxy import Proxied

    def told(number: str, address: str, status: int) -> None:
        app.log.info("no request", request_id=number, client=address, status=status)

    proxied = Proxied(app, settings.proxies)
    together = Crowd(settings.limits.connections, files(), proxied.trusts)
    return type("Connection", (PromptConnection,), {"crowd": together, "tell": staticmethod(told)})
