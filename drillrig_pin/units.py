"""Units that files of samples are written in, with what each is in SI."""

from __future__ import annotations

import difflib
import math

#: Of every quantity a column may hold: unit as written, and what one of it is in SI. Capitals count: mN is no MN.
#: Sources: BIPM, SI Brochure, 9th edition (2019); g_n = 9.80665 m/s^2 by the 3rd CGPM (1901); pound 0.45359237 kg and
#: inch 0.0254 m by the international yard and pound agreement (1959).
QUANTITIES: dict[str, dict[str, float]] = {
    "time": {"s": 1.0, "sec": 1.0, "ms": 1e-3, "msec": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0},
    "force": {
        "N": 1.0,
        "mN": 1e-3,
        "daN": 10.0,
        "kN": 1e3,
        "MN": 1e6,
        "kgf": 9.80665,
        "kp": 9.80665,
        "tf": 9806.65,
        "lbf": 4.4482216152605,
        "kip": 4448.2216152605,
    },
    "torque": {
        "Nm": 1.0,
        "mNm": 1e-3,
        "daNm": 10.0,
        "kNm": 1e3,
        "MNm": 1e6,
        "Nmm": 1e-3,
        "Ncm": 1e-2,
        "kgfm": 9.80665,
        "lbfft": 1.3558179483314004,
        "ftlbf": 1.3558179483314004,
        "lbfin": 0.1129848290276167,
    },
    "length": {"m": 1.0, "km": 1e3, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "nm": 1e-9, "in": 0.0254, "ft": 0.3048},
    "angle": {"rad": 1.0, "mrad": 1e-3, "deg": math.pi / 180, "°": math.pi / 180},
    "pressure": {
        "Pa": 1.0,
        "hPa": 1e2,
        "kPa": 1e3,
        "MPa": 1e6,
        "GPa": 1e9,
        "bar": 1e5,
        "mbar": 1e2,
        "psi": 6894.757293,
    },
    "frequency": {"Hz": 1.0, "kHz": 1e3, "rpm": 1 / 60},
    "speed": {"m/s": 1.0, "mm/s": 1e-3, "km/h": 1 / 3.6},
    "acceleration": {"m/s^2": 1.0, "mm/s^2": 1e-3},
    "mass": {"kg": 1.0, "g": 1e-3, "lb": 0.45359237},
    "electric potential": {"V": 1.0, "mV": 1e-3},
    "electric current": {"A": 1.0, "mA": 1e-3},
}


def normal(unit: str) -> str:
    """A unit as the table writes it: micro as u, no spaces, no signs of multiplication."""
    for sign, plain in (("µ", "u"), ("μ", "u"), ("²", "^2"), ("**", "^"), ("*", ""), ("·", ""), ("⋅", ""), ("×", "")):
        unit = unit.replace(sign, plain)
    # N.m and kN-m are written too.
    return "".join(unit.split()).replace("N.m", "Nm").replace("N-m", "Nm")


def quantity_of(unit: str) -> str | None:
    """What a unit measures, e.g. ``force``; None if it is not known here."""
    name = normal(unit)
    return next((quantity for quantity, units in QUANTITIES.items() if name in units), None)


def factor_of(unit: str, quantity: str) -> float | None:
    """What one of the unit is in SI; None if it does not measure that quantity."""
    return QUANTITIES[quantity].get(normal(unit))


def legal_units(unit: str, quantity: str) -> str:
    """Advice for a unit that does not do: the nearest that does, and all of them."""
    names = list(QUANTITIES[quantity])
    folded = {name.casefold(): name for name in reversed(names)}
    near = folded.get(normal(unit).casefold()) or next(iter(difflib.get_close_matches(normal(unit), names, 1)), "")
    hint = f"Did you mean {near!r}? " if near else ""
    return f"{hint}Units of {quantity}: {', '.join(names)}."
