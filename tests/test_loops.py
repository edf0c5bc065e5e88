"""Closed loops with redundant rows, hinges and welds: named, solved in the least norm, and physically right."""

from __future__ import annotations

import numpy as np
import pytest
from rigs import bennett, floating_body, four_bar, joint, link, point, robot

from drillrig_pin import Rig, Scenario, load_rig_text, simulate
from drillrig_pin.dynamics import Dynamics
from drillrig_pin.simulation import prepare

TIGHT = {"integrator.rtol": 1e-11, "integrator.atol": 1e-12}
START = {"crank_joint": 0.4, "coupler_joint": 0.3, "rocker_joint": 1.2}
SPIN = {"crank_joint": 8.0}
BENNETT = {"j1": 1.0, "j2": 2.0, "j3": -1.0}


def four_bar_case(closure: str, duration: float = 0.5) -> tuple[Rig, Scenario]:
    return load_rig_text(four_bar(closure=closure)), Scenario(
        duration=duration, positions=START, velocities=SPIN
    ).changed(TIGHT)


@pytest.mark.parametrize(
    ("closure", "redundant"),
    [
        ('translations="x y"', ()),
        ('translations="x y z"', ("closure.z",)),
        ('translations="x y z" rotations="x y"', ("closure.z", "closure.rx", "closure.ry")),
    ],
)
def test_rows_that_follow_from_the_others_are_named(closure: str, redundant: tuple[str, ...]) -> None:
    rig, case = four_bar_case(closure)
    run = simulate(rig, case.changed({"duration": 0.01}))
    assert prepare(rig, case).equilibrium.assembly.redundant == redundant
    named = [note for note in run.notes if note.startswith("redundant")]
    assert len(named) == bool(redundant)
    assert all(row in named[0] for row in redundant)


@pytest.mark.parametrize("formulation", ["multipliers", "null_space"])
@pytest.mark.parametrize("closure", ['translations="x y z"', 'translations="x y z" rotations="x y"'])
def test_redundant_rows_change_no_acceleration_and_carry_nothing(closure: str, formulation: str) -> None:
    (rig, case), (plain, _) = four_bar_case(closure), four_bar_case('translations="x y"')
    with_rows = simulate(rig, case.changed({"formulation": formulation}))
    without = simulate(plain, case)
    # Same motion through other sums: both are integrated to 1e-11 over half a second at 60 rad/s^2.
    np.testing.assert_allclose(with_rows.q, without.q, atol=1e-9)
    np.testing.assert_allclose(with_rows.a, without.a, atol=1e-8 * np.abs(without.a).max())
    np.testing.assert_allclose(with_rows.reaction[:, :2], without.reaction, atol=1e-8 * np.abs(without.reaction).max())
    # A planar machine puts no load across its plane, and the least norm says so.
    assert np.abs(with_rows.reaction[:, 2:]).max() < 1e-8 * np.abs(without.reaction).max()


def test_at_one_state_redundant_rows_give_the_same_acceleration_to_rounding() -> None:
    accelerations = []
    for closure in ('translations="x y"', 'translations="x y z"'):
        rig, case = four_bar_case(closure)
        dynamics = prepare(rig, case)
        dynamics.rate(0.0, dynamics.initial())
        accelerations.append(dynamics.a)
    np.testing.assert_allclose(accelerations[0], accelerations[1], rtol=1e-11)


def test_bennett_linkage_is_assembled_as_its_closed_form_says() -> None:
    alpha, beta = 0.6, 1.1
    assembly = prepare(load_rig_text(bennett(alpha=alpha, beta=beta)), Scenario(positions=BENNETT)).equilibrium.assembly
    q = assembly.q
    assert q[2] == pytest.approx(-q[0], abs=1e-12)
    ratio = np.sin((beta + alpha) / 2) / np.sin((beta - alpha) / 2)
    assert np.tan(q[0] / 2) * np.tan(q[1] / 2) == pytest.approx(ratio, rel=1e-11)
    assert len(assembly.redundant) == 3, "five rows on three dofs leave one free: three of them are redundant"


@pytest.mark.parametrize("formulation", ["multipliers", "null_space"])
def test_bennett_linkage_moves_on_its_closed_form_though_it_is_overconstrained(formulation: str) -> None:
    alpha, beta = 0.6, 1.1
    rig = load_rig_text(bennett(alpha=alpha, beta=beta))
    case = Scenario(duration=0.6, positions=BENNETT, velocities={"j1": 2.0}, formulation=formulation)
    run = simulate(rig, case.changed(TIGHT))
    assert run.outcome.completed, run.outcome
    q = run.q
    assert np.ptp(q[:, 0]) > 0.3
    ratio = np.sin((beta + alpha) / 2) / np.sin((beta - alpha) / 2)
    # tan(q1/2) tan(q2/2) = ratio, written without poles.
    residual = np.sin(q[:, 0] / 2) * np.sin(q[:, 1] / 2) - ratio * np.cos(q[:, 0] / 2) * np.cos(q[:, 1] / 2)
    assert np.abs(residual).max() < 1e-11
    assert np.abs(run.energy_residual).max() < 1e-8 * np.ptp(run.energy_potential)
    assert np.abs(run.constraint_error).max() < 1e-12


HINGED = point("pivot", "world", (0.1, 0.2, -0.3), (0.3, 0.5, 0.0))
AXES = point("axle", "body", (0.1, 0.2, -0.3), (0.3, 0.5, 0.0))


