"""The locked hydraulic cylinder: its frequency, its energy, its pressures, the two readings of its law."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rigs import mass_on_cylinder
from scipy.integrate import quad
from scipy.optimize import brentq

from drillrig_pin import AssemblyError, Scenario, load_rig_text, simulate
from drillrig_pin.elements.cylinder import Cylinder, LockedOil

LENGTH = 0.65
MASS = 500.0
TIGHT = {"integrator.rtol": 1e-12, "integrator.atol": 1e-14}


def cylinder(law: str = "geometric", **changes: float) -> Cylinder:
    numbers = {"bore": 0.063, "rod": 0.030, "length_retracted": 0.472, "dead_length_a": 0.04, "dead_length_b": 0.06}
    return Cylinder(
        name="oil", start="a", end="b", law=law, **{**numbers, "bulk_modulus": 2.85e9, "precharge": 3e6, **changes}
    )


def by_hand() -> tuple[float, float, float, float]:
    """S_A, S_B, l0A, l0B of the paper's cylinder 4 at LENGTH, from table 5."""
    S_A, S_B = np.pi * 0.063**2 / 4, np.pi * (0.063**2 - 0.030**2) / 4
    l_A = LENGTH - 0.472
    return S_A, S_B, l_A, (0.472 - 0.040 - 0.060) - l_A


def oscillate(law: str, amplitude: float) -> tuple[float, float]:
    """Measured frequency of the mass started at equilibrium with the velocity of this amplitude, and the linear one."""
    S_A, S_B, l_A, l_B = by_hand()
    k = 2.85e9 * (S_A / l_A + S_B / l_B)
    expected = np.sqrt(k / MASS) / (2 * np.pi)
    rig = load_rig_text(mass_on_cylinder(MASS, LENGTH, f'law="{law}"'))
    case = Scenario(duration=0.15, output_rate=20_000, velocities={"slide": amplitude * 2 * np.pi * expected})
    q = simulate(rig, case.changed(TIGHT)).q[:, 0]
    t = np.arange(len(q)) / 20_000
    up = np.flatnonzero((q[:-1] < 0) & (q[1:] >= 0))
    up = up[up > 0]
    # Crossing times by the chord: 300 samples a period leave an error far below the 1e-4 that is asked.
    crossings = t[up] - q[up] * (t[up + 1] - t[up]) / (q[up + 1] - q[up])
    return (len(crossings) - 1) / (crossings[-1] - crossings[0]), expected


@pytest.mark.parametrize("law", ["geometric", "printed"])
def test_a_mass_on_one_locked_cylinder_oscillates_at_the_frequency_of_its_oil(law: str) -> None:
    # 1 um on oil columns of 0.18 m: the logarithm's curvature changes the frequency by (u / l)^2, far below the bar.
    measured, expected = oscillate(law, 1e-6)
    assert measured == pytest.approx(expected, rel=1e-4)
    assert expected * 0.15 > 5, "several periods must lie within the run"


@pytest.mark.parametrize("law", ["geometric", "printed"])
def test_at_large_amplitude_the_period_is_that_of_the_exact_law(law: str) -> None:
    # Half a turn lasts the integral of dx / sqrt(2 (E - U) / m) between the turning points, with U by quadrature of F.
    amplitude = 0.06
    measured, linear = oscillate(law, amplitude)
    oil = cylinder(law, precharge=0.0).bind(LENGTH, MASS * 9.81)

    def potential(u: float) -> float:
        return float(oil.energy(np.array([LENGTH + u]))[0]) + MASS * 9.81 * u

    total = 0.5 * MASS * (amplitude * 2 * np.pi * linear) ** 2
    low, high = (brentq(lambda u: potential(u) - total, a, b, xtol=1e-15) for a, b in ((-0.12, 0.0), (0.0, 0.12)))
    middle, reach = (low + high) / 2, (high - low) / 2

    def slowness(s: float) -> float:
        return reach * np.cos(s) / np.sqrt(2 * (total - potential(middle + reach * np.sin(s))) / MASS)

    half, _ = quad(slowness, -np.pi / 2 + 1e-4, np.pi / 2 - 1e-4, epsrel=1e-9)
    # The two cut ends of 1e-4 of the substitution's pi; the integrand is flat there.
    half += 1e-4 * (slowness(-np.pi / 2 + 1e-4) + slowness(np.pi / 2 - 1e-4))
    assert measured == pytest.approx(1 / (2 * half), rel=1e-5)
    assert abs(measured / linear - 1) > 1e-3, "the logarithm is no linear spring"


@pytest.mark.parametrize("law", ["geometric", "printed"])
@given(fraction=st.floats(-0.95, 0.95), held=st.floats(-1e5, 1e5))
def test_stored_energy_is_the_integral_of_the_force(law: str, fraction: float, held: float) -> None:
    bound = cylinder(law).bind(LENGTH, held)
    reach = min(bound.l_A, bound.l_B)
    work, error = quad(
        lambda x: float(bound.force(np.array([x]), np.zeros(1), 0.0)[0]),
        LENGTH,
        LENGTH + fraction * reach,
        epsrel=1e-12,
    )
    stored = float(bound.energy(np.array([LENGTH + fraction * reach]))[0])
    # Closed form against quadrature: both lose a few digits where large parts cancel, hence the absolute part of 1 uJ.
    assert stored == pytest.approx(-work, rel=1e-9, abs=1e-6 + 10 * error)


