"""What a run says, in sentences: is it accurate, is the hole straight, do the cylinders hold; and what to do."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum

from drillrig_pin.analysis.design import Design
from drillrig_pin.analysis.forces import GAS_RELEASE, CylinderRange, ReactionRange
from drillrig_pin.analysis.hole_quality import HoleQuality
from drillrig_pin.analysis.limits import Limit
from drillrig_pin.analysis.metrics import Metrics
from drillrig_pin.errors import Outcome
from drillrig_pin.words import absolute, measure_name, number, percent, quantity

#: A value beyond this part of its limit is worth a look although it keeps it.
NEAR = 0.8
#: A frequency with less than this share of the motion does not say where a vibration comes from.
TELLING = 0.2


#: What to do about a pressure that nothing holds.
BURSTING = "Use no number from that moment on. Look at the geometry and at the units of what was changed."
#: What to do about oil in tension.
TORN = (
    "Use no number from that moment on. A torn column leaves a cavity in which the piston is free, and a blow when it "
    "closes: motion and peak pressures of the real machine may be several times those printed here. More precharge, a "
    "larger bore or less load keeps the oil within its law."
)


class Level(Enum):
    """How a finding is to be taken; the worst one is that of the run."""

    GOOD = "good"
    NOTE = "note"
    NEAR = "near the limit"
    BAD = "over the limit"


@dataclass(frozen=True, slots=True)
class Finding:
    """One sentence of the verdict: what was found, against a limit or not, and what to do about it.

    ``doubtful``: it keeps the numbers from being judged at all. ``voids``: no number of the run may be used.
    """

    level: Level
    title: str
    sentence: str
    advice: str = ""
    limited: bool = False
    doubtful: bool = False
    voids: bool = False


def findings(
    metrics: Metrics, design: Design, quality: HoleQuality | None, limits: Mapping[str, Limit], outcome: Outcome
) -> tuple[Finding, ...]:
    """Everything there is to say about a run, the worst first."""
    found = [*_computation(metrics, outcome), *_statistics(metrics)]
    found += _joints(metrics)
    if quality is not None:
        found += _hole(quality, limits)
    elif metrics.no_hole:
        words = f"The errors of the hole cannot be told: {metrics.no_hole}."
        found.append(Finding(Level.NOTE, "Hole quality", words))
    found += _shake(metrics, limits)
    pressures = [finding for cylinder in metrics.cylinders for finding in _cylinder(cylinder)]
    found += pressures or _calm(metrics)
    for reaction in metrics.reactions:
        found += _contact(reaction)
    found += _source_of_vibration(metrics)
    order = list(Level)
    return tuple(sorted(found, key=lambda finding: (not finding.voids, -order.index(finding.level))))


def headline(found: tuple[Finding, ...]) -> tuple[Level, str]:
    """The whole verdict in one sentence."""
    bad = [finding for finding in found if finding.level is Level.BAD]
    near = [finding for finding in found if finding.level is Level.NEAR]
    void = next((finding for finding in found if finding.voids), None)
    if void is not None:
        return Level.BAD, f"{void.title}: these numbers are no basis for a decision. {void.sentence}"
    if bad:
        what = "one point needs" if len(bad) == 1 else f"{len(bad)} points need"
        return Level.BAD, f"Not good enough as it is: {what} a change."
    doubtful = next((finding for finding in found if finding.doubtful), None)
    if doubtful is not None:
        return Level.NEAR, f"Not to be judged yet: {doubtful.title[:1].lower()}{doubtful.title[1:]}."
    if near:
        what = "one value is" if len(near) == 1 else f"{len(near)} values are"
        return Level.NEAR, f"Within all limits that are set, but {what} near its limit."
    if any(finding.limited for finding in found):
        return Level.GOOD, "Within all limits that are set."
    return Level.NOTE, "No limit applies to this machine; its numbers are yours to judge."


def _computation(metrics: Metrics, outcome: Outcome) -> list[Finding]:
    trust = metrics.trust
    found = []
    if not outcome.completed:
        words = f"{_sentence(outcome.status.message)} (at {outcome.time:.4g} s)"
        sentence = f"{words}: {outcome.cause}." if outcome.cause else f"{words}."
        found.append(Finding(Level.BAD, "The run stopped early", sentence, outcome.status.advice))
    if outcome.valid_until is not None:
        found.append(
            Finding(
                Level.BAD,
                f"Not valid from t = {outcome.valid_until:.4g} s",
                f"{_sentence(outcome.doubt)}.",
                TORN if "tears" in outcome.doubt else BURSTING,
                voids=True,
            )
        )
    if trust.doubts:
        words = " and ".join(trust.doubts)
        advice = "Do not use these numbers. Tighten scenario.integrator.rtol or choose another method, and run again."
        title, sentence = "The computation is not accurate", f"{_sentence(words)}."
        return [*found, Finding(Level.BAD, title, sentence, advice, voids=True)]
    kept = []
    if trust.relative is not None:
        kept.append(f"the energy balance closes to {trust.relative:.1e} of the {trust.against}")
    if trust.estimated is not None:
        kept.append(f"the joint positions are right to about {trust.estimated:.1e} rad or m")
    words = f"{_sentence(' and '.join(kept))}. " if kept else ""
    if trust.error is not None:
        # Stabilisation and projection see to it in any run, a wrong one too.
        words += f"The constraints are kept to {trust.error:.1e} m, which says nothing about the motion along them. "
    if trust.estimated is not None:
        words += "The equations are solved accurately; how well the model describes the machine depends on its numbers."
        return [*found, Finding(Level.GOOD, "The computation is accurate", words)]
    words += "How far the positions are from the exact solution of the equations was not estimated."
    title = "The energy balance closes" if trust.relative is not None else "The accuracy was not looked at"
    advice = "Run it with --estimate, which solves a second time, tighter."
    return [*found, Finding(Level.NOTE, title, words, advice)]


def _statistics(metrics: Metrics) -> list[Finding]:
    """Whether the numbers below are those of a steady motion, of rows that can show it."""
    found = []
    if not metrics.sampling.enough:
        advice = "Run again with more samples a second; spectra are left out, peaks and RMS may be of another motion."
        sentence = f"{_sentence(metrics.sampling.words)}."
        found.append(Finding(Level.BAD, "The samples cannot show the loads", sentence, advice, doubtful=True))
    elif not metrics.stored.enough:
        sentence = f"{_sentence(metrics.stored.words)}. The statistics are not made of these samples; curves are."
        found.append(Finding(Level.NOTE, "Curves mislead", sentence))
    if metrics.steadiness.words:
        sentence = f"The statistics are {metrics.steadiness.words}."
        advice = "Until then peaks, RMS and load cycles hold part of the start; held against limits they say little."
        found.append(Finding(Level.NEAR, "The motion is not steady", sentence, advice, doubtful=True))
    return found


def _joints(metrics: Metrics) -> list[Finding]:
    """Positions that the machine's joints cannot take."""
    advice = "Nothing in the model stops it there: add what does, start from another pose, or correct the <limit>."
    return [
        Finding(Level.BAD, f"Joint {passed.joint}", f"{_sentence(passed.words)}.", advice, limited=True)
        for passed in metrics.passed
    ]


