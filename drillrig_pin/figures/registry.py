"""All figures by name; a new one is an entry here."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np

from drillrig_pin.analysis.sampling import record_sampling
from drillrig_pin.errors import ResultFileError, legal_names
from drillrig_pin.figures import forces, motion, spectra, trust
from drillrig_pin.figures.sheet import TIME, Sheet
from drillrig_pin.figures.subject import Subject

#: Makes a sheet of a run, or None if the run has nothing to show there.
FIGURES: dict[str, Callable[[Subject], Sheet | None]] = {
    "loads": forces.loads,
    "joints": motion.joints,
    "survey": motion.survey,
    "path": motion.path,
    "measured": motion.measured,
    "hole": motion.hole,
    "survey_spectrum": spectra.survey_spectrum,
    "joint_spectra": spectra.joint_spectra,
    "pressures": forces.pressures,
    "cylinder_forces": forces.cylinder_forces,
    "rainflow": forces.rainflow,
    "reaction": forces.reaction,
    "constraints": trust.constraints,
    "energy": trust.energy,
}


def sheets_of(subject: Subject, names: Iterable[str] | None = None) -> list[Sheet]:
    """Sheets of a run.

    Args:
        names: keys of ``FIGURES``, or ``figure.panel`` for one panel alone; None: every figure the run has.

    Raises:
        ResultFileError: no such figure or panel, or the run has nothing to show in one that was asked for by name.
    """
    found = []
    # The last samples of a run that diverged may be too large to be squared.
    with np.errstate(all="ignore"):
        if names is None:
            made = (make(subject) for make in FIGURES.values())
            return [_said(sheet, subject) for sheet in made if sheet is not None]
        for name in names:
            figure, _, key = name.partition(".")
            if figure not in FIGURES:
                raise ResultFileError(f"no figure {figure!r}", todo=legal_names(figure, FIGURES, "figures"))
            sheet = FIGURES[figure](subject)
            if sheet is None:
                raise ResultFileError(f"the run has nothing to show in figure {figure!r}", todo=_why(figure, subject))
            alone = sheet.alone(key) if key else sheet
            if alone is None:
                keys = [panel.key for panel in sheet.panels]
                raise ResultFileError(f"figure {figure!r} has no panel {key!r}", todo=legal_names(key, keys, "panels"))
            found.append(_said(alone, subject))
    return found


def _said(sheet: Sheet, subject: Subject) -> Sheet:
    """A sheet of curves over time with what its samples cannot show in its caption."""
    words = subject.sampled_words
    over_time = any(panel.x_label == TIME for panel in sheet.panels) or sheet.name == "path"
    return replace(sheet, caption=f"{sheet.caption} {words}") if words and over_time else sheet


def _why(figure: str, subject: Subject) -> str:
    sampling = record_sampling(subject.trajectory, subject.design)
    if FIGURES[figure].__module__ == spectra.__name__ and not sampling.enough:
        return f"A spectrum would show lines at wrong frequencies: {sampling.words}."
    if figure == "measured":
        return "Give --measured FILE.csv, with at least half of the run or of the measurement in common."
    return f"It draws: {(FIGURES[figure].__doc__ or '').splitlines()[0].lower()}"
