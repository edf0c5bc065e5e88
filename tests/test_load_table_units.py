"""Units, offsets and separators of load tables: converted, or refused in a sentence; never read as something else."""

from __future__ import annotations

from pathlib import Path

import pytest
from rigs import NO_GRAVITY, point_mass

from drillrig_pin import ModelError, Scenario, ScenarioError, load_rig, load_rig_text, simulate
from drillrig_pin.elements.loads import read_samples

RAMP = [(100 * i, i) for i in range(11)]


def rows(separator: str = ",") -> str:
    return "\n".join(f"{t}{separator}{f}" for t, f in RAMP)


def model(kind: str = "force", attributes: str = "", text: str = "") -> str:
    table = f"<table {attributes}>{text}</table>"
    load = f'<load name="push" kind="{kind}" point="P" axis="1 0 0" frame="world">{table}</load>'
    return point_mass(10.0, NO_GRAVITY + load)


HEADERS = [
    "time [ms],force [kN]",
    "time (ms),F (kN)",
    "t / ms,F / kN",
    "t in ms,F in kN",
    "time_ms,force_kN",
    "time ms,load kN",
    "ms,kN",
    "Time,Force\nms,kN",
    "Time,Force\n[ms],[kN]",
    "# time [ms], force [kN]",
    "# rig 7\n# time [ms], force [kN]",
    "\ufefftime [ms],force [kN]",
    '"time [ms]","force [kN]"',
    "Zeit [ms],Kraft [kN] (gefiltert)",
]


@pytest.mark.parametrize("header", HEADERS)
def test_units_in_a_header_are_read(header: str) -> None:
    samples = read_samples(header.lstrip("\ufeff") + "\n" + rows(), "load.csv")
    assert samples == tuple((i / 10, 1000.0 * i) for i in range(11))


@pytest.mark.parametrize("engine", ["core", "python"])
def test_a_ramp_of_kilonewtons_over_milliseconds_moves_the_mass_by_its_cube(tmp_path: Path, engine: str) -> None:
    (tmp_path / "load.csv").write_text("time [ms],force [kN]\n" + rows())
    (tmp_path / "m.urdf").write_text(model(attributes='file="load.csv"'))
    run = simulate(load_rig(tmp_path / "m.urdf"), Scenario(duration=1.0, engine=engine))
    # x = F' t^3 / (6 m) = 1e4 / 60 m.
    assert run.q[-1, 0] == pytest.approx(1e4 / 60, rel=1e-9)
    assert any("in ms and kN" in note for note in run.notes)


@pytest.mark.parametrize(
    ("unit", "factor"),
    [("N", 1), ("kN", 1e3), ("MN", 1e6), ("mN", 1e-3), ("daN", 10), ("kgf", 9.80665), ("lbf", 4.4482216152605)],
)
def test_units_of_force(unit: str, factor: float) -> None:
    assert read_samples(f"time [s],F [{unit}]\n" + rows(), "f.csv")[10][1] == pytest.approx(10 * factor, rel=1e-14)


@pytest.mark.parametrize("unit", ["N m", "Nm", "N*m", "N·m", "N.m", "kN m", "kN·m", "kNm"])
def test_units_of_torque(unit: str) -> None:
    factor = 1e3 if unit.startswith("k") else 1.0
    assert read_samples(f"time [s],M [{unit}]\n" + rows(), "f.csv", "torque")[10][1] == 10 * factor


@pytest.mark.parametrize(
    ("kind", "header", "words"),
    [
        ("force", "time [ms],force [kn]", r"'kn' is no unit of force known here.*Did you mean 'kN'"),
        ("force", "time [fortnight],force [N]", r"'fortnight' is no unit of time known here"),
        ("force", "time [s],force [N m]", r"'N m' is no unit of force, but of torque.*'force'"),
        ("torque", "time [s],torque [kN]", r"'kN' is no unit of torque, but of force.*'torque'"),
        ("torque", "time_s,torque_kN", r"'kN' is no unit of torque, but of force"),
        ("force", "time [s],pressure [bar]", r"'bar' is no unit of force, but of pressure"),
        ("force", "time [s],force [-]", r"'-' is no unit of force known here"),
        ("force", "time [s],force []", r"no unit of force known here"),
        ("force", "force [kN],time [ms]", r"'kN' is no unit of time, but of force"),
        ("force", "force,time", r"the first column of the load table is 'force'. Time comes first"),
        ("force", "mass [kg],force [N]", r"'kg' is no unit of time, but of mass"),
        ("force", "time [s],x [m],force [N]", r"3 columns"),
        ("force", "a\nb\nc", r"is not `time,value`"),
    ],
)
def test_a_unit_that_does_not_fit_is_refused(kind: str, header: str, words: str) -> None:
    with pytest.raises(ModelError, match=words) as caught:
        load_rig_text(model(kind, "", header + "\n" + rows()))
    assert "\n" not in str(caught.value)


