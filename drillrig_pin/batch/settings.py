"""What a study says about searching its bounds: its sections ``sensitivity:`` and ``optimize:``."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator

from drillrig_pin.batch.measures import require_known
from drillrig_pin.words import si

#: What a design is worth when it is run under several conditions, e.g. at nine holes.
Over = Literal["worst", "mean"]

#: Designs a start of a search needs to be one.
LEAST_BUDGET = 20

_CONSTRAINT = re.compile(r"\s*(?P<metric>[^<>=\s]+)\s*(?P<sense><=|>=)\s*(?P<value>[^<>=]+?)\s*")


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, str_max_length=10_000)


@dataclass(frozen=True, slots=True)
class Constraint:
    """A metric, or all that a pattern means, stays on one side of a bound under every condition.

    Attributes:
        text: as it was written.
        metric: name or pattern.
        least: whether ``bound`` is the least allowed value, not the greatest.
        bound, unit: in SI; the unit is empty where none was written.
    """

    text: str
    metric: str
    least: bool
    bound: float
    unit: str

    def broken(self, value: float) -> bool:
        """Whether a value lies on the wrong side."""
        return value < self.bound if self.least else value > self.bound

    def excess(self, value: float) -> float:
        """How badly a value breaks it: 0 if it does not, towards 1 far away."""
        if not self.broken(value):
            return 0.0
        over = abs(value - self.bound) / (abs(self.bound) or 1.0)
        return over / (1.0 + over)


def parse_constraint(text: str) -> Constraint:
    """``lift_cylinder.p_min >= 2 bar`` as a constraint; ValueError with what is wrong."""
    match = _CONSTRAINT.fullmatch(text)
    if match is None:
        raise ValueError(f"{text!r} is no constraint; write METRIC >= VALUE UNIT or METRIC <= VALUE UNIT")
    require_known([match["metric"]])
    bound, unit = si(match["value"])
    return Constraint(" ".join(text.split()), match["metric"], match["sense"] == ">=", bound, unit)


class SensitivitySettings(_Part):
    """How ``drillrig sensitivity`` looks at a study."""

    method: Literal["morris", "sobol"] = Field("morris", description="screening, or shares of the variance")
    metric: str | None = Field(None, description="metric that is told first; none: the one of the worst case")
    over: Over = Field("worst", description="of a metric over the conditions of a design")
    trajectories: Annotated[int, Field(ge=2, le=100_000)] = 10
    samples: Annotated[int, Field(ge=2, le=1_000_000)] = 64
    seed: Annotated[int, Field(ge=0, lt=2**31)] = 0

    @field_validator("samples")
    @classmethod
    def _balanced(cls, given: int) -> int:
        if given & (given - 1):
            raise ValueError(f"a Sobol sequence is even only for a power of two, not for {given} samples")
        return given

    @field_validator("metric")
    @classmethod
    def _known(cls, given: str | None) -> str | None:
        require_known([] if given is None else [given])
        return given

    def asked(self) -> Iterator[tuple[tuple[str | int, ...], str]]:
        """Metrics it names, with the way to the entry."""
        if self.metric is not None:
            yield ("metric",), self.metric


class OptimizeSettings(_Part):
    """What ``drillrig optimize`` looks for."""

    minimize: str | None = Field(None, description="metric to make small")
    maximize: str | None = Field(None, description="metric to make great; none of both: the worst case's metric, small")
    over: Over = Field("worst", description="of that metric over the conditions of a design")
    constraints: Annotated[list[str], Field(description="METRIC >= VALUE UNIT, under every condition")] = []
    starts: Annotated[int, Field(ge=1, le=1000)] = 2
    budget: Annotated[int, Field(ge=1, le=1_000_000, description="designs tried at most")] = 120
    seed: Annotated[int, Field(ge=0, lt=2**31)] = 0

    @model_validator(mode="after")
    def _one_goal(self) -> Self:
        if self.minimize is not None and self.maximize is not None:
            raise ValueError("give either minimize or maximize")
        if self.budget < LEAST_BUDGET * self.starts:
            raise ValueError(
                f"a start needs at least {LEAST_BUDGET} designs, so {self.starts} starts a budget of "
                f"{LEAST_BUDGET * self.starts}, not {self.budget}"
            )
        return self

    @field_validator("minimize", "maximize")
    @classmethod
    def _known(cls, given: str | None) -> str | None:
        require_known([] if given is None else [given])
        return given

    @field_validator("constraints")
    @classmethod
    def _readable(cls, given: list[str]) -> list[str]:
        for text in given:
            parse_constraint(text)
        return given

    def parsed(self) -> tuple[Constraint, ...]:
        """The constraints."""
        return tuple(parse_constraint(text) for text in self.constraints)

    def asked(self) -> Iterator[tuple[tuple[str | int, ...], str]]:
        """Metrics it names, with the way to the entry."""
        if self.minimize is not None:
            yield ("minimize",), self.minimize
        if self.maximize is not None:
            yield ("maximize",), self.maximize
        for i, constraint in enumerate(self.parsed()):
            yield ("constraints", i), constraint.metric
