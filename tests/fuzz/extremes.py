"""Numbers and text of legal files, most of them plain, some of them as far out as the grammar allows."""

from __future__ import annotations

import math
from random import Random
from typing import TypeVar

T = TypeVar("T")

#: Least and greatest doubles and their neighbours, numbers whose squares or cubes leave the range, integers that no
#: double holds, zeros of both signs.
EDGES = (
    "0", "-0.0", "5e-324", "1e-310", "2.2250738585072014e-308", "1e-300", "1e-200", "1e-155", "1e-100", "1e-30",
    "1e-16", "1e-9", "1", "-1", "1.0000000000000002", "1e6", "1e9", "1e15", "9007199254740993", "18446744073709551617",
    "1000000000000000000000000000000", "1e30", "1e75", "1e100", "1e154", "1e160", "1e200", "1e300",
    "1.7976931348623157e308", "3.141592653589793", "1.5707963267948966", "6.283185307179586", "1e5", "0.1",
)  # fmt: skip


class Numbers:
    """Draws for one input.

    Args:
        random: where all of it comes from.
        wild: how many of the numbers are drawn from the edges; between 0 and 1.
    """

    def __init__(self, random: Random, wild: float) -> None:
        self.random, self.wild = random, wild

    def chance(self, part: float) -> bool:
        """True this often."""
        return self.random.random() < part

    def one_of(self, *options: T) -> T:
        """Any of them."""
        return self.random.choice(options)

    def edge(self, *, signed: bool = True) -> str:
        """A number at an edge of what doubles hold, or of any order of magnitude."""
        text = self.one_of(*EDGES) if self.chance(0.7) else repr(10.0 ** self.random.uniform(-300, 300))
        if not signed:
            return text.lstrip("-")
        return text if text.startswith("-") or self.chance(0.5) else f"-{text}"

    def plain(self, low: float, high: float) -> str:
        """A number of an ordinary file; across zero it is spread evenly, else over the orders of magnitude."""
        if low > 0:
            return f"{math.exp(self.random.uniform(math.log(low), math.log(high))):.4g}"
        return f"{self.random.uniform(low, high):.4g}"

    def number(self, low: float, high: float) -> str:
        """A number between two bounds, or an edge."""
        return self.edge() if self.chance(self.wild) else self.plain(low, high)

    def positive(self, low: float, high: float) -> str:
        """A number that no sign makes illegal, or an edge; zero is one."""
        return self.edge(signed=False) if self.chance(self.wild) else self.plain(low, high)

    def vector(self, reach: float) -> str:
        """Three numbers; often on a grid, so that points coincide and axes are parallel."""
        if self.chance(0.4):
            parts = [self.one_of("0", "0", "0.25", "0.5", "-0.5") for _ in range(3)]
        else:
            parts = [self.plain(-reach, reach) for _ in range(3)]
        return " ".join(self.edge() if self.chance(self.wild) else part for part in parts)

    def angles(self) -> str:
        """Roll, pitch and yaw; mostly none."""
        if self.chance(0.6):
            return "0 0 0"
        return " ".join(self.number(-3.2, 3.2) for _ in range(3))

    def direction(self) -> str:
        """A direction: an axis, askew, or of an odd length."""
        if self.chance(0.6):
            return self.one_of("1 0 0", "0 1 0", "0 0 1", "0 0 -1")
        if self.chance(self.wild):
            length = self.edge()
            return self.one_of(f"{length} 0 0", f"0 {length} {length}", f"{length} 1 0")
        return " ".join(self.plain(-1, 1) for _ in range(3))


def attributes(**given: str | None) -> str:
    """Attributes of an element as text; ``None`` leaves one out, a trailing ``_`` of a name is dropped."""
    return "".join(f' {name.rstrip("_")}="{value}"' for name, value in given.items() if value is not None)
