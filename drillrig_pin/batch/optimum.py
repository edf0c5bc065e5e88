"""The best design of a search as files: ``best.yaml``, a study that runs it again, and ``optimum.json``.

``optimum.json`` is one document (SI):

    format       "drillrig optimum 1"
    study, text, seed, budget
    goal         metric, unit, sense ("minimize", "maximize"), over ("worst", "mean", "" for a single case)
    constraints  as they were given
    parameters   list: name, low, high, scale, unit, text, assumed
    designs, infeasible, cases    tried; of these not feasible; runs
    starts       list: designs, generations, value, converged
    default, best                 design (by name), value, feasible, cases: list of condition, case (row of the table),
                                  status, reason, value; default is null if the model does not tell its values
    improvement  share of the default's value, positive if the best is better; null without a default to compare with
    at_bound     names the best design has at a bound: "lower" or "upper"
    reproduced   true if best.yaml gave the same numbers when it was run
"""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any

from drillrig_pin.batch.goal import Trial
from drillrig_pin.batch.optimizer import Found
from drillrig_pin.batch.rerun import best_study
from drillrig_pin.batch.space import Space, parameters
from drillrig_pin.batch.study import Study, study_text
from drillrig_pin.files import saving

FILE = "optimum.json"
STUDY = "best.yaml"
FORMAT = "drillrig optimum 1"
#: A design nearer to a bound than this share of the range stands at it.
AT_BOUND = 0.01


def improvement(found: Found) -> float | None:
    """By which share of its value the default was improved; None if it cannot be compared."""
    default, best = found.default, found.best
    if default is None or best is None or not default.value or best.value is None:
        return None
    gain = (default.value - best.value) / abs(default.value)
    return gain if found.goal.lower else -gain


def at_bound(space: Space, trial: Trial) -> dict[str, str]:
    """Names a design has at one of their bounds."""
    shares = zip(space.bounds, space.shares(trial.design), strict=True)
    return {
        name: "lower" if share < AT_BOUND else "upper"
        for name, share in shares
        if share < AT_BOUND or share > 1 - AT_BOUND
    }


def optimum_document(study: Study, found: Found) -> dict[str, Any]:
    """What the file holds."""
    goal, best = found.goal, found.best
    conditions = len(found.space.conditions)
    return {
        "format": FORMAT,
        "study": study.name,
        "text": study.text,
        "seed": study.optimize.seed,
        "budget": study.optimize.budget,
        "goal": {
            "metric": goal.metric,
            "unit": goal.unit,
            "sense": goal.sense,
            "over": goal.over if conditions > 1 else "",
        },
        "constraints": [constraint.text for constraint in goal.constraints],
        "parameters": [dataclasses.asdict(item) for item in parameters(found.space, found.asker)],
        "designs": len(found.trials),
        "infeasible": sum(not trial.feasible for trial in found.trials),
        "cases": found.tally.done,
        "starts": [dataclasses.asdict(start) for start in found.starts],
        "default": _told(found, found.default),
        "best": _told(found, best),
        "improvement": improvement(found),
        "at_bound": {} if best is None else at_bound(found.space, best),
        "reproduced": None if found.differences is None else not found.differences,
    }


def save_optimum(study: Study, found: Found, folder: Path) -> None:
    """Write both files; ResultFileError if that cannot be. Without a feasible design there is no study of it."""
    document = json.dumps(optimum_document(study, found), indent=1, ensure_ascii=False, allow_nan=False)
    _write(folder / FILE, document + "\n")
    if found.best is not None and found.best.feasible:
        told = f"# Best design of the study {study.name}, found by drillrig optimize.\n"
        _write(folder / STUDY, told + study_text(best_study(study, found.space, found.best)))


def _write(target: Path, text: str) -> None:
    with saving(target, where=target, todo="Make room; the cases themselves are safe.") as aside:
        aside.write_text(text, encoding="utf-8")


def _told(found: Found, trial: Trial | None) -> dict[str, Any] | None:
    if trial is None:
        return None
    rows = zip(found.space.conditions, trial.cases, trial.answers, trial.values, strict=True)
    cases = [
        {"condition": point, "case": case.index, "status": answer.status, "reason": answer.reason, "value": value}
        for point, case, answer, value in rows
    ]
    return {"design": trial.design, "value": trial.value, "feasible": trial.feasible, "cases": cases}
