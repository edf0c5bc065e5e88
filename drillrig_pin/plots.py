"""Figures of a run. One function per figure; :data:`FIGURES` names them all, and a new figure is an entry there.

A function draws on an empty figure and returns False if the run has nothing to show there.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from drillrig_pin.analysis.design import Design, design_of
from drillrig_pin.analysis.forces import is_rotation
from drillrig_pin.analysis.motion import after, joint_motions, start_up, survey_point
from drillrig_pin.analysis.spectra import BOOM_BAND, HAMMER_BAND, amplitude_spectrum, strongest_lines
from drillrig_pin.elements.cylinder import ATMOSPHERE
from drillrig_pin.errors import ResultFileError
from drillrig_pin.files import write_aside
from drillrig_pin.kinematics import Array
from drillrig_pin.trajectory import AXES, Trajectory

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Draw = Callable[["Figure", Trajectory, Design], bool]

WIDTH = 9.0
DOTS_PER_INCH = 130
STYLE: dict[Any, Any] = {
    "font.size": 9.0,
    "axes.grid": True,
    "grid.alpha": 0.3,
    "axes.titlesize": 9.0,
    "axes.titlelocation": "left",
    "lines.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
    "agg.path.chunksize": 20_000,
}
COLOURS = {"x": "tab:red", "y": "tab:green", "z": "tab:blue"}


def save_figures(trajectory: Trajectory, folder: Path, names: Iterable[str] | None = None) -> list[Path]:
    """Draw figures of a run of at least two samples as PNG files named after them.

    Args:
        trajectory: the run.
        folder: an existing folder.
        names: keys of :data:`FIGURES`; None: all.

    Raises:
        ResultFileError: a file cannot be written.
    """
    import matplotlib as mpl
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    design = design_of(trajectory)
    written = []
    for name in FIGURES if names is None else names:
        # Figures are made without pyplot, which keeps state of its own and may open windows.
        with mpl.rc_context(STYLE), np.errstate(all="ignore"):
            figure = Figure(figsize=(WIDTH, 5.0), dpi=DOTS_PER_INCH, layout="constrained")
            FigureCanvasAgg(figure)
            if not FIGURES[name](figure, trajectory, design):
                continue
            path = folder / f"{name}.png"
            try:
                with write_aside(path) as aside:
                    figure.savefig(aside, format="png")
            except OSError as error:
                raise ResultFileError(f"cannot be written ({error.strerror})", where=path) from None
        written.append(path)
    return written


def draw_joints(figure: Figure, trajectory: Trajectory, design: Design) -> bool:
    """Deviation of every joint from its initial position, in degrees or millimetres."""
    motions = list(joint_motions(trajectory, design))
    if not motions:
        return False
    panels = _stack(figure, len(motions), "Joints: deviation from the initial position")
    for panel, (name, unit, values) in zip(panels, motions, strict=True):
        label, factor = ("°", 180 / math.pi) if unit == "rad" else ("mm", 1e3)
        panel.plot(trajectory.time, values * factor)
        panel.set_title(f"{name} [{label}]")
    _time_axis(panels, trajectory)
    return True


def draw_survey_point(figure: Figure, trajectory: Trajectory, design: Design) -> bool:
    """Displacement of the survey point along the world axes, and its path in the Y-Z plane, across the hole.

    Without a contact to say where the hole is, the path is shown in the plane of the two largest motions.
    """
    point = survey_point(trajectory)
    if point is None:
        return False
    u = trajectory.of("point_displacement", point)
    label, factor = _length_unit(u)
    figure.set_size_inches(WIDTH, 4.6)
    figure.suptitle(f"Displacement of {point} from its initial position", x=0.01, ha="left")
    grid = figure.add_gridspec(3, 2, width_ratios=(1.2, 1.0))
    first_panel = figure.add_subplot(grid[0, 0])
    panels = [first_panel, *(figure.add_subplot(grid[i, 0], sharex=first_panel) for i in (1, 2))]
    for panel in panels[:-1]:
        panel.tick_params(labelbottom=False)
    for i, (panel, axis) in enumerate(zip(panels, AXES, strict=True)):
        panel.plot(trajectory.time, u[:, i] * factor, color=COLOURS[axis])
        panel.set_ylabel(f"{axis} [{label}]")
    _time_axis(panels, trajectory)
    path = figure.add_subplot(grid[:, 1])
    begin = after(trajectory, start_up(trajectory, design))
    first = begin.start or 0
    i, j = (1, 2) if design.contacts else sorted(np.argsort(np.ptp(u, axis=0))[-2:])
    if first:
        path.plot(u[: first + 1, i] * factor, u[: first + 1, j] * factor, color="0.75", label="start-up")
    path.plot(u[first:, i] * factor, u[first:, j] * factor, color="tab:blue", alpha=0.7, label="path")
    path.plot(0, 0, "k+", label="start")
    path.set_aspect("equal", adjustable="datalim")
    path.set_xlabel(f"{AXES[i]} [{label}]")
    path.set_ylabel(f"{AXES[j]} [{label}]")
    path.set_title(f"path in the {AXES[i].upper()}–{AXES[j].upper()} plane")
    path.legend(loc="upper right")
    return True


def draw_spectra(figure: Figure, trajectory: Trajectory, design: Design) -> bool:
    """Amplitude spectra of the survey point after the start-up, with its strongest lines named."""
    point = survey_point(trajectory)
    if point is None:
        return False
    steady = after(trajectory, start_up(trajectory, design))
    spectrum = amplitude_spectrum(trajectory.time[steady], trajectory.of("point_displacement", point)[steady])
    if spectrum is None:
        return False
    label, factor = _length_unit(spectrum.amplitude)
    highest = min(2.0 * HAMMER_BAND[1], float(spectrum.frequency[-1]))
    shown = spectrum.frequency <= highest
    panels = list(np.atleast_1d(figure.subplots(3, 1, sharex=True)))
    figure.set_size_inches(WIDTH, 6.0)
    figure.suptitle(f"Amplitude spectrum of {point}, bin {spectrum.bin:.3g} Hz", x=0.01, ha="left")
    floor = float(spectrum.amplitude[shown].max()) * factor * 1e-4
    lines = strongest_lines(spectrum, AXES)
    for i, (panel, axis) in enumerate(zip(panels, AXES, strict=True)):
        panel.plot(spectrum.frequency[shown], spectrum.amplitude[shown, i] * factor, color=COLOURS[axis])
        if floor > 0 and (spectrum.amplitude[shown, i] > 0).any():
            panel.set_yscale("log")
            panel.set_ylim(bottom=floor)
        panel.axvspan(*BOOM_BAND, color="tab:orange", alpha=0.08, lw=0)
        panel.axvspan(*HAMMER_BAND, color="tab:purple", alpha=0.06, lw=0)
        panel.set_ylabel(f"{axis} [{label}]")
        for line in lines:
            panel.axvline(line.frequency, color="0.5", lw=0.6, ls=":")
    for line in lines:
        panels[0].annotate(
            f"{line.frequency:.1f}",
            (line.frequency, 1.0),
            xycoords=("data", "axes fraction"),
            xytext=(0, 1),
            textcoords="offset points",
            ha="center",
            fontsize=8,
            color="0.3",
        )
    panels[-1].set_xlim(0, highest)
    panels[-1].set_xlabel("frequency [Hz]   (shaded: 0–15 Hz boom, 15–80 Hz hammer)")
    return True


def draw_cylinders(figure: Figure, trajectory: Trajectory, design: Design) -> bool:
    """Force of every cylinder, and the pressures of its chambers between gas release and relief."""
    names = trajectory.labels["cylinder"]
    if not names:
        return False
    figure.set_size_inches(WIDTH, 1.0 + 1.5 * len(names))
    figure.suptitle("Cylinders: force and pressure", x=0.01, ha="left")
    grid = figure.subplots(len(names), 2, sharex=True, squeeze=False)
    for (left, right), name in zip(grid, names, strict=True):
        left.plot(trajectory.time, trajectory.of("cylinder_force", name) / 1e3, color="0.2")
        left.set_title(f"{name}: force, positive pushes the pins apart [kN]")
        right.set_title("pressure [bar absolute]")
        for chamber, colour in (("a", "tab:blue"), ("b", "tab:orange")):
            pressure = (trajectory.of(f"pressure_{chamber}", name) + ATMOSPHERE) / 1e5
            right.plot(trajectory.time, pressure, color=colour, label=f"chamber {chamber.upper()}")
        right.axhline(1.0, color="tab:red", lw=0.8, ls="--", label="gas release, relief")
        if name in design.relief:
            right.axhline((design.relief[name] + ATMOSPHERE) / 1e5, color="tab:red", lw=0.8, ls="--")
    figure.legend(*grid[0, 1].get_legend_handles_labels(), loc="outside upper right", ncols=3)
    _time_axis(list(grid[-1]), trajectory)
    return True


def draw_reaction(figure: Figure, trajectory: Trajectory, design: Design) -> bool:
    """Reactions of all constraint rows, and the forces of contacts along their axes into the rock."""
    rows = [(name, trajectory.of("reaction", name)) for name in trajectory.labels["constraint"]]
    contacts = [name for name in trajectory.labels["element"] if name in design.contacts]
    rows += [
        (f"{name}, along its axis, above zero it pulls", trajectory.of("element_force", name)) for name in contacts
    ]
    if not rows:
        return False
    panels = _stack(figure, len(rows), "Force of the surroundings on the machine")
    for panel, (name, values) in zip(panels, rows, strict=True):
        panel.plot(trajectory.time, values / 1e3)
        panel.axhline(0.0, color="0.4", lw=0.6)
        panel.set_title(f"{name} [{'kN m' if is_rotation(name) else 'kN'}]")
    _time_axis(panels, trajectory)
    return True


def draw_trust(figure: Figure, trajectory: Trajectory, design: Design) -> bool:
    """Greatest constraint errors so far, work and stored energies, and the residual of the energy balance."""
    time, rows = trajectory.time, trajectory.labels["constraint"]
    panels = _stack(figure, 5 if rows else 3, "May this run be believed?", each=1.6)
    if rows:
        for panel, variable, title in (
            (panels[0], "constraint_error", "greatest |f| so far [m; rotations: 1]"),
            (panels[1], "constraint_rate", "greatest |df/dt| so far [m/s; rotations: 1/s]"),
        ):
            for name in rows:
                panel.plot(time, _greatest(trajectory.of(variable, name)), label=name)
            panel.set_yscale("log")
            panel.set_title(title)
            panel.legend(loc="lower right", ncols=4)
    work, stored, residual = panels[-3:]
    work.plot(time, trajectory.work_input, label="work in")
    work.plot(time, trajectory.work_dissipated, label="dissipated")
    work.set_title("work [J]")
    for name in ("kinetic", "potential", "elastic"):
        energy = trajectory.arrays[f"energy_{name}"]
        stored.plot(time, energy - energy[0], label=name)
    stored.set_title("energy since the start [J]")
    for panel in (work, stored):
        panel.margins(y=0.3)
        panel.legend(loc="upper left", ncols=3)
    residual.plot(time, _greatest(trajectory.energy_residual), color="0.2")
    residual.set_yscale("log")
    residual.set_title("greatest |energy residual| so far [J]")
    _time_axis(panels, trajectory)
    return True


FIGURES: dict[str, Draw] = {
    "joints": draw_joints,
    "survey_point": draw_survey_point,
    "spectra": draw_spectra,
    "cylinders": draw_cylinders,
    "reaction": draw_reaction,
    "trust": draw_trust,
}


def _stack(figure: Figure, count: int, title: str, each: float = 1.25) -> list[Axes]:
    figure.set_size_inches(WIDTH, 0.9 + each * count)
    figure.suptitle(title, x=0.01, ha="left")
    return list(np.atleast_1d(figure.subplots(count, 1, sharex=True)))


def _time_axis(panels: list[Axes], trajectory: Trajectory) -> None:
    """Time from the first to the last sample, labelled in the last row."""
    for panel in panels:
        place = panel.get_subplotspec()
        if place is None or place.is_last_row():
            panel.set_xlabel("time [s]")
        panel.set_xlim(float(trajectory.time[0]), float(trajectory.time[-1]))


def _length_unit(values: Array) -> tuple[str, float]:
    """Unit and factor that suit lengths in metres."""
    largest = float(np.nanmax(np.abs(values), initial=0.0))
    if largest >= 0.5:
        return "m", 1.0
    return ("mm", 1e3) if largest >= 1e-4 else ("µm", 1e6)


def _greatest(values: Array) -> Array:
    """Greatest magnitude so far, for a logarithmic axis: exact zeros are drawn at a hundredth of the rounding of 1."""
    greatest: Array = np.maximum.accumulate(np.maximum(np.abs(values), np.finfo(float).eps / 100))
    return greatest