@given(fraction=st.floats(-1e-4, 1e-4))
def test_printed_and_geometric_law_agree_to_first_order(fraction: float) -> None:
    geometric, printed = cylinder("geometric").bind(LENGTH, 2e4), cylinder("printed").bind(LENGTH, 2e4)
    u = fraction * geometric.l_B
    x = np.array([LENGTH + u])
    difference = float((geometric.force(x, np.zeros(1), 0.0) - printed.force(x, np.zeros(1), 0.0))[0])
    # ln(1 - s) + ln(1 + s) = -s^2 + ...: nothing of first order is left; the slack is the rounding of 1e5 N.
    second_order = 2.85e9 * geometric.S_B * (u / geometric.l_B) ** 2
    assert abs(difference) <= 1.01 * second_order + 1e-6


def test_stiffness_is_that_of_both_oil_columns() -> None:
    S_A, S_B, l_A, l_B = by_hand()
    law = cylinder().bind(LENGTH, 0.0)
    h = 1e-7
    low, high = (float(law.force(np.array([LENGTH + u]), np.zeros(1), 0.0)[0]) for u in (-h, h))
    expected = 2.85e9 * (S_A / l_A + S_B / l_B)
    # A central difference over 1e-7 m leaves rounding of 1e-8 of the pressures' force.
    assert -(high - low) / (2 * h) == pytest.approx(expected, rel=1e-6)
    assert float(law.stiffness()) == pytest.approx(expected, rel=1e-14)


@given(held=st.floats(-3e5, 3e5))
def test_rest_pressures_carry_the_held_force_with_the_less_loaded_chamber_at_precharge(held: float) -> None:
    element = cylinder()
    p_A, p_B = element.rest_pressures(held)
    assert p_A * element.piston_area - p_B * element.annulus_area == pytest.approx(held, rel=1e-12, abs=1e-9)
    assert min(p_A, p_B) == pytest.approx(element.precharge, rel=1e-12)


@given(size=st.floats(1e-6, 0.1), way=st.sampled_from([-1, 1]))
def test_extending_lowers_the_pressure_behind_the_piston_and_raises_the_one_before_it(size: float, way: int) -> None:
    u = size * way
    law = cylinder().bind(LENGTH, 0.0)
    p_A, p_B = law.pressures(np.array([LENGTH + u]))
    assert np.sign(p_A[0] - law.p_A0) == -np.sign(u)
    assert np.sign(p_B[0] - law.p_B0) == np.sign(u)


def test_pressures_integrate_the_oil_flow_equations() -> None:
    # d p_A / du = -E0 S_A / (V0A + S_A u) and d p_B / du = E0 S_B / (V0B - S_B u): (29)-(30) with the valves shut.
    law = cylinder().bind(LENGTH, 1e4)
    for u in (-0.05, 0.0, 0.08):
        h = 1e-6
        (a0, b0), (a1, b1) = law.pressures(np.array([LENGTH + u - h])), law.pressures(np.array([LENGTH + u + h]))
        assert (a1 - a0)[0] / (2 * h) == pytest.approx(-law.E0 / (law.l_A + u), rel=1e-7)
        assert (b1 - b0)[0] / (2 * h) == pytest.approx(law.E0 / (law.l_B - u), rel=1e-7)


def test_piston_friction_takes_away_the_energy_it_reports() -> None:
    rig = load_rig_text(mass_on_cylinder(options='friction="10000"'))
    run = simulate(rig, Scenario(duration=0.2, velocities={"slide": 0.5}).changed(TIGHT))
    start = 0.5 * MASS * 0.5**2
    assert run.work_dissipated[-1] > 0.9 * start
    # Integrated to 1e-12, so 1e-9 of the energy leaves room for the sum of a thousand steps and no more.
    assert np.abs(run.energy_residual).max() < 1e-9 * start


def test_a_cylinder_outside_its_stroke_is_refused_by_name() -> None:
    rig = load_rig_text(mass_on_cylinder(length=0.40))
    with pytest.raises(AssemblyError, match=r"'oil'.* 0\.4000 m .*0\.4720 to 0\.8440 m"):
        simulate(rig, Scenario(duration=0.1))


def test_laws_stacked_give_the_forces_of_each() -> None:
    laws = [cylinder().bind(0.60, 1e4), cylinder(bore=0.08).bind(0.70, -2e4)]
    x, x_dot = np.array([0.61, 0.68]), np.array([0.1, -0.2])
    together = LockedOil.stack(laws).force(x, x_dot, 0.0)
    alone = [law.force(x[i : i + 1], x_dot[i : i + 1], 0.0)[0] for i, law in enumerate(laws)]
    np.testing.assert_array_equal(together, alone)
