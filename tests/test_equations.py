"""The equations of motion against what each of their terms means, on a machine with every kind of row and force."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from numpy.testing import assert_allclose
from rigs import bennett, double_pendulum, floating_body, four_bar, point, tree

from drillrig_pin import Rig, Scenario, SingularConfigurationError, load_rig_text
from drillrig_pin.constraints import Hold, Loop
from drillrig_pin.dynamics import (
    Dynamics,
    Equations,
    ForceGroup,
    solve_damped,
    solve_least_norm,
    solve_multipliers,
    solve_null_space,
)
from drillrig_pin.kinematics import Array
from drillrig_pin.simulation import prepare
from drillrig_pin.stabilization import Baumgarte, NoCorrection
from drillrig_pin.workspace import Workspace

BUSY = (
    '<hold name="pin" point="B" axes="z x"/>'
    '<loop name="ring" from="R" to="L" translations="x y"/>'
    '<spring name="tie" from="O" to="L" stiffness="500" damping="3"/>'
    '<load name="push" kind="force" point="R" axis="0 0 1" frame="world"><constant value="40" ramp="0.5"/></load>'
    '<joint_spring name="soft" joint="elbow" stiffness="20" damping="2"/>'
    '<contact name="rock" point="R" axis="0 1 0" stiffness="100" damping="9" preload="4" mode="unilateral"/>'
    '<load name="twist" kind="torque" point="L" axis="1 0 0"><harmonics mean="2" ramp="0.25"/></load>'
    '<spring name="rope" from="B" to="O" stiffness="70" damping="1"/>'
)
H = 1e-6


@pytest.fixture
def busy() -> Dynamics:
    """A tree with two holds, a loop, springs, a contact and loads, stabilised."""
    case = Scenario(positions={"elbow": 0.2, "spin": -0.3}, stabilization={"alpha": 3.0, "beta": 5.0})
    return prepare(load_rig_text(tree(BUSY)), case)


@pytest.fixture
def state(busy: Dynamics, rng: np.random.Generator) -> tuple[Array, Array]:
    """A state off the constraints, in motion."""
    model = busy.rig.model
    q = pin.integrate(model, busy.equilibrium.assembly.q, 0.05 * rng.uniform(-1, 1, model.nv))
    return q, rng.uniform(-1, 1, model.nv)


def test_every_term_of_the_equations_is_what_it_says(busy: Dynamics, state: tuple[Array, Array]) -> None:
    q, v = state
    model, data = busy.rig.model, busy.rig.model.createData()
    equations = busy.assemble(0.3, q, v)
    M = pin.crba(model, data, q)
    assert_allclose(equations.M, np.triu(M) + np.triu(M, 1).T, rtol=1e-12, atol=1e-12)
    fresh = Workspace(busy.rig, busy.forces)

    def residual(q: Array) -> Array:
        fresh.update(q, np.zeros(model.nv))
        return fresh.x_constraint - busy.targets

    f = residual(q)
    assert np.abs(f).max() > 1e-3
    assert_allclose(equations.f, f, rtol=1e-12, atol=1e-12)
    ahead, behind = residual(pin.integrate(model, q, H * v)), residual(pin.integrate(model, q, -H * v))
    assert_allclose(equations.f_dot, (ahead - behind) / (2 * H), atol=1e-8)
    # With J a = p2 the second derivative of f is the correction.
    a = np.linalg.lstsq(equations.J, equations.p2, rcond=None)[0]
    h = 1e-4
    second = (
        residual(pin.integrate(model, q, h * v + h * h / 2 * a))
        - 2 * f
        + residual(pin.integrate(model, q, -h * v + h * h / 2 * a))
    ) / h**2
    assert_allclose(second, -6 * equations.f_dot - 25 * f, atol=1e-5)
    # Power of all forces: those of the elements, less gravity and inertia.
    powers = float(busy.F @ busy.x_dot) - float(pin.nonLinearEffects(model, data, q, v) @ v)
    assert equations.p1 @ v == pytest.approx(powers, rel=1e-12)


def test_forces_are_those_of_the_laws_one_by_one(busy: Dynamics, state: tuple[Array, Array]) -> None:
    q, v = state
    busy.evaluate_forces(0.3, q, v)
    supplied = lost = 0.0
    for i, (element, law) in enumerate(zip(busy.forces, busy.laws, strict=True)):
        j = int(busy.space.index[i])
        x, x_dot = busy.x[j : j + 1], busy.space.rows[j : j + 1] @ v
        assert busy.x_dot[j] == pytest.approx(float(x_dot[0]), rel=1e-13)
        F = float(np.ravel(law.force(x, x_dot, 0.3))[0])
        assert busy.F[j] == pytest.approx(F, rel=1e-12), element.name
        if element.load:
            supplied += F * float(x_dot[0])
        else:
            lost += float(np.ravel(law.dissipation(x, x_dot))[0])
    assert busy.powers() == pytest.approx((supplied, lost), rel=1e-12)
    assert supplied != 0.0
    assert lost > 0.0


def test_loads_that_do_not_act_are_left_out() -> None:
    rig = load_rig_text(tree(BUSY))
    for loads, names in (("all", {"push", "twist"}), ("none", set()), (["twist"], {"twist"})):
        dynamics = prepare(rig, Scenario(loads=loads))
        assert {e.name for e in dynamics.forces if e.load} == names
        assert {e.name for e in dynamics.forces if not e.load} == {"tie", "soft", "rock", "rope"}


def test_a_workspace_is_taken_over_only_if_it_has_the_forces_that_act() -> None:
    rig = load_rig_text(tree(BUSY))
    equilibrium = prepare(rig, Scenario()).equilibrium
    every, few = Workspace(rig, rig.forces), Workspace(rig, rig.forces[:2])
    assert Dynamics(rig, equilibrium, space=every).space is every
    assert Dynamics(rig, equilibrium, space=few).space is not few
    assert Dynamics(rig, equilibrium).space.forces == rig.forces
    assert isinstance(Dynamics(rig, equilibrium).correction, NoCorrection)
    assert Dynamics(rig, equilibrium).formulation == "multipliers"


def test_a_group_takes_a_slice_where_its_members_stand_side_by_side(busy: Dynamics) -> None:
    law = next(law for law in busy.laws if law.stackable)
    where = np.array([4, 2, 3, 0])
    assert ForceGroup([1, 2], [law, law], where, True).where == slice(2, 4)
    assert ForceGroup([3], [law], where, False).where == slice(0, 1)
    assert ForceGroup([0, 1], [law, law], where, False).where.tolist() == [4, 2]
    assert ForceGroup([2, 1], [law, law], where, False).where.tolist() == [3, 2]
    group = ForceGroup([1, 2], [law, law], where, True)
    assert (group.load, group.members) == (True, [1, 2])
    members = [name for g in busy.groups for name in (busy.forces[i].name for i in g.members)]
    assert sorted(members) == sorted(e.name for e in busy.forces)
    assert {g.load for g in busy.groups} == {True, False}
    assert sorted(len(g.members) for g in busy.groups) == [1, 2, 3], "loads; contact; springs of both kinds"


def test_the_integrated_vector_is_state_and_work(busy: Dynamics, state: tuple[Array, Array]) -> None:
    q, v = state
    model = busy.rig.model
    y = np.concatenate([q, v, [7.0, 8.0]])
    rate = busy.rate(0.3, y)
    assert busy.size == len(y) == len(rate) == model.nq + model.nv + 2
    assert_allclose(busy.initial(), np.concatenate([*_started(busy), [0.0, 0.0]]))
    h = 1e-7
    ahead, behind = pin.integrate(model, q, h * v), pin.integrate(model, q, -h * v)
    assert_allclose(rate[: model.nq], (ahead - behind) / (2 * h), atol=1e-7)
    a = rate[model.nq : -2]
    equations = busy.equations
    assert_allclose(equations.M @ a, equations.p1 + equations.J.T @ busy.multipliers, rtol=1e-9, atol=1e-9)
    assert_allclose(equations.J @ a, equations.p2, atol=1e-9)
    assert_allclose(busy.a, a)
    assert tuple(rate[-2:]) == pytest.approx(busy.powers())


def _started(dynamics: Dynamics) -> tuple[Array, Array]:
    assembly = dynamics.equilibrium.assembly
    return assembly.q, assembly.v


def test_a_vector_without_turning_joints_changes_at_its_velocities() -> None:
    dynamics = prepare(load_rig_text(double_pendulum()), Scenario(velocities={"shoulder": 2.0, "elbow": -3.0}))
    assert dynamics.rate(0.0, dynamics.initial())[:2].tolist() == [2.0, -3.0]


def test_projection_ends_on_the_constraints_and_changes_velocities_the_least(
    busy: Dynamics, state: tuple[Array, Array]
) -> None:
    q, v = state
    model = busy.rig.model
    y = np.concatenate([q, v, [7.0, 8.0]])
    y[3:7] *= 1.1  # the quaternion of the floating base, no longer of length one
    kept = y.copy()
    once = busy.project(y)
    assert_allclose(y, kept)
    done = once
    for _ in range(3):
        done = busy.project(done)
    equations = busy.assemble(0.0, done[: model.nq], done[model.nq : -2])
    assert np.abs(equations.f).max() < 1e-13
    assert np.abs(equations.f_dot).max() < 1e-13
    assert np.linalg.norm(done[3:7]) == pytest.approx(1.0, abs=1e-14)
    assert done[-2:].tolist() == [7.0, 8.0]
    # Two steps of Newton: what is off by 1e-3 ends nearer than the 1e-7 that one step leaves.
    near = done.copy()
    near[: model.nq] = pin.integrate(model, done[: model.nq], 1e-3 * np.linspace(-1, 1, model.nv))
    near = busy.project(near)
    assert np.abs(busy.assemble(0.0, near[: model.nq], near[model.nq : -2]).f).max() < 1e-10
    # From a state on the constraints the change of v lies along M^-1 J^T: least in the metric of the mass.
    moved = done.copy()
    moved[model.nq : -2] += np.linspace(-1, 1, model.nv)
    back = busy.project(moved)
    equations = busy.assemble(0.0, done[: model.nq], done[model.nq : -2])
    change = equations.M @ (back - moved)[model.nq : -2]
    assert np.abs(change).max() > 0.1
    fit = np.linalg.lstsq(equations.J.T, change, rcond=None)[0]
    assert_allclose(equations.J.T @ fit, change, atol=1e-10)


def test_projection_without_constraints_only_makes_quaternions_unit() -> None:
    dynamics = prepare(load_rig_text(floating_body()), Scenario())
    y = dynamics.initial() + 0.1
    done = dynamics.project(y)
    assert_allclose(done[3:7], y[3:7] / np.linalg.norm(y[3:7]))
    assert_allclose(np.delete(done, range(3, 7)), np.delete(y, range(3, 7)))


def test_switches_and_breakpoints_are_those_of_the_laws(busy: Dynamics, state: tuple[Array, Array]) -> None:
    q, v = state
    y = np.concatenate([q, v, [0.0, 0.0]])
    busy.evaluate_forces(0.0, q, v)
    i = [e.name for e in busy.forces].index("rock")
    j = int(busy.space.index[i])
    expected = busy.laws[i].switches(busy.x[j : j + 1], busy.x_dot[j : j + 1])
    busy.space.update(busy.equilibrium.assembly.q, 0 * v)
    assert_allclose(busy.switches(y), expected, rtol=1e-12)
    assert busy.switching
    assert busy.breakpoints().tolist() == [0.0, 0.25, 0.5] or busy.breakpoints().tolist() == [0.25, 0.5]
    smooth = prepare(load_rig_text(double_pendulum()), Scenario())
    assert not smooth.switching
    assert smooth.switches(smooth.initial()).shape == (0,)
    assert smooth.breakpoints().shape == (0,)


def random_equations(rng: np.random.Generator, n: int, m: int) -> Equations:
    A = rng.uniform(-1, 1, (n, n))
    J = rng.uniform(-1, 1, (m, n))
    p1, p2 = rng.uniform(-1, 1, n), rng.uniform(-1, 1, m)
    return Equations(A @ A.T + n * np.eye(n), p1, J, p2, np.zeros(m), np.zeros(m))


def least_norm(equations: Equations, rank: int) -> tuple[Array, Array]:
    return solve_least_norm(equations, rank)


@pytest.mark.parametrize("m", [0, 1, 3])
@pytest.mark.parametrize("solve", [solve_multipliers, solve_null_space], ids=["multipliers", "null space"])
def test_both_solutions_fulfil_the_equations(solve: Any, m: int, rng: np.random.Generator) -> None:
    equations = random_equations(rng, 5, m)
    a, multipliers = solve(equations)
    assert a.shape == (5,)
    assert multipliers.shape == (m,)
    assert_allclose(equations.M @ a, equations.p1 + equations.J.T @ multipliers, atol=1e-12)
    assert_allclose(equations.J @ a, equations.p2, atol=1e-12)


def test_a_used_workspace_changes_nothing(rng: np.random.Generator) -> None:
    work = np.full((8, 8), 7.0, order="F")
    for _ in range(2):
        equations = random_equations(rng, 5, 3)
        for one, other in zip(solve_multipliers(equations, work), solve_multipliers(equations), strict=True):
            assert_allclose(one, other, rtol=1e-12)


def test_redundant_rows_share_their_reaction_with_least_norm(rng: np.random.Generator) -> None:
    equations = random_equations(rng, 5, 2)
    twice = Equations(
        equations.M,
        equations.p1,
        np.vstack([equations.J, equations.J[0]]),
        np.append(equations.p2, equations.p2[0]),
        np.zeros(3),
        np.zeros(3),
    )
    a, multipliers = solve_multipliers(equations)
    for solve in (solve_least_norm, solve_null_space):
        b, shared = solve(twice, 2)
        assert_allclose(b, a, atol=1e-12)
        assert_allclose(shared, [multipliers[0] / 2, multipliers[1], multipliers[0] / 2], atol=1e-12)
    with pytest.raises(SingularConfigurationError, match="the constraints have lost rank at this configuration"):
        solve_multipliers(Equations(twice.M, twice.p1, 0 * twice.J, twice.p2, twice.f, twice.f_dot))


@pytest.mark.parametrize(
    ("text", "formulation", "positions", "chosen"),
    [
        (bennett(), "null_space", {"j1": 1.0, "j2": 2.0, "j3": -1.0}, solve_null_space),
        (bennett(), "multipliers", {"j1": 1.0, "j2": 2.0, "j3": -1.0}, solve_least_norm),
        (tree(BUSY), "null_space", {}, solve_null_space),
    ],
    ids=["redundant, null space", "redundant, multipliers", "null space"],
)
def test_the_formulation_chosen_solves(text: str, formulation: Any, positions: Any, chosen: Any) -> None:
    dynamics = prepare(load_rig_text(text), Scenario(formulation=formulation, positions=positions))
    q, v = _started(dynamics)
    assert dynamics.redundant == ("bennett" in text or "last" in text)
    equations = dynamics.assemble(0.1, q, v)
    for mine, its in zip(dynamics.solve(equations), chosen(equations, dynamics.rank), strict=True):
        assert mine.tolist() == its.tolist()


def test_projection_of_a_redundant_machine() -> None:
    dynamics = prepare(load_rig_text(bennett()), Scenario(positions={"j1": 1.0, "j2": 2.0, "j3": -1.0}))
    y = dynamics.initial()
    y[:6] += 1e-3
    y = dynamics.project(y)
    equations = dynamics.assemble(0.0, y[:3], y[3:6])
    assert np.abs(equations.f).max() < 1e-8
    assert np.abs(equations.f_dot).max() < 1e-12


def rows_of(extension: str, text: Any = floating_body) -> tuple[Rig, Array]:
    """The rows of a machine and their Jacobian at the start."""
    rig = load_rig_text(text(extension))
    space = Workspace(rig, ())
    space.update(rig.configuration(), np.zeros(rig.model.nv))
    return rig, space.J.copy()


def test_a_hold_keeps_a_point_on_world_axes_in_the_order_given() -> None:
    rig, J = rows_of('<hold name="h" point="C" axes="z x" target="0.5 -0.25"/>' + point("C", "body"))
    assert [(r.name, r.target, r.unit, r.loop) for r in rig.rows] == [
        ("h.z", 0.5, "m", False),
        ("h.x", -0.25, "m", False),
    ]
    assert_allclose(J, [[0, 0, 1, 0, 0, 0], [1, 0, 0, 0, 0, 0]], atol=1e-15)
    assert [row.target for row in rows_of('<hold name="h" point="P" axes="x y"/>')[0].rows] == [None, None]


FRAMES = point("O", "world") + point("C", "body")


@pytest.mark.parametrize("axes", ["x y z", "x y", "y z", "z x", "y x"])
def test_the_rotations_of_a_loop_grow_with_positive_turns_about_their_axes(axes: str) -> None:
    loop = f'<loop name="l" from="O" to="C" translations="y x" rotations="{axes}"/>'
    rig, J = rows_of(FRAMES + loop)
    names = [f"l.{axis}" for axis in "yx"] + [f"l.r{axis}" for axis in axes.split()]
    assert [row.name for row in rig.rows] == names
    assert [row.unit for row in rig.rows] == ["m", "m", *["1"] * (len(names) - 2)]
    assert all(row.loop and row.target == 0.0 for row in rig.rows)
    dofs = [1, 0, *(3 + "xyz".index(axis) for axis in axes.split())]
    expected = np.zeros((len(names), 6))
    expected[range(len(names)), dofs] = 1.0
    assert_allclose(J, expected, atol=1e-15)


def test_a_hinge_lets_its_third_axis_turn_all_the_way() -> None:
    """With two rotations closed the residual stays zero however far the third one turns."""
    for axes, free in (("x y", "z"), ("y z", "x"), ("z x", "y")):
        loop = f'<loop name="l" from="O" to="C" rotations="{axes}"/>'
        rig = load_rig_text(floating_body(FRAMES + loop))
        space = Workspace(rig, ())
        for angle in (0.7, 2.0, -1.4):
            turn = np.zeros(6)
            turn[3 + "xyz".index(free)] = angle
            space.update(pin.integrate(rig.model, rig.configuration(), turn), np.zeros(6))
            assert_allclose(space.x_constraint, 0.0, atol=1e-15)


def test_loops_and_holds_say_what_makes_no_joint() -> None:
    def loop(**axes: str) -> Loop:
        return Loop.model_validate({"name": "l", "from": "A", "to": "B", **axes})

    assert loop().fault() == "neither translations nor rotations are closed"
    assert "single rotation axis" in str(loop(rotations="x").fault())
    assert "single rotation axis" in str(loop(translations="x", rotations="x").fault())
    assert loop(rotations="x y").fault() is None
    assert loop(translations="x").fault() is None
    hold = {"name": "h", "point": "P", "axes": "x y"}
    assert Hold.model_validate(hold).fault() is None
    assert Hold.model_validate({**hold, "target": "initial"}).fault() is None
    assert Hold.model_validate({**hold, "target": "1 2"}).fault() is None
    assert Hold.model_validate({**hold, "target": "1"}).fault() == "1 targets for 2 axes"


def test_the_reaction_of_a_loop_is_the_force_on_its_second_point(rng: np.random.Generator) -> None:
    """A body hung on a loop in zero motion: the reaction carries its weight, upwards, in the first frame's axes."""
    rig = load_rig_text(
        floating_body(FRAMES + '<loop name="l" from="O" to="C" translations="x y z" rotations="x y z"/>')
    )
    dynamics = prepare(rig, Scenario())
    dynamics.correction = Baumgarte(1.0, 1.0)
    dynamics.rate(0.0, dynamics.initial())
    assert_allclose(dynamics.a, 0.0, atol=1e-12)
    names = [row.name for row in rig.rows]
    weight = 4.0 * 9.81
    reaction = dict(zip(names, dynamics.multipliers.tolist(), strict=True))
    assert reaction["l.z"] == pytest.approx(weight)
    # The centre of mass lies at (0.05, -0.02, 0.03) from the point.
    assert (reaction["l.rx"], reaction["l.ry"]) == pytest.approx((-0.02 * weight, -0.05 * weight))


