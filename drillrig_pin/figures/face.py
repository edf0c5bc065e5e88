"""The rock face in one picture: which holes the machine drills badly, and which element their vibration comes from."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from drillrig_pin.analysis.quantities import label_of
from drillrig_pin.batch.face import Face, FaceHole
from drillrig_pin.figures.printed import FORMATS, STYLE, save_figure
from drillrig_pin.figures.sheet import CYCLE, Ink
from drillrig_pin.words import number, quantity, reading

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

NAME = "face"
#: Width of the picture, its greatest height, and margins around the face: left, right, below, above [inch].
WIDTH, TALLEST, MARGINS = 6.9, 8.6, (0.55, 1.0, 0.85, 0.98)
#: Radius of a hole's disc, and inner and outer radius of the ring around it, as parts of the distance between holes.
DISC, RING = 0.19, (0.21, 0.3)
#: Room around the outermost holes, as part of that distance: to the sides, below, above.
ROOM = (0.6, 0.66, 0.5)
#: Beyond so many holes words no longer fit beside them.
LETTERED = 30
#: Shares below this are not drawn on their own; a second element is named from this share on.
SMALL, WORTH_NAMING = 0.03, 0.3
#: What tells elements apart when there are more of them than colours.
HATCHES = ("", "/////", ".....")
GROUND, ROCK, BAD = "#ffffff", "#eeebe6", "#a32100"
RAMP = "YlOrRd"


def save_face(face: Face, title: str, folder: Path, formats: Iterable[str] = FORMATS) -> list[Path]:
    """Write the picture as ``face.png`` and ``face.svg``; ResultFileError if that cannot be.

    Args:
        face: what to draw.
        title: of the study.
        folder: an existing folder.
        formats: of ``FORMATS``.
    """
    import matplotlib as mpl

    with mpl.rc_context(STYLE):
        return save_figure(draw_face(face, title), NAME, (title, caption(face)), folder, formats)


def conclusion(face: Face) -> str:
    """The answer in a sentence or two: worst and best hole, and the cylinder most of it comes from."""
    drilled = face.drilled
    out = [hole for hole in face.holes if not hole.reachable]
    if not drilled:
        return f"No hole has a result; {len(out)} of {len(face.holes)} are out of reach.{_void(face)}"
    worst, best = drilled[0], drilled[-1]
    words = "By the worst case of each hole, " if face.several else ""
    words += f"{worst.name} is the worst ({quantity(worst.value, face.unit)}"
    words += f"), {best.name} the best ({quantity(best.value, face.unit)})." if best is not worst else ")."
    leading = [found[0] for hole in drilled if (found := hole.leading(face.cylinders))]
    if leading:
        name = max(dict.fromkeys(leading), key=leading.count)
        words += f" {name} causes more of the vibration than any other cylinder at {leading.count(name)} of "
        words += f"{len(drilled)} holes" if len(drilled) > 1 else "1 hole"
        at_worst = worst.leading(face.cylinders)
        if at_worst is not None:
            words += f"; at {worst.name} {at_worst[0]} causes {_percent(at_worst[1])} of it"
            name, share = next(iter(worst.shares.items()))
            if name not in face.cylinders:
                words += f", and {name}, no cylinder, {_percent(share)}"
        words += "."
    if out:
        words += f" Out of reach: {', '.join(hole.name for hole in out)}."
    return words + _void(face)


def _void(face: Face) -> str:
    """Holes that could be drilled but have no numbers that may be used, with the first reason."""
    void = [hole for hole in face.holes if hole.reachable and hole.value is None]
    if not void:
        return ""
    return (
        f" Without a usable result, and not ranked: {', '.join(h.name for h in void)} ({void[0].reason.rstrip('.')})."
    )


def caption(face: Face) -> str:
    """How to read the picture."""
    words = "Seen from the machine."
    if face.metric:
        words += f" Colour: {label_of(face.metric, face.unit)}"
        words += ", of the worst case of each hole." if face.several else "."
    if face.elements:
        words += (
            " Ring: share of each cylinder, spring and contact in the mean square of the vibration, by how far its "
            "change of length moves the point (principle of virtual work); negative shares are left out."
        )
    if any(hole.too_high or hole.too_low for hole in face.holes):
        words += " Red words: a pressure beyond the relief valve, or below 1 bar absolute, where oil releases its air."
    return words + (" *: position assumed." if any(hole.assumed for hole in face.holes) else "")


def draw_face(face: Face, title: str) -> Figure:
    """The picture, in the style in force."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    spacing = _spacing(face)
    rights, ups = [h.right for h in face.holes], [h.up for h in face.holes]
    left, right = min(rights) - ROOM[0] * spacing, max(rights) + ROOM[0] * spacing
    low, high = min(ups) - ROOM[1] * spacing, max(ups) + ROOM[2] * spacing
    inner = WIDTH - MARGINS[0] - MARGINS[1]
    tall = min(inner * (high - low) / (right - left), TALLEST - MARGINS[2] - MARGINS[3])
    wide = tall * (right - left) / (high - low)
    answer = textwrap.wrap(conclusion(face), 118)
    head = MARGINS[3] + 0.14 * max(0, len(answer) - 2)
    height = tall + MARGINS[2] + head
    figure = Figure(figsize=(WIDTH, height), facecolor=GROUND)
    FigureCanvasAgg(figure)
    start = MARGINS[0] + (inner - wide) / 2
    axes = figure.add_axes((start / WIDTH, MARGINS[2] / height, wide / WIDTH, tall / height), facecolor=ROCK)
    axes.set_xlim(left, right)
    axes.set_ylim(low, high)
    axes.set_aspect("equal")
    axes.grid(visible=False)
    axes.set_xlabel("to the right, seen from the machine [m]")
    axes.set_ylabel("up [m]")
    inks = inks_of(face)
    scale = _scale(face)
    lettered = len(face.holes) <= LETTERED
    # Letters that fit between two holes, at about 0.047 inch each.
    letters = max(12, int(spacing * tall / (high - low) / 0.047))
    for hole in face.holes:
        _draw_hole(axes, hole, face, spacing, inks, scale, letters if lettered else 0)
    figure.text(0.02, 1 - 0.07 / height, title, ha="left", va="top", fontsize=9, fontweight="bold")
    figure.text(0.02, 1 - 0.27 / height, "\n".join(answer), ha="left", va="top", fontsize=7.5)
    note = "\n".join(textwrap.wrap(caption(face), 150))
    figure.text(0.02, 0.05 / height, note, ha="left", va="bottom", fontsize=5.6, color="0.3")
    if inks:
        _name_elements(figure, inks, 1 - (head - 0.36) / height)
    if face.drilled:
        _colour_bar(
            figure, face, scale, ((start + wide + 0.12) / WIDTH, MARGINS[2] / height, 0.11 / WIDTH, tall / height)
        )
    return figure