def test_a_byte_order_mark_takes_no_row_along() -> None:
    assert read_samples("\ufeff" + rows(), "f.csv")[0] == (0.0, 0.0)


@pytest.mark.parametrize("header", ["time,force", "time,force_z", "t,F_min", "time (s),F_max", "stamp,load"])
def test_names_without_units_are_seconds_and_newtons(header: str) -> None:
    assert read_samples(header + "\n" + rows(), "f.csv")[1] == (100.0, 1.0)


@pytest.mark.parametrize("separator", [";", "\t", ", ", " ; ", " \t "])
def test_semicolons_and_tabs_separate_columns_too(separator: str) -> None:
    text = f"time [ms]{separator.strip(' ')}force [kN]\n" + rows(separator)
    assert read_samples(text, "f.csv")[10] == (1.0, 10000.0)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("time;force\n0,0;0,0\n0,1;1,5\n", "decimal comma.*decimal points"),
        ("time\tforce\n0,0\t0\n", "decimal comma"),
        ("0,0,0,0\n0,1,1,5\n", "decimal points"),
        ("0,5\n0,1,7\n", "line 2 .*columns"),
        ("0 0\n1 5\n", "comma, a semicolon or a tab"),
        ("2026-01-05 12:00:00,1\n", "seconds|fewer"),
        ("0,1_000\n1,2\n", "line 1"),
        ("0,1e999\n1,2\n", "not finite"),
        ("0,0x10\n1,2\n", "line 1"),
        ("0,1.000,5\n", "line 1"),
        ("O,0\n1,5\n2,5\n3,5\n4,5\n", "line 1"),
        ("sep=;\ntime;force\n0;1\n", "line 2"),
    ],
)
def test_what_could_be_misread_is_refused(text: str, words: str) -> None:
    with pytest.raises(ModelError, match=words):
        read_samples(text, "f.csv")


@pytest.mark.parametrize(
    ("attributes", "stamps", "first", "last"),
    [
        ('time_offset="auto"', [1764000000.125 + i / 8 for i in range(11)], 0.0, 1.25),
        ('time_offset="-1764000000.125"', [1764000000.125 + i / 8 for i in range(11)], 0.0, 1.25),
        ('time_scale="0.001"', [100 * i for i in range(11)], 0.0, 1.0),
        ('time_scale="0.001" time_offset="auto"', [5000 + 100 * i for i in range(11)], 0.0, 1.0),
        ('time_offset="-5"', [5 + i for i in range(11)], 0.0, 10.0),
    ],
)
def test_times_are_scaled_and_shifted(attributes: str, stamps: list[float], first: float, last: float) -> None:
    law = load_rig_text(model("force", attributes, "\n".join(f"{t!r},1" for t in stamps))).forces[0].law
    assert (law.samples[0][0], law.samples[-1][0]) == (first, last)


def test_time_stamps_of_today_keep_their_microseconds() -> None:
    # A float at 1.76e9 s has steps of 0.24 us; as text the stamps have six digits.
    text = "\n".join(f"1764000000.{i:06d},1" for i in range(1, 12))
    samples = read_samples(text, "f.csv", time_offset="auto")
    assert [t for t, _ in samples] == [float(f"{i}e-6") for i in range(11)]


def test_a_table_that_does_not_start_at_zero_says_what_to_write() -> None:
    stamps = "\n".join(f"{1764000000 + i / 10!r},1" for i in range(11))
    with pytest.raises(ScenarioError, match=r'time_offset="auto".*time_offset="-1764000000.0"'):
        simulate(load_rig_text(model(text=stamps)), Scenario(duration=1.0))
    assert simulate(
        load_rig_text(model(attributes='time_offset="auto"', text=stamps)), Scenario(duration=1.0)
    ).outcome.completed


def test_a_scale_that_is_no_number_is_refused_by_name() -> None:
    for attribute in ('time_scale="0"', 'time_scale="-1"', 'time_offset="now"', 'ramp="-1"', 'unit="kN"'):
        with pytest.raises(ModelError, match=attribute.split("=")[0]):
            load_rig_text(model("force", attribute, rows()))
