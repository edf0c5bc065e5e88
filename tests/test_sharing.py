"""What balance alone does not decide is shared by stiffness, or named."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rigs import joint, link, point, robot

from drillrig_pin import Scenario, load_rig_text, simulate
from drillrig_pin.check import check_text
from drillrig_pin.sharing import share
from drillrig_pin.simulation import start_state
from drillrig_pin.statics import Equilibrium

G = 9.81
OIL = (
    '<cylinder name="{name}" from="{start}" to="{end}" bore="{bore}" rod="{rod}" length_retracted="0.5" '
    'dead_length_a="0.05" dead_length_b="0.05" bulk_modulus="1.6e9" precharge="1e6"/>'
)


def boom(extension: str) -> str:
    """A boom of 200 kg, its weight at 1 m from the pin, on a cylinder with its eye at 0.5 m."""
    return robot(
        link("boom", 200.0, (1.0, 0, 0), (1, 60, 60)),
        joint("lift", "revolute", "world", "boom", axis=(0, -1, 0)),
        extension=point("base", "world", (0.5, 0, -0.7))
        + point("eye", "boom", (0.5, 0, 0))
        + OIL.format(name="lift_cyl", start="base", end="eye", bore=0.08, rod=0.05)
        + extension,
    )


def side_by_side(bores: tuple[float, float]) -> str:
    """1000 kg that slides on two upright cylinders of equal length."""
    oil = "".join(
        point(f"a{i}", "world", (i, 0, -0.7))
        + point(f"b{i}", "mass", (i, 0, 0))
        + OIL.format(name=f"c{i}", start=f"a{i}", end=f"b{i}", bore=bore, rod=bore / 2)
        for i, bore in enumerate(bores)
    )
    return robot(link("mass", 1000.0), joint("slide", "prismatic", "world", "mass"), extension=oil)


def at_rest(text: str, **case: object) -> Equilibrium:
    return start_state(load_rig_text(text), Scenario(**case))


@pytest.mark.parametrize("stiffness", [0.0, 0.001, 1.0])
def test_a_spring_of_no_stiffness_to_speak_of_carries_nothing(stiffness: float) -> None:
    spring = f'<joint_spring name="hose" joint="lift" stiffness="{stiffness}" damping="20"/>'
    rest = at_rest(boom(spring))
    # 200 g x 1 m / 0.5 m; the oil's stiffness of about 1e8 N/m at 0.5 m leaves the spring a part of 1e-7 at most.
    assert rest.held["lift_cyl"] == pytest.approx(3924.0, rel=1e-7)
    assert abs(rest.held.get("hose", 0.0)) < 1e-3
    assert rest.at_rest
    assert rest.shared == (("lift_cyl", "hose") if stiffness else ())


def test_two_bores_share_as_their_oil_is_stiff() -> None:
    rest = at_rest(side_by_side((0.100, 0.032)))
    # Oil columns of equal length: stiffness as the bore squared, here 1 / (1 + 0.1024) of 9810 N.
    assert rest.held["c0"] == pytest.approx(9810.0 / (1 + 0.32**2), rel=1e-9)
    assert rest.held["c1"] == pytest.approx(9810.0 - 9810.0 / (1 + 0.32**2), rel=1e-9)
    assert (rest.shared, rest.spread) == (("c0", "c1"), {})


@pytest.mark.parametrize("engine", ["core", "python"])
def test_what_is_shared_is_noted_and_holds_the_machine_still(engine: str) -> None:
    run = simulate(load_rig_text(side_by_side((0.1, 0.05))), Scenario(duration=0.1, engine=engine))
    assert np.abs(run.q).max() < 1e-12
    assert any("statically indeterminate: c0, c1 share their load by stiffness" in note for note in run.notes)


@settings(max_examples=25, deadline=None)
@given(data=st.data(), n=st.integers(2, 6), nv=st.integers(1, 4), unit=st.sampled_from([1.0, 1e-3]))
def test_forces_are_in_balance_of_least_energy_and_of_no_unit_of_length(
    data: st.DataObject, n: int, nv: int, unit: float
) -> None:
    rng = np.random.default_rng(data.draw(st.integers(0, 2**32 - 1)))
    rows, k, needed = rng.standard_normal((n, nv)), 10 ** rng.uniform(-3, 8, n), rng.standard_normal(nv) * 1e3
    J = rng.standard_normal((data.draw(st.integers(0, 1)), nv))
    found = share(rows, k, J, needed)
    if n + len(J) < nv:
        return
    scale = np.abs(needed).max() * np.linalg.cond(np.vstack([rows, J]))
    np.testing.assert_allclose(rows.T @ found.elastic + J.T @ found.rigid, needed, atol=1e-9 * scale)
    # Kept in compatible motion: every element gives way by F / k = row . u, the rigid rows by nothing.
    u = np.linalg.lstsq(
        np.vstack([rows * np.sqrt(k)[:, None], J * 1e6]), np.r_[found.elastic / np.sqrt(k), J @ np.zeros(nv)]
    )[0]
    energy = 0.5 * found.elastic**2 @ (1 / k)
    assert np.linalg.norm(found.elastic / np.sqrt(k) - (rows @ u) * np.sqrt(k)) <= 1e-3 * math.sqrt(2 * energy) + 1e-9
    # The same machine in millimetres: rows and stiffness of lines take another number, forces do not.
    other = share(rows / unit, k * unit**2, J / unit, needed / unit)
    np.testing.assert_allclose(other.elastic, found.elastic, atol=1e-7 * scale)


def test_rigid_rows_that_carry_the_same_are_named_with_their_spread() -> None:
    twice = "".join(
        point(f"p{i}", "world") + point(f"q{i}", "mass") + f'<loop name="l{i}" from="p{i}" to="q{i}" translations="z"/>'
        for i in (0, 1)
    )
    text = robot(link("mass", 10.0), joint("slide", "prismatic", "world", "mass"), extension=twice)
    rest = at_rest(text)
    assert rest.reaction == pytest.approx([10 * G / 2, 10 * G / 2])
    # Each of them may carry all or nothing.
    assert rest.spread["l0.z"] == pytest.approx((0.0, 10 * G), abs=1e-9)
    assert rest.spread["l1.z"] == pytest.approx((0.0, 10 * G), abs=1e-9)
    assert any("reactions of rigid rows at rest are one choice of many" in p.message for p in check_text(text, "m"))


def test_an_element_beside_a_rigid_row_carries_nothing() -> None:
    loop = point("p", "world") + point("q", "mass") + '<loop name="l" from="p" to="q" translations="z"/>'
    spring = '<joint_spring name="s" joint="slide" stiffness="1e5"/>'
    rest = at_rest(robot(link("mass", 10.0), joint("slide", "prismatic", "world", "mass"), extension=loop + spring))
    assert rest.held["s"] == pytest.approx(0.0, abs=1e-9)
    assert rest.reaction == pytest.approx([10 * G])


def test_the_shipped_machine_is_determinate() -> None:
    from drillrig_pin import load_rig

    rest = start_state(load_rig("mkz49"), Scenario())
    assert (rest.shared, rest.spread) == ((), {})


@pytest.mark.parametrize("order", [[0, 1], [1, 0]])
def test_elements_whose_direction_a_rigid_row_spans_leave_all_of_it_to_the_row(order: list[int]) -> None:
    # Gradients one rounding apart: what a projection leaves of them is rounding, too, and must not carry.
    rows = np.array([[0, 0, 0.047744889509533574], [0, 0, 0.047744889509533581]])[order]
    J = np.array([[0, 0, -0.20364499528480623], [-0.115, 0.367, 0.0]])
    shares = share(rows, np.array([300.0, 14739.3])[order], J, np.array([-1.9, 5.9, -27.5]))
    # Rounding of 27.5 N over a lever of 0.05.
    np.testing.assert_allclose(shares.elastic, 0.0, atol=1e-9)
    assert shares.rigid[0] == pytest.approx(27.5 / 0.20364499528480623, rel=1e-9)
