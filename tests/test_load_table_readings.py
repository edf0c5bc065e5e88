"""Load tables between their rows: straight lines, held values, curves; jumps; the momentum they give a free mass."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rigs import NO_GRAVITY, point_mass

from drillrig_pin import ModelError, Scenario, Trajectory, load_rig_text, simulate
from drillrig_pin.check import check_text
from drillrig_pin.elements import JointCoordinate, Name, PluginElement, quantity, reference
from drillrig_pin.elements.loads import Table, TableLaw
from drillrig_pin.kinematics import Array

MASS = 10.0
ENGINES = [("core", "auto"), ("core", "DOP853"), ("core", "RK4"), ("core", "RODAS"), ("core", "ExpAdams")]
ENGINES += [("python", "DOP853"), ("python", "RK4"), ("python", "Radau"), ("python", "LSODA")]
STEP_1US = "0.0,0.0\n0.1,0.0\n0.100001,1000.0\n0.2,1000.0\n0.3,1000.0"
STEP_1MS = "0.0,0.0\n0.1,0.0\n0.101,1000.0\n0.2,1000.0\n0.3,1000.0"
STEP = "0.0,0.0\n0.1,0.0\n0.1,1000.0\n0.3,1000.0"
ON_CHANGE = "0.0,0.0\n0.5,100.0\n2.0,40.0\n2.1,0.0\n3.0,0.0"
BANG = "0.0,1000.0\n0.1,1000.0\n0.10001,-1000.0\n0.2,-1000.0\n0.3,-1000.0"


def model(rows: str, attributes: str = "") -> str:
    load = '<load name="push" kind="force" point="P" axis="1 0 0" frame="world">'
    return point_mass(MASS, NO_GRAVITY + f"{load}<table {attributes}>\n{rows}\n</table></load>")


def pushed(text: str, duration: float, engine: str = "core", method: str = "auto", rate: float = 100.0) -> Trajectory:
    settings: dict[str, object] = {"integrator": {"method": method, "rtol": 1e-10}}
    if method == "LSODA":
        settings["stabilization"] = {"projection": False}
    return simulate(load_rig_text(text), Scenario(duration=duration, engine=engine, output_rate=rate, **settings))


@pytest.mark.parametrize(("engine", "method"), ENGINES)
@pytest.mark.parametrize(
    ("rows", "attributes", "duration", "momentum"),
    [
        (STEP_1US, "", 0.3, 1000 * (0.2 - 0.5e-6)),
        (STEP_1MS, "", 0.3, 1000 * (0.2 - 0.5e-3)),
        (STEP, "", 0.3, 200.0),
        (STEP, "", 0.1, 0.0),
        (BANG, "", 0.2, 100.0 - 99.99),
        (ON_CHANGE, "", 3.0, 25.0 + 105.0 + 2.0),
        (ON_CHANGE, 'reading="hold"', 3.0, 150.0 + 4.0),
        (STEP, 'reading="hold"', 0.3, 200.0),
    ],
    ids=[
        "step in 1 us",
        "step in 1 ms",
        "jump",
        "jump at the end",
        "bang bang",
        "log in lines",
        "log held",
        "jump held",
    ],
)
def test_a_table_gives_the_momentum_of_its_lines(
    rows: str, attributes: str, duration: float, momentum: float, engine: str, method: str
) -> None:
    for rate in (7.0, 100.0):
        run = pushed(model(rows, attributes), duration, engine, method, rate)
        assert run.outcome.completed
        # The integrators are exact for forces that are straight lines; LSODA keeps its tolerance over its history.
        tolerance = 1e-6 if method == "LSODA" else 1e-9
        assert MASS * run.v[-1, 0] == pytest.approx(momentum, abs=tolerance * 200)
        values = [float(row.split(",")[1]) for row in rows.split()]
        assert min(values) <= run.load_value.min() <= run.load_value.max() <= max(values)


def test_at_a_jump_the_result_shows_the_value_behind_it() -> None:
    for engine, method in ENGINES:
        run = pushed(model(STEP), 0.3, engine, method)
        before, at = run.load_value[9:11, 0]
        assert (before, at) == (0.0, 1000.0)
        assert run.a[10, 0] == pytest.approx(100.0, rel=1e-12)


def test_a_ramp_brings_a_table_in_smoothly_in_both_engines() -> None:
    text = model("0,500\n1,500\n2,500\n3,500", 'ramp="0.4"')
    for engine, method in ENGINES[1:]:
        run = pushed(text, 1.0, engine, method, rate=40)
        s = np.minimum(run.time / 0.4, 1.0)
        # 1e-12 of 500 N: rounding of the polynomial.
        np.testing.assert_allclose(run.load_value[:, 0], 500 * (6 * s**5 - 15 * s**4 + 10 * s**3), atol=5e-10)
        # The ramp's mean is one half.
        assert MASS * run.v[-1, 0] == pytest.approx(500 * (1.0 - 0.2), rel=1e-6)


class Pulse(PluginElement):
    """A user's force that is on from one time to another, closed on the left or on the right."""

    tag = "pulse"
    load = True
    joint: Name = reference("joint")
    on: float = quantity("s", "from")
    off: float = quantity("s", "to")
    late: bool = reference("whether the instants themselves count as before", default=False)

    def coordinate(self, resolver) -> JointCoordinate:  # type: ignore[no-untyped-def]
        return resolver.joint(self.joint)

    def force(self, x: Array, xdot: Array, t: float) -> Array:
        acts = self.on < t <= self.off if self.late else self.on <= t < self.off
        return np.full_like(x, 100.0 if acts else 0.0)

    def breakpoints(self) -> Array:
        return np.array([self.on, self.off])


