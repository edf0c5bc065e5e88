"""Sheets on paper: PNG and SVG, one journal column wide, by Matplotlib."""

from __future__ import annotations

import contextlib
import gc
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from drillrig_pin.figures.lettering import letter, power_of_ten
from drillrig_pin.figures.sheet import Curve, Panel, Sheet
from drillrig_pin.figures.thin import thin, thin_path
from drillrig_pin.files import saving

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: One column of a journal [inch].
WIDTH = 3.5
DOTS_PER_INCH = 300
FORMATS = ("png", "svg")
#: Kept in every file, so that it is known again.
MAKER = "drillrig-pin"
#: Margins around the panels and between them [inch].
LEFT, RIGHT, BOTTOM, TOP, BETWEEN = 0.58, 0.1, 0.4, 0.42, 0.26
#: A legend below the panels, and x labels between panels that do not share x [inch].
LEGEND, LABELS = 0.2, 0.22
#: Height of the only panel, of one of two or three, and of one of many [inch].
HEIGHTS = {1: 1.9, 2: 1.25, 3: 1.0}
HEIGHT = 0.8
#: Letters of the smaller size that fit across the panels.
LETTERS = 56
#: Curves are thinned to the least and greatest sample of each of so many stretches: one per dot of the print.
BUCKETS = 850

STYLE: dict[Any, Any] = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "font.size": 7.0,
    "axes.titlesize": 7.0,
    "axes.titlelocation": "left",
    "axes.titlepad": 3.0,
    "axes.labelsize": 7.0,
    "axes.labelpad": 2.0,
    "axes.linewidth": 0.5,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "grid.color": "#dddddd",
    "grid.linewidth": 0.4,
    "xtick.labelsize": 6.5,
    "ytick.labelsize": 6.5,
    "xtick.major.width": 0.5,
    "ytick.major.width": 0.5,
    "xtick.major.size": 2.0,
    "ytick.major.size": 2.0,
    "xtick.minor.size": 0.0,
    "ytick.minor.size": 0.0,
    "lines.linewidth": 0.7,
    "lines.solid_joinstyle": "round",
    "legend.frameon": False,
    "legend.fontsize": 6.5,
    "legend.handlelength": 1.3,
    "legend.columnspacing": 1.0,
    "legend.borderaxespad": 0.0,
    "legend.borderpad": 0.1,
    "axes.formatter.useoffset": False,
    # A joint may be called $x$: names of a model are words, not formulas.
    "text.parse_math": False,
    "svg.hashsalt": "drillrig",
}


def save_sheets(sheets: Iterable[Sheet], folder: Path, formats: Iterable[str] = FORMATS) -> list[Path]:
    """Write every sheet as ``NAME.png`` and ``NAME.svg``.

    Args:
        sheets: what to draw.
        folder: an existing folder.
        formats: of ``FORMATS``.

    Raises:
        ResultFileError: a file cannot be written.
    """
    import matplotlib as mpl

    written = []
    for sheet in sheets:
        with mpl.rc_context(STYLE), np.errstate(all="ignore"), _collecting_later():
            written += save_figure(draw(sheet), _file_name(sheet.name), (sheet.title, sheet.caption), folder, formats)
    return written


def file_names(names: Iterable[str], formats: Iterable[str] = FORMATS) -> list[str]:
    """Names of the files that sheets of these names are written to."""
    formats = list(formats)
    return [f"{_file_name(name)}.{form}" for name in names for form in formats]


def save_figure(
    figure: Figure, name: str, words: tuple[str, str], folder: Path, formats: Iterable[str] = FORMATS
) -> list[Path]:
    """Write a drawn figure as ``NAME.png`` and ``NAME.svg``, in the style in force.

    Args:
        figure: what was drawn.
        name: of the files.
        words: title and caption, kept in the files.
        folder: an existing folder.
        formats: of ``FORMATS``.

    Raises:
        ResultFileError: a file cannot be written.
    """
    written = []
    for form in formats:
        path = folder / f"{name}.{form}"
        metadata: dict[str, Any] = {"Title": words[0], "Description": words[1]}
        metadata |= {"Date": None, "Creator": MAKER} if form == "svg" else {"Software": MAKER}
        with saving(path, where=path) as aside:
            # Quick compression: the files grow by a tenth, drawing is a fifth faster.
            options: Any = {"pil_kwargs": {"compress_level": 3}} if form == "png" else {}
            figure.savefig(aside, format=form, dpi=DOTS_PER_INCH, metadata=metadata, **options)
        written.append(path)
    return written


