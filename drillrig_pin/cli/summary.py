"""The table at the end of a run."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from drillrig_pin.cli.output import decimals, number, percent, table
from drillrig_pin.words import measure_name, quantity

if TYPE_CHECKING:
    from collections.abc import Iterable

    from rich.console import Console, RenderableType

    from drillrig_pin.analysis.forces import Chamber, CylinderRange
    from drillrig_pin.analysis.metrics import Metrics
    from drillrig_pin.analysis.motion import JointRange
    from drillrig_pin.analysis.trust import Trust

#: Between two tables beside each other.
GUTTER = 4


def print_summary(out: Console, metrics: Metrics) -> None:
    """Print every section that has content; first of all whether the numbers may be used."""
    for reason in metrics.invalid:
        words = (
            f"NOT VALID{reason.removeprefix('not valid')}" if reason.startswith("not valid") else f"NOT VALID: {reason}"
        )
        out.print(words, markup=False, style="bold red", soft_wrap=True)
    left, right = _survey(metrics), _frequencies(metrics)
    _side_by_side(out, left, right)
    _side_by_side(out, _joints(metrics))
    for reactions in _reactions(metrics):
        _side_by_side(out, reactions)
    _side_by_side(out, _hole(metrics))
    if metrics.no_hole:
        out.print(f"No hole quality: {metrics.no_hole}.", "", markup=False, soft_wrap=True)
    if metrics.cylinders:
        out.print(_cylinders(metrics.cylinders, metrics.start_up))
        if any(chamber.least < 0 for c in metrics.cylinders for chamber in c.chambers):
            out.print("* below zero: no pressure, oil cannot pull", markup=False, style="red")
        out.print()
    for line in trust_lines(metrics.trust):
        out.print(line, markup=False, style="bold")
    for warning in metrics.warnings:
        if warning not in metrics.invalid:
            out.print(f"warning: {warning}", markup=False, style="yellow")


def _side_by_side(out: Console, *sections: RenderableType | None) -> None:
    """Beside each other where that cuts nothing off, else one below the other."""
    from rich.measure import Measurement
    from rich.table import Table

    shown = [section for section in sections if section is not None]
    widths = [Measurement.get(out, out.options, section).maximum + GUTTER for section in shown]
    rows = [shown] if sum(widths) - GUTTER <= out.width else [[section] for section in shown]
    for row in filter(None, rows):
        grid = Table.grid(padding=(0, GUTTER, 0, 0))
        grid.add_row(*row)
        out.print(grid, "")


def _length(values: Iterable[float]) -> tuple[str, float]:
    """Unit and factor that suit a column of lengths given in metres."""
    largest = max((abs(value) for value in values if math.isfinite(value)), default=0.0)
    for unit, factor in (("m", 1.0), ("mm", 1e3), ("µm", 1e6)):
        if largest * factor >= 1.0:
            return unit, factor
    return "µm", 1e6


def _survey(metrics: Metrics) -> RenderableType | None:
    motion = metrics.survey
    if motion is None:
        return None
    unit, factor = _length([axis.peak_to_peak for axis in motion.axes])
    rows = [
        (axis.axis, number(axis.peak_to_peak * factor), number(axis.rms * factor), number(axis.mean * factor))
        for axis in motion.axes
    ]
    if motion.across is not None:
        rows.append(
            (
                f"across {'hole' if metrics.hole else 'contact'} (⌀)",
                number(2 * motion.across.farthest * factor),
                number(motion.across.rms * factor),
                "",
            )
        )
    return table(
        f"Point {motion.point}{_window(metrics)}", ("axis", f"pk-pk {unit}", f"RMS {unit}", f"mean {unit}"), rows
    )


def _window(metrics: Metrics) -> str:
    """What a heading says of the time its numbers are taken over."""
    if not metrics.sampling.enough:
        return ", too few samples to show the loads"
    after = f", after {metrics.start_up:.3g} s" if metrics.start_up > 0 else ""
    return f"{after}, not steady yet" if metrics.steadiness.words else after


def _frequencies(metrics: Metrics) -> RenderableType | None:
    found = metrics.frequencies
    if found is None or metrics.survey is None or not found.lines:
        return None
    unit, factor = _length([line.amplitude for line in found.lines])
    rows = [
        (decimals(line.frequency, 2), number(line.amplitude * factor), line.axis, percent(line.share), source.short)
        for line, source in zip(found.lines, found.sources, strict=True)
    ]
    rows.append(("below 15", "", "", percent(found.boom_share), ""))
    rows.append(("15–80", "", "", percent(found.hammer_share), ""))
    title = f"Its frequencies, ±{number(found.bin / 2, 2)} Hz"
    return table(title, ("Hz", f"amplitude {unit}", "mainly", "share", "from"), rows)


def _joints(metrics: Metrics) -> RenderableType | None:
    if not metrics.joints:
        return None
    rows = []
    for joint in metrics.joints:
        unit, factor = _joint_unit(joint)
        rows.append((joint.joint, number(joint.whole * factor), number(joint.steady * factor), unit))
    return table("Range of the joints", ("joint", "whole run", "after start-up", ""), rows)


def _joint_unit(joint: JointRange) -> tuple[str, float]:
    return ("°", 180.0 / math.pi) if joint.unit == "rad" else ("mm", 1e3)


def _reactions(metrics: Metrics) -> list[RenderableType]:
    """A table for every kind of reaction, under the name of what it is."""
    from drillrig_pin.analysis.forces import reaction_groups

    largest = max((max(abs(r.least), abs(r.greatest)) for r in metrics.reactions), default=0.0)
    unit, factor = ("k", 1e-3) if largest >= 1e4 else ("", 1.0)
    tables = []
    for title, reactions in reaction_groups(metrics.reactions).items():
        lifting = any(r.lift_off is not None for r in reactions)
        heads = ("", "min", "mean", "max", "", *(("off the face", "impacts") if lifting else ()))
        rows = []
        for r in reactions:
            numbers = [number(value * factor) for value in (r.least, r.mean, r.greatest)]
            lifted = (percent(r.lift_off.share), str(r.lift_off.impacts)) if r.lift_off else ("", "")
            rows.append((r.name, *numbers, f"{unit}{r.unit}", *(lifted if lifting else ())))
        tables.append(table(title, heads, rows))
    return tables


def _hole(metrics: Metrics) -> RenderableType | None:
    if metrics.hole is None:
        return None
    rows = [
        (measure_name(e.name), *(quantity(value, e.unit) for value in (e.static, e.vibration, e.worst)))
        for e in metrics.hole.errors
    ]
    return table(
        "Hole quality, feed line against its direction at the start", ("", "static", "vibration", "worst"), rows
    )


def _cylinders(cylinders: tuple[CylinderRange, ...], start_up: float) -> RenderableType:
    def span(low: float, high: float, factor: float) -> str:
        return f"{decimals(low * factor, 1)} … {decimals(high * factor, 1)}"

    def pressures(chamber: Chamber) -> str:
        return span(chamber.least, chamber.greatest, 1e-5) + ("*" if chamber.least < 0 else "")

    rows = [
        (
            c.cylinder,
            *map(pressures, c.chambers),
            decimals(c.relief * 1e-5 if c.relief is not None else None, 0),
            span(c.force_min, c.force_max, 1e-3),
        )
        for c in cylinders
    ]
    heads = ("cylinder", "chamber A", "chamber B", "relief", f"force kN{', after start-up' if start_up > 0 else ''}")
    return table("Pressures of the whole run, bar absolute (1 bar: gas release)", heads, rows)


def trust_lines(trust: Trust) -> list[str]:
    """May this run be believed, and what did it cost: two lines of numbers."""
    words = []
    if trust.error is not None and trust.rate is not None:
        words.append(f"max |f| {trust.error:.1e} m, max |df/dt| {trust.rate:.1e} m/s")
    if trust.relative is not None:
        words.append(f"energy residual {trust.relative:.1e} of {number(trust.reference, 3)} J {trust.against}")
    else:
        words.append(f"energy residual {trust.residual:.1e} J, nothing moved")
    if trust.estimated is not None:
        words.append(f"joint positions to about {trust.estimated:.1e} rad or m")
    cost = [trust.engine, f"{trust.steps} steps", f"{trust.evaluations} evaluations", f"{trust.wall_time:.1f} s"]
    if trust.real_time_factor is not None:
        cost.append(f"{number(trust.real_time_factor, 2)} x real time")
    return ["Trust: " + "; ".join(words), "Cost:  " + ", ".join(cost)]