@pytest.mark.parametrize("late", [False, True])
@pytest.mark.parametrize(("engine", "method"), ENGINES)
def test_a_pulse_of_a_users_element_acts_whole_at_any_output_rate(engine: str, method: str, late: bool) -> None:
    rig = load_rig_text(
        point_mass(MASS, NO_GRAVITY), elements=[Pulse(name="p", joint="x", on=0.31, off=0.35, late=late)]
    )
    settings: dict[str, object] = {"integrator": {"method": method, "rtol": 1e-10}}
    if method == "LSODA":
        settings["stabilization"] = {"projection": False}
    for rate in (2.0, 100.0):
        run = simulate(rig, Scenario(duration=1.0, engine=engine, output_rate=rate, **settings))
        assert MASS * run.v[-1, 0] == pytest.approx(4.0, rel=1e-9)


@pytest.mark.parametrize("per_period", [10, 21, 100])
def test_dense_samples_of_sines_are_read_by_a_curve_that_follows_them(per_period: int) -> None:
    t = np.arange(0, 20.3, 1 / per_period)
    wave = 3.0 + np.sin(2 * np.pi * t + 0.4)
    law = TableLaw(t, wave)
    assert law.choice.reading == "cubic"
    between = np.linspace(2.0, 18.0, 4001)
    curve = np.array([law.force(np.zeros(1), np.zeros(1), at)[0] for at in between])
    # Error of a cubic spline through samples h apart: at most h^4 / 384 max f'''' (Hall and Meyer 1976, times 5).
    bound = 5 / 384 * (2 * np.pi / per_period) ** 4
    np.testing.assert_allclose(curve, 3.0 + np.sin(2 * np.pi * between + 0.4), atol=bound)


@pytest.mark.parametrize("per_period", [3, 4, 6])
def test_sparse_samples_of_a_sine_are_read_by_lines(per_period: int) -> None:
    t = np.arange(0, 20.3, 1 / per_period)
    assert TableLaw(t, np.sin(2 * np.pi * t + 0.4)).choice.reading == "linear"


