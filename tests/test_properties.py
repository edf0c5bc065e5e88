"""What must hold of any machine: random trees that carry one element of every registered class."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from random_machines import Machine, machines

from drillrig_pin import Rig, Scenario, Trajectory, load_rig_text, load_trajectory, simulate
from drillrig_pin.dynamics import Dynamics
from drillrig_pin.kinematics import Array
from drillrig_pin.simulation import prepare

SEEDS = st.integers(0, 2**32 - 1)
few = settings(
    max_examples=100,
    derandomize=True,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
#: Central differences over 1e-5 leave 1e-10 of truncation and of rounding, times numbers of the order of ten.
H, NEAR = 1e-5, 1e-7
#: The same numbers summed in another order, through a mass matrix whose condition is some thousands.
SAME = 1e-10


def state_of(dynamics: Dynamics, seed: int) -> tuple[Array, Array]:
    """A state on the constraints near the start, in motion."""
    rng = np.random.default_rng(seed)
    model, y = dynamics.rig.model, dynamics.initial()
    y[: model.nq] = pin.integrate(model, y[: model.nq], rng.uniform(-0.02, 0.02, model.nv))
    y[model.nq : -2] = rng.uniform(-1, 1, model.nv)
    dynamics.rate(0.0, y)
    for _ in range(3):
        y = dynamics.project(y)
    return y[: model.nq], y[model.nq : -2]


@few
@given(machine=machines(), seed=SEEDS)
def test_the_row_of_every_coordinate_is_its_gradient(machine: Machine, seed: int) -> None:
    dynamics = prepare(machine.rig(), Scenario())
    q, v = state_of(dynamics, seed)
    space, model = dynamics.space, dynamics.rig.model
    turning = {i for i, e in enumerate(dynamics.forces) if getattr(e, "kind", "") == "torque"}
    # A torque has no coordinate of its own, only a rate.
    kept = [space.index[i] for i in range(len(dynamics.forces)) if i not in turning]
    space.update(q, v)
    rows = space.rows[kept].copy()
    for k, step in enumerate(H * np.eye(model.nv)):
        space.update(pin.integrate(model, q, step), v)
        ahead = space.x[kept].copy()
        space.update(pin.integrate(model, q, -step), v)
        np.testing.assert_allclose(rows[:, k], (ahead - space.x[kept]) / (2 * H), atol=NEAR)


def energy(dynamics: Dynamics, q: Array, v: Array) -> float:
    """Kinetic, potential and stored energy [J]."""
    dynamics.space.update(q, v)
    model, data = dynamics.rig.model, dynamics.rig.model.createData()
    total = pin.computeKineticEnergy(model, data, q, v) + pin.computePotentialEnergy(model, data, q)
    for group in dynamics.groups:
        if not group.load:
            total += float(np.sum(group.law.energy(dynamics.x[group.where])))
    return float(total)


@few
@given(machine=st.booleans().flatmap(machines), seed=SEEDS)
def test_power_is_the_rate_of_energy_plus_dissipation(machine: Machine, seed: int) -> None:
    dynamics = prepare(machine.rig(), Scenario(stabilization={"method": "none"}))
    q, v = state_of(dynamics, seed)
    dynamics.rate(0.3, np.concatenate([q, v, np.zeros(2)]))
    supplied, lost = dynamics.powers()
    a, model = dynamics.a.copy(), dynamics.rig.model

    def at(h: float) -> float:
        return energy(dynamics, pin.integrate(model, q, h * v + 0.5 * h * h * a), v + h * a)

    slope = (at(H) - at(-H)) / (2 * H)
    scale = abs(supplied) + lost + abs(slope) + float(np.abs(dynamics.F * dynamics.x_dot).sum())
    # Rounding of energies of some kJ over the step.
    assert abs(slope + lost - supplied) <= 1e-5 * scale + 1e-5


def accelerations(rig: Rig, formulation: str) -> tuple[dict[str, float], dict[str, float], dict[str, float]]:
    """Accelerations, forces and reactions by name, in motion."""
    dofs = {name: 0.3 + 0.1 * len(name) for name in rig.dof_names}
    # Baumgarte's terms would magnify the residual of 1e-13 m that assembly leaves by beta^2 = 4e4 1/s^2.
    plain = {"method": "none"}
    dynamics = prepare(rig, Scenario(formulation=formulation, velocities=dofs, stabilization=plain))
    dynamics.rate(0.2, dynamics.initial())
    forces = {e.name: float(F) for e, F in zip(dynamics.forces, dynamics.F[dynamics.space.index], strict=True)}
    rows = [row.name for row in rig.rows]
    reactions = dict(zip(rows, dynamics.multipliers.tolist(), strict=True))
    return dict(zip(rig.dof_names, dynamics.a.tolist(), strict=True)), forces, reactions


def assert_alike(one: Any, other: Any, renamed: Any = str) -> None:
    for mine, its in zip(one, other, strict=True):
        # What is zero is a difference of terms of at least ten: m/s^2, N or rad/s^2.
        size = max([10.0, *(abs(value) for value in mine.values())])
        assert {renamed(name) for name in mine} == set(its)
        for name, value in mine.items():
            assert its[renamed(name)] == pytest.approx(value, rel=0, abs=SAME * size)


FORMULATIONS = st.sampled_from(["multipliers", "null_space"])


def anywhere(rng: np.random.Generator) -> pin.SE3:
    """Any move of the world."""
    return pin.SE3(pin.rpy.rpyToMatrix(*rng.uniform(-3, 3, 3)), rng.uniform(-2, 2, 3))


@few
@given(machine=st.booleans().flatmap(machines), seed=SEEDS, formulation=FORMULATIONS)
def test_a_rigid_move_of_the_world_changes_nothing(machine: Machine, seed: int, formulation: str) -> None:
    move = anywhere(np.random.default_rng(seed))
    assert_alike(accelerations(machine.rig(), formulation), accelerations(machine.rig(move=move), formulation))


@few
@given(machine=st.booleans().flatmap(lambda closed: machines(closed, held=True)), seed=SEEDS, formulation=FORMULATIONS)
def test_a_rigid_move_of_the_world_turns_the_reactions_of_a_hold_and_changes_nothing_else(
    machine: Machine, seed: int, formulation: str
) -> None:
    rng = np.random.default_rng(seed)
    (i,) = (i for i, (tag, *_) in enumerate(machine.elements) if tag == "hold")
    name, held = f"e{i}", machine.elements[i][1]["held"]
    move = anywhere(rng)
    if len(held.axes) < 3:
        # A hold names axes of the world: only quarter turns take them to axes again.
        turns = np.pi / 2 * rng.integers(0, 4, 3)
        move.rotation = np.rint(pin.rpy.rpyToMatrix(*turns))
    a, forces, reactions = accelerations(machine.rig(), formulation)
    on_hold = np.array([reactions.pop(f"{name}.{axis}", 0.0) for axis in "xyz"])
    assert np.abs(on_hold).max() > 1e-3
    turned = dict(zip((f"{name}.{axis}" for axis in "xyz"), (move.rotation @ on_hold).tolist(), strict=True))
    moved = accelerations(machine.rig(move=move), formulation)
    expected = {key: value for key, value in turned.items() if key in moved[2]}
    assert set(expected) == {f"{name}.{axis}" for axis in held.moved(move)[0].split()}
    assert_alike((a, forces, reactions | expected), moved)


@few
@given(machine=st.tuples(st.booleans(), st.booleans()).flatmap(lambda both: machines(*both)), seed=SEEDS)
def test_the_order_of_what_stands_in_the_file_changes_nothing(machine: Machine, seed: int) -> None:
    """Links, joints, points, gravity, force elements, loads, loops and holds."""
    other = machine.rig(mixed=np.random.default_rng(seed))
    assert_alike(accelerations(machine.rig(), "multipliers"), accelerations(other, "multipliers"))


def backwards(name: str) -> str:
    """Another name, of the same length, that sorts the other way round."""
    head, _, tail = name.partition(".")
    digit = 9 - int(head[1:])
    return f"{head[0]}{digit}" + (f".{tail}" if tail else "")


@few
@given(machine=st.tuples(st.booleans(), st.booleans()).flatmap(lambda both: machines(*both)))
def test_other_names_change_nothing_but_the_names(machine: Machine) -> None:
    mine, its = (accelerations(machine.rig(name), "multipliers") for name in (str, backwards))
    assert_alike(mine, its, backwards)


def again(run: Trajectory) -> Trajectory:
    return simulate(load_rig_text(run.model), run.scenario)


@settings(few, max_examples=30)
@given(machine=st.booleans().flatmap(machines), engine=st.sampled_from(["core", "python"]))
def test_a_run_saved_loaded_and_run_again_is_the_same_to_the_byte(
    machine: Machine, engine: str, tmp_path: Path
) -> None:
    if engine == "core":
        pytest.importorskip("drillrig_pin.core", reason="the package was built without a C++ compiler")
    run = simulate(machine.rig(), Scenario(duration=0.02, output_rate=500, engine=engine))
    run.save(tmp_path / "run.nc")
    back = load_trajectory(tmp_path / "run.nc")
    repeated = again(back)
    assert repeated.outcome.status is run.outcome.status
    for name, array in run.arrays.items():
        assert back.arrays[name].tobytes() == array.tobytes(), name
        assert repeated.arrays[name].tobytes() == array.tobytes(), name