@contextlib.contextmanager
def _collecting_later() -> Iterator[None]:
    """No garbage collection for one figure: a tenth of the time goes into looking at artists that are all in use."""
    collecting = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collecting:
            gc.enable()


def draw(sheet: Sheet) -> Figure:
    """Draw a sheet in the style in force."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    count = len(sheet.panels)
    each = _square_height(sheet.panels[0]) if sheet.panels[0].square else HEIGHTS.get(count, HEIGHT)
    head = TOP + (LEGEND if sheet.panels[0].marks and count > 1 else 0.0)
    together = _one_legend(sheet)
    gap = BETWEEN + (0.0 if sheet.shared else LABELS)
    foot = BOTTOM + (LEGEND if together else 0.0)
    height = head + count * each + (count - 1) * gap + foot
    # Figures are made without pyplot, which keeps state of its own and may open windows.
    figure = Figure(figsize=(WIDTH, height))
    FigureCanvasAgg(figure)
    figure.text(0.03, 1 - 0.06 / height, sheet.title, ha="left", va="top", fontsize=8, fontweight="bold")
    first: Axes | None = None
    for i, panel in enumerate(sheet.panels):
        bottom = height - head - each - i * (each + gap)
        place = (LEFT / WIDTH, bottom / height, (WIDTH - LEFT - RIGHT) / WIDTH, each / height)
        axes = figure.add_axes(place, sharex=first if sheet.shared else None)
        first = first or axes
        last = i == count - 1 or not sheet.shared
        _draw_panel(axes, panel, titled=count > 1, top=i == 0, labelled=last, legend=not together)
    if together and first is not None:
        handles, names = first.get_legend_handles_labels()
        figure.legend(handles, names, loc="lower center", ncols=_columns(names), bbox_to_anchor=(0.5, 0.04 / height))
    return figure


def _draw_panel(axes: Axes, panel: Panel, *, titled: bool, top: bool, labelled: bool, legend: bool) -> None:
    several = len(panel.curves) > 1
    if titled:
        # A given place: looking for one costs as much as drawing the panel.
        axes.set_title(panel.title, y=1.0)
    if panel.log:
        axes.set_yscale("log", nonpositive="clip")
    for band in panel.bands:
        axes.axvspan(band.low, band.high, color=band.ink.value, alpha=0.13, lw=0)
    for mark in panel.marks:
        axes.axvline(mark.x, color="0.35", lw=0.6, ls=":")
    depth = _depths(panel)
    for curve, behind in zip(panel.curves, depth, strict=True):
        _draw_curve(axes, curve, panel, several, behind)
    for level in panel.levels:
        axes.axhline(level.value, color="0.2", lw=0.6, ls=(0, (4, 2)))
    axes.set_ylabel(panel.y_label)
    axes.yaxis.set_label_coords(-0.47 / (WIDTH - LEFT - RIGHT), 0.5, transform=axes.transAxes)
    if labelled:
        axes.set_xlabel(panel.x_label)
    else:
        axes.tick_params(labelbottom=False)
    _limits(axes, panel)
    letter(axes, panel, top=top, titled=titled)
    if legend and several:
        _legend(axes, len(panel.title) if titled else 0)


def _legend(axes: Axes, taken: int) -> None:
    """On the line of the title, of which ``taken`` letters are used; inside the panel if it is longer."""
    names = axes.get_legend_handles_labels()[1]
    if taken + sum(len(name) + 5 for name in names) <= LETTERS:
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.02), ncols=len(names))
    else:
        axes.legend(loc="upper right", frameon=True, framealpha=0.8, edgecolor="none")


def _square_height(panel: Panel) -> float:
    """Height that leaves little empty where both axes have one scale."""
    spans = [[float(np.ptp(v[np.isfinite(v)])) for v in (c.x, c.y) if len(v)] for c in panel.curves]
    wide, high = (max((span[k] for span in spans if len(span) == 2), default=1.0) for k in (0, 1))
    width = WIDTH - LEFT - RIGHT
    return width * min(max(1.2 * high / wide if wide > 0 else 1.2, 0.35), 1.2)


def _depths(panel: Panel) -> list[float]:
    """Drawing order of the curves: the widest at the back, so that it does not cover the others."""
    spans = [float(np.ptp(y)) if len(y := curve.y[np.isfinite(curve.y)]) else 0.0 for curve in panel.curves]
    return [2.0 + 0.5 * sum(other > span for other in spans) / len(spans) for span in spans]


def _draw_curve(axes: Axes, curve: Curve, panel: Panel, several: bool, depth: float) -> None:
    label = curve.name if several else None
    if panel.bars:
        width = 0.85 * float(curve.x[1] - curve.x[0]) if len(curve.x) > 1 else 1.0
        shown = curve.y > 0 if panel.log else np.full(len(curve.y), True)
        axes.bar(curve.x[shown], curve.y[shown], width, color=curve.ink.value, label=label)
        axes.set_xlim(float(curve.x[0]) - width / 1.7, float(curve.x[-1]) + width / 1.7)
        return
    x, y = thin_path(curve.x, curve.y) if curve.path else thin(curve.x, curve.y, BUCKETS)
    axes.plot(x, y, color=curve.ink.value, ls="--" if curve.dashed else "-", label=label, zorder=depth)


def _limits(axes: Axes, panel: Panel) -> None:
    from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullLocator

    if panel.square:
        axes.set_aspect("equal", adjustable="datalim")
        return
    if panel.x_range is not None:
        axes.set_xlim(*panel.x_range)
    elif not panel.bars and (filled := [curve.x for curve in panel.curves if len(curve.x) > 1]):
        axes.set_xlim(min(float(x[0]) for x in filled), max(float(x[-1]) for x in filled))
    if not panel.bars:
        axes.xaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 4, 5, 10]))
    if panel.log:
        if panel.floor is not None:
            axes.set_ylim(bottom=panel.floor)
        else:
            low, high = np.log10(axes.get_ylim())
            axes.set_ylim(10 ** np.floor(low), 10 ** np.ceil(high))
        axes.yaxis.set_major_locator(LogLocator(numticks=5))
        axes.yaxis.set_minor_locator(NullLocator())
        # Plain superscripts: the mathematical text of the default labels takes as long as the drawing.
        axes.yaxis.set_major_formatter(FuncFormatter(power_of_ten))
        if panel.note:
            axes.set_ylim(top=axes.get_ylim()[1] * 8)
    else:
        axes.margins(y=0.12)
        low, high = axes.get_ylim()
        # Names of limits stand outside the curves: room for them above the upper ones, below the lower ones.
        room = 0.12 * (high - low) if panel.levels else 0.0
        upper = [panel.is_upper(level) for level in panel.levels]
        note = 0.17 * (high - low) * len(panel.note.splitlines())
        axes.set_ylim(low - room * (False in upper), high + room * (True in upper) + note)
        axes.yaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 2.5, 5, 10]))


def _one_legend(sheet: Sheet) -> bool:
    """Whether all panels show the same several curves, so that one legend below them serves all."""
    names = [tuple(curve.name for curve in panel.curves) for panel in sheet.panels]
    return (len(names[0]) > 1 and all(other == names[0] for other in names)) or max(map(len, names)) > 4


def _columns(names: list[str]) -> int:
    """Columns of a legend as wide as the figure: about 52 letters."""
    longest = max(map(len, names), default=1) + 5
    return max(1, min(len(names), 60 // longest))


def _file_name(name: str) -> str:
    """A sheet's name as a file name: what a model calls its parts must not name another folder."""
    return "".join(c if c.isalnum() or c in "._-" else "_" for c in name)