def test_the_four_bar_moves_on_its_circle() -> None:
    """Accelerations of the closed linkage are those of its closed form: the loop's residual stays at rest."""
    dynamics = prepare(
        load_rig_text(four_bar()), Scenario(positions={"crank_joint": 0.4, "coupler_joint": 0.3, "rocker_joint": 1.2})
    )
    dynamics.rate(0.0, dynamics.initial())
    equations = dynamics.equations
    assert_allclose(equations.J @ dynamics.a, equations.p2, atol=1e-10)


def test_damped_multipliers_without_constraints_are_the_free_motion() -> None:
    M, p1 = np.diag([2.0, 4.0]), np.array([2.0, 8.0])
    a, multipliers = solve_damped(Equations(M, p1, np.zeros((0, 2)), np.zeros(0), np.zeros(0), np.zeros(0)))
    assert a == pytest.approx([1.0, 2.0])
    assert multipliers.shape == (0,)


@pytest.mark.parametrize(("s", "share"), [(1.0, 1.0), (2.6e-3, 1.0), (2.5e-8, 0.5), (2.5e-9, 1 / 101)])
def test_damping_takes_its_share_of_a_weak_direction_only(s: float, share: float) -> None:
    """S = diag(1, s): weak below s_0 = 0.05^2, d = 1e-5 s_0 far below, so that s^2 / (s^2 + d^2) is the share held."""
    M, p1 = np.diag([2.0, 2.0, 5.0]), np.array([2.0, -4.0, 10.0])
    J = np.diag([np.sqrt(2.0), np.sqrt(2.0 * s), 0.0])[:2]
    p2 = np.array([3.0, 0.5])
    a, multipliers = solve_damped(Equations(M, p1, J, p2, np.zeros(2), np.zeros(2)))
    free = np.array([1.0, -2.0, 2.0])
    expected = (p2 - J @ free) * np.array([1.0, share / s])
    assert multipliers == pytest.approx(expected, rel=1e-6)
    assert a == pytest.approx(free + J.T @ expected / 2.0, rel=1e-6)
    # What a held direction asks for is met; one let go keeps the rest of its free acceleration.
    assert J @ a == pytest.approx(np.array([3.0, share * 0.5 + (1 - share) * (J @ free)[1]]), rel=1e-6)