def _spacing(face: Face) -> float:
    """Least distance between two holes on the face [m]; 1 for a single one."""
    places = np.array([(hole.right, hole.up) for hole in face.holes])
    distances = np.linalg.norm(places[:, None] - places[None], axis=2)
    apart = distances[distances > 1e-6]
    return float(apart.min()) if len(apart) else 1.0


def _scale(face: Face) -> Any:
    from matplotlib.colors import Normalize

    values = [hole.value for hole in face.drilled if hole.value is not None]
    low, high = (min(values), max(values)) if values else (0.0, 1.0)
    # The darkest and lightest ends of the ramp hide the words on them.
    return Normalize(low - 0.15 * (high - low or 1.0), high + 0.25 * (high - low or 1.0))


def _draw_hole(
    axes: Axes,
    hole: FaceHole,
    face: Face,
    spacing: float,
    inks: Mapping[str, tuple[str, str]],
    scale: Any,
    letters: int,
) -> None:
    from matplotlib import colormaps
    from matplotlib.patches import Circle

    at, radius = (hole.right, hole.up), DISC * spacing
    name = f"{hole.name}{'*' if hole.assumed else ''}"
    if hole.value is None:
        axes.add_patch(Circle(at, radius, facecolor="white", edgecolor="0.4", hatch="////", lw=0.8, ls="--"))
        words = "out of reach" if not hole.reachable else "no result"
        if letters:
            axes.text(*at, words, ha="center", va="center", fontsize=6.2, bbox={"fc": "white", "ec": "none", "pad": 1})
            _under(axes, at, RING[1] * spacing, _limit_words(hole, letters), "0.3")
    else:
        colour = colormaps[RAMP](scale(hole.value))
        axes.add_patch(Circle(at, radius, facecolor=colour, edgecolor="0.2", lw=0.6))
        _ring(axes, hole, spacing, inks)
        if letters:
            dark = np.dot(colour[:3], (0.299, 0.587, 0.114)) < 0.5
            words = quantity(hole.value, face.unit).replace(" ", "\n")
            axes.text(
                *at, words, ha="center", va="center", fontsize=7, color="white" if dark else "black", linespacing=1.0
            )
            bad = _pressures(hole)
            _under(axes, at, RING[1] * spacing, [*_blame(hole, face.cylinders), *bad], "0.15", len(bad))
    if letters:
        axes.text(
            at[0], at[1] + (RING[1] + 0.02) * spacing, name, ha="center", va="bottom", fontsize=7, fontweight="bold"
        )


