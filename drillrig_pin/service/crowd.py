"""Connections by address: who says nothing makes room for who does."""

from __future__ import annotations

import resource
from collections import OrderedDict
from collections.abc import Callable
from typing import Protocol

from drillrig_pin.service.proxy import household

#: Connections at once, if the system gives as many files.
TOTAL = 8_000
#: Of the files a process may open, so many are for records, workers and results.
OWN_FILES = 200
#: Connections beyond the bound that are still heard: one may ask whether the server lives.
RESERVE = 64


class Silent(Protocol):
    """A connection, as far as it matters here."""

    address: str

    @property
    def silent(self) -> bool:
        """Whether no request of it is being answered."""

    def hang_up(self) -> None:
        """End it."""


class Crowd:
    """The open connections of a server.

    Args:
        each: of one address.
        total: of all.
        proxy: whether an address is a proxy's, whose connections are many clients'.
    """

    def __init__(self, each: int, total: int, proxy: Callable[[str], bool] = lambda _: False) -> None:
        self.each, self.total, self.proxy = min(each, max(1, total * 3 // 4)), total, proxy
        self._open: dict[str, OrderedDict[Silent, None]] = {}
        self._count = 0

    def enter(self, connection: Silent) -> bool | None:
        """Take a connection in; the one that has been silent longest makes room for it.

        Returns:
            True; False if nothing was silent, so that it is one too many; None if it cannot even be heard.
        """
        own = self._open.setdefault(household(connection.address), OrderedDict())
        own[connection] = None
        self._count += 1
        room = True
        if len(own) > self.each and not self.proxy(connection.address):
            room = self._hang_up_on_silent(own, connection)
            if not room and len(own) > self.each + RESERVE:
                return None
        if self._count > self.total:
            largest = max(self._open.values(), key=len)
            room = self._hang_up_on_silent(largest, connection)
            if not room and self._count > self.total + RESERVE:
                return None
        return room

    def spoke(self, connection: Silent) -> None:
        """A request of a connection was complete: of the silent ones it is the last to go."""
        own = self._open.get(household(connection.address))
        if own is not None and connection in own:
            own.move_to_end(connection)

    def leave(self, connection: Silent) -> None:
        """Forget a connection."""
        place = household(connection.address)
        own = self._open.get(place)
        if own is not None and connection in own:
            del own[connection]
            self._count -= 1
            if not own:
                del self._open[place]

    def _hang_up_on_silent(self, own: OrderedDict[Silent, None], but: Silent) -> bool:
        for connection in own:
            if connection is not but and connection.silent:
                self.leave(connection)
                connection.hang_up()
                return True
        return False


def files() -> int:
    """Let this process open as many files as the system allows it; gives how many connections that makes."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = TOTAL + OWN_FILES
    most = wanted if hard == resource.RLIM_INFINITY else min(wanted, hard)
    if soft != resource.RLIM_INFINITY and soft < most:
        resource.setrlimit(resource.RLIMIT_NOFILE, (most, hard))
        soft = most
    return min(TOTAL, max(64, (TOTAL + OWN_FILES if soft == resource.RLIM_INFINITY else soft) - OWN_FILES))