def test_near_duplicate_stamps_do_not_make_a_force_of_their_own() -> None:
    random = np.random.default_rng(7)
    t = np.arange(2000) / 20e3
    for i in random.choice(np.arange(1, 2000), 39, replace=False):
        t[i] = t[i - 1] + 1e-8
    values = 3000 * np.sin(2 * np.pi * 40 * t) + 200 * random.standard_normal(2000)
    law = TableLaw(t, values)
    assert law.choice.reading == "linear"
    assert law.extremes() == (values.min(), values.max())


rows_of_any_shape = st.lists(
    st.tuples(
        st.sampled_from([0.0, 1e-6, 1e-3, 0.013, 0.05, 0.11]),
        st.one_of(st.sampled_from([0.0, 1000.0, -1000.0, 5.0]), st.floats(-1e4, 1e4)),
    ),
    min_size=6,
    max_size=12,
)


def _increasing(steps: list[tuple[float, float]]) -> tuple[Array, Array]:
    rows: list[tuple[float, float]] = []
    for step, value in steps:
        t = (rows[-1][0] if rows else 0.0) + (step if rows else 0.0)
        if len(rows) > 1 and rows[-1][0] == rows[-2][0] == t:
            t += 0.01
        rows.append((t, value))
    rows.append((rows[-1][0] + 0.1, rows[-1][1]))
    table = np.array(rows)
    return table[:, 0], table[:, 1]


@settings(max_examples=25, deadline=None)
@given(rows_of_any_shape, st.sampled_from(["auto", "linear", "hold", "spline"]))
def test_tables_of_any_shape_act_within_their_extremes_in_both_engines(
    steps: list[tuple[float, float]], reading: str
) -> None:
    time, value = _increasing(steps)
    text = model(
        "\n".join(f"{t!r},{v!r}" for t, v in zip(time.tolist(), value.tolist(), strict=True)), f'reading="{reading}"'
    )
    low, high = TableLaw(time, value, reading).extremes()
    # A curve that auto takes may pass the top of a wave between its samples; rounding of 1e-12 of the range.
    slack = (0.05 if reading == "auto" else 1e-12) * max(np.ptp(value), 1.0)
    assert value.min() - slack <= low <= high <= value.max() + slack
    ends = []
    for engine in ("core", "python"):
        run = pushed(text, float(time[-1]), engine, "DOP853", rate=50 / float(time[-1]))
        assert run.outcome.completed
        assert low - 1e-9 <= run.load_value.min() <= run.load_value.max() <= high + 1e-9
        ends.append(MASS * float(run.v[-1, 0]))
    # Forces within the extremes give no more momentum than those.
    span = float(time[-1])
    assert min(low, 0.0) * span - 1e-6 <= ends[0] <= max(high, 0.0) * span + 1e-6
    assert ends[0] == pytest.approx(ends[1], rel=1e-8, abs=1e-7 * max(abs(low), abs(high), 1.0) * span)


@settings(max_examples=200, deadline=None)
@given(rows_of_any_shape)
def test_held_and_straight_readings_have_the_integral_of_their_rows(steps: list[tuple[float, float]]) -> None:
    time, value = _increasing(steps)
    whole = (time[0], time[-1])
    size = np.abs(value).max() * time[-1] + 1e-300
    held = TableLaw(time, value, "hold")._spline.integrate(*whole)
    assert held == pytest.approx(float((value[:-1] * np.diff(time)).sum()), abs=1e-12 * size)
    lines = TableLaw(time, value, "linear")._spline.integrate(*whole)
    assert lines == pytest.approx(float(np.trapezoid(value, time)), abs=1e-12 * size)


def test_the_run_says_how_a_table_was_read_and_what_acts() -> None:
    run = pushed(model(STEP_1US), 0.3)
    (note,) = [note for note in run.notes if "'push'" in note]
    for words in ("5 rows from 0 to 0.3 s", "in s and N", "straight lines", "auto: a cubic would leave", "0 to 1000 N"):
        assert words in note
    assert "auto" not in pushed(model(STEP_1US, 'reading="linear"'), 0.3).notes[0]


