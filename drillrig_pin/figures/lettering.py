"""Small words in printed panels: limits, marks, bands, notes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from drillrig_pin.figures.sheet import Band, Panel

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Size of these words [pt].
SMALL = 5.8
#: What small words stand on, so that they can be read over curves.
PLATE: dict[str, Any] = {"boxstyle": "square,pad=0.15", "fc": "white", "ec": "none", "alpha": 0.75}


def power_of_ten(value: float, _: object) -> str:
    """Label of a logarithmic axis in plain superscripts: 10⁻⁵."""
    exponent = round(np.log10(value)) if value > 0 else 0
    if 0 <= exponent <= 3:
        return f"{10**exponent}"
    return "10" + str(exponent).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))


def letter(axes: Axes, panel: Panel, *, top: bool, titled: bool) -> None:
    """Name limits, marks and bands of a panel (the latter two in the top panel only), and write its note."""
    for level in panel.levels:
        above = panel.is_upper(level)
        axes.annotate(
            level.name,
            (0.005, level.value),
            xycoords=("axes fraction", "data"),
            xytext=(0, 1.5 if above else -1.5),
            textcoords="offset points",
            va="bottom" if above else "top",
            fontsize=SMALL,
            color="0.2",
        )
    if top:
        for mark in panel.marks:
            axes.annotate(
                mark.name,
                (mark.x, 1.0),
                xycoords=axes.get_xaxis_transform(),
                # Above the line of the panel's title, if it has one.
                xytext=(0, 12 if titled else 2),
                textcoords="offset points",
                ha="center",
                fontsize=SMALL,
            )
        for band in panel.bands:
            _name_band(axes, band)
    if panel.note:
        axes.annotate(
            panel.note,
            (1.0, 1.0),
            xycoords="axes fraction",
            xytext=(-2, -2),
            textcoords="offset points",
            ha="right",
            va="top",
            fontsize=SMALL,
            bbox=PLATE,
        )


def _name_band(axes: Axes, band: Band) -> None:
    axes.annotate(
        band.name,
        (band.low, 1.0),
        xycoords=axes.get_xaxis_transform(),
        xytext=(2, -2),
        textcoords="offset points",
        va="top",
        fontsize=SMALL,
        color="0.25",
        annotation_clip=True,
    )
