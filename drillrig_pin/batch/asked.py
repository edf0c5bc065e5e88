"""Metrics a study asks for, held against those its runs have."""

from __future__ import annotations

from collections.abc import Collection
from fnmatch import fnmatchcase

from drillrig_pin.batch.measures import sections
from drillrig_pin.batch.study import Study
from drillrig_pin.errors import ScenarioError, legal_names

Way = tuple[str | int, ...]


def unmatched(study: Study, names: Collection[str], *, ended: bool) -> tuple[Way, str] | None:
    """The first name or pattern in a study that fits no metric, with the way to it; None if all fit one.

    It is said after the first run already, since the study has to be run anew once it is put right. Only where other
    runs may have other metrics, it is said at the end.

    Args:
        study: the study.
        names: metrics of the runs completed so far; none: nothing is known yet.
        ended: no more runs follow.
    """
    if not names or (not ended and "scenario.model" in study.names):
        return None
    for way, pattern in study.asked():
        # A run at rest has no strongest frequency; the next one may.
        may_come = not ended and "frequencies" in sections([pattern])
        if not may_come and not any(fnmatchcase(name, pattern) for name in names):
            return way, pattern
    return None


def no_such_metric(study: Study, way: Way, pattern: str, names: Collection[str]) -> ScenarioError:
    """The error that says so, with the names that come near."""
    return ScenarioError(
        f"no run of this study has a metric {pattern!r}",
        where=study.at(*way) or study.name,
        todo=legal_names(pattern, names, "metrics"),
    )
