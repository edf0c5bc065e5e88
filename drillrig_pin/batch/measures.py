"""What a study asks of every run: only the sections that hold an asked metric are computed."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from fnmatch import fnmatchcase

from drillrig_pin.analysis.design import Design, design_of
from drillrig_pin.analysis.fatigue import cylinder_rainflow
from drillrig_pin.analysis.forces import cylinder_ranges, reaction_ranges
from drillrig_pin.analysis.hole_quality import hole_axis, hole_quality
from drillrig_pin.analysis.metrics import Metrics, point_frequencies
from drillrig_pin.analysis.motion import joint_ranges, point_motion, survey_point
from drillrig_pin.analysis.quantities import Quantity, quantities
from drillrig_pin.analysis.sampling import record_sampling, stored_sampling
from drillrig_pin.analysis.shares import Share, motion_shares
from drillrig_pin.analysis.trust import trust
from drillrig_pin.analysis.window import Window, window_of
from drillrig_pin.model.modelfile import read_model_text
from drillrig_pin.rig import Rig, build_rig
from drillrig_pin.trajectory import Trajectory

#: The last word of a metric's name tells the section of the analysis it comes from.
SECTIONS = {
    "worst": "hole",
    "static": "hole",
    "peak_to_peak": "motion",
    "rms": "motion",
    "share": "shares",
    "p_max": "cylinders",
    "p_min": "cylinders",
    "force_range": "cylinders",
    "tension": "reactions",
    "impacts": "reactions",
    "least": "reactions",
    "greatest": "reactions",
    "equivalent": "cycles",
    "range": "joints",
    "strongest": "frequencies",
    "slow": "frequencies",
    "fast": "frequencies",
    "steady": "trust",
    "needed": "trust",
    "sampled": "trust",
    "valid_until": "trust",
    "error": "trust",
    "energy": "trust",
    "steps": "trust",
}
#: What every row of a table says besides: whether its numbers are what they are called.
WINDOW = ("window.steady", "window.needed", "window.sampled")
#: Differs from run to run of the same case; the table has a column of its own for it.
LEFT_OUT = frozenset({"cost.wall_time"})


def sections(patterns: Iterable[str]) -> frozenset[str]:
    """Sections that hold a metric one of the patterns may mean."""
    last = [pattern.rpartition(".")[2] for pattern in patterns]
    return frozenset(section for word, section in SECTIONS.items() if any(fnmatchcase(word, item) for item in last))


def require_known(patterns: Iterable[str]) -> None:
    """ValueError for a name or pattern that no metric can have."""
    for pattern in patterns:
        if not sections([pattern]):
            raise ValueError(f"no metric ends like {pattern!r}; metrics end in {', '.join(SECTIONS)}")


def measured(trajectory: Trajectory, patterns: Sequence[str], rig: Rig | None = None) -> dict[str, Quantity]:
    """Metrics of a run that the patterns ask for, in the order of the patterns.

    Args:
        trajectory: the run, of at least two samples.
        patterns: names such as ``S.z.rms``, or patterns such as ``*.p_max``.
        rig: the rig it was made with, to save building it again.
    """
    needed = sections(patterns)
    rig = rig or build_rig(read_model_text(trajectory.model))
    design = design_of(trajectory, rig.file)
    window = window_of(trajectory, design)
    record, rows = window.record, window.rows
    found = quantities(
        _metrics(trajectory, design, window, needed),
        hole_quality(record, design, rows) if "hole" in needed else None,
        cylinder_rainflow(record, rows) if "cycles" in needed else (),
        _shares(record, rig, design, rows) if "shares" in needed else (),
    )
    return {
        key: found[key] for pattern in patterns for key in found if fnmatchcase(key, pattern) and key not in LEFT_OUT
    }


def _shares(trajectory: Trajectory, rig: Rig, design: Design, steady: slice) -> tuple[Share, ...]:
    point = survey_point(trajectory)
    return motion_shares(trajectory, rig, point, steady, hole_axis(trajectory, design)) if point else ()


def _metrics(trajectory: Trajectory, design: Design, window: Window, needed: frozenset[str]) -> Metrics:
    record, steady = window.record, window.rows
    point = survey_point(record)
    across = hole_axis(record, design) if "motion" in needed else None
    return Metrics(
        start_up=window.start_up,
        survey=point_motion(record, point, steady, across) if point and "motion" in needed else None,
        joints=joint_ranges(record, design, steady) if "joints" in needed else (),
        frequencies=point_frequencies(window, design, point) if point and "frequencies" in needed else None,
        hole=None,
        cylinders=cylinder_ranges(record, design, steady) if "cylinders" in needed else (),
        reactions=reaction_ranges(record, design, steady) if "reactions" in needed else (),
        trust=trust(trajectory),
        warnings=(),
        steadiness=window.steadiness,
        sampling=record_sampling(trajectory, design),
        stored=stored_sampling(trajectory, design),
        valid_until=trajectory.outcome.valid_until,
    )
