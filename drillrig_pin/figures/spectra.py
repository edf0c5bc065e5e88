"""Amplitude spectra of the survey point and of every joint, with the bands of boom and hammer and the blows marked."""

from __future__ import annotations

import numpy as np

from drillrig_pin.analysis.motion import joint_motions, survey_point
from drillrig_pin.analysis.sampling import record_sampling
from drillrig_pin.analysis.spectra import BOOM_BAND, HAMMER_BAND, averaged_spectrum
from drillrig_pin.figures.sheet import AXIS_INKS, Band, Curve, Ink, Mark, Panel, Sheet
from drillrig_pin.figures.subject import Subject, angle_unit, length_unit
from drillrig_pin.kinematics import Array
from drillrig_pin.trajectory import AXES
from drillrig_pin.words import number

FREQUENCY = "frequency [Hz]"
#: Twice the hammer's band shows its harmonics too.
HIGHEST = 2.0 * HAMMER_BAND[1]
#: So many modes are named.
OWN = 4
#: Amplitudes below this part of the tallest line are not shown.
DEPTH = 1e-4
BANDS = tuple(
    Band(f"{low:g}–{high:g}", low, high, ink) for (low, high), ink in ((BOOM_BAND, Ink.ORANGE), (HAMMER_BAND, Ink.SKY))
)


def survey_spectrum(subject: Subject) -> Sheet | None:
    """Amplitude spectrum of the survey point along the world axes."""
    run, steady, point = subject.window.record, subject.window.rows, survey_point(subject.trajectory)
    if point is None or not record_sampling(run, subject.design).enough:
        return None
    spectrum = averaged_spectrum(run.time[steady], run.of("point_displacement", point)[steady])
    if spectrum is None:
        return None
    label, factor = length_unit(spectrum.amplitude)
    panels = tuple(
        _panel(
            subject, axis, f"{point}, along {axis}", label, spectrum.frequency, spectrum.amplitude[:, i] * factor, ink
        )
        for i, (axis, ink) in enumerate(zip(AXES, AXIS_INKS, strict=True))
    )
    return Sheet("survey_spectrum", f"Amplitude spectrum of {point}", _caption(subject, spectrum.bin), panels)


def joint_spectra(subject: Subject) -> Sheet | None:
    """Amplitude spectrum of every joint."""
    run, steady = subject.window.record, subject.window.rows
    motions = list(joint_motions(run, subject.design))
    if not motions or not record_sampling(run, subject.design).enough:
        return None
    spectrum = averaged_spectrum(run.time[steady], np.stack([values[steady] for _, _, values in motions], axis=1))
    if spectrum is None:
        return None
    panels = []
    for i, (name, unit, _) in enumerate(motions):
        amplitude = spectrum.amplitude[:, i]
        label, factor = angle_unit(amplitude) if unit == "rad" else length_unit(amplitude)
        panels.append(_panel(subject, name, name, label, spectrum.frequency, amplitude * factor, Ink.BLUE))
    return Sheet("joint_spectra", "Amplitude spectra of the joints", _caption(subject, spectrum.bin), tuple(panels))


def _panel(subject: Subject, key: str, title: str, unit: str, frequency: Array, amplitude: Array, ink: Ink) -> Panel:
    highest = min(HIGHEST, float(frequency[-1]))
    shown = frequency <= highest
    tallest = float(amplitude[shown].max(initial=0.0))
    return Panel(
        key,
        title,
        FREQUENCY,
        f"amplitude [{unit}]",
        (Curve(key, frequency[shown], amplitude[shown], ink),),
        bands=tuple(band for band in BANDS if band.low < highest),
        marks=_harmonics(subject.design.percussion, highest),
        log=tallest > 0,
        floor=tallest * DEPTH if tallest > 0 else None,
        x_range=(0.0, highest),
    )


def _harmonics(percussion: float, highest: float) -> tuple[Mark, ...]:
    if percussion <= 0:
        return ()
    return tuple(Mark(f"{k * percussion:g} Hz", k * percussion) for k in range(1, int(highest / percussion) + 1))


def _caption(subject: Subject, width: float) -> str:
    blows = subject.design.percussion
    bands = "Shaded: below 15 Hz and 15–80 Hz"
    if blows > 0:
        bands += f". Dotted: the blows at {blows:g} Hz and their harmonics"
    own = [f"{number(mode.frequency, 3)}" for mode in subject.trajectory.modes if mode.frequency > 0][:OWN]
    if own:
        bands += f". The machine's own modes that take longest to ring down: {', '.join(own)} Hz"
    return (
        f"Amplitude spectrum after the start-up (Welch, flat-top window, bins of {width:.2g} Hz): a lasting sine shows "
        f"its amplitude. {bands}."
    )
