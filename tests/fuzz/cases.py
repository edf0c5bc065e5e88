"""Scenarios, studies, limits and measurements as the grammar allows them, with plain numbers and extreme ones."""

from __future__ import annotations

from random import Random
from typing import Any

import yaml

from drillrig_pin.scenario import CORE_METHODS, PYTHON_METHODS
from fuzz import seeds
from fuzz.extremes import EDGES, Numbers
from fuzz.machines import Machine, chain, machine, position

Files = dict[str, bytes]
#: Of a hundred inputs, how many draw this part of their numbers from the edges.
WILDNESS = (0.0,) * 45 + (0.02,) * 30 + (0.1,) * 17 + (0.4,) * 8


def _dumped(fields: dict[str, Any]) -> bytes:
    return yaml.dump(fields, Dumper=getattr(yaml, "CSafeDumper", yaml.SafeDumper), sort_keys=False).encode()


def _number(text: str) -> float | int:
    return int(text) if text.lstrip("-").isdigit() and len(text) > 15 else float(text)


def case_and_machine(random: Random) -> Files:
    """A model and a scenario for it. One in 1,500 is a chain of 500 links or has 200 loops."""
    n = Numbers(random, random.choice(WILDNESS))
    duration = float(n.plain(1e-3, 2e-2))
    if random.random() < 1 / 1500:
        made = chain(n, *random.choice(((500, 0), (120, 1), (3, 200), (1, 200))))
    else:
        made = machine(n, duration)
    return {"rig.urdf": made.text.encode(), "case.yaml": _dumped(scenario(n, made, duration))}


def scenario(n: Numbers, made: Machine, duration: float) -> dict[str, Any]:
    """A scenario for a machine."""
    fields: dict[str, Any] = {
        "model": "rig.urdf",
        "duration": duration if not n.chance(n.wild / 3) else _number(n.edge(signed=False)),
        "output_rate": _number(n.plain(1, 20)) / duration,
        "engine": n.one_of("core", "core", "core", "auto", "python"),
        "formulation": n.one_of("multipliers", "multipliers", "null_space", "damped"),
    }
    if n.chance(n.wild / 3):
        fields["output_rate"] = _number(n.edge(signed=False))
    if n.chance(0.4):
        fields["stabilization"] = _stabilization(n)
    fields["integrator"] = _integrator(n, fields["engine"], duration)
    if fields["integrator"].get("method") == "LSODA":
        fields.setdefault("stabilization", {})["projection"] = False
    if made.poses and n.chance(0.4):
        fields["pose"] = n.one_of(*made.poses)
    if n.chance(0.3):
        fields["positions"] = {
            joint: [_number(word) for word in position(n, kind).split()]
            if kind == "floating"
            else _number(n.number(-1, 1))
            for joint, kind in made.joints.items()
            if n.chance(0.4)
        }
    if n.chance(0.3):
        fields["velocities"] = {joint: _number(n.number(-2, 2)) for joint in made.single if n.chance(0.5)}
    if made.rows and n.chance(0.15):
        fields["targets"] = {n.one_of(*made.rows): _number(n.number(-0.5, 0.5))}
    if made.loads and n.chance(0.2):
        fields["loads"] = n.one_of("none", [n.one_of(*made.loads)])
    if made.single and n.chance(0.05):
        fields["lock"] = [n.one_of(*made.single)]
    return fields


def _stabilization(n: Numbers) -> dict[str, Any]:
    method = n.one_of("none", "baumgarte", "baumgarte", "sliding_mode")
    fields: dict[str, Any] = {"method": method, "projection": n.one_of(True, True, False)}
    names = {"baumgarte": ("alpha", "beta"), "sliding_mode": ("rate", "gain", "width")}.get(method, ())
    ranges = {"alpha": (1, 100), "beta": (1, 100), "rate": (1, 100), "gain": (1e-4, 1), "width": (1e-6, 1e-3)}
    return fields | {name: _number(n.positive(*ranges[name])) for name in names if n.chance(0.6)}


def _integrator(n: Numbers, engine: str, duration: float) -> dict[str, Any]:
    methods = {"core": CORE_METHODS, "python": PYTHON_METHODS}.get(engine, ())
    method = n.one_of("auto", "auto", *methods, *methods)
    fields: dict[str, Any] = {"method": method, "step": duration / _number(n.plain(3, 15))}
    if n.chance(n.wild / 2):
        fields["step"] = _number(n.edge(signed=False))
    for name, low, high in (("rtol", 1e-11, 1e-3), ("atol", 1e-13, 1e-4), ("max_step", 1e-4, 1e-1)):
        if n.chance(0.3):
            fields[name] = _number(n.positive(low, high))
    return fields


