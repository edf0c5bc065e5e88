"""A run that leaves what its laws describe says from when on, in both engines and wherever it is read."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np
import pytest
from command import Command
from hypothesis import given, settings
from hypothesis import strategies as st
from rigs import mass_on_cylinder

from drillrig_pin import Scenario, Trajectory, load_rig_text, load_trajectory, simulate
from drillrig_pin.analysis.design import design_of
from drillrig_pin.analysis.metrics import measure
from drillrig_pin.analysis.verdict import Level, findings, headline
from drillrig_pin.elements.cylinder import ATMOSPHERE, VAPOUR_PRESSURE
from drillrig_pin.validity import BURST

ENGINES = ["core", "python"]
PULL = (
    '<load name="pull" kind="force" point="pin_b" axis="0 0 1" frame="world"><harmonics mean="0" ramp="0.05">'
    '<term amplitude="{}" frequency="10"/></harmonics></load>\n'
)


def shaken(options: str = "", force: float = 30e3, **fields: object) -> Trajectory:
    """A tonne on a cylinder without precharge, pulled at by +-30 kN: either chamber would have to pull."""
    model = mass_on_cylinder(1000.0, options=options, extension=PULL.format(force))
    return simulate(load_rig_text(model), Scenario(**{"duration": 0.3, "output_rate": 5000, **fields}))  # type: ignore[arg-type]


def moments(run: Trajectory, vapour: float = VAPOUR_PRESSURE, relief: float = 21e6) -> float | None:
    """First stored row at which a chamber is out of bounds, straight from the arrays; None if there is none."""
    p = np.stack([run.pressure_a, run.pressure_b])
    out = ((p + ATMOSPHERE < vapour) | (p > BURST * relief)).any(axis=(0, 2))
    return float(run.time[np.argmax(out)]) if out.any() else None


@pytest.mark.parametrize("engine", ENGINES)
def test_oil_in_tension_ends_what_is_valid(engine: str) -> None:
    run = shaken(engine=engine)
    first = moments(run)
    assert first is not None
    assert run.outcome.completed
    assert run.outcome.valid_until is not None
    # The crossing lies between the first row out of bounds and the one before it.
    assert first - 1 / 5000 - 1e-12 <= run.outcome.valid_until <= first
    assert "tears and cannot pull" in str(run.outcome)
    assert "assumed" in run.outcome.doubt
    assert len(measure(run).invalid) == 1


@pytest.mark.parametrize("engine", ENGINES)
def test_a_pressure_that_bursts_every_hose_is_not_valid_from_the_start(engine: str) -> None:
    run = shaken('relief_pressure="1e5" precharge="5e5"', 0.0, engine=engine)
    assert run.outcome.valid_until == 0.0
    assert "relief" in run.outcome.doubt


def test_the_vapour_pressure_of_a_model_counts_and_is_then_not_assumed() -> None:
    options = 'precharge="4e5" vapour_pressure="9e4"'
    run = shaken(options, 10e3)
    assert "assumed" not in run.outcome.doubt
    first = moments(run, 9e4)
    assert first is not None
    assert run.outcome.valid_until == pytest.approx(first, abs=1 / 5000 + 1e-12)
    assert not measure(run).cylinders[0].vapour_assumed


@settings(max_examples=15, deadline=None)
@given(
    precharge=st.floats(0, 4e6),
    force=st.floats(0, 60e3),
    relief=st.floats(2e5, 21e6),
    law=st.sampled_from(["geometric", "printed"]),
)
def test_verdict_and_flags_agree_with_the_arrays(precharge: float, force: float, relief: float, law: str) -> None:
    """Generated machines: the judgement is made a second time here, from nothing but the stored pressures."""
    run = shaken(f'precharge="{precharge!r}" relief_pressure="{relief!r}" law="{law}"', force, duration=0.15)
    first = moments(run, relief=relief)
    found, metrics = run.outcome, measure(run)
    if first is None:
        # Nothing out of bounds in any row; between rows only by less than a row's change.
        assert found.valid_until is None
        assert metrics.invalid == ()
    else:
        assert found.valid_until == pytest.approx(first, abs=1 / 5000 + 1e-12)
        assert metrics.invalid == (found.invalid,)
    told = findings(metrics, design_of(run), metrics.hole, {}, found)
    level, sentence = headline(told)
    assert ("Not valid from" in sentence) == (first is not None)
    assert any(finding.voids for finding in told) == (first is not None)
    (oil,) = metrics.cylinders
    lowest = (run.pressure_a.min() + ATMOSPHERE, run.pressure_b.min() + ATMOSPHERE)
    if min(lowest) < 1e5 or first is not None:
        assert level is Level.BAD
    for chamber, least, pressure in zip(oil.chambers, lowest, (run.pressure_a, run.pressure_b), strict=True):
        assert chamber.least == pytest.approx(least, rel=1e-2, abs=1e4)
        # A share of rows is that of time to within a row for each of the crossings, of which 10 Hz makes few.
        assert chamber.below == pytest.approx((pressure + ATMOSPHERE < 1e5).mean(), abs=0.02)
        warned = [text for text in metrics.warnings if f"chamber {chamber.name} falls" in text]
        assert len(warned) == (least < 1e5)
        assert all(("(tension)" in text) == (least < 0) for text in warned)


def test_files_and_the_command_line_say_so(drillrig: Command) -> None:
    Path("cav.urdf").write_text(mass_on_cylinder(1000.0, extension=PULL.format(30e3)))
    answer = drillrig("run", "cav.urdf", "--set", "scenario.duration=0.3", "-o", "cav.nc")
    assert answer.code == 4
    assert "NOT VALID from t = " in answer.out
    assert "no pressure, oil cannot pull" in answer.out
    assert "not to be used" in answer.err
    run = load_trajectory("cav.nc")
    until = run.outcome.valid_until
    assert until is not None
    assert run.dataset.attrs["valid_until"] == until
    run.to_csv("cav.csv")
    with Path("cav.csv").open() as stream:
        header, *rows = csv.reader(stream)
    assert header[-1].startswith("valid")
    assert {(float(row[0]) < until) == (float(row[-1]) == 1) for row in rows} == {True}
    assert math.isfinite(until)
