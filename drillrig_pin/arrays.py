"""Named arrays, some of them computed only when first asked for: a study looks at a few of twenty variables."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence

from drillrig_pin.kinematics import Array


class Arrays(Mapping[str, Array]):
    """A mapping of given arrays and of late ones, which are kept once computed.

    Args:
        given: arrays by name.
        late: functions without arguments by the names of what they give, one array a name.
    """

    def __init__(
        self, given: Mapping[str, Array], late: Mapping[tuple[str, ...], Callable[[], Sequence[Array]]]
    ) -> None:
        self._there = dict(given)
        self._late = {name: (names, function) for names, function in late.items() for name in names}
        self._names = [*self._there, *self._late]

    def __getitem__(self, name: str) -> Array:
        if name not in self._there:
            names, function = self._late[name]
            self._there.update(zip(names, function(), strict=True))
        return self._there[name]

    def __contains__(self, name: object) -> bool:
        return name in self._there or name in self._late

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)
