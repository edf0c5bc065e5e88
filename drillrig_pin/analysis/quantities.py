"""The numbers of a run by name, each with unit and which way is better, so that runs can be compared one by one."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

from drillrig_pin.analysis.fatigue import Rainflow
from drillrig_pin.analysis.hole_quality import HoleQuality
from drillrig_pin.analysis.metrics import Metrics
from drillrig_pin.analysis.shares import Share
from drillrig_pin.trajectory import AXES
from drillrig_pin.words import measure_name

Better = Literal["lower", "higher", ""]

#: Groups in the order of their importance to a designer.
GROUPS = ("hole", "motion", "pressures", "contact", "load cycles", "forces", "joints", "frequencies", "trust", "cost")


@dataclass(frozen=True, slots=True)
class Meaning:
    """What the last word of a key says: in words, its group, which way is better, changes below which mean nothing."""

    words: str
    group: str
    better: Better = "lower"
    noise: float = 0.0


#: By the last word of a key.
MEANINGS = {
    "worst": Meaning("at worst", "hole"),
    "static": Meaning("static", "hole"),
    "peak_to_peak": Meaning("peak to peak", "motion"),
    "rms": Meaning("RMS", "motion"),
    "share": Meaning("share of the vibration", "motion", ""),
    "p_max": Meaning("highest pressure", "pressures", noise=1e3),
    "p_min": Meaning("lowest pressure", "pressures", "higher", 1e3),
    "force_range": Meaning("range of force", "forces", noise=1.0),
    "tension": Meaning("share of time lifted off", "contact", noise=1e-4),
    "impacts": Meaning("impacts on the face", "contact"),
    "least": Meaning("least contact force", "contact", "higher", 1.0),
    "greatest": Meaning("greatest force", "forces", noise=1e-3),
    "equivalent": Meaning("damage-equivalent range at 1 Hz", "load cycles", noise=1.0),
    "range": Meaning("range", "joints"),
    "strongest": Meaning("strongest frequency", "frequencies", ""),
    "slow": Meaning("share below 15 Hz", "frequencies", "", 1e-3),
    "fast": Meaning("share of 15–80 Hz", "frequencies", "", 1e-3),
    "steady": Meaning("steady (1: yes, 0: not yet)", "trust", ""),
    "needed": Meaning("length of a run that becomes steady", "trust", "", 0.1),
    "sampled": Meaning("rows in a period of the fastest load", "trust", "", 0.01),
    "valid_until": Meaning("not valid from", "trust", ""),
    "error": Meaning("constraint error", "trust", noise=1e-12),
    "energy": Meaning("energy residual, relative", "trust", noise=1e-8),
    "estimated": Meaning("estimated error of joint positions", "trust", noise=1e-8),
    "steps": Meaning("steps", "cost", ""),
    "wall_time": Meaning("wall time", "cost", ""),
}
#: What a point may move along, behind its name.
ALONG = {**{axis: f"along {axis}" for axis in AXES}, "across": "across the hole"}


def meaning_of(key: str) -> Meaning | None:
    """What a key means, by its last word; None for a word that no quantity ends in."""
    return MEANINGS.get(key.rpartition(".")[2])


def label_of(key: str, unit: str = "") -> str:
    """A key in words: ``S.across.rms`` is "S across the hole, RMS"; a key that means nothing stays as it is."""
    subject, _, last = key.rpartition(".")
    meaning = MEANINGS.get(last)
    if meaning is None or not subject:
        return key
    if meaning.group in ("frequencies", "trust", "cost"):
        return meaning.words
    if meaning.group == "hole":
        return f"{measure_name(subject.removeprefix('hole.'))}, {meaning.words}"
    if last in ("rms", "peak_to_peak"):
        point, _, along = subject.rpartition(".")
        return f"{point} {ALONG[along]}, {meaning.words}" if along in ALONG else f"{subject}, {meaning.words}"
    return f"{subject}, {'greatest moment' if last == 'greatest' and unit == 'N m' else meaning.words}"


@dataclass(frozen=True, slots=True)
class Quantity:
    """One number of a run.

    Attributes:
        key: the same in every run that has it.
        value, unit: SI.
    """

    key: str
    value: float
    unit: str

    @property
    def label(self) -> str:
        """In words."""
        return label_of(self.key, self.unit)

    @property
    def group(self) -> str:
        """One of ``GROUPS``."""
        return self._meaning.group

    @property
    def better(self) -> Better:
        """Which way is better; empty where neither is."""
        return self._meaning.better

    @property
    def noise(self) -> float:
        """Changes below this mean nothing [unit]."""
        return self._meaning.noise

    @property
    def _meaning(self) -> Meaning:
        return MEANINGS[self.key.rpartition(".")[2]]


def quantities(
    metrics: Metrics, quality: HoleQuality | None, counts: Sequence[Rainflow], shares: Sequence[Share] = ()
) -> dict[str, Quantity]:
    """All numbers of a run by key."""
    found = [*_hole(quality), *_motion(metrics), *_shares(shares), *_cylinders(metrics), *_reactions(metrics)]
    found += [*_cycles(counts), *_joints(metrics), *_frequencies(metrics), *_trust(metrics)]
    return {quantity.key: quantity for quantity in found}


def _hole(quality: HoleQuality | None) -> Iterator[Quantity]:
    for error in quality.errors if quality else ():
        yield Quantity(f"hole.{error.name}.worst", error.worst, error.unit)
        yield Quantity(f"hole.{error.name}.static", error.static, error.unit)


def _motion(metrics: Metrics) -> Iterator[Quantity]:
    motion = metrics.survey
    if motion is None:
        return
    for axis in motion.axes:
        yield Quantity(f"{motion.point}.{axis.axis}.peak_to_peak", axis.peak_to_peak, "m")
        yield Quantity(f"{motion.point}.{axis.axis}.rms", axis.rms, "m")
    if motion.across is not None:
        yield Quantity(f"{motion.point}.across.rms", motion.across.rms, "m")


def _shares(shares: Sequence[Share]) -> Iterator[Quantity]:
    for share in shares:
        yield Quantity(f"{share.element}.share", share.share, "1")


def _cylinders(metrics: Metrics) -> Iterator[Quantity]:
    for c in metrics.cylinders:
        yield Quantity(f"{c.cylinder}.p_max", max(c.a_max, c.b_max), "Pa")
        yield Quantity(f"{c.cylinder}.p_min", min(c.a_min, c.b_min), "Pa")
        yield Quantity(f"{c.cylinder}.force_range", c.force_max - c.force_min, "N")


def _reactions(metrics: Metrics) -> Iterator[Quantity]:
    for r in metrics.reactions:
        if r.tension is not None:
            yield Quantity(f"{r.name}.tension", r.tension, "1")
        if r.lift_off is not None:
            yield Quantity(f"{r.name}.impacts", float(r.lift_off.impacts), "")
            yield Quantity(f"{r.name}.least", r.lift_off.least, "N")
        yield Quantity(f"{r.name}.greatest", max(abs(r.least), abs(r.greatest)), r.unit)


def _cycles(counts: Sequence[Rainflow]) -> Iterator[Quantity]:
    for count in counts:
        yield Quantity(f"{count.cylinder}.equivalent", count.equivalent, "N")


def _joints(metrics: Metrics) -> Iterator[Quantity]:
    for joint in metrics.joints:
        yield Quantity(f"{joint.joint}.range", joint.steady, joint.unit)


def _frequencies(metrics: Metrics) -> Iterator[Quantity]:
    found = metrics.frequencies
    if found is None or not found.lines:
        return
    yield Quantity("frequency.strongest", found.lines[0].frequency, "Hz")
    yield Quantity("frequency.slow", found.boom_share, "1")
    yield Quantity("frequency.fast", found.hammer_share, "1")


def _trust(metrics: Metrics) -> Iterator[Quantity]:
    trust = metrics.trust
    settled, sampling = metrics.steadiness, metrics.sampling
    if settled.steady is not None:
        yield Quantity("window.steady", float(settled.steady), "")
    if settled.needed is not None:
        yield Quantity("window.needed", settled.needed, "s")
    if sampling.highest > 0:
        yield Quantity("window.sampled", sampling.rate / sampling.highest, "")
    if trust.error is not None:
        yield Quantity("trust.error", trust.error, "")
    if trust.relative is not None:
        yield Quantity("trust.energy", trust.relative, "")
    if trust.estimated is not None:
        yield Quantity("trust.estimated", trust.estimated, "")
    yield Quantity("cost.steps", float(trust.steps), "")
    yield Quantity("cost.wall_time", trust.wall_time, "s")
