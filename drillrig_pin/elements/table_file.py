"""The rows of a load table: read, held to what a measurement may look like, and what is to be said about them."""

from __future__ import annotations

from typing import Literal

import numpy as np

from drillrig_pin.elements.base import Remark
from drillrig_pin.elements.tables import OUTSIDE, Reading, TableLaw
from drillrig_pin.errors import ModelError
from drillrig_pin.kinematics import Array
from drillrig_pin.series import read_series
from drillrig_pin.words import number

#: A step in a regular measurement longer than this many times its usual step is a gap.
GAP = 10.0
#: A table is a regular measurement if this part of its steps is its usual step, to 10 %.
REGULAR = 0.75
#: Rows that `auto` and the curves need, and those a table needs whose reading is written.
FEWEST, LEAST = 4, 2
TO_CHOOSE = 'Write reading="linear", "hold", "spline" or "cubic" to choose.'
WAYS = {
    "linear": "by straight lines",
    "hold": "as held values",
    "spline": "by a curve between neighbouring rows",
    "cubic": "by a cubic spline",
}


def read_samples(
    text: str,
    where: object,
    kind: Literal["force", "torque"] = "force",
    reading: Reading = "auto",
    time_scale: float = 1.0,
    time_offset: float | Literal["auto"] = 0.0,
) -> tuple[tuple[float, float], ...]:
    """The rows of :func:`read_table`, time [s] and value [N or N m]."""
    return read_table(text, where, kind, reading, time_scale, time_offset)[0]


def read_table(
    text: str,
    where: object,
    kind: Literal["force", "torque"],
    reading: Reading,
    time_scale: float,
    time_offset: float | Literal["auto"],
) -> tuple[tuple[tuple[float, float], ...], tuple[str, str]]:
    """Parse `time,value` lines of a load of a kind; a first line of words is a header, which may name units.

    Returns:
        The rows in SI and the units of the header, of time and of value; a row that repeats another is left out.

    Raises:
        ModelError: as :func:`~drillrig_pin.series.read_series`; too few rows, a gap in a regular measurement.
    """
    series = read_series(
        text,
        "load table",
        lambda _: where,
        ModelError,
        quantity=kind,
        what=f"the values, a load of kind {kind!r},",
        time_factor=time_scale,
        time_offset=time_offset,
    )
    rows = tuple(dict.fromkeys(series.rows))
    asked = reading in ("linear", "hold")
    if len(rows) < (LEAST if asked else FEWEST):
        words = "two" if asked else "four"
        todo = "" if asked else 'Rows that are meant to be few need reading="linear" or reading="hold".'
        raise ModelError(f"the load table has fewer than {words} samples", where=where, todo=todo)
    gap = gap_in(np.array([t for t, _ in rows]))
    if gap is not None and not asked:
        raise ModelError(
            f"the load table has a gap from t = {gap[0]:g} to {gap[1]:g} s",
            where=where,
            todo='Fill it; or write reading="hold" if rows stand where the value changes, reading="linear" for a '
            "straight line across.",
        )
    return rows, series.units


def gap_in(time: Array) -> tuple[float, float] | None:
    """The widest gap of a measurement of a regular rate, from and to [s]; None if it has none or is irregular."""
    steps = np.diff(time)
    steps_apart = steps[steps > 0]
    usual = float(np.median(steps_apart))
    regular = float(np.mean(np.abs(steps_apart - usual) <= 0.1 * usual)) >= REGULAR
    widest = int(np.argmax(steps))
    if regular and len(steps_apart) >= FEWEST and steps[widest] > GAP * usual:
        return float(time[widest]), float(time[widest + 1])
    return None


def table_remarks(
    name: str, law: TableLaw, units: tuple[str, str], kind: Literal["force", "torque"], scale: float
) -> list[Remark]:
    """How a table was read and what acts, and what of that is doubtful."""
    unit = "N" if kind == "force" else "N m"
    rows, acts = (float(law.value.min()), float(law.value.max())), law.extremes()
    chosen = law.choice
    why = f" (auto: {chosen.why})" if chosen.why else ""
    way = WAYS[chosen.reading]
    whole = rows[1] - rows[0]
    twice = law.time[1:][np.diff(law.time) == 0.0]
    # Two rows at one time say what is meant; where the rows are only not smooth, the author may have meant a curve.
    decided = chosen.reading == "linear" and bool(chosen.why) and whole > 0 and not len(twice)
    said = [
        Remark(
            f"load {name!r}: {len(law.time)} rows from {law.time[0]:g} to {law.time[-1]:g} s, in "
            f"{units[0] or 's'} and {units[1] or unit}{f' times {scale:g}' if scale != 1.0 else ''}, read {way}{why}; "
            f"{_span(rows, unit)} in the table, {_span(acts, unit)} between its rows",
            TO_CHOOSE if decided else "",
        )
    ]
    beyond = max(acts[1] - rows[1], rows[0] - acts[0])
    if beyond > OUTSIDE * whole:
        said.append(
            Remark(
                f"load {name!r} leaves its table: {_span(rows, unit)} in the rows, {_span(acts, unit)} between them",
                'Write reading="linear" or "spline": neither leaves its rows.',
            )
        )
    if chosen.reading == "hold" and len(twice):
        words = f"load {name!r} has two rows at t = {twice[0]:g} s; of held values the second acts"
        said.append(Remark(words, "Leave out the first."))
    gap = gap_in(law.time)
    if gap is not None and chosen.reading != "hold":
        words = f"load {name!r} has a gap from t = {gap[0]:g} to {gap[1]:g} s, read as a straight line"
        said.append(Remark(words, 'Fill it, or write reading="hold" if the value was held.'))
    return said


def _span(values: tuple[float, float], unit: str) -> str:
    return f"{number(values[0])} to {number(values[1])} {unit}"
