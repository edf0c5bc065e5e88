"""Sensitivity of a study: which of its ranges matters, by Morris screening or Sobol indices through SALib."""

from __future__ import annotations

import json
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from drillrig_pin.batch.cases import Asker, Case, Plan, require_few
from drillrig_pin.batch.importance import Analysed, Index, Method, Sensitivity
from drillrig_pin.batch.ranking import looked_at, ranked, verdict
from drillrig_pin.batch.runner import Finished, run_study
from drillrig_pin.batch.session import TIME_LIMIT_DEFAULT, Listener
from drillrig_pin.batch.space import Space, parameters, space_of
from drillrig_pin.batch.study import Study
from drillrig_pin.batch.summary import higher_is_better
from drillrig_pin.batch.worker import COMPLETED
from drillrig_pin.errors import ScenarioError
from drillrig_pin.kinematics import Array

#: Levels of a Morris grid; SALib steps over half of them.
LEVELS = 4
#: Samples of the bootstrap that gives the confidence: its own scatter is then some 5 %.
RESAMPLES = 200
CONFIDENCE = 0.95


@dataclass(frozen=True)
class Sampled:
    """A sampling plan: designs in the order SALib wants them, as shares of the ranges (designs, names)."""

    method: Method
    seed: int
    space: Space
    shares: Array

    @property
    def block(self) -> int:
        """Designs of one trajectory (Morris) or one sample (Sobol), which are worth something together only."""
        names = len(self.space.bounds)
        return names + 1 if self.method == "morris" else names + 2

    @property
    def blocks(self) -> int:
        """Trajectories or samples."""
        return len(self.shares) // self.block

    @property
    def problem(self) -> dict[str, Any]:
        """The box of shares, as SALib describes it."""
        names = list(self.space.bounds)
        return {"num_vars": len(names), "names": names, "bounds": [[0.0, 1.0]] * len(names)}


def sample(study: Study) -> Sampled:
    """The designs that the study's section ``sensitivity`` asks for; more of them begin with those of fewer.

    Raises:
        ScenarioError: the study has no bounds.
    """
    wanted, space = study.sensitivity, space_of(study)
    plan = Sampled(wanted.method, wanted.seed, space, np.empty((0, len(space.bounds))))
    if wanted.method == "morris":
        from SALib.sample import morris

        shares = morris.sample(plan.problem, wanted.trajectories, num_levels=LEVELS, seed=wanted.seed)
    else:
        from SALib.sample import sobol

        shares = sobol.sample(plan.problem, wanted.samples, calc_second_order=False, seed=wanted.seed)
    return Sampled(wanted.method, wanted.seed, space, shares)


