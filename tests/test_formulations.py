"""Multipliers kept (57) and multipliers eliminated (58) are two ways to the same accelerations and reactions."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from rigs import bennett, four_bar, tree

from drillrig_pin import Rig, Scenario, SingularConfigurationError, load_rig_text
from drillrig_pin.dynamics import (
    Dynamics,
    Equations,
    solve_damped,
    solve_least_norm,
    solve_multipliers,
    solve_null_space,
)
from drillrig_pin.kinematics import Array
from drillrig_pin.simulation import prepare

STATES = 1000
TREE_LOOP = (
    '<hold name="pin" point="B" axes="x z"/>'
    '<loop name="ring" from="L" to="R" translations="x y z"/>'
    '<spring name="tie" from="O" to="L" stiffness="500" damping="3"/>'
)


def relative(a: Array, b: Array) -> float:
    return float(np.abs(a - b).max() / max(np.abs(a).max(), np.abs(b).max(), 1e-300))


def random_state(rig: Rig, q0: Array, spread: float, rng: np.random.Generator) -> tuple[Array, Array]:
    q = pin.integrate(rig.model, q0, spread * rng.uniform(-1, 1, rig.model.nv))
    return q, rng.uniform(-1, 1, rig.model.nv)


@pytest.fixture(scope="module")
def rig_dynamics(mkz49: Rig) -> Dynamics:
    return prepare(mkz49, Scenario())


def test_both_forms_agree_on_the_rig_at_a_thousand_random_states(
    rig_dynamics: Dynamics, rng: np.random.Generator
) -> None:
    rig, q0 = rig_dynamics.rig, rig_dynamics.equilibrium.assembly.q
    worst = 0.0
    for _ in range(STATES):
        # 0.02 rad or m keeps every cylinder inside its stroke.
        q, v = random_state(rig, q0, 0.02, rng)
        equations = rig_dynamics.assemble(rng.uniform(0, 10), q, v)
        (a, reaction), (b, eliminated) = solve_multipliers(equations), solve_null_space(equations)
        worst = max(worst, relative(a, b), relative(reaction, eliminated))
    assert worst <= 1e-9


@pytest.mark.parametrize("text", [four_bar(), tree(TREE_LOOP)], ids=["four-bar", "tree with hold and loop"])
def test_both_forms_agree_on_loops_at_a_thousand_random_states(text: str, rng: np.random.Generator) -> None:
    rig = load_rig_text(text)
    # Anywhere, closed or not: both forms solve the same equations at any state.
    dynamics = Dynamics(rig, _at(rig, rig.configuration()))
    worst = 0.0
    done = 0
    while done < STATES:
        q, v = random_state(rig, rig.configuration(), 1.0, rng)
        equations = dynamics.assemble(0.0, q, v)
        if np.linalg.cond(equations.J @ np.linalg.solve(equations.M, equations.J.T)) > 1e6:
            # Nearly singular: no method keeps nine digits there.
            continue
        done += 1
        (a, reaction), (b, eliminated) = solve_multipliers(equations), solve_null_space(equations)
        worst = max(worst, relative(a, b), relative(reaction, eliminated))
    assert worst <= 1e-9


def _at(rig: Rig, q: Array):
    from drillrig_pin.assembly import Assembly
    from drillrig_pin.statics import find_equilibrium

    n = len(rig.rows)
    return find_equilibrium(rig, Assembly(q, np.zeros(rig.model.nv), np.zeros(n), {}, ()))


def test_both_forms_agree_on_redundant_rows(rng: np.random.Generator) -> None:
    dynamics = prepare(load_rig_text(bennett()), Scenario(positions={"j1": 1.0, "j2": 2.0, "j3": -1.0}))
    assert len(dynamics.equilibrium.assembly.redundant) == 3
    assembly = dynamics.equilibrium.assembly
    J = dynamics.assemble(0.0, assembly.q, np.zeros(3)).J
    free = np.linalg.svd(J)[2][-1]
    equations = dynamics.assemble(0.0, assembly.q, 0.8 * free)
    (a, reaction), (b, eliminated) = solve_least_norm(equations, 2), solve_null_space(equations, 2)
    # Consistent rows only up to the assembly's residual, 1e-13 m over a singular value of 0.1.
    assert relative(a, b) <= 1e-9
    assert relative(reaction, eliminated) <= 1e-9


def test_the_solution_satisfies_the_equations_it_was_asked_for(
    rig_dynamics: Dynamics, rng: np.random.Generator
) -> None:
    q, v = random_state(rig_dynamics.rig, rig_dynamics.equilibrium.assembly.q, 0.02, rng)
    e = rig_dynamics.assemble(1.0, q, v)
    a, reaction = solve_multipliers(e)
    scale = np.abs(e.p1).max()
    # Rounding of a well-conditioned solve: a few units in the last place of the largest force.
    assert np.abs(e.M @ a - e.p1 - e.J.T @ reaction).max() < 1e-12 * scale
    assert np.abs(e.J @ a - e.p2).max() < 1e-10


def test_a_rank_deficient_jacobian_is_refused_by_the_saddle_point_form() -> None:
    J = np.array([[1.0, 0.0], [1.0, 0.0]])
    equations = Equations(np.eye(2), np.ones(2), J, np.zeros(2), np.zeros(2), np.zeros(2))
    with pytest.raises(SingularConfigurationError):
        solve_multipliers(equations)


def test_without_constraints_both_forms_are_plain_newton() -> None:
    M, p1, none = np.diag([2.0, 4.0]), np.array([2.0, 2.0]), np.zeros(0)
    equations = Equations(M, p1, np.zeros((0, 2)), none, none, none)
    for solve in (solve_multipliers, solve_null_space):
        a, reaction = solve(equations)
        np.testing.assert_allclose(a, [1.0, 0.5], rtol=1e-15)
        assert reaction.size == 0


def test_damped_multipliers_are_plain_ones_away_from_singular_positions(mkz49: Rig) -> None:
    """No direction of the face is weak: the filter is off, and what remains is another way to invert."""
    plain, damped = (prepare(mkz49, Scenario(formulation=name)) for name in ("multipliers", "damped"))
    equations = plain.assemble(0.0, *np.split(plain.initial()[:-2], 2))
    (a, multipliers), (b, others) = plain.solve(equations), damped.solve(equations)
    assert np.abs(a - b).max() < 1e-11 * np.abs(a).max()
    assert np.abs(multipliers - others).max() < 1e-11 * np.abs(multipliers).max()


def test_damped_multipliers_let_go_where_plain_ones_grow_without_end() -> None:
    """Two rows that become one and ask for different accelerations: multipliers grow as 1 / angle^2."""

    def greatest(angle: float) -> tuple[float, float]:
        J = np.array([[1.0, 0.0, 0.0], [np.cos(angle), np.sin(angle), 0.0]])
        equations = Equations(np.eye(3), np.zeros(3), J, np.array([1.0, 0.9]), np.zeros(2), np.zeros(2))
        return np.abs(solve_multipliers(equations)[1]).max(), np.abs(solve_damped(equations)[1]).max()

    # s = angle^2 / 2 against d = 5e-8: one per cent of damping at a milliradian, nearly free at a microradian.
    plain, damped = greatest(1e-3)
    assert plain == pytest.approx(0.1 / 1e-3**2, rel=0.01)
    assert damped == pytest.approx(plain, rel=0.02)
    plain, damped = greatest(1e-6)
    assert plain > 5e10
    assert damped < 20
