"""One force element of every kind, with legal attributes, on points and joints of a machine."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

from fuzz.extremes import Numbers, attributes

if TYPE_CHECKING:
    from fuzz.machines import Machine


def _name(made: Machine) -> str:
    return f"e{len(made.extension)}"


def _two_points(made: Machine) -> tuple[str, str, float]:
    """Two points and how far apart they are at zero [m]; they may coincide, or be the same."""
    first, second = made.some_point(), made.some_point()
    apart = 0.7
    if first in made.at and second in made.at:
        apart = math.dist(made.at[first][1], made.at[second][1])
    return first, second, apart


def _cylinder(made: Machine) -> None:
    n = made.numbers
    first, second, apart = _two_points(made)
    length = apart / n.random.uniform(1.05, 1.6) if 0 < apart < 1e6 else 0.5
    bore = float(n.plain(0.03, 0.2))
    rod = bore * n.random.uniform(0.3, 0.8)
    given = attributes(
        name=_name(made), from_=first, to=second,
        bore=n.edge(signed=False) if n.chance(n.wild) else f"{bore:.4g}",
        rod=n.edge(signed=False) if n.chance(n.wild) else f"{rod:.4g}",
        length_retracted=n.edge(signed=False) if n.chance(n.wild) else repr(length),
        dead_length_a=n.edge(signed=False) if n.chance(n.wild) else repr(length / 20),
        dead_length_b=n.edge(signed=False) if n.chance(n.wild) else repr(length / 15),
        bulk_modulus=n.positive(1e8, 3e9),
        friction=n.one_of(None, n.positive(10, 1e4)),
        precharge=n.one_of(None, n.positive(1e5, 1e7)),
        relief_pressure=n.one_of(None, n.positive(1e7, 3e7)),
        vapour_pressure=n.one_of(None, None, n.positive(1e3, 1e5)),
        law=n.one_of(None, None, "printed"),
    )  # fmt: skip
    made.extension.append(f"<cylinder{given}/>")


def _spring(made: Machine) -> None:
    n = made.numbers
    first, second, apart = _two_points(made)
    rest = n.one_of(None, "initial", n.number(apart * 0.9 + 1e-3, apart * 1.1 + 2e-3))
    given = attributes(
        name=_name(made), from_=first, to=second, stiffness=n.positive(10, 1e6),
        damping=n.one_of(None, n.positive(1, 1e3)), rest_length=rest,
    )  # fmt: skip
    made.extension.append(f"<spring{given}/>")


def _joint_spring(made: Machine) -> None:
    n = made.numbers
    rest = n.one_of(None, "initial", n.number(-0.5, 0.5))
    given = attributes(
        name=_name(made), joint=_joint(made), stiffness=n.positive(1, 1e6),
        damping=n.one_of(None, n.positive(0.1, 1e3)), rest=rest,
    )  # fmt: skip
    made.extension.append(f"<joint_spring{given}/>")


def _joint_torque(made: Machine) -> None:
    given = attributes(name=_name(made), joint=_joint(made), value=made.numbers.number(-100, 100))
    made.extension.append(f"<joint_torque{given}/>")


def _joint_friction(made: Machine) -> None:
    n = made.numbers
    given = attributes(
        name=_name(made), joint=_joint(made), damping=n.one_of(None, n.positive(0.1, 100)),
        friction=n.one_of(None, n.positive(0.1, 100)), creep=n.one_of(None, n.positive(1e-4, 0.1)),
    )  # fmt: skip
    made.extension.append(f"<joint_friction{given}/>")


def _joint(made: Machine) -> str:
    return made.numbers.one_of(*(made.single or ["j1"]))


def _contact(made: Machine) -> None:
    n = made.numbers
    given = attributes(
        name=_name(made), point=made.some_point(), axis=n.one_of(None, n.direction()), stiffness=n.positive(1e3, 1e7),
        damping=n.one_of(None, n.positive(10, 1e4)), preload=n.one_of(None, n.positive(10, 1e4)),
        mode=n.one_of(None, "bilateral", "unilateral", "unilateral"),
    )  # fmt: skip
    made.extension.append(f"<contact{given}/>")


def _load(made: Machine) -> None:
    n, name = made.numbers, _name(made)
    kind = n.one_of("force", "force", "torque")
    inside = n.one_of(_constant, _harmonics, _table, _table)(n, made.duration, kind)
    given = attributes(
        name=name, kind=kind, point=made.some_point(), axis=n.direction(), frame=n.one_of(None, "body", "world")
    )
    made.loads.append(name)
    made.extension.append(f"<load{given}>{inside}</load>")


def _ramp(n: Numbers) -> str | None:
    return n.one_of(None, None, n.positive(1e-4, 0.1))


def _constant(n: Numbers, duration: float, kind: str) -> str:
    return f"<constant{attributes(value=n.number(-1e3, 1e3), ramp=_ramp(n))}/>"


def _harmonics(n: Numbers, duration: float, kind: str) -> str:
    terms = "".join(
        f"<term{attributes(amplitude=n.number(-1e3, 1e3), frequency=n.positive(1, 500), phase=n.one_of(None, n.number(-3, 3)))}/>"  # noqa: E501
        for _ in range(n.one_of(0, 1, 1, 2, 4))
    )
    return f"<harmonics{attributes(mean=n.one_of(None, n.number(-1e3, 1e3)), ramp=_ramp(n))}>{terms}</harmonics>"


def _table(n: Numbers, duration: float, kind: str) -> str:
    """Rows over the duration and beyond, in units of the header; jumps, constant stretches, single odd rows."""
    reading = n.one_of(None, "auto", "linear", "hold", "spline", "cubic")
    rows = n.one_of(2, 4, 5, 9, 30)
    unit, factor = n.one_of(("s", 1.0), ("s", 1.0), ("ms", 1e3), ("us", 1e6))
    span = duration * n.random.uniform(1.0, 3.0)
    start = n.one_of(0.0, 0.0, 0.0, 5.0)
    wild = n.wild / 4  # of so many numbers one is enough
    lines = [n.one_of(f"time [{unit}],f [{_unit(n, kind)}]", "time,value")]
    if lines[0] == "time,value":
        factor = 1.0
    for i in range(rows):
        at = (start + span * i / (rows - 1)) * factor
        time = n.edge() if n.chance(wild) else f"{at:.9g}"
        value = n.edge() if n.chance(wild) else f"{100 * math.sin(7.0 * i / rows) + n.random.uniform(-5, 5):.6g}"
        lines.append(f"{time},{value}")
        if n.chance(0.04):
            lines.append(f"{time},{n.number(-100, 100)}")
    given = attributes(
        reading=reading, scale=n.one_of(None, n.number(-10, 10)),
        time_scale=n.one_of(None, None, None, None, n.positive(1, 10)),
        time_offset="auto" if start else n.one_of(None, None, "auto", n.number(-1e-3, 0)), ramp=_ramp(n),
    )  # fmt: skip
    text = "\n".join(lines)
    return f"<table{given}>{text}\n</table>"


def _unit(n: Numbers, kind: str) -> str:
    return n.one_of("N", "kN", "MN") if kind == "force" else n.one_of("N*m", "kN*m")


FORCES: tuple[Callable[[Machine], None], ...] = (
    _cylinder, _cylinder, _spring, _spring, _joint_spring, _joint_spring, _joint_torque, _joint_friction, _contact,
    _contact, _load, _load, _load,
)  # fmt: skip
