"""What is known of a study at any moment: how many cases have which status, the best and the worst so far."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Iterable, Sequence
from fnmatch import fnmatchcase

from drillrig_pin.analysis.sampling import ENOUGH
from drillrig_pin.batch.cases import Case, Plan
from drillrig_pin.batch.worker import COMPLETED, FAILED, TRIED_AGAIN, UNREACHABLE, Answer

#: Cases that ended so have no trajectory.
WITHOUT_RUN = frozenset({FAILED, UNREACHABLE, *TRIED_AGAIN})


def higher_is_better(metric: str) -> bool:
    """Whether small values of a metric are the bad ones: a chamber may run empty."""
    return metric.endswith("p_min")


class Tally:
    """Counts and extremes of one study.

    Attributes:
        total: rows of the table, as far as they are planned.
        before: how many were recorded by an earlier command.
        statuses: how many ended how.
        metric: name of the metric that ranks the cases, once one is known.
        unit: its unit.
        reasons: one reason for every status other than completed, with its case.
        solve_time: time spent in integrations by this command [s].
        names: every metric met so far.
        completed: a case that was completed, once there is one.
        unsteady: completed cases whose motion has not settled.
        needed: how long their runs must be at least [s]; 0 if nothing is known of it.
        unseen: completed cases whose rows cannot show the loads.
        note: what a search that plans its cases as it goes has to say of itself.
    """

    def __init__(self, plan: Plan, recorded: Iterable[Answer]) -> None:
        self.total, self._planned = 0, 0
        self.started = time.monotonic()
        self.statuses: Counter[str] = Counter()
        self.metric, self.unit = "", ""
        self.reasons: dict[str, tuple[Case, str]] = {}
        self.solve_time, self.since_start = 0.0, 0
        self._pattern = plan.study.worst or plan.study.metrics[0]
        self.names: set[str] = set()
        self.completed: Case | None = None
        self.unsteady, self.unseen, self.needed = 0, 0, 0.0
        self.note = ""
        self.before = 0
        self._cases: dict[str, list[Case]] = {}
        self._values: dict[str, float] = {}
        self._with_run: set[str] = set()
        self.plan_more(plan.cases, recorded)

    def plan_more(self, cases: Iterable[Case], recorded: Iterable[Answer]) -> None:
        """Take over cases that were not planned before, and what was recorded of them by earlier commands."""
        planned = 0
        for case in cases:
            self._cases.setdefault(case.question.key, []).append(case)
            planned += 1
        self._planned += planned
        self.total = max(self.total, self._planned)
        self.before += sum(self._count(answer) for answer in recorded)

    @property
    def done(self) -> int:
        """Rows there are."""
        return sum(self.statuses.values())

    @property
    def failures(self) -> int:
        """Rows of cases that did not complete."""
        return self.done - self.statuses[COMPLETED]

    @property
    def best(self) -> tuple[Case, float] | None:
        """The case with the least (of a pressure that should be high: greatest) value of the metric."""
        return self._extreme(worst=False)

    @property
    def worst(self) -> tuple[Case, float] | None:
        """The opposite of the best."""
        return self._extreme(worst=True)

    def expect(self, count: int) -> None:
        """Say how many cases there will be in the end, at least those that are planned."""
        self.total = max(count, self._planned)

    def add(self, answer: Answer, now: float) -> None:
        """Take over an answer recorded just now."""
        self.solve_time += answer.solve_time
        self.since_start += self._count(answer)
        self.last = now

    def rate(self, now: float) -> float:
        """Cases a second since the start of this command."""
        return self.since_start / max(now - self.started, 1e-9)

    def ranked(self, cases: Sequence[Case]) -> list[Case]:
        """Cases that have the metric, worst first; equal ones in their order."""
        known = [case for case in cases if case.question.key in self._values]
        return sorted(known, key=lambda case: -self._badness(self._values[case.question.key]))

    def with_run(self, cases: Sequence[Case]) -> list[Case]:
        """Cases that were integrated, to their end or not."""
        return [case for case in cases if case.question.key in self._with_run]

    def _badness(self, value: float) -> float:
        return -value if higher_is_better(self.metric) else value

    def _extreme(self, worst: bool) -> tuple[Case, float] | None:
        if not self._values:
            return None
        choose = max if worst else min
        key = choose(self._values, key=lambda key: self._badness(self._values[key]))
        return self._cases[key][0], self._values[key]

    def _count(self, answer: Answer) -> int:
        cases = self._cases.get(answer.key, [])
        if not cases:
            return 0
        self.statuses[answer.status] += len(cases)
        if answer.status not in WITHOUT_RUN:
            self._with_run.add(answer.key)
        if answer.status != COMPLETED:
            self.reasons.setdefault(answer.status, (cases[0], answer.reason))
            return len(cases)
        self.names.update(answer.metrics)
        if answer.window.get("window.steady") == 0:
            self.unsteady += len(cases)
            self.needed = max(self.needed, answer.window.get("window.needed", 0.0))
        if answer.window.get("window.sampled", ENOUGH) < ENOUGH:
            self.unseen += len(cases)
        self.completed = self.completed or cases[0]
        if not self.metric:
            self.metric = next((name for name in answer.metrics if fnmatchcase(name, self._pattern)), "")
            self.unit = answer.units.get(self.metric, "")
        if self.metric in answer.metrics:
            self._values[answer.key] = answer.metrics[self.metric]
        return len(cases)
