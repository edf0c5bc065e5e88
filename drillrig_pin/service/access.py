"""Who may use the server: its token in a header, or a cookie that was given for it; and from which pages."""

from __future__ import annotations

import hashlib
import hmac
from collections.abc import Mapping
from typing import Literal
from urllib.parse import urlsplit

from drillrig_pin.service.problems import ServiceError
from drillrig_pin.service.sessions import Sessions
from drillrig_pin.service.settings import LOCAL_HOSTS, Settings

COOKIE = "drillrig_session"
#: How a client was let in: it showed the token, or the cookie of a login; ``""``: neither, and neither was asked for.
Entrance = Literal["token", "cookie", ""]
SAFE = frozenset({"GET", "HEAD", "OPTIONS"})
#: What everybody may see: that the server lives, and the page one logs in on.
PUBLIC = ("/", "/healthz", "/login", "/favicon.ico")


class Access:
    """The rules of one server. Tokens are compared in constant time and never kept, shown or logged.

    Attributes:
        sessions: the logins there are.
    """

    def __init__(self, settings: Settings) -> None:
        token = settings.token
        self._digest = None if token is None else _digest(token)
        self.sessions = Sessions()
        self._hosts = settings.hosts or (LOCAL_HOSTS if settings.local else ())

    @property
    def open(self) -> bool:
        """True when no token is asked for."""
        return self._digest is None

    def knows(self, token: str) -> bool:
        """Whether this is the token."""
        return self._digest is not None and hmac.compare_digest(_digest(token), self._digest)

    def require_host(self, host: str) -> None:
        """ServiceError 400 for a name this server does not go by, as a page says that was rebound to this address."""
        name = _name(host)
        if name is None or (self._hosts and name not in self._hosts):
            raise ServiceError(
                400,
                "this server does not go by the name in the Host header",
                todo="Use the address it was started with, or start it with --allow-host NAME.",
            )

    def entrance(self, headers: Mapping[str, str], cookies: Mapping[str, str]) -> Entrance:
        """What a client shows."""
        if self.open:
            return ""
        scheme, _, token = headers.get("authorization", "").partition(" ")
        if scheme.lower() == "bearer" and self.knows(token.strip()):
            return "token"
        if not scheme and self.sessions.valid(cookies.get(COOKIE, "")):
            return "cookie"
        return ""

    def require_known(self, path: str, headers: Mapping[str, str], entrance: Entrance) -> None:
        """ServiceError 401 for a client that knows no token."""
        if entrance or self.open or path in PUBLIC or path.startswith("/static/"):
            return
        scheme = headers.get("authorization", "")
        raise ServiceError(
            401,
            "this server asks for a token" if not scheme else "this is not the server's token",
            todo="Log in on its page, or send the header Authorization: Bearer TOKEN.",
            headers={"WWW-Authenticate": 'Bearer realm="drillrig"'},
        )

    def require_own_page(self, method: str, headers: Mapping[str, str], *, cookie: bool) -> None:
        """ServiceError 403 for a change that a page of another origin asks for in the name of its reader."""
        if method in SAFE:
            return
        site, origin = headers.get("sec-fetch-site"), headers.get("origin")
        foreign = site not in (None, "same-origin", "none")
        if origin is not None and (origin == "null" or _place(origin) != headers.get("host")):
            foreign = True
        if foreign or (cookie and site is None and origin is None):
            raise ServiceError(403, "only this server's own page may ask for changes", todo="Open it and log in there.")


def _digest(token: str) -> bytes:
    return hashlib.sha256(token.encode()).digest()


def _name(host: str) -> str | None:
    """The name in a Host header; empty if there is none, as HTTP/1.0 allows; None if it is none that could be."""
    if len(host) >= 300 or set(host) & set("/?#@\\"):
        return None
    try:
        found = urlsplit(f"//{host}")
        _ = found.port
    except ValueError:
        return None
    return found.hostname or ("" if not host else None)


def _place(origin: str) -> str | None:
    """Name and port of an Origin header; None for what is no address of a page."""
    try:
        return urlsplit(origin).netloc
    except ValueError:
        return None