def _hole(quality: HoleQuality, limits: Mapping[str, Limit]) -> list[Finding]:
    found, unlimited = [], []
    advice = (
        "Stiffen what gives way most (see the joint motion and the cylinder forces), drill with less feed force, or "
        "move the machine's frequencies away from those of the load."
    )
    for error in quality.errors:
        limit = limits.get(error.name)
        if limit is None:
            unlimited.append(f"{measure_name(error.name).lower()} {quantity(error.worst, error.unit)}")
            continue
        sentence = (
            f"{measure_name(error.name)}: at worst {quantity(error.worst, error.unit)}, of which "
            f"{quantity(error.static, error.unit)} static; the limit is {quantity(limit.value, error.unit)}"
            f"{' (assumed)' if limit.assumed else ''}."
        )
        found.append(_against(error.worst, limit.value, "Hole quality", sentence, advice))
    if unlimited:
        todo = "Set one to have it judged, e.g. --limit angle=0.5deg."
        found.append(Finding(Level.NOTE, "Hole quality", f"No limit is set for {', '.join(unlimited)} at worst.", todo))
    return found


def _shake(metrics: Metrics, limits: Mapping[str, Limit]) -> list[Finding]:
    limit, motion = limits.get("shake"), metrics.survey
    if limit is None or motion is None or motion.across is None:
        return []
    value = 2 * motion.across.farthest
    sentence = (
        f"Point {motion.point} moves {quantity(value, 'm')} across {metrics.across_what}, peak to peak; "
        f"the limit is {quantity(limit.value, 'm')}{' (assumed)' if limit.assumed else ''}."
    )
    return [
        _against(value, limit.value, "Vibration", sentence, "Stiffen the machine, or change the load's frequencies.")
    ]