def test_a_floating_body_closed_with_three_and_two_rows_swings_as_on_a_hinge() -> None:
    loop = '<loop name="hinge" from="pivot" to="axle" translations="x y z" rotations="x y"/>'
    # The same body on a revolute joint about the z axis of the pivot.
    hinged = load_rig_text(
        robot(
            link("arm", 1e-9, inertia=(0.0, 0.0, 0.0)),
            joint("hinge", "revolute", "world", "arm", (0.1, 0.2, -0.3), (0, 0, 1), (0.3, 0.5, 0.0)),
            _body_on_arm(),
            extension=point("P", "body", (0.1, 0.2, -0.3)) + point("Q", "body", (0.4, -0.3, 0.2)),
        )
    )
    free = load_rig_text(floating_body(HINGED + AXES + loop + point("Q", "body", (0.4, -0.3, 0.2))))
    case = Scenario(duration=1.0).changed(TIGHT)
    a, b = simulate(free, case), simulate(hinged, case)
    assert np.ptp(a.of("point_position", "Q", "x")) > 0.05, "it must swing"
    for axis in "xyz":
        # Twelve dofs of rounding and a massless arm of 1e-9 kg.
        np.testing.assert_allclose(a.of("point_position", "Q", axis), b.of("point_position", "Q", axis), atol=3e-8)
    assert np.abs(a.constraint_error).max() < 1e-12


def _body_on_arm() -> str:
    """The floating body of `rigs`, fixed to the arm so that both frames start as in the free case."""
    import pinocchio as pin

    placement = pin.SE3(pin.rpy.rpyToMatrix(0.3, 0.5, 0.0), np.array([0.1, 0.2, -0.3])).inverse()
    xyz, rpy = placement.translation.tolist(), pin.rpy.matrixToRpy(placement.rotation).tolist()
    return link("body", 4.0, (0.05, -0.02, 0.03), (0.10, 0.17, 0.23)) + joint(
        "weld", "fixed", "arm", "body", xyz, rpy=rpy
    )


def _at_rest(text: str) -> Dynamics:
    dynamics = prepare(load_rig_text(text), Scenario())
    dynamics.rate(0.0, dynamics.initial())
    return dynamics


def test_a_weld_of_six_rows_carries_force_and_moment_of_a_cantilever() -> None:
    loop = '<loop name="weld" from="wall" to="P" translations="x y z" rotations="x y z"/>'
    dynamics = _at_rest(floating_body(point("wall", "world", (0.1, 0.2, -0.3)) + loop))
    weight, lever = np.array([0, 0, -4.0 * 9.81]), np.array([0.05, -0.02, 0.03]) - np.array([0.1, 0.2, -0.3])
    # Force and moment of the wall on the body balance the weight at its centre of mass.
    expected = np.concatenate([-weight, -np.cross(lever, weight)])
    assert [row.name for row in dynamics.rig.rows] == [f"weld.{r}" for r in ("x", "y", "z", "rx", "ry", "rz")]
    np.testing.assert_allclose(dynamics.multipliers, expected, atol=1e-10 * 40)
    np.testing.assert_allclose(dynamics.a, 0, atol=1e-11)


@pytest.mark.parametrize(("free", "closed"), [("z", "x y"), ("x", "y z"), ("y", "x z")])
def test_a_hinge_carries_the_moments_across_its_axis(free: str, closed: str) -> None:
    # A body at rest on a hinge along any axis: its weight, off the hinge, tilts the bearing but does not turn it.
    axis = "xyz".index(free)
    com, place = np.array([0.05, -0.02, 0.03]), np.array([0.2, 0.3, -0.1])
    # The hinge axis passes so that the weight has no moment about it.
    if free != "z":
        place[1 if free == "x" else 0] = com[1 if free == "x" else 0]
    loop = f'<loop name="hinge" from="wall" to="pin" translations="x y z" rotations="{closed}"/>'
    text = floating_body(point("wall", "world", place.tolist()) + point("pin", "body", place.tolist()) + loop)
    dynamics = _at_rest(text)
    weight = np.array([0, 0, -4.0 * 9.81])
    moment = -np.cross(com - place, weight)
    expected = np.concatenate([-weight, np.delete(moment, axis)])
    np.testing.assert_allclose(dynamics.multipliers, expected, atol=1e-10 * 40)
    np.testing.assert_allclose(dynamics.a, 0, atol=1e-10)


def test_a_welded_body_stays_where_it_is() -> None:
    loop = '<loop name="weld" from="wall" to="P" translations="x y z" rotations="x y z"/>'
    rig = load_rig_text(floating_body(point("wall", "world", (0.1, 0.2, -0.3)) + loop))
    run = simulate(rig, Scenario(duration=0.5, output_rate=100))
    assert np.abs(run.point_displacement).max() < 1e-12
    assert np.abs(run.constraint_error).max() < 1e-14


@pytest.mark.parametrize(
    ("attributes", "fault"),
    [
        ("", "neither translations nor rotations"),
        ('rotations="x"', "a single rotation axis"),
        ('translations="x x"', "twice"),
    ],
)
def test_loops_that_are_no_joint_are_refused(attributes: str, fault: str) -> None:
    from drillrig_pin import ModelError

    with pytest.raises(ModelError, match=fault):
        load_rig_text(four_bar(closure=attributes))