def case_of_a_sound_machine(random: Random) -> Files:
    """A scenario whose numbers are mostly edges, for a machine that runs."""
    n = Numbers(random, random.choice((0.2, 0.5, 0.9)))
    made = Machine(n, joints={"shoulder": "revolute", "elbow": "revolute"})
    made.loads, made.rows = ["push"], ["face.z"]
    model = seeds.double_pendulum(n.one_of("", seeds.HOLD) + n.one_of(seeds.SINES, seeds.SINES + seeds.CONTACT))
    return {"rig.urdf": model.encode(), "case.yaml": _dumped(scenario(n, made, 0.01))}


def study(random: Random) -> Files:
    """A study with axes of every kind over any numbers."""
    n = Numbers(random, random.choice((0.2, 0.6)))
    names = [
        "model.mass", "model.length", "scenario.duration", "scenario.output_rate", "scenario.integrator.step",
        "scenario.integrator.rtol", "scenario.positions.hinge", "scenario.velocities.hinge",
    ]  # fmt: skip
    random.shuffle(names)
    axes = [_axis(n, names) for _ in range(n.one_of(1, 1, 2))]
    fields = {"model": "rig.urdf.xacro", "scenario": {"duration": 0.01}, "axes": axes}
    if n.chance(0.3):
        fields["set"] = {names.pop(): _number(n.positive(0.1, 10))}
    return {**seeds.XACRO, "study.yaml": _dumped(fields)}


def _axis(n: Numbers, names: list[str]) -> dict[str, Any]:
    kind = n.one_of("list", "range", "zip", "grid", "latin_hypercube", "sobol")
    if kind in ("list", "range"):
        return {"name": names.pop(), kind: _values(n) if kind == "list" else _span(n)}
    if kind in ("zip", "grid"):
        values = [_values(n), _values(n)]
        values[1] = (values[1] * 4)[: len(values[0])] if kind == "zip" else values[1]
        return {kind: {names.pop(): values[0], names.pop(): values[1]}}
    bounds: dict[str, Any] = {}
    for name in (names.pop(), names.pop()):
        low, high = sorted((_number(n.positive(1, 2)), _number(n.positive(2, 9))))
        bounds[name] = n.one_of([low, high], {"low": low, "high": high, "scale": n.one_of("linear", "log")})
    return {kind: {"samples": n.one_of(1, 4, 8), "seed": n.one_of(0, 3), "bounds": bounds}}


def _values(n: Numbers) -> list[float | int]:
    return [_number(n.number(0.1, 10)) for _ in range(n.one_of(1, 2, 3))]


def _span(n: Numbers) -> dict[str, Any]:
    start, stop = sorted((_number(n.positive(0.1, 1)), _number(n.positive(1, 9))))
    if n.chance(0.5):
        return {"start": start, "stop": stop, "count": n.one_of(1, 3, 9), "scale": n.one_of("linear", "log")}
    return {"start": start, "stop": stop, "step": _number(n.positive(0.1, 3))}


def limits(random: Random) -> Files:
    """A file of limits."""
    n = Numbers(random, 0.5)
    units = {"angle": ("deg", "rad"), "collar": ("mm", "m"), "shake": ("mm", "m")}
    rows = {name: _limit(n, n.one_of(*units[name])) for name in units if n.chance(0.6)}
    rows[f"toe_{n.positive(1, 20)}m"] = _limit(n, "m")
    return {"limits.yaml": _dumped(rows)}


def _limit(n: Numbers, unit: str) -> Any:
    value = n.positive(0.1, 10)
    return n.one_of(f"{value}{unit}", {"value": _number(value), "unit": unit, "source": "assumed: x"})


def measurement(random: Random) -> Files:
    """A measurement, its numbers mostly plain."""
    n = Numbers(random, random.choice((0.0, 0.01, 0.1)))
    scale, shift = n.positive(1e-3, 10), n.number(-0.5, 0.5)
    rows = [n.one_of("time [s], S_z [mm]", "time [ms], z [m]", "t,z", "t / s,z / mm")]
    for i in range(n.one_of(3, 10, 60, 60)):
        time = n.edge() if n.chance(n.wild / 5) else repr(i / 100 + float(shift) * (abs(float(shift)) < 1e3))
        rows.append(f"{time},{n.number(-1, 1) if scale in EDGES else repr(float(scale) * (i % 7 - 3))}")
    return {"gauge.csv": "\n".join(rows).encode()}
