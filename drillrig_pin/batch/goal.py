"""What a search looks for: one number a design, and what must hold under every condition."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from fnmatch import fnmatchcase

from drillrig_pin.batch.cases import Case
from drillrig_pin.batch.settings import Constraint, Over
from drillrig_pin.batch.study import Study
from drillrig_pin.batch.summary import higher_is_better
from drillrig_pin.batch.worker import COMPLETED, Answer
from drillrig_pin.errors import ScenarioError


@dataclass(frozen=True, slots=True)
class Breach:
    """Why a case makes its design infeasible: it has no numbers, or breaks a constraint."""

    case: Case
    reason: str
    constraint: Constraint | None = None


@dataclass(frozen=True)
class Trial:
    """A design that was run.

    Attributes:
        design: values of what is searched.
        cases, answers: one for every condition.
        value: of the goal in SI; None if a case has no number.
        values: of the metric, one for every condition.
        excess: how badly it fails, 0 if it is feasible: a case without numbers counts more than all broken constraints.
        breaches: what makes it infeasible.
        start, generation: of the search it was first tried in.
    """

    design: dict[str, float]
    cases: list[Case] = field(repr=False)
    answers: list[Answer] = field(repr=False)
    value: float | None
    values: list[float | None]
    excess: float
    breaches: list[Breach] = field(repr=False)
    start: int = 0
    generation: int = 0

    @property
    def feasible(self) -> bool:
        """Every case has its numbers and keeps every constraint."""
        return self.excess == 0


@dataclass
class Goal:
    """A metric to make small or great over the conditions of a design, under constraints.

    Attributes:
        pattern: name of the metric, as it was given.
        lower: small is good.
        over: whether the worst condition counts or the mean.
        constraints: must hold under every condition.
        unique: whether the pattern must mean one metric, not the first of several.
        metric, unit: known once a case was completed.
    """

    pattern: str
    lower: bool
    over: Over
    constraints: tuple[Constraint, ...]
    unique: bool
    metric: str = ""
    unit: str = ""

    @property
    def sense(self) -> str:
        """``minimize`` or ``maximize``."""
        return "minimize" if self.lower else "maximize"

    def energy(self, trial: Trial) -> float:
        """The number that is made small."""
        if trial.value is None:
            return math.inf
        return trial.value if self.lower else -trial.value

    def better(self, trial: Trial, than: Trial | None) -> bool:
        """Whether a design is better than another: feasible ones always are, then the goal decides."""
        if than is None:
            return True
        if trial.feasible and than.feasible:
            return self.energy(trial) < self.energy(than)
        return trial.excess < than.excess

    def judge(
        self, design: dict[str, float], cases: list[Case], answers: list[Answer], start: int, generation: int
    ) -> Trial:
        """What a design is worth.

        Raises:
            ScenarioError: the goal means several metrics, or a constraint has the wrong unit.
        """
        breaches: list[Breach] = []
        values: list[float | None] = []
        excess = 0.0
        for case, answer in zip(cases, answers, strict=True):
            if answer.status == COMPLETED:
                self._learn(answer)
            value = answer.metrics.get(self.metric) if answer.status == COMPLETED else None
            if value is None or not math.isfinite(value):
                values.append(None)
                excess += 1.0 + len(self.constraints)
                breaches.append(Breach(case, answer.reason or f"has no {self.metric or self.pattern}"))
                continue
            values.append(value)
            for constraint in self.constraints:
                over, reason = _broken(constraint, answer)
                excess += over
                if over:
                    breaches.append(Breach(case, reason, constraint))
        known = [value for value in values if value is not None]
        whole = self._over(known) if len(known) == len(values) else None
        return Trial(design, cases, answers, whole, values, excess, breaches, start, generation)

    def _over(self, values: list[float]) -> float:
        if self.over == "mean":
            return math.fsum(values) / len(values)
        return max(values) if self.lower else min(values)

    def _learn(self, answer: Answer) -> None:
        if self.metric:
            return
        found = [name for name in answer.metrics if fnmatchcase(name, self.pattern)]
        if not found:
            return
        if self.unique and len(found) > 1:
            raise ScenarioError(
                f"{self.pattern!r} means {len(found)} metrics, and a goal is one",
                where=f"--{self.sense}",
                todo=f"Choose one of {', '.join(found)}.",
            )
        self.metric, self.unit = found[0], answer.units.get(found[0], "")
        for constraint in self.constraints:
            for name, unit in answer.units.items():
                if constraint.unit and fnmatchcase(name, constraint.metric) and unit != constraint.unit:
                    raise ScenarioError(
                        f"{name} is measured in {unit or 'no unit'}",
                        where=f"constraint {constraint.text!r}",
                        todo="Give the bound in that unit, or without unit in SI.",
                    )


def goal_of(study: Study) -> Goal:
    """The goal in a study's section ``optimize``; without one, the metric of its worst case in the good direction."""
    wanted = study.optimize
    pattern = wanted.minimize or wanted.maximize
    if pattern is not None:
        return Goal(pattern, wanted.maximize is None, wanted.over, wanted.parsed(), True)
    pattern = study.worst or study.metrics[0]
    return Goal(pattern, not higher_is_better(pattern), wanted.over, wanted.parsed(), False)


def _broken(constraint: Constraint, answer: Answer) -> tuple[float, str]:
    """How badly one case breaks a constraint, and the value that does."""
    from drillrig_pin.words import quantity

    found = {name: value for name, value in answer.metrics.items() if fnmatchcase(name, constraint.metric)}
    if not found:
        return 1.0, f"has no {constraint.metric}"
    name = max(found, key=lambda name: constraint.excess(found[name]))
    return constraint.excess(found[name]), f"{name} is {quantity(found[name], answer.units.get(name, ''))}"
