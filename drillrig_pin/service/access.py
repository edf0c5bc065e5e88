"""Who may use the server: its token in a header, or a cookie that was given for it; and from which pages."""

from __future__ import annotations

import hashlib
import hmac
import time
from collections.abc import Mapping
from urllib.parse import urlsplit

from drillrig_pin.service.problems import ServiceError
from drillrig_pin.service.settings import LOCAL_HOSTS, Settings

COOKIE = "drillrig_session"
#: How long a login lasts [s].
SESSION = 12 * 3600
SAFE = frozenset({"GET", "HEAD", "OPTIONS"})
#: What everybody may see: that the server lives, and the page one logs in on.
PUBLIC = ("/", "/healthz", "/login", "/favicon.ico")


class Access:
    """The rules of one server. Tokens are compared in constant time and never kept, shown or logged."""

    def __init__(self, settings: Settings) -> None:
        token = settings.token
        self._digest = None if token is None else _digest(token)
        self._key = b"" if token is None else hmac.digest(token.encode(), b"drillrig session", "sha256")
        self._hosts = settings.hosts or (LOCAL_HOSTS if settings.local else ())

    @property
    def open(self) -> bool:
        """True when no token is asked for."""
        return self._digest is None

    def knows(self, token: str) -> bool:
        """Whether this is the token."""
        return self._digest is not None and hmac.compare_digest(_digest(token), self._digest)

    def session(self) -> str:
        """The content of a new cookie: when it ends, signed with a key that follows from the token."""
        end = str(int(time.time()) + SESSION)
        return f"{end}.{self._signature(end)}"

    def require_host(self, host: str) -> None:
        """ServiceError 400 for a name this server does not go by, as a page says that was rebound to this address."""
        name = (urlsplit(f"//{host}").hostname or "") if _sound(host) else ""
        if self._hosts and name not in self._hosts:
            raise ServiceError(
                400,
                "this server does not go by the name in the Host header",
                todo="Use the address it was started with, or start it with --allow-host NAME.",
            )

    def require_known(self, path: str, headers: Mapping[str, str], cookies: Mapping[str, str]) -> bool:
        """ServiceError 401 for a client that knows no token; gives whether a cookie let it in."""
        if self.open or path in PUBLIC or path.startswith("/static/"):
            return False
        scheme, _, token = headers.get("authorization", "").partition(" ")
        if scheme.lower() == "bearer" and self.knows(token.strip()):
            return False
        if not scheme and self._valid(cookies.get(COOKIE, "")):
            return True
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
        if origin is not None and (origin == "null" or urlsplit(origin).netloc != headers.get("host")):
            foreign = True
        if foreign or (cookie and site is None and origin is None):
            raise ServiceError(403, "only this server's own page may ask for changes", todo="Open it and log in there.")

    def _valid(self, session: str) -> bool:
        end, _, signature = session.partition(".")
        sound = end.isascii() and end.isdecimal() and len(end) < 12
        return (
            sound and hmac.compare_digest(signature.encode(), self._signature(end).encode()) and int(end) > time.time()
        )

    def _signature(self, end: str) -> str:
        return hmac.new(self._key, end.encode(), "sha256").hexdigest()


def _digest(token: str) -> bytes:
    return hashlib.sha256(token.encode()).digest()


def _sound(host: str) -> bool:
    return bool(host) and len(host) < 300 and not set(host) & set("/?#@\\")
