"""The error of a run follows its tolerance and its loads, never the output rate: closed forms of a mass on a mount."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rigs import point_mass

from drillrig_pin import Scenario, Trajectory, load_rig_text, simulate

ENGINES = ("core", "python")
MASS = 100.0
Terms = list[tuple[float, float]]


def run_of(frequency: float, damping: float, terms: Terms, **fields: object) -> tuple[Trajectory, float, float]:
    """A mass on a mount of this frequency [Hz] and share of the critical damping, under sines from t = 0 on."""
    k, c = MASS * (2 * np.pi * frequency) ** 2, 2 * damping * MASS * 2 * np.pi * frequency
    words = "".join(f'<term amplitude="{a}" frequency="{f}"/>' for a, f in terms)
    text = f"""<gravity xyz="0 0 0"/><joint_spring name="mount" joint="z" stiffness="{k}" damping="{c}"/>
    <load name="hammer" kind="force" point="P" axis="0 0 1" frame="world"><harmonics>{words}</harmonics></load>"""
    case = Scenario(**fields)
    if case.engine != "python":
        # What `auto` takes on a machine all of whose joints are held; this mass is free to drift aside.
        case = case.changed({"integrator.method": "ExpAdams"})
    return simulate(load_rig_text(point_mass(MASS, text)), case), k, c


def error(run: Trajectory, k: float, c: float, terms: Terms) -> float:
    """Largest difference from the closed form, over the largest displacement, of samples and record."""
    decay = c / (2 * MASS)
    own = np.sqrt(k / MASS - decay**2)
    worst = 0.0
    for rows in (run, run.record):
        t, x, x0, v0 = rows.time, np.zeros(len(rows.time)), 0.0, 0.0
        for amplitude, frequency in terms:
            w = 2 * np.pi * frequency
            H = amplitude / (k - MASS * w**2 + 1j * w * c)
            x, x0, v0 = x + np.imag(H * np.exp(1j * w * t)), x0 + np.imag(H), v0 + np.imag(1j * w * H)
        # From rest: what is missing at t = 0 rings down.
        x = x + np.exp(-decay * t) * (-x0 * np.cos(own * t) + (-v0 - decay * x0) / own * np.sin(own * t))
        z = rows.q[:, rows.labels["joint"].index("z")]
        worst = max(worst, float(np.abs(z - x).max()) / float(np.abs(x).max()))
    return worst


def imbalance(run: Trajectory) -> float:
    """Energy missed, over the work put in."""
    record = run.record
    return float(np.abs(record.energy_residual).max() / np.abs(record.work_input).max())


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("rate", [1000.0, 100.0, 50.0, 25.0, 10.0])
def test_a_blow_rate_near_the_output_rate_errs_no_more_than_any_other(engine: str, rate: float) -> None:
    terms = [(5000.0, 48.0)]
    duration = 5.0 if engine == "core" else 0.4
    run, k, c = run_of(5.0, 0.05, terms, duration=duration, output_rate=rate, engine=engine)
    assert run.method == ("ExpAdams" if engine == "core" else "DOP853")
    # The tolerance is 1e-8 a step.
    assert error(run, k, c, terms) < 1e-7
    # A hundredth of what a run is doubted for.
    assert imbalance(run) < 1e-5


@pytest.mark.parametrize(
    ("engine", "frequency"), [("core", 150.0), ("core", 300.0), ("core", 500.0), ("python", 150.0)]
)
def test_fast_loads_raise_no_false_alarm(engine: str, frequency: float) -> None:
    terms = [(5000.0, frequency)]
    duration = 3.0 if engine == "core" else 0.1
    run, k, c = run_of(5.0, 0.05, terms, duration=duration, engine=engine)
    assert error(run, k, c, terms) < 1e-6
    # Far below the thousandth from which a run is doubted: it measures the run, not the measuring.
    assert imbalance(run) < 1e-5


def test_a_train_of_short_blows_is_met_to_the_last_harmonic() -> None:
    # Half sines of 1 ms and 40 kN, 48 a second, as their first twenty harmonics.
    t = np.linspace(0.0, 1e-3, 2001)
    blow = 40e3 * np.sin(np.pi * t / 1e-3)
    terms = [
        (float(2 * 48 * np.trapezoid(blow * np.cos(2 * np.pi * 48 * n * (t - 5e-4)), t)), 48.0 * n)
        for n in range(1, 21)
    ]
    run, k, c = run_of(5.0, 0.05, terms, duration=1.0)
    assert error(run, k, c, terms) < 1e-7
    assert imbalance(run) < 1e-5


@settings(max_examples=12, deadline=None)
@given(
    own=st.floats(1.0, 60.0),
    damping=st.floats(0.01, 0.5),
    frequency=st.floats(1.0, 300.0),
    rate=st.floats(5.0, 3000.0),
    rtol=st.sampled_from([1e-6, 1e-8]),
)
def test_error_follows_tolerance_on_any_mount_load_and_output_rate(
    own: float, damping: float, frequency: float, rate: float, rtol: float
) -> None:
    terms = [(100.0, frequency)]
    tolerances = {"rtol": rtol, "atol": rtol / 100}
    run, k, c = run_of(own, damping, terms, duration=0.5, output_rate=rate, engine="core", integrator=tolerances)
    largest = float(np.abs(run.record.q).max())
    # A thousand tolerances: some hundred steps add up; the absolute one counts on a mass that hardly moves.
    assert error(run, k, c, terms) < 1e3 * (rtol + rtol / 100 / largest)
    assert imbalance(run) < 1e-3