def test_check_says_which_reading_was_decided_and_when_a_curve_leaves_its_rows() -> None:
    def found(rows: str, attributes: str = "") -> list[str]:
        return [
            str(problem) for problem in check_text(model(rows, attributes), "m.urdf") if "'push'" in problem.message
        ]

    (decided,) = found(STEP_1US)
    for words in ("warning", "read by straight lines", 'reading="linear"'):
        assert words in decided
    assert not found(STEP_1US, 'reading="linear"')
    assert not found(STEP)  # two rows at one time say what is meant
    (beyond,) = found(STEP_1US, 'reading="cubic"')
    assert "leaves its table: 0 to 1000 N in the rows, -6.008e+07 to 1.925e+07 N between them" in beyond
    waves = "\n".join(f"{t!r},{np.sin(5 * t)!r}" for t in np.arange(0, 3, 0.05).tolist())
    assert not found(waves)


def test_a_gap_in_a_regular_measurement_is_refused_with_the_way_to_write_held_data() -> None:
    regular = [f"{i / 100},{i % 7}" for i in range(60)]
    with_gap = "\n".join([*regular, *[f"{3 + i / 100},{i % 5}" for i in range(60)]])
    with pytest.raises(ModelError, match=r'gap from t = 0.59 to 3 s.*reading="hold".*reading="linear"'):
        load_rig_text(model(with_gap))
    assert load_rig_text(model(with_gap, 'reading="hold"')).forces[0].remarks()[0].advice == ""
    said = load_rig_text(model(with_gap, 'reading="linear"')).forces[0].remarks()
    assert any("gap from t = 0.59 to 3 s" in remark.text and remark.advice for remark in said)
    # A log of changes has no rate, and so no gap.
    load_rig_text(model("0,0\n0.02,5\n0.5,2\n9,4\n9.1,0\n30,1"))


def test_few_rows_need_their_reading_written() -> None:
    with pytest.raises(ModelError, match=r'fewer than four.*reading="linear"'):
        load_rig_text(model("0,0\n1,5"))
    assert MASS * pushed(model("0,0\n1,5", 'reading="linear"'), 1.0).v[-1, 0] == pytest.approx(2.5, rel=1e-9)
    with pytest.raises(ModelError, match="fewer than two"):
        load_rig_text(model("0,0", 'reading="hold"'))


def test_a_held_log_with_two_rows_at_one_time_says_which_acts() -> None:
    remarks = load_rig_text(model("0,1\n0.5,2\n0.5,3\n1,0", 'reading="hold"')).forces[0].remarks()
    assert any("two rows at t = 0.5 s" in remark.text and remark.advice for remark in remarks)


def test_an_unknown_reading_is_refused_with_the_legal_ones() -> None:
    with pytest.raises(ModelError, match=r"reading = 'step'.*'linear'.*'hold'"):
        load_rig_text(model(STEP, 'reading="step"'))


def test_a_table_made_in_python_reads_alike() -> None:
    law = Table(samples=((0.0, 0.0), (0.1, 0.0), (0.1, 5.0), (0.2, 5.0)), scale=2.0).law()
    values = [law.force(np.zeros(1), np.zeros(1), t)[0] for t in (0.0, np.nextafter(0.1, 0), 0.1, 0.2, 9.0)]
    assert values == [0.0, 0.0, 10.0, 10.0, 10.0]
    assert law.jumps().tolist() == [0.1]


def test_the_reading_is_kept_in_the_expanded_model(tmp_path: Path) -> None:
    rig = load_rig_text(model(ON_CHANGE, 'reading="hold" time_offset="0.5"'))
    again = load_rig_text(rig.file.text)
    assert again.forces[0].law == rig.forces[0].law
    assert again.forces[0].start_of_table() == 0.5
