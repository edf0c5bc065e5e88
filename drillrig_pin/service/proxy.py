"""What a proxy in front of the server says of its clients: believed from the addresses given, from nobody else."""

from __future__ import annotations

import functools
import ipaddress
from collections.abc import Iterable
from typing import Any

from starlette.types import ASGIApp, Receive, Scope, Send
from uvicorn.middleware.proxy_headers import ProxyHeadersMiddleware

Network = ipaddress.IPv4Network | ipaddress.IPv6Network


class Proxied:
    """An ASGI application around another one, which sees the client, the scheme and the name the proxy was asked by.

    Args:
        app: the application.
        proxies: addresses and networks, e.g. ``127.0.0.1``, ``10.0.0.0/8``. ValueError for anything else.
    """

    def __init__(self, app: ASGIApp, proxies: Iterable[str]) -> None:
        self._app = app
        self._networks = networks(proxies)
        # It reads X-Forwarded-For from the right, up to the first address that is no proxy, and X-Forwarded-Proto.
        believed: Any = ProxyHeadersMiddleware
        self._believed = believed(app, [str(network) for network in self._networks])

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""
        client = scope.get("client")
        if scope["type"] != "http" or client is None or not self.trusts(client[0]):
            await self._app(scope, receive, send)
            return
        plain = (str(address_of(client[0])), client[1])
        await self._believed({**scope, "client": plain, "headers": _named(scope["headers"])}, receive, send)

    def trusts(self, address: str) -> bool:
        """Whether this is the address of a proxy."""
        found = address_of(address)
        return found is not None and any(found in network for network in self._networks)


def networks(given: Iterable[str]) -> tuple[Network, ...]:
    """Addresses and networks as text; ValueError for what is neither."""
    return tuple(ipaddress.ip_network(text.strip(), strict=False) for text in given)


@functools.lru_cache(4096)
def address_of(text: str) -> ipaddress.IPv4Address | ipaddress.IPv6Address | None:
    """An address; one of IPv4 that came over a socket of IPv6 is one of IPv4. None for anything else."""
    try:
        found = ipaddress.ip_address(text)
    except ValueError:
        return None
    return getattr(found, "ipv4_mapped", None) or found


@functools.lru_cache(4096)
def household(text: str) -> str:
    """What counts as one client: an address of IPv4, or all those of IPv6 that one line gets."""
    found = address_of(text)
    if isinstance(found, ipaddress.IPv6Address):
        return str(ipaddress.ip_network((found, 64), strict=False))
    return str(found) if found is not None else text[:100]


def _named(headers: list[tuple[bytes, bytes]]) -> list[tuple[bytes, bytes]]:
    """Headers with the Host the proxy was asked by: the last one told, which is what the proxy itself wrote."""
    told = [value for name, value in headers if name == b"x-forwarded-host"]
    host = told[-1].rpartition(b",")[2].strip() if told else b""
    if not host:
        return headers
    return [(b"host", host), *((name, value) for name, value in headers if name != b"host")]