def _cylinder(c: CylinderRange) -> list[Finding]:
    found = []
    for x in c.chambers:
        if x.least < GAS_RELEASE:
            sentence = (
                f"Chamber {x.name} falls to {absolute(x.least)}; below {quantity(GAS_RELEASE, 'Pa')} the "
                f"oil releases air ({percent(x.below)} of time) "
            )
            if x.least < c.vapour:
                assumed = ", assumed" if c.vapour_assumed else ""
                sentence += (
                    f"and below {quantity(c.vapour, 'Pa')}{assumed}, it tears instead of pulling: a cavity opens, and "
                    "motion and pressures are not those printed here but may be several times as large."
                )
            else:
                sentence += "and is softer than computed."
            found.append(
                Finding(Level.BAD, c.cylinder, sentence, "Raise its precharge, or load it less.", limited=True)
            )
        if c.relief is not None and x.greatest > NEAR * c.relief:
            opens = f" and is above it for {percent(x.above)} of time" if x.greatest > c.relief else ""
            sentence = (
                f"Chamber {x.name} rises to {absolute(x.greatest)}; its relief valve opens at "
                f"{quantity(c.relief, 'Pa')}{opens}."
            )
            found.append(_against(x.greatest, c.relief, c.cylinder, sentence, "Take a larger bore, or load it less."))
    return found


def _calm(metrics: Metrics) -> list[Finding]:
    if not metrics.cylinders:
        return []
    least = min(min(c.a_min, c.b_min) for c in metrics.cylinders)
    greatest = max(max(c.a_max, c.b_max) for c in metrics.cylinders)
    sentence = (
        f"All chambers stay between {quantity(least, 'Pa')} and {quantity(greatest, 'Pa')} absolute, away from gas "
        "release and relief."
    )
    return [Finding(Level.GOOD, "Cylinders", sentence, limited=True)]


def _contact(r: ReactionRange) -> list[Finding]:
    found = r.lift_off
    if found is None:
        return []
    if found.share == 0:
        sentence = (
            f"The tip stays pressed on after the start-up: {quantity(found.least, 'N')} at least, "
            f"{quantity(-r.mean, 'N')} in the mean."
        )
        if found.whole > 0:
            sentence += f" During the start-up it lifts off, {percent(found.whole)} of the whole run."
            return [Finding(Level.NEAR, r.name, sentence, "Start more softly (ramp of the loads).", limited=True)]
        return [Finding(Level.GOOD, r.name, sentence, limited=True)]
    impacts = f"{found.impacts} impact{'' if found.impacts == 1 else 's'}"
    if found.unilateral:
        sentence = (
            f"The tip is off the face for {percent(found.share)} of time: {impacts}, at most "
            f"{quantity(found.gap, 'm')} away. Meanwhile nothing presses on the rock, and every landing is a blow."
        )
        advice = "Press the tip on harder (feed force, preload), or shake it less."
    else:
        sentence = (
            f"The rock would have to pull at the tip for {percent(found.share)} of time, with "
            f"{quantity(-found.least, 'N')} at most: a real tip lifts off there."
        )
        advice = (
            "Press the tip on harder (feed force, preload), or shake it less. Mode unilateral of the contact computes "
            "the flights and impacts that follow; it does not make the lift-off go away."
        )
    told = [Finding(Level.BAD, r.name, sentence, advice, limited=True)]
    if found.ties:
        several = len(found.ties) > 1
        sentence = (
            f"{_sentence(' and '.join(found.ties))} {'go' if several else 'goes'} on holding the body of the tip while "
            f"it is off the face, {percent(found.share)} of time, where nothing holds a real one."
        )
        advice = "Do not take the motion and reactions of these times for those of a free tip."
        told.append(Finding(Level.BAD, r.name, sentence, advice, limited=True))
    return told


def _source_of_vibration(metrics: Metrics) -> list[Finding]:
    found = metrics.frequencies
    if found is None or metrics.survey is None or not found.lines:
        return []
    line = found.lines[0]
    if line.share < TELLING:
        return []
    cause = f" {found.sources[0].words}" if found.sources else ""
    sentence = (
        f"{percent(line.share)} of the motion of {metrics.survey.point} is at {number(line.frequency, 3)} Hz, mainly "
        f"{line.way}.{cause}"
    )
    return [Finding(Level.NOTE, "Where the vibration comes from", sentence)]


def _against(value: float, limit: float, title: str, sentence: str, advice: str) -> Finding:
    if not value <= limit:
        return Finding(Level.BAD, title, sentence, advice, limited=True)
    if value > NEAR * limit:
        return Finding(Level.NEAR, title, f"{sentence} That is {percent(value / limit)} of it.", advice, limited=True)
    return Finding(Level.GOOD, title, sentence, limited=True)


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:]