def test_damping_fades_in_smoothly_below_the_bound() -> None:
    """Half way down, d = 1e-5 s_0 (1 - 1/4): the share held differs from one by d^2 / s^2."""
    s = 0.5 * 0.05**2
    J = np.diag([1.0, np.sqrt(s)])
    equations = Equations(np.eye(2), np.zeros(2), J, np.array([0.0, 1.0]), np.zeros(2), np.zeros(2))
    held = solve_damped(equations)[1][1] * s
    assert 1.0 - held == pytest.approx((1e-5 * 0.75 / 0.5) ** 2, rel=1e-3)


def test_the_damped_formulation_solves_and_projects_with_damped_multipliers(state: tuple[Array, Array]) -> None:
    case = Scenario(positions={"elbow": 0.2, "spin": -0.3}, formulation="damped")
    dynamics = prepare(load_rig_text(tree(BUSY)), case)
    equations = dynamics.assemble(0.3, *state)
    a, multipliers = dynamics.solve(equations)
    assert_allclose(a, solve_damped(equations)[0], rtol=0, atol=0)
    assert_allclose(multipliers, solve_multipliers(equations)[1], rtol=1e-9)
    plain = prepare(load_rig_text(tree(BUSY)), case.changed({"formulation": "multipliers"}))
    y = np.concatenate([*state, [0.0, 0.0]])
    assert_allclose(dynamics.project(y), plain.project(y), rtol=0, atol=1e-12)


