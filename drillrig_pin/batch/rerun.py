"""A design as a study of its own, and running it once more to see that its numbers come out again."""

from __future__ import annotations

from drillrig_pin.batch.cases import unfold
from drillrig_pin.batch.goal import Trial
from drillrig_pin.batch.session import Session
from drillrig_pin.batch.settings import OptimizeSettings, SensitivitySettings
from drillrig_pin.batch.space import Space
from drillrig_pin.batch.study import Study


def best_study(study: Study, space: Space, trial: Trial) -> Study:
    """The study of one design: its values set, the conditions left as axes."""
    return study.having(
        name=f"{study.name}_best",
        text=f"Best design found of: {study.text or study.name}",
        set={**study.set, **trial.design},
        axes=space.others,
        metrics=list(study.all_metrics()),
        sensitivity=SensitivitySettings(),
        optimize=OptimizeSettings(),
    )


def reproduced(session: Session, study: Study, space: Space, trial: Trial) -> list[str]:
    """Run the study of a design once more and give what comes out otherwise."""
    plan = unfold(best_study(study, space, trial))
    found = []
    for case, before, now in zip(trial.cases, trial.answers, session.again(plan), strict=True):
        if before.status != now.status:
            found.append(f"case {case.index} was {before.status}, now it is {now.status}: {now.reason}")
        for name, value in before.metrics.items():
            if now.metrics.get(name) != value:
                found.append(f"case {case.index}: {name} was {value!r}, now it is {now.metrics.get(name)!r}")
    return found
