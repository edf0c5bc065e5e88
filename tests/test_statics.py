"""Static equilibrium: forces against closed forms of levers, and machines that then really stay at rest."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from rigs import CYLINDER, double_pendulum, four_bar, joint, link, pendulum, point, point_mass, robot

from drillrig_pin import Rig, Scenario, load_rig_text, simulate
from drillrig_pin.elements.cylinder import Cylinder
from drillrig_pin.simulation import start_state
from drillrig_pin.statics import Equilibrium

G = 9.81


def lever(extension: str = "", mass: float = 120.0, length: float = 2.0) -> str:
    """A level beam on a hinge at the origin, on a cylinder from the post (0, 0, -0.6) to 0.25 m along the beam."""
    return robot(
        link("beam", mass, (length / 2, 0, 0), (0.1, mass * length**2 / 12, mass * length**2 / 12)),
        joint("hinge", "revolute", "world", "beam", axis=(0, -1, 0)),
        extension=point("pin_a", "world", (0.0, 0.0, -0.6))
        + point("pin_b", "beam", (0.25, 0, 0))
        + CYLINDER.format('precharge="2e6"')
        + extension,
    )


def equilibrium(text: str, **case: object) -> Equilibrium:
    return start_state(load_rig_text(text), Scenario(**case))


def test_a_beam_on_one_cylinder_is_carried_by_the_law_of_the_lever() -> None:
    result = equilibrium(lever())
    L = np.hypot(0.25, 0.6)
    # Distance of the hinge from the cylinder's line: area of the triangle over its base.
    arm = 0.25 * 0.6 / L
    assert result.x0["oil"] == pytest.approx(L, rel=1e-15)
    assert result.held["oil"] == pytest.approx(120.0 * G * 1.0 / arm, rel=1e-13)
    S_A, S_B = np.pi * 0.063**2 / 4, np.pi * (0.063**2 - 0.030**2) / 4
    p_A, p_B = result.pressures["oil"]
    assert p_B == 2e6, "the less loaded chamber holds the precharge"
    assert p_A == pytest.approx((result.held["oil"] + 2e6 * S_B) / S_A, rel=1e-14)
    assert result.at_rest


def test_the_beam_then_stays_at_rest() -> None:
    run = simulate(load_rig_text(lever()), Scenario(duration=2.0, output_rate=100))
    assert np.abs(run.q).max() < 1e-12
    np.testing.assert_allclose(run.pressure_b, 2e6, rtol=1e-9)


def test_two_cylinders_on_one_joint_share_by_stiffness() -> None:
    second = (
        point("pin_c", "world", (0.1, 0.0, -0.6))
        + point("pin_d", "beam", (0.4, 0, 0))
        + CYLINDER.format("").replace('"oil"', '"second"').replace("pin_a", "pin_c").replace("pin_b", "pin_d")
    )
    result = equilibrium(lever(second))
    arms = np.array([0.25 * 0.6 / np.hypot(0.25, 0.6), 0.4 * 0.6 / np.hypot(0.3, 0.6)])

    # Locked while loaded, the beam sinks by phi and each cylinder gives way by arm phi: F = k arm phi, sum(arm F) = M.
    # Both are of one kind; lengths 0.65 m and sqrt(0.3^2 + 0.6^2) tell their oil columns.
    def stiffness(length: float) -> float:
        piston, rod, l_A = np.pi * 0.063**2 / 4, np.pi * 0.030**2 / 4, length - 0.472
        return 2.85e9 * (piston / l_A + (piston - rod) / (0.372 - l_A))

    pulled = arms * [stiffness(np.hypot(0.25, 0.6)), stiffness(np.hypot(0.3, 0.6))]
    expected = 120.0 * G * pulled / (arms @ pulled)
    np.testing.assert_allclose([result.held["oil"], result.held["second"]], expected, rtol=1e-12)


def test_what_nothing_carries_is_reported_per_dof() -> None:
    result = equilibrium(double_pendulum('<joint_spring name="s" joint="elbow" stiffness="10"/>'))
    # Level bars: the elbow's moment is held by its spring, the shoulder's by nothing.
    assert result.held["s"] == pytest.approx(-1.0 * G * 0.2, rel=1e-13)
    np.testing.assert_allclose(result.unbalanced, [-(2.0 * 0.25 + 1.0 * 0.7) * G, 0.0], atol=1e-13)
    assert not result.at_rest
    run = simulate(load_rig_text(double_pendulum()), Scenario(duration=0.01))
    assert any("does not rest" in note for note in run.notes)


def test_forces_of_the_rig_satisfy_virtual_work(mkz49: Rig, hole_9: Equilibrium) -> None:
    # Independent of every row and Jacobian: lengths and heights alone, by finite differences.
    model, data = mkz49.model, mkz49.model.createData()
    q, h = hole_9.assembly.q, 1e-6
    anchors = {c.name: (mkz49.point(c.start), mkz49.point(c.end)) for c in mkz49.forces if isinstance(c, Cylinder)}
    tip = mkz49.point("E")
    rock = next(e for e in mkz49.forces if e.tag == "contact")

    def place(anchor):
        return data.oMi[anchor.joint].act(np.array(anchor.vector))

    def virtual(q: np.ndarray) -> float:
        pin.forwardKinematics(model, data, q)
        work = -pin.computePotentialEnergy(model, data, q)
        for name, (start, end) in anchors.items():
            work += hole_9.held[name] * float(np.linalg.norm(place(end) - place(start)))
        return work + hole_9.held["head_coupling"] * q[3] - rock.preload * place(tip)[0]

    for k in range(6):
        step = np.zeros(6)
        step[k] = h
        slope = (virtual(q + step) - virtual(q - step)) / (2 * h)
        # Energies of 1e5 J differ by 1e-11 in rounding; over 2e-6 that is 1e-5 N m of moments of 1e4 N m.
        assert abs(slope) < 1e-3, mkz49.joints[k]
    np.testing.assert_array_equal(hole_9.reaction, 0.0)
    assert hole_9.at_rest


def test_a_hold_carries_nothing_while_the_machine_carries_itself() -> None:
    held = equilibrium(lever(point("tip", "beam", (2, 0, 0)) + '<hold name="face" point="tip" axes="z"/>'))
    free = equilibrium(lever())
    assert held.held["oil"] == pytest.approx(free.held["oil"], rel=1e-14)
    np.testing.assert_array_equal(held.reaction, 0.0)


def test_a_hold_carries_what_nothing_else_can() -> None:
    result = equilibrium(pendulum(0.7, 3.0, '<hold name="support" point="P" axes="z"/>'))
    assert result.reaction[0] == pytest.approx(3.0 * G / 2, rel=1e-13)
    assert result.at_rest


def test_a_loop_takes_part_in_equilibrium() -> None:
    spring = '<joint_spring name="s" joint="crank_joint" stiffness="100"/>'
    start = {"crank_joint": 0.4, "coupler_joint": 0.3, "rocker_joint": 1.2}
    rig = load_rig_text(four_bar(extension=spring))
    result = start_state(rig, Scenario(positions=start))
    assert result.at_rest
    assert np.abs(result.reaction).min() > 0.1
    # One dof: the held moment is the derivative of the potential along the motion the loop allows.
    run = simulate(rig, Scenario(positions=start, duration=0.5, output_rate=100))
    assert np.abs(run.q - run.q[0]).max() < 1e-11


@pytest.mark.parametrize(
    ("extension", "force"),
    [
        ('<joint_spring name="e" joint="z" stiffness="400"/>', 2.0 * G),
        (
            '<joint_torque name="motor" joint="z" value="5"/><joint_spring name="e" joint="z" stiffness="400"/>',
            2.0 * G - 5,
        ),
        (
            '<contact name="c" point="P" axis="0 0 -1" stiffness="1e4" preload="30"/>'
            '<joint_spring name="e" joint="z" stiffness="400"/>',
            2.0 * G - 30,
        ),
        (
            '<joint_spring name="relaxed" joint="z" stiffness="100" rest="0.1"/>'
            '<joint_spring name="e" joint="z" stiffness="400"/>',
            2.0 * G - 10,
        ),
    ],
    ids=["alone", "with a motor", "with a pressed contact", "with a spring of its own length"],
)
def test_forces_of_their_own_are_part_of_the_balance(extension: str, force: float) -> None:
    rail = '<hold name="rail" point="P" axes="x y"/>'
    rig = load_rig_text(point_mass(2.0, extension + rail))
    assert start_state(rig, Scenario()).held["e"] == pytest.approx(force, rel=1e-13)
    run = simulate(rig, Scenario(duration=0.5, output_rate=100))
    assert np.abs(run.q).max() < 1e-12


def test_loads_do_not_preload_the_machine() -> None:
    load = '<load name="l" kind="force" point="pin_b" axis="0 0 1" frame="world"><constant value="500"/></load>'
    assert equilibrium(lever(load)).held == equilibrium(lever()).held
