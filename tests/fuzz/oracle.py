"""What a legal model and scenario must come to: numbers finite, balanced and alike in both engines, or words."""

from __future__ import annotations

import dataclasses
import io
import math
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from drillrig_pin import DrillrigError, Rig, Scenario, Trajectory, load_rig, load_scenario, load_trajectory, simulate
from drillrig_pin.accuracy import estimate_error
from drillrig_pin.analysis.metrics import Metrics, measure
from drillrig_pin.analysis.trust import Trust, trust
from drillrig_pin.check import check_model
from drillrig_pin.cli.summary import print_summary
from drillrig_pin.trajectory import VARIABLES
from fuzz.moment import moment, no_warning

#: Runs of both engines are looked at more closely where they differ by more than these parts of the joints' motion and
#: of their positions; that they are different is said only where each of them calls itself right.
ALIKE, ROUNDED = 1e-3, 1e-6
#: A run in which nothing moved may miss this part of its energies, by rounding.
AT_REST = 1e-6


class NotFiniteError(Exception):
    """A run that reached its end holds what is no number."""


class UnbalancedError(Exception):
    """A run that reached its end misses energy, and does not say so."""


class DisagreementError(Exception):
    """The engines come to different motions, and each says that its own is right."""


class ContradictionError(Exception):
    """What refuses a file and what checks it disagree."""


def use_case(folder: Path) -> None:
    """Load model and scenario, run them, and hold the run to what it says of itself.

    What costs much is done with some inputs only; with which follows from their text, so that each stays as it is.
    """
    with no_warning():
        lot = zlib.crc32((folder / "rig.urdf").read_bytes() + (folder / "case.yaml").read_bytes())
        rig = loaded(folder / "rig.urdf", check=lot % 16 == 0)
        run = run_case(rig, load_scenario(folder / "case.yaml"))
        if run is None:
            return
        look_at(run, lot, folder)
        if lot % 6 == 0 and run.outcome.completed and not trust(run).doubts:
            compare_engines(rig, run)


def loaded(path: Path, *, check: bool) -> Rig:
    """The model; with ``check`` also what `drillrig check` says, which must not contradict."""
    findings = check_model(path) if check else None
    try:
        return load_rig(path)
    except DrillrigError as error:
        if findings is not None and not any(finding.severity == "error" for finding in findings):
            raise ContradictionError(f"check finds no error, load_rig says: {error}") from error
        raise


def run_case(rig: Rig, case: Scenario) -> Trajectory | None:
    """The run, or None where it was ended before there was one."""
    with moment():
        return simulate(rig, case)
    return None


def look_at(run: Trajectory, lot: int, folder: Path) -> None:
    """Its numbers are finite; its energy is balanced or the run says that it is not; its summary can be printed."""
    if run.outcome.completed:
        require_finite(run)
    if len(run.time) < 2:
        return
    believed = trust(run)
    if run.outcome.completed and not believed.doubts:
        require_balance(run, believed)
    if lot % 20 == 1:
        metrics = measure(run)
        if run.outcome.completed and not believed.doubts:
            require_finite_metrics(metrics)
        print_summary(Console(file=io.StringIO()), metrics)
    if lot % 200 == 2:
        run.save(folder / "run.nc")
        if load_trajectory(folder / "run.nc").content_hash != run.content_hash:
            raise ContradictionError("the run in the file is not the one that was written")


def require_finite(run: Trajectory) -> None:
    """Every array of a run that reached its end, at its samples and in its record."""
    for rows in (run, run.record):
        for name in ("time", *VARIABLES):
            array = np.asarray(getattr(rows, name))
            if not np.isfinite(array).all():
                raise NotFiniteError(f"{name} of a completed run is {array[~np.isfinite(array)].flat[0]}")
    if run.outcome.time != run.scenario.duration:
        raise NotFiniteError(f"a completed run ends at {run.outcome.time!r} s, not {run.scenario.duration!r} s")


def require_balance(run: Trajectory, believed: Trust) -> None:
    """A run without a doubt has an energy residual that is a number, and small where nothing moved."""
    if not math.isfinite(believed.residual):
        raise UnbalancedError(f"the energy residual is {believed.residual} and no doubt is said")
    record = run.record
    size = max(
        float(np.abs(energy).max())
        for energy in (record.energy_kinetic, record.energy_potential, record.energy_elastic)
    )
    if believed.relative is None and believed.residual > max(AT_REST * size, 1e-6):
        raise UnbalancedError(f"nothing moved, and {believed.residual:g} J of {size:g} J are missing")


def require_finite_metrics(metrics: Metrics) -> None:
    """The summary of a run that is believed holds no infinity, and no NaN."""
    for place, value in _floats(metrics, "metrics"):
        if not math.isfinite(value) and place.rpartition(".")[2] not in OPEN:
            raise NotFiniteError(f"{place} is {value}")


#: Numbers that may be infinite: limits of joints without one.
OPEN = ("lower", "upper", "low", "high")


def _floats(value: Any, place: str) -> Any:
    if dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            yield from _floats(getattr(value, field.name), f"{place}.{field.name}")
    elif isinstance(value, tuple | list):
        for item in value:
            yield from _floats(item, place)
    elif isinstance(value, float):
        yield place, value


def compare_engines(rig: Rig, run: Trajectory, finer: Callable[[Rig, Trajectory], Trajectory] = estimate_error) -> None:
    """The same case in the other engine, by the same method where it has it; ``finer`` says how wrong each may be."""
    engine = "python" if run.engine == "core" else "core"
    method = run.method if run.method in ("RK4", "DOP853") else "auto"
    case = run.scenario.changed({"engine": engine, "integrator.method": method})
    other = run_case(rig, case)
    if other is None or not other.outcome.completed or trust(other).doubts or not _differ(run, other):
        return
    with moment(2.0) as time:
        run, other = finer(rig, run), finer(rig, other)
    believed = [trust(each) for each in (run, other)]
    if time.over or any(each.doubts or each.estimated is None for each in believed):
        return
    missed = sum(each.estimated or 0.0 for each in believed)
    difference = float(np.abs(run.q - other.q).max())
    if difference > 3 * missed and _differ(run, other):
        raise DisagreementError(
            f"{run.engine} {run.method} and {other.engine} {other.method} differ by {difference:.3g}, "
            f"joints move by {believed[0].moved:.3g}, errors estimated {missed:.3g} together"
        )


def _differ(run: Trajectory, other: Trajectory) -> bool:
    if not np.array_equal(run.time, other.time):
        return False
    require_finite(other)
    moved = float(np.ptp(run.q, axis=0).max(initial=0.0))
    allowed = ALIKE * moved + ROUNDED * float(np.abs(run.q).max(initial=0.0)) + 1e-9
    return float(np.abs(run.q - other.q).max(initial=0.0)) > allowed