def sensitivity_plan(study: Study, sampled: Sampled) -> tuple[Plan, Asker]:
    """Cases of all designs of a sampling plan; tags say which design and which block a case belongs to."""
    space = sampled.space
    require_few(study, len(sampled.shares) * len(space.conditions))
    asker = Asker(study)
    cases: list[Case] = []
    for i, row in enumerate(sampled.shares):
        tags = {"design": i, "block": i // sampled.block}
        cases += space.cases(asker, space.design(row), len(cases), tags)
    return asker.plan(cases, "sensitivity"), asker


def run_sensitivity(
    study: Study,
    folder: str | Path,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    time_limit: float | None = TIME_LIMIT_DEFAULT,
    listener: Listener | None = None,
) -> tuple[Finished, Sensitivity | None]:
    """Run the designs of a sensitivity study, write their table and the indices beside it.

    Args: those of :func:`drillrig_pin.batch.runner.run_study`; the study's section ``sensitivity`` says the rest.

    Returns:
        What was run, and the indices; None if it was interrupted.

    Raises:
        ScenarioError: the study has no bounds; too many cases failed to say anything.
    """
    sampled = sample(study)
    plan, asker = sensitivity_plan(study, sampled)
    finished = run_study(plan, folder, workers=workers, scheduler=scheduler, time_limit=time_limit, listener=listener)
    if finished.interrupted:
        return finished, None
    result = analyse(study, sampled, asker, finished)
    result.save(Path(folder))
    return finished, result


def analyse(study: Study, sampled: Sampled, asker: Asker, finished: Finished) -> Sensitivity:
    """Indices of every metric in the table of a sensitivity study.

    A Morris trajectory of which a design failed is left out. Sobol indices need every design: of a metric that misses
    one there are none.

    Raises:
        ScenarioError: nothing is left of the metric that the study is about.
    """
    wanted = study.sensitivity
    values, units = _values(finished.table, sampled)
    main = _main(wanted.metric or study.worst or study.metrics[0], list(values), finished)
    conditions = len(sampled.space.conditions)
    over = wanted.over if conditions > 1 else ""
    indices: list[Index] = []
    metrics: list[Analysed] = []
    missing: dict[str, str] = {}
    for metric in sorted(values, key=lambda name: name != main):
        y = _over(values[metric], metric, wanted.over)
        try:
            found, about = indices_of(sampled, y, metric, units.get(metric, ""))
        except NothingToSayError as error:
            missing[metric] = str(error)
        else:
            indices += found
            metrics.append(about)
    if main in missing:
        raise ScenarioError(
            f"no indices of {main}: {missing[main]}",
            where=study.at("axes") or study.name,
            todo=f"The cases are in {finished.table}. Draw the bounds closer, so that every design can be run"
            + (", or take --method morris, which leaves single trajectories out." if wanted.method == "sobol" else "."),
        )
    gone = np.isnan(values[main]).any(axis=1)
    return Sensitivity(
        study.name,
        study.text,
        sampled.method,
        sampled.seed,
        CONFIDENCE,
        over,
        conditions,
        len(sampled.shares),
        sampled.blocks,
        int(gone.sum()),
        main,
        parameters(sampled.space, asker),
        tuple(indices),
        tuple(metrics),
        missing,
    )


class NothingToSayError(Exception):
    """There are no indices of one metric; says why."""


def _values(table: Path, sampled: Sampled) -> tuple[dict[str, Array], dict[str, str]]:
    """Every metric by design and condition, NaN where a case did not complete; and the units."""
    import pyarrow.parquet

    read = pyarrow.parquet.read_table(table)
    about = read.schema.metadata
    rows = np.array(read["case"]), np.array(read["status"]) == COMPLETED
    conditions = len(sampled.space.conditions)
    found = {}
    for metric in json.loads(about[b"metrics"]):
        column = np.full(len(sampled.shares) * conditions, np.nan)
        numbers = np.array(read[metric].to_numpy(), dtype=float)
        column[rows[0]] = np.where(rows[1], numbers, np.nan)
        found[metric] = column.reshape(-1, conditions)
    return found, json.loads(about[b"units"])


def _main(pattern: str, metrics: list[str], finished: Finished) -> str:
    """The metric a study is about; there is one, unless nothing was completed."""
    from fnmatch import fnmatchcase

    for metric in metrics:
        if fnmatchcase(metric, pattern):
            return metric
    reasons = "; ".join(reason for _, reason in finished.tally.reasons.values())
    raise ScenarioError(
        f"no case was completed ({reasons[:300]})", where=finished.table, todo="Put the study right, then run it again."
    )


def _over(values: Array, metric: str, over: str) -> Array:
    """One number a design: worst or mean over its conditions; NaN as soon as one is missing."""
    if over == "mean":
        return np.asarray(values.mean(axis=1))
    return np.asarray(values.min(axis=1) if higher_is_better(metric) else values.max(axis=1))


def indices_of(sampled: Sampled, y: Array, metric: str, unit: str) -> tuple[list[Index], Analysed]:
    """Indices of one number a design; NaN where there is none.

    Raises:
        NothingToSayError: the same number everywhere, too few numbers for Morris, or one missing for Sobol.
    """
    by_block = ~np.isnan(y).reshape(sampled.blocks, sampled.block)
    complete = by_block.all(axis=1)
    used, lost = int(complete.sum()), int((~by_block).sum())
    if sampled.method == "sobol" and lost:
        raise NothingToSayError(f"{lost} of {len(y)} designs have no number, and Sobol indices need every one")
    if used < 2:
        raise NothingToSayError(f"{used} of {sampled.blocks} trajectories have all their numbers, and two are needed")
    keep = np.repeat(complete, sampled.block)
    y = y[keep]
    if np.ptp(y) <= 1e-12 * np.abs(y).max():
        raise NothingToSayError("the same in every design")
    rows = list(_morris(sampled, keep, y) if sampled.method == "morris" else _sobol(sampled, y))
    indices = ranked(metric, unit, list(sampled.space.bounds), rows)
    sentence, advised = verdict(indices, sampled.method, used)
    sentence += " " + looked_at(sampled.method, used * sampled.block, LEVELS)
    scale = float(y.mean()), float(y.min()), float(y.max())
    about = Analysed(metric, unit, used, *scale, sentence, advised)
    return indices, about


def _morris(sampled: Sampled, keep: Any, y: Array) -> Iterator[dict[str, float]]:
    from SALib.analyze import morris

    found = morris.analyze(
        sampled.problem,
        sampled.shares[keep],
        y,
        num_resamples=RESAMPLES,
        conf_level=CONFIDENCE,
        num_levels=LEVELS,
        seed=sampled.seed,
    )
    for i in range(len(sampled.space.bounds)):
        yield {name: float(found[name][i]) for name in ("mu_star", "mu_star_conf", "mu", "sigma")}


def _sobol(sampled: Sampled, y: Array) -> Iterator[dict[str, float]]:
    from SALib.analyze import sobol

    with warnings.catch_warnings():
        # A resample of few samples may be constant; its index is 0 then.
        warnings.simplefilter("ignore")
        # SALib takes the seed 0 for none.
        found = sobol.analyze(
            sampled.problem,
            y,
            calc_second_order=False,
            num_resamples=RESAMPLES,
            conf_level=CONFIDENCE,
            seed=sampled.seed + 1,
        )
    for i in range(len(sampled.space.bounds)):
        yield {name: float(found[name][i]) for name in ("S1", "S1_conf", "ST", "ST_conf")}
