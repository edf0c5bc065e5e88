"""Assembly: the nearest configuration on the constraints, or a sentence that names the row that stays open."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from rigs import double_pendulum, four_bar, point_mass, tree

from drillrig_pin import AssemblyError, Rig, Scenario, load_rig_text, simulate
from drillrig_pin.assembly import Assembly, assemble_state, redundant_rows
from drillrig_pin.kinematics import Array
from drillrig_pin.workspace import Workspace

PRINTED = {"face.y": 0.350, "face.z": 1.710}
FLOATING = tree(
    '<hold name="pin" point="L" axes="x y z" target="0.9 0.4 0.5"/><loop name="tie" from="B" to="R" translations="y"/>'
)


def jacobian(rig: Rig, q: Array) -> tuple[Array, Array]:
    space = Workspace(rig, ())
    space.update(q, np.zeros(rig.model.nv))
    return space.x_constraint.copy(), space.J.copy()


def null_space(J: Array) -> Array:
    _, values, V = np.linalg.svd(J)
    return V[(values > 1e-9 * values[0]).sum() :]


def cases(mkz49: Rig) -> list[tuple[Rig, Array, dict[str, float]]]:
    floating = load_rig_text(FLOATING)
    bars = load_rig_text(four_bar())
    return [
        (mkz49, mkz49.configuration("hole_9"), PRINTED),
        (floating, floating.configuration(None, {"elbow": 0.4, "spin": 1.0}), {}),
        (bars, bars.configuration(None, {"crank_joint": 0.4, "coupler_joint": 0.3, "rocker_joint": 1.2}), {}),
    ]


def assembled(rig: Rig, q0: Array, targets: dict[str, float]) -> Assembly:
    return assemble_state(rig, q0, np.zeros(rig.model.nv), targets)


@pytest.mark.parametrize("case", [0, 1, 2], ids=["rig at the printed tip", "floating tree", "four-bar"])
def test_targets_are_met_with_the_smallest_change(mkz49: Rig, case: int) -> None:
    rig, q0, targets = cases(mkz49)[case]
    result = assembled(rig, q0, targets)
    x, J = jacobian(rig, result.q)
    assert np.abs(x - result.targets).max() < 1e-12
    moved = pin.difference(rig.model, q0, result.q)
    assert np.linalg.norm(moved) > 0.01, "there is something to do"
    # First-order optimality: along no direction that keeps the constraints does the change get smaller. The iteration
    # ends when a step is below 1e-9.
    free = null_space(J)
    if len(free):
        assert np.abs(free @ moved).max() < 1e-7 * np.linalg.norm(moved)
    # And it is a minimum, not a saddle: neighbours on the constraints are farther away.
    for direction in free:
        for step in (-0.05, 0.05):
            near = pin.integrate(rig.model, result.q, step * direction)
            for _ in range(20):
                x, J = jacobian(rig, near)
                near = pin.integrate(rig.model, near, -np.linalg.lstsq(J, x - result.targets, rcond=1e-9)[0])
            change = np.linalg.norm(pin.difference(rig.model, q0, near))
            assert change > np.linalg.norm(moved) - 1e-9


def test_what_moved_is_reported_by_name(mkz49: Rig) -> None:
    q0 = mkz49.configuration("hole_9")
    result = assembled(mkz49, q0, PRINTED)
    assert list(result.moved) == mkz49.dof_names
    np.testing.assert_allclose(list(result.moved.values()), result.q - q0, atol=1e-15)


def test_nothing_moves_where_the_constraints_already_hold(mkz49: Rig) -> None:
    result = assembled(mkz49, mkz49.configuration("hole_9"), {})
    assert set(result.moved.values()) == {0.0}


def test_rows_held_at_their_initial_value_take_it_after_loops_have_closed() -> None:
    rig = load_rig_text(four_bar(extension='<point name="M" link="coupler"/><hold name="stop" point="M" axes="y"/>'))
    result = assembled(
        rig, rig.configuration(None, {"crank_joint": 0.4, "coupler_joint": 0.3, "rocker_joint": 1.2}), {}
    )
    x, _ = jacobian(rig, result.q)
    assert result.targets[2] == x[2] != 0.0


@pytest.mark.parametrize(
    ("extension", "row", "open_by"),
    [
        ('<hold name="far" point="P" axes="x z" target="0 2"/>', "far.z", 2.0 - 0.9),
        (
            '<hold name="one" point="P" axes="x" target="0.5"/><hold name="two" point="P" axes="x" target="0.6"/>',
            "one.x|two.x",
            0.05,
        ),
    ],
    ids=["out of reach", "contradiction"],
)
def test_an_impossible_hold_is_refused_naming_the_row(extension: str, row: str, open_by: float) -> None:
    rig = load_rig_text(double_pendulum(extension))
    with pytest.raises(AssemblyError, match=rf"'({row})' stays .* open") as error:
        assembled(rig, rig.configuration(None, {"shoulder": -0.8, "elbow": 0.5}), {})
    # The gap that is named is the gap that is left at best.
    assert float(str(error.value).split("stays ")[1].split()[0]) == pytest.approx(open_by, rel=0.25)


def test_an_unknown_target_is_refused_with_the_legal_rows(mkz49: Rig) -> None:
    with pytest.raises(AssemblyError, match=r"'face.x'.*face\.y, face\.z"):
        assembled(mkz49, mkz49.configuration("hole_9"), {"face.x": 4.0})


def test_velocity_loses_only_what_violates_the_constraints(mkz49: Rig, rng: np.random.Generator) -> None:
    v0 = rng.uniform(-1, 1, 6)
    result = assemble_state(mkz49, mkz49.configuration("hole_9"), v0)
    _, J = jacobian(mkz49, result.q)
    assert np.abs(J @ result.v).max() < 1e-14 * np.abs(J @ v0).max() + 1e-15
    assert np.abs(null_space(J) @ (result.v - v0)).max() < 1e-14
    assert np.abs(result.v - v0).max() > 0.01


def test_redundant_rows_are_those_that_follow_from_earlier_ones() -> None:
    J = np.array([[1.0, 0, 0], [0, 2.0, 0], [3.0, 4.0, 0], [0, 0, 0], [0, 1e-5, 1e-5]])
    assert redundant_rows(J, list("abcde")) == ("c", "d")


def test_a_row_that_is_tiny_but_independent_is_kept() -> None:
    assert redundant_rows(np.array([[1.0, 0.0], [0.0, 1e-8]]), ["a", "b"]) == ()


def test_two_holds_of_one_point_on_one_axis_are_redundant_and_harmless() -> None:
    holds = '<hold name="one" point="P" axes="z"/><hold name="two" point="P" axes="z"/>'
    rig = load_rig_text(point_mass(2.0, holds))
    run = simulate(rig, Scenario(duration=0.1))
    assert "two.z" in " ".join(run.notes)
    # Least norm: the two share the weight evenly.
    np.testing.assert_allclose(run.reaction, 0.5 * 2.0 * 9.81, rtol=1e-12)
    np.testing.assert_allclose(run.q, 0.0, atol=1e-13)


def test_a_hold_may_be_given_its_place_by_file_or_by_scenario() -> None:
    by_file = load_rig_text(double_pendulum('<hold name="face" point="P" axes="z" target="-0.3"/>'))
    by_case = load_rig_text(double_pendulum('<hold name="face" point="P" axes="z"/>'))
    start = {"shoulder": 0.6, "elbow": 0.3}
    a = assembled(by_file, by_file.configuration(None, start), {})
    b = assembled(by_case, by_case.configuration(None, start), {"face.z": -0.3})
    np.testing.assert_allclose(a.q, b.q, atol=1e-14)
