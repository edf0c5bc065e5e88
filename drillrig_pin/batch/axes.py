"""Axes of a study: what is varied, and over which values.

Every axis knows its ``names``, its ``size`` and a ``sample`` of its points without making them: what is asked for is
held to bounds before it costs anything.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, Discriminator, Field, Tag, model_validator

from drillrig_pin.batch.holes import Aim, Hole
from drillrig_pin.scenario import require_no_switch

#: One combination of values: ``model.ARGUMENT`` and ``scenario.FIELD`` to values, ``hole`` to a :class:`Hole`.
Point = dict[str, Any]


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, str_max_length=10_000)

    @model_validator(mode="before")
    @classmethod
    def _no_switch_for_a_number(cls, given: Any) -> Any:
        return require_no_switch(cls, given)


def _plain(value: Any) -> Any:
    """YAML reads 1e6 as a word; a word that is a number is one."""
    if isinstance(value, str):
        try:
            number = float(value)
        except ValueError:
            return value
        return number if math.isfinite(number) else value
    return value


Value = Annotated[bool | int | float | str | list[float], BeforeValidator(_plain)]
Number = Annotated[float, Field(allow_inf_nan=False)]


class Span(_Part):
    """Evenly spaced values from ``start`` to ``stop``, both included; either ``count`` or ``step`` says how many."""

    start: Number
    stop: Number
    count: Annotated[int, Field(ge=1, le=1_000_000)] | None = None
    step: Annotated[float, Field(gt=0)] | None = None
    scale: Literal["linear", "log"] = "linear"

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        if (self.count is None) == (self.step is None):
            raise ValueError("give either count or step")
        if self.scale == "log" and (self.step is not None or min(self.start, self.stop) <= 0):
            raise ValueError("a log scale takes count, and start and stop above zero")
        if self.step is not None and not 0 <= (self.stop - self.start) / self.step < 1e6:
            raise ValueError("stop lies below start, or more than a million steps away")
        return self

    def __len__(self) -> int:
        """How many values."""
        if self.step is not None:
            return math.floor((self.stop - self.start) / self.step * (1 + 1e-12)) + 1
        return self.count or 1

    def values(self) -> Iterator[float]:
        """The values in order. Twelve digits: 25 + 3 x 0.1 is meant to be 25.3."""
        if self.step is not None:
            return (float(f"{self.start + i * self.step:.12g}") for i in range(len(self)))
        space = np.geomspace if self.scale == "log" else np.linspace
        return (float(f"{value:.12g}") for value in space(self.start, self.stop, len(self)))


Values = Annotated[list[Value], Field(min_length=1)] | Span


def _values(given: list[Any] | Span) -> Iterator[Any]:
    return given.values() if isinstance(given, Span) else iter(given)


def _first(given: list[Any] | Span) -> Any:
    return float(f"{given.start:.12g}") if isinstance(given, Span) else given[0]


class ListAxis(_Part):
    """One name over listed values."""

    name: str
    list: Annotated[list[Value], Field(min_length=1)]

    @property
    def names(self) -> tuple[str, ...]:
        """What it varies."""
        return (self.name,)

    @property
    def size(self) -> int:
        """How many points it has."""
        return len(self.list)

    def sample(self) -> Point:
        """Its first point."""
        return {self.name: self.list[0]}

    def points(self) -> Iterator[Point]:
        """One point for every value."""
        return ({self.name: value} for value in self.list)


class RangeAxis(_Part):
    """One name over evenly spaced values."""

    name: str
    range: Span

    @property
    def names(self) -> tuple[str, ...]:
        """What it varies."""
        return (self.name,)

    @property
    def size(self) -> int:
        """How many points it has."""
        return len(self.range)

    def sample(self) -> Point:
        """Its first point."""
        return {self.name: _first(self.range)}

    def points(self) -> Iterator[Point]:
        """One point for every value."""
        return ({self.name: value} for value in self.range.values())


class ZipAxis(_Part):
    """Several names that change together: first values, second values, and so on."""

    zip: Annotated[dict[str, Values], Field(min_length=1)]

    @model_validator(mode="after")
    def _equal_lengths(self) -> Self:
        lengths = {name: len(given) for name, given in self.zip.items()}
        if len(set(lengths.values())) > 1:
            told = ", ".join(f"{name} has {n}" for name, n in itertools.islice(lengths.items(), 20))
            raise ValueError(f"zipped names need equally many values: {told}")
        return self

    @property
    def names(self) -> tuple[str, ...]:
        """What it varies."""
        return tuple(self.zip)

    @property
    def size(self) -> int:
        """How many points it has."""
        return len(next(iter(self.zip.values())))

    def sample(self) -> Point:
        """Its first point."""
        return {name: _first(given) for name, given in self.zip.items()}

    def points(self) -> Iterator[Point]:
        """One point for every place in the lists."""
        columns = [_values(given) for given in self.zip.values()]
        return (dict(zip(self.zip, row, strict=True)) for row in zip(*columns, strict=True))


class GridAxis(_Part):
    """Several names, every combination; the last name changes fastest."""

    grid: Annotated[dict[str, Values], Field(min_length=1)]

    @property
    def names(self) -> tuple[str, ...]:
        """What it varies."""
        return tuple(self.grid)

    @property
    def size(self) -> int:
        """How many points it has."""
        return math.prod(len(given) for given in self.grid.values())

    def sample(self) -> Point:
        """Its first point."""
        return {name: _first(given) for name, given in self.grid.items()}

    def points(self) -> Iterator[Point]:
        """One point for every combination."""
        columns = [_values(given) for given in self.grid.values()]
        return (dict(zip(self.grid, row, strict=True)) for row in itertools.product(*columns))


class Bounds(_Part):
    """From ``low`` to ``high``, uniform in the value or in its logarithm; also written ``[low, high]``."""

    low: Number
    high: Number
    scale: Literal["linear", "log"] = "linear"

    @model_validator(mode="before")
    @classmethod
    def _pair(cls, given: Any) -> Any:
        return {"low": given[0], "high": given[1]} if isinstance(given, list) and len(given) == 2 else given

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if not self.low < self.high:
            raise ValueError(f"low ({self.low:g}) is not below high ({self.high:g})")
        if self.scale == "log" and self.low <= 0:
            raise ValueError("a log scale needs bounds above zero")
        return self

    def at(self, share: float) -> float:
        """The value at a share from 0 to 1 of the way."""
        if self.scale == "log":
            return float(self.low * (self.high / self.low) ** share)
        return float(self.low + share * (self.high - self.low))


class Sampling(_Part):
    """How many samples within which bounds; the same seed gives the same samples."""

    samples: Annotated[int, Field(ge=1, le=1_000_000)]
    seed: Annotated[int, Field(ge=0)] = 0
    bounds: Annotated[dict[str, Bounds], Field(min_length=1)]

    def middle(self) -> Point:
        """The middle of the box."""
        return {name: bound.at(0.5) for name, bound in self.bounds.items()}

    def spread(self, shares: Any) -> Iterator[Point]:
        """Points of samples of the unit cube (samples, names)."""
        return (
            {name: bound.at(float(share)) for (name, bound), share in zip(self.bounds.items(), row, strict=True)}
            for row in shares
        )


class LatinHypercubeAxis(_Part):
    """Samples of which every name sees each of ``samples`` equal slices of its range once."""

    latin_hypercube: Sampling

    @property
    def names(self) -> tuple[str, ...]:
        """What it varies."""
        return tuple(self.latin_hypercube.bounds)

    @property
    def size(self) -> int:
        """How many points it has."""
        return self.latin_hypercube.samples

    def sample(self) -> Point:
        """A point that stands for the others: the middle of the box."""
        return self.latin_hypercube.middle()

    def points(self) -> Iterator[Point]:
        """One point for every sample."""
        from scipy.stats import qmc

        plan = self.latin_hypercube
        return plan.spread(qmc.LatinHypercube(len(plan.bounds), rng=plan.seed).random(plan.samples))


class SobolAxis(_Part):
    """A scrambled Sobol sequence, which fills the box more evenly than chance; ``samples`` is a power of two."""

    sobol: Sampling

    @property
    def names(self) -> tuple[str, ...]:
        """What it varies."""
        return tuple(self.sobol.bounds)

    @property
    def size(self) -> int:
        """How many points it has."""
        return self.sobol.samples

    def sample(self) -> Point:
        """A point that stands for the others: the middle of the box."""
        return self.sobol.middle()

    @model_validator(mode="after")
    def _balanced(self) -> Self:
        n = self.sobol.samples
        if n & (n - 1):
            raise ValueError(f"a Sobol sequence is even only for a power of two, not for {n} samples")
        return self

    def points(self) -> Iterator[Point]:
        """One point for every sample."""
        from scipy.stats import qmc

        plan = self.sobol
        return plan.spread(qmc.Sobol(len(plan.bounds), rng=plan.seed).random(plan.samples))


class Holes(Aim):
    """Holes on the rock face, each turned into a pose of the machine."""

    places: Annotated[dict[str, Hole], Field(min_length=1)]


class HolesAxis(_Part):
    """One case for every hole."""

    holes: Holes

    @property
    def names(self) -> tuple[str, ...]:
        """What it varies."""
        return ("hole",)

    @property
    def size(self) -> int:
        """How many points it has."""
        return len(self.holes.places)

    def sample(self) -> Point:
        """Its first point."""
        return {"hole": next(iter(self.holes.places))}

    def points(self) -> Iterator[Point]:
        """One point for every hole, by its name."""
        return ({"hole": name} for name in self.holes.places)


KINDS: dict[str, type[_Part]] = {
    "list": ListAxis,
    "range": RangeAxis,
    "zip": ZipAxis,
    "grid": GridAxis,
    "latin_hypercube": LatinHypercubeAxis,
    "sobol": SobolAxis,
    "holes": HolesAxis,
}


def _kind(given: Any) -> str | None:
    if isinstance(given, BaseModel):
        return next((kind for kind, cls in KINDS.items() if isinstance(given, cls)), None)
    found = [kind for kind in KINDS if isinstance(given, dict) and kind in given]
    return found[0] if len(found) == 1 else None


Axis = Annotated[
    Annotated[ListAxis, Tag("list")]
    | Annotated[RangeAxis, Tag("range")]
    | Annotated[ZipAxis, Tag("zip")]
    | Annotated[GridAxis, Tag("grid")]
    | Annotated[LatinHypercubeAxis, Tag("latin_hypercube")]
    | Annotated[SobolAxis, Tag("sobol")]
    | Annotated[HolesAxis, Tag("holes")],
    Discriminator(
        _kind, custom_error_type="axis", custom_error_message=f"an axis has exactly one of {', '.join(KINDS)}"
    ),
]


def size_of(axes: Iterable[Any]) -> int:
    """How many combinations the points of these axes have, told without making any."""
    return math.prod(axis.size for axis in axes)
