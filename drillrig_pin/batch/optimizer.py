"""Search the bounds of a study for its best design: differential evolution, every generation a batch."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from drillrig_pin.batch.cases import Asker, require_few
from drillrig_pin.batch.goal import Goal, Trial, goal_of
from drillrig_pin.batch.rerun import reproduced
from drillrig_pin.batch.session import TIME_LIMIT_DEFAULT, Listener, Session
from drillrig_pin.batch.settings import LEAST_BUDGET
from drillrig_pin.batch.space import Design, Space, default_design, space_of
from drillrig_pin.batch.study import Study
from drillrig_pin.batch.summary import Tally
from drillrig_pin.errors import ScenarioError
from drillrig_pin.kinematics import Array
from drillrig_pin.words import quantity

#: A start ends when the values of its population differ by less than this share of their mean.
CONVERGED = 1e-3
#: A little gentler than scipy's own: with some hundred designs, not many thousands, they came nearer to the least of a
#: bowl with a constraint. On the shipped study both end alike.
MUTATION, RECOMBINATION = (0.4, 0.9), 0.7
#: Designs of a generation: at least; at most, and for every name searched if that is more.
POPULATION = (8, 12, 6)
#: Generations a population that is larger than the least leaves room for.
ROOM = 12
#: A start has at least this many generations, if that leaves scipy its least population.
GENERATIONS, LEAST_POPULATION = LEAST_BUDGET // 5, 5


@dataclass(frozen=True, slots=True)
class Start:
    """One start of the search: how long it went, the best it found, whether its population agreed in the end."""

    designs: int
    generations: int
    value: float | None
    converged: bool


@dataclass(frozen=True)
class Found:
    """What a search found.

    Attributes:
        table: the Parquet file with every case.
        tally: counts.
        goal: what was looked for.
        space: between which bounds.
        best: the best design, feasible if there is one that is; None if interrupted before the first.
        default: the design the study starts from, if it is known.
        trials: all designs tried.
        starts: those that ended.
        interrupted: stopped by Ctrl-C.
        asker: makes cases of the study.
        differences: what came out otherwise when the best design was run again; None: it was not run again.
    """

    table: Path
    tally: Tally
    goal: Goal
    space: Space
    best: Trial | None
    default: Trial | None
    trials: list[Trial] = field(repr=False)
    starts: list[Start]
    interrupted: bool
    asker: Asker = field(repr=False)
    differences: list[str] | None = None


def run_search(
    study: Study,
    folder: str | Path,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    time_limit: float | None = TIME_LIMIT_DEFAULT,
    listener: Listener | None = None,
) -> Found:
    """Search a study for its best design, keep every evaluation, and run the best one again.

    The same study and seed try the same designs, however many workers there are; what the folder holds of them is not
    computed again.

    Args: those of :func:`drillrig_pin.batch.runner.run_study`; the study's section ``optimize`` says the rest.

    Raises:
        ScenarioError: the study has no bounds, its goal is no metric, or no design can be run.
    """
    space, goal = space_of(study), goal_of(study)
    require_few(study, study.optimize.budget * len(space.conditions))
    session = Session(
        study,
        folder,
        workers=workers,
        scheduler=scheduler,
        time_limit=time_limit,
        listener=listener,
        remember=True,
    )
    with session:
        asker = Asker(study)
        tally = session.start(asker.plan([], "optimize"))
        search = Search(study, session, asker, space, goal)
        interrupted, differences = False, None
        try:
            search.run()
            tally.expect(0)
            if search.best is not None and search.best.feasible:
                differences = reproduced(session, study, space, search.best)
        except KeyboardInterrupt:
            interrupted = True
        finally:
            table = session.write_table()
        trials = list(search.trials.values())
        return Found(
            table,
            tally,
            goal,
            space,
            search.best,
            search.default,
            trials,
            search.starts,
            interrupted,
            asker,
            differences,
        )


class Search:
    """Differential evolution over shares of the ranges, with every design run once."""

    def __init__(self, study: Study, session: Session, asker: Asker, space: Space, goal: Goal) -> None:
        self.study, self.session, self.asker, self.space, self.goal = study, session, asker, space, goal
        self.trials: dict[tuple[float, ...], Trial] = {}
        self.best: Trial | None = None
        self.default: Trial | None = None
        self.starts: list[Start] = []
        self._start = self._generation = self._first = 0

    def run(self) -> None:
        """All starts, one after the other; the first population holds the design the study starts from."""
        wanted = self.study.optimize
        self.session.tally.expect(wanted.budget * len(self.space.conditions))
        self.session.tally.note = "start 1, generation 1"
        default = default_design(self.space, self.asker)
        for start in range(wanted.starts):
            self._start, self._generation, self._first = start, 0, len(self.trials)
            self._one(np.random.default_rng([wanted.seed, start]), default if start == 0 else None)

    def evaluate(self, designs: list[Design]) -> list[Trial]:
        """What designs are worth; those not run yet are run together."""
        keys = [tuple(design.values()) for design in designs]
        new = {key: design for key, design in zip(keys, designs, strict=True) if key not in self.trials}
        if new:
            self._run(list(new.values()))
            self._generation += 1
        return [self.trials[key] for key in keys]

    def _run(self, designs: list[Design]) -> None:
        planned = []
        at = len(self.session.plan.cases)
        for i, design in enumerate(designs, len(self.trials)):
            tags = {"design": i, "start": self._start, "generation": self._generation}
            planned.append(self.space.cases(self.asker, design, at, tags))
            at += len(planned[-1])
        answers = self.session.extend([case for cases in planned for case in cases])
        step = len(self.space.conditions)
        for i, (design, cases) in enumerate(zip(designs, planned, strict=True)):
            found = answers[i * step : (i + 1) * step]
            trial = self.goal.judge(design, cases, found, self._start, self._generation)
            self.trials[tuple(design.values())] = trial
            if self.goal.better(trial, self.best):
                self.best = trial
        self._require_some()
        self.session.tally.note = self._standing()

    def _one(self, rng: np.random.Generator, default: Design | None) -> None:
        from scipy.optimize import NonlinearConstraint, differential_evolution
        from scipy.stats import qmc

        names = len(self.space.bounds)
        budget = self.study.optimize.budget // self.study.optimize.starts
        population = qmc.LatinHypercube(names, rng=rng).random(population_size(names, budget))
        designs = [self.space.design(row) for row in population]
        if default is not None:
            if self.space.inside(default):
                designs[0], population[0] = default, self.space.shares(default)
            else:
                designs.append(default)
        first = self.evaluate(designs)
        if default is not None:
            self.default = first[0] if self.space.inside(default) else first[-1]
        found = differential_evolution(
            lambda x: np.array([self.goal.energy(trial) for trial in self._at(x)]),
            [(0.0, 1.0)] * names,
            init=population,
            maxiter=budget // len(population) - 1,
            tol=CONVERGED,
            mutation=MUTATION,
            recombination=RECOMBINATION,
            rng=rng,
            polish=False,
            updating="deferred",
            vectorized=True,
            # The least violating of two infeasible designs is the better one [Lampinen, CEC 2002].
            constraints=NonlinearConstraint(lambda x: np.array([[t.excess for t in self._at(x)]]), -np.inf, 0.0),
        )
        self.starts.append(self._ended(found))

    def _at(self, x: Array) -> list[Trial]:
        """Trials at the columns of x (names, designs)."""
        shares = np.asarray(x).reshape(len(self.space.bounds), -1)
        designs = []
        for column in shares.T:
            # The design the study starts from may have more digits than designs of the search.
            near = self.default if self.default is not None and self._is_default(column) else None
            designs.append(near.design if near is not None else self.space.design(column))
        return self.evaluate(designs)

    def _is_default(self, shares: Array) -> bool:
        assert self.default is not None
        return bool(np.allclose(shares, self.space.shares(self.default.design), rtol=0, atol=1e-13))

    def _ended(self, found: Any) -> Start:
        trials = list(self.trials.values())[self._first :]
        best: Trial | None = None
        for trial in trials:
            best = trial if self.goal.better(trial, best) else best
        value = best.value if best is not None and best.feasible else None
        return Start(len(trials), self._generation, value, bool(found.success))

    def _require_some(self) -> None:
        """The first designs tell whether there is anything to search."""
        if self._start or self._generation or any(v is not None for t in self.trials.values() for v in t.values):
            return
        reason = next(breach.reason for trial in self.trials.values() for breach in trial.breaches)
        raise ScenarioError(
            f"none of the first {len(self.trials)} designs can be run, e.g. {reason.rstrip('.')}",
            where=self.study.at("axes") or self.study.name,
            todo="Look at the bounds.",
        )

    def _standing(self) -> str:
        best = self.best
        told = "no feasible design yet"
        if best is not None and best.feasible:
            told = f"best {quantity(best.value, self.goal.unit)}"
        return f"start {self._start + 1}, generation {self._generation + 1}: {told}"


def population_size(names: int, budget: int) -> int:
    """Designs of a generation: more for more names and a larger budget, few enough to leave some generations."""
    least, most, each = POPULATION
    size = min(max(least, budget // ROOM), max(most, each * names))
    return max(LEAST_POPULATION, min(size, budget // GENERATIONS))