def inks_of(face: Face) -> dict[str, tuple[str, str]]:
    """Colour and hatch of every element that has a share worth drawing at some hole, the greatest at any hole first."""
    most = {name: max(hole.shares.get(name, 0.0) for hole in face.holes) for name in face.elements}
    names = sorted((name for name, share in most.items() if share >= SMALL), key=lambda name: -most[name])
    plain = [ink.value for ink in CYCLE if ink is not Ink.GREY]
    return {name: (plain[i % len(plain)], HATCHES[i // len(plain) % len(HATCHES)]) for i, name in enumerate(names)}


def _ring(axes: Axes, hole: FaceHole, spacing: float, inks: Mapping[str, tuple[str, str]]) -> None:
    """Shares clockwise from the top, the greatest first; what is small or negative goes together in grey."""
    from matplotlib.patches import Wedge

    whole = sum(max(share, 0.0) for share in hole.shares.values())
    if whole <= 0:
        return
    shown = [(n, s / whole) for n, s in hole.shares.items() if s / whole >= SMALL and n in inks]
    rest = 1.0 - sum(share for _, share in shown)
    turned = 90.0
    for name, share in [*shown, ("", rest)]:
        end = turned - 360.0 * share
        colour, hatch = inks.get(name, (Ink.GREY.value, ""))
        ring = Wedge(
            (hole.right, hole.up), RING[1] * spacing, end, turned, width=(RING[1] - RING[0]) * spacing, facecolor=colour
        )
        ring.set(edgecolor="white", linewidth=0.5, hatch=hatch)
        axes.add_patch(ring)
        turned = end


def _blame(hole: FaceHole, cylinders: frozenset[str]) -> list[str]:
    leading = hole.leading(cylinders)
    if leading is None:
        return []
    others = [(n, s) for n, s in hole.shares.items() if n != leading[0] and s >= WORTH_NAMING]
    return [f"{name} {_percent(share)}" for name, share in sorted([leading, *others], key=lambda item: -item[1])[:2]]


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %"


def _pressures(hole: FaceHole) -> list[str]:
    found = []
    if hole.too_high is not None:
        p = hole.too_high
        found.append(f"{p.cylinder} {p.value / 1e5:.0f} > {p.limit / 1e5:.0f} bar")
    if hole.too_low is not None:
        p = hole.too_low
        low = number(p.value / 1e5, 2).replace("-", "\N{MINUS SIGN}")
        found.append(f"{p.cylinder} {low} < {p.limit / 1e5:.0f} bar")
    return found


def _limit_words(hole: FaceHole, letters: int) -> list[str]:
    reason = hole.reason.partition("; ")[2] or hole.reason
    return textwrap.wrap(reason, letters, max_lines=4, placeholder=" …")


def _under(axes: Axes, at: tuple[float, float], below: float, lines: list[str], colour: str, bad: int = 0) -> None:
    """Lines of small words under a hole, the last ``bad`` of them in red."""
    for i, line in enumerate(lines):
        axes.annotate(
            line,
            (at[0], at[1] - below),
            xytext=(0, -3 - 7.4 * i),
            textcoords="offset points",
            ha="center",
            va="top",
            fontsize=6,
            color=BAD if i >= len(lines) - bad else colour,
        )


def _name_elements(figure: Figure, inks: Mapping[str, tuple[str, str]], top: float) -> None:
    from matplotlib.patches import Patch

    seen = list(inks)
    keys: list[Any] = [Patch(fc=colour, ec="white", lw=0, hatch=hatch, label=n) for n, (colour, hatch) in inks.items()]
    keys.append(Patch(color=Ink.GREY.value, label="the others"))
    figure.legend(
        handles=keys,
        loc="upper left",
        bbox_to_anchor=(0.015, top),
        ncols=min(len(keys), max(3, math.floor(118 / (6 + max(map(len, seen)))))),
        handlelength=0.9,
        fontsize=6.5,
    )


def _colour_bar(figure: Figure, face: Face, scale: Any, place: tuple[float, float, float, float]) -> None:
    """A bar over the values there are, not over all of the ramp."""
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import ListedColormap, Normalize

    values = [hole.value for hole in face.drilled if hole.value is not None]
    low, high = min(values), max(values)
    if high <= low:
        return
    unit, factor = reading(face.unit, high)
    steps = colormaps[RAMP](scale(np.linspace(low, high, 128)))
    shown = ScalarMappable(Normalize(low * factor, high * factor), ListedColormap(steps))
    bar = figure.colorbar(shown, cax=figure.add_axes(place))
    bar.outline.set_visible(False)
    bar.set_label(f"{label_of(face.metric, face.unit)}{f' [{unit}]' if unit else ''}")
