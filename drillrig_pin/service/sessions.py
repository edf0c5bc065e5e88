"""Logins of a server: every one has a name nobody can guess, and ends."""

from __future__ import annotations

import hashlib
import secrets
import threading
import time

#: How long a login lasts [s].
SESSION = 12 * 3600
#: Logins at once. One more ends the oldest.
MOST = 1000


class Sessions:
    """The logins there are. They end with the server: what is not written down cannot be stolen.

    Every method may be called from any thread. Names are kept as hashes.
    """

    def __init__(self, seconds: float = SESSION, most: int = MOST) -> None:
        self.seconds, self.most = seconds, most
        self._lock = threading.Lock()
        self._ends: dict[bytes, float] = {}

    def open(self) -> str:
        """A new login's name."""
        now = time.time()
        name = f"{int(now + self.seconds)}.{secrets.token_hex(32)}"
        with self._lock:
            self._ends = {known: end for known, end in self._ends.items() if end > now}
            while len(self._ends) >= self.most:
                del self._ends[next(iter(self._ends))]
            self._ends[_digest(name)] = now + self.seconds
        return name

    def valid(self, name: str) -> bool:
        """Whether there is a login of this name that has not ended."""
        with self._lock:
            return self._ends.get(_digest(name), 0.0) > time.time()

    def end(self, name: str) -> None:
        """End a login; one that is unknown stays so."""
        with self._lock:
            self._ends.pop(_digest(name), None)


def _digest(name: str) -> bytes:
    return hashlib.sha256(name.encode("utf-8", "replace")).digest()