def test_the_work_of_two_groups_of_loads_adds_up(state: tuple[Array, Array]) -> None:
    """A harmonic torque and a table of forces are two groups: both supply, each force times its rate."""
    rows = "\n".join(f"{t},{40 + 5 * t * t}" for t in np.arange(0.0, 12.0, 1.0))
    table = f'<load name="wave" kind="force" point="R" axis="1 0 0" frame="world"><table>\n{rows}\n</table></load>'
    dynamics = prepare(load_rig_text(tree(BUSY + table)), Scenario(positions={"elbow": 0.2, "spin": -0.3}))
    dynamics.evaluate_forces(0.7, *state)
    loads = [i for i, element in enumerate(dynamics.forces) if element.load]
    where = dynamics.space.index[loads]
    assert len({type(dynamics.laws[i]) for i in loads}) == 2
    powers = dynamics.F[where] * dynamics.x_dot[where]
    assert dynamics.powers()[0] == pytest.approx(float(powers.sum()), rel=1e-12)
    assert np.abs(powers).min() > 1e-3


def test_what_is_weak_is_measured_against_the_strongest_direction() -> None:
    """Everything four hundred times as strong: the same directions are let go by the same share."""
    J = np.diag([20.0, 10.0, 20.0 * np.sqrt(2.5e-8)])
    equations = Equations(np.eye(3), np.zeros(3), J, np.array([0.0, 0.0, 1.0]), np.zeros(3), np.zeros(3))
    assert solve_damped(equations)[1][2] * 400 * 2.5e-8 == pytest.approx(0.5, rel=1e-6)
