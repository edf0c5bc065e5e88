"""Whatever numbers are given: a run holds finite ones, or a sentence says why it does not; and anybody can end it."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from rigs import NO_GRAVITY, mass_on_cylinder, pendulum, point_mass

from drillrig_pin import DrillrigError, ModelError, Scenario, ScenarioError, Status, load_rig_text, simulate
from drillrig_pin.analysis.trust import trust
from drillrig_pin.analysis.validity import invalid
from drillrig_pin.balance import doubt
from drillrig_pin.batch.holes import Hole, aim_at
from drillrig_pin.beat import listening
from drillrig_pin.budget import Budget, OverspentError
from drillrig_pin.elements import JointCoordinate, Name, PluginElement, reference
from drillrig_pin.finite import FARTHEST, STRAYED
from drillrig_pin.marching import march_core, march_python
from drillrig_pin.simulation import Case, start_state

ENGINES = ["core", "python"]
MARCHES = {"core": march_core, "python": march_python}


def arm(**numbers: Any) -> str:
    """Two links, every kind of element, each number by name; loops and points are left out where they are empty."""
    given = {
        "mass": "3",
        "inertia": "0.1",
        "com": "0.3",
        "origin": "0.6",
        "axis": "1",
        "pin": "0.25",
        "base": "-0.35",
        "bore": "0.08",
        "bulk": "1.5e9",
        "friction": "1e3",
        "stiffness": "1e4",
        "damping": "10",
        "rock": "1e6",
        "preload": "100",
        "amplitude": "100",
        "frequency": "40",
        "gravity": "-9.81",
        "torque": "5",
        "extra": "",
        **numbers,
    }
    return """<robot name="m"><link name="world"/>
<link name="bar"><inertial><origin xyz="{com} 0 0"/><mass value="{mass}"/>
<inertia ixx="{inertia}" ixy="0" ixz="0" iyy="{inertia}" iyz="0" izz="{inertia}"/></inertial></link>
<link name="arm"><inertial><origin xyz="0.3 0 0"/><mass value="2"/>
<inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
<joint name="hinge" type="revolute"><parent link="world"/><child link="bar"/><axis xyz="0 {axis} 0"/>
<limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
<joint name="elbow" type="revolute"><parent link="bar"/><child link="arm"/><origin xyz="{origin} 0 0"/>
<axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
<drillrig><gravity xyz="0 0 {gravity}"/>
<point name="base" link="world" xyz="0 0 {base}"/><point name="pin" link="bar" xyz="{pin} 0 0"/>
<point name="tip" link="arm" xyz="0.6 0 0.05"/>
<cylinder name="oil" from="base" to="pin" bore="{bore}" rod="0.04" length_retracted="0.3" dead_length_a="0.05"
 dead_length_b="0.05" bulk_modulus="{bulk}" friction="{friction}"/>
<joint_spring name="hose" joint="elbow" stiffness="{stiffness}" damping="{damping}" rest="initial"/>
<joint_torque name="motor" joint="elbow" value="{torque}"/>
<contact name="rock" point="tip" axis="1 0 0" stiffness="{rock}" damping="1e3" preload="{preload}"/>
<load name="hammer" kind="force" point="tip" axis="1 0 0" frame="world"><harmonics mean="10" ramp="0.01">
<term amplitude="{amplitude}" frequency="{frequency}"/></harmonics></load>{extra}
</drillrig></robot>""".format(**given)


LOOPS = "".join(f'<loop name="l{i}" from="base" to="base" translations="x y z"/>' for i in range(12))
#: Numbers that are read, but are hardly those of a machine, and cases of a scenario.
EXTREMES: list[tuple[dict[str, Any], dict[str, Any]]] = [
    ({"mass": "1e-300"}, {}),
    ({"mass": "1e30"}, {}),
    ({"inertia": "1e30"}, {}),
    ({"inertia": "1e-310"}, {"formulation": "null_space"}),
    ({"com": "1e29"}, {}),
    ({"origin": "1e29"}, {}),
    ({"axis": "1e-160"}, {}),
    ({"pin": "0", "base": "0"}, {}),
    ({"bore": "1e20"}, {}),
    ({"bulk": "1e30"}, {}),
    ({"stiffness": "1e30"}, {"formulation": "damped"}),
    ({"stiffness": "5e-324", "damping": "1e-300"}, {}),
    ({"rock": "1e-300"}, {}),
    ({"preload": "1e30"}, {}),
    ({"amplitude": "1e30"}, {}),
    ({"frequency": "1e30"}, {}),
    ({"gravity": "-1e30"}, {}),
    ({"torque": "1e30"}, {}),
    ({"extra": LOOPS}, {}),
    ({"extra": '<loop name="l" from="tip" to="tip" translations="x z"/>'}, {"formulation": "null_space"}),
    ({"extra": '<hold name="h" point="tip" axes="x y z"/>'}, {"stabilization": {"beta": 1e30}}),
    ({"extra": '<hold name="h" point="tip" axes="z"/>'}, {"stabilization": {"alpha": 1e-310}}),
    (
        {"extra": '<hold name="h" point="tip" axes="z"/>'},
        {"stabilization": {"method": "sliding_mode", "width": 1e-300}},
    ),
    ({"extra": '<hold name="h" point="tip" axes="z" target="1e20"/>'}, {}),
    ({"extra": '<gear name="g" joint="elbow" mimics="hinge" ratio="1e29"/>'}, {}),
    ({}, {"duration": 1e-300}),
    ({}, {"duration": 1e30, "output_rate": 1e-25}),
    ({}, {"output_rate": 1e-300}),
    ({}, {"integrator": {"method": "RK4", "step": 1e-300}}),
    ({}, {"integrator": {"max_step": 1e-300}}),
    ({}, {"integrator": {"atol": 1e-300}}),
    ({}, {"velocities": {"hinge": 1e30}}),
    ({}, {"positions": {"elbow": 1e30}}),
]


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize(("numbers", "fields"), EXTREMES, ids=lambda value: "-".join(value) if value else "-")
def test_an_extreme_number_gives_finite_ones_or_a_sentence(
    engine: str, numbers: dict[str, Any], fields: dict[str, Any]
) -> None:
    integrator = {"budget": 0.5, **fields.get("integrator", {})}
    case = {"duration": 0.002, "engine": engine, **fields, "integrator": integrator}
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        warnings.simplefilter("ignore", UserWarning)
        try:
            run = simulate(load_rig_text(arm(**numbers)), Scenario(**case))
        except DrillrigError:
            return
    for name, values in run.arrays.items():
        assert np.isfinite(values).all(), name
    assert run.outcome.completed or run.outcome.cause


@pytest.mark.parametrize(
    ("numbers", "told"),
    [
        ({"bore": "1e200"}, "<cylinder 'oil'> bore = '1e200' is beyond 1e+30"),
        ({"mass": "1e300"}, "<mass> value = '1e300' is beyond 1e+30"),
        ({"origin": "-1e300"}, "<origin> xyz = '-1e300 0 0' is beyond 1e+30"),
        ({"axis": "1e-200"}, "joint 'hinge': its axis '0 1e-200 0' has no direction"),
        ({"gravity": "1e31"}, "<gravity> xyz = '0 0 1e31' is beyond 1e+30"),
        ({"frequency": "1e300"}, "<term> frequency = '1e300' is beyond 1e+30"),
        ({"pin": "1e99"}, "<point 'pin'> xyz = '1e99 0 0' is beyond 1e+30"),
        (
            {"extra": '<hold name="h" point="tip" axes="x z" target="0 1e40"/>'},
            "<hold 'h'> target = '0 1e40' is beyond",
        ),
    ],
)
def test_a_number_beyond_all_machines_is_refused_with_name_and_line(numbers: dict[str, str], told: str) -> None:
    with pytest.raises(ModelError) as caught:
        load_rig_text(arm(**numbers), "rig.urdf")
    assert told in str(caught.value)
    assert str(caught.value).startswith("rig.urdf:")


@pytest.mark.parametrize(
    "fields",
    [
        {"duration": 1e300},
        {"stabilization": {"alpha": 1e200}},
        {"velocities": {"hinge": -1e300}},
        {"positions": {"hinge": [0.0, 1e40]}},
        {"targets": {"h.x": math.nan}},
    ],
)
def test_a_scenario_says_which_number_is_beyond_all_machines(fields: dict[str, Any]) -> None:
    with pytest.raises(ScenarioError, match=f"scenario.{next(iter(fields))}"):
        Scenario(**fields)


def test_the_start_names_what_is_no_number_of_a_machine() -> None:
    for numbers, told in (
        ({"pin": "0", "base": "0"}, "'oil' has no direction at the start"),
        ({"origin": "3e8"}, "joint 'elbow' lies 3e+08 m from the origin of the world"),
        ({"pin": "1e29"}, "point 'pin' lies 1e+29 m from the origin"),
    ):
        with pytest.raises(DrillrigError, match=told.replace("+", r"\+")):
            start_state(load_rig_text(arm(**numbers)), Scenario())
    assert FARTHEST > 1e7, "map coordinates are places of machines"


class Odd(PluginElement):
    """Energy that is no number from some position on."""

    tag = "odd"
    joint: Name = reference("the joint")

    def coordinate(self, resolver: Any) -> JointCoordinate:
        """The joint's own."""
        found: JointCoordinate = resolver.joint(self.joint)
        return found

    def force(self, x: Any, xdot: Any, t: float) -> Any:
        """None."""
        return 0.0 * x

    def energy(self, x: Any) -> Any:
        """Infinite beyond half a metre."""
        return np.where(np.abs(x) > 0.5, np.inf, 0.0)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_run_diverges_when_its_first_number_is_none_of_a_machine(engine: str) -> None:
    # At 20 m/s half a metre is passed behind 0.025 s; 4e9 m/s^2 leads 1e6 m away in the root of 5e-4 s.
    free = load_rig_text(point_mass(extension=NO_GRAVITY), "m")
    odd = load_rig_text(point_mass(extension=NO_GRAVITY), elements=[Odd(name="odd", joint="x")])
    pushed = load_rig_text(point_mass(2.0, '<gravity xyz="4e9 0 0"/>'))
    for machine, velocity, time, told in (
        (odd, 20.0, 0.025, "elastic energy is no finite number"),
        (pushed, 0.0, math.sqrt(5e-4), "position of"),
        (free, 1e9, STRAYED / 1e9, "position of"),
    ):
        run = simulate(machine, Scenario(duration=0.03, engine=engine, velocities={"x": velocity}))
        assert run.outcome.status is Status.DIVERGED
        assert told in run.outcome.cause
        assert time <= run.outcome.time <= time + 0.0011, "the first row behind it"
        assert run.time[-1] < run.outcome.time, "nothing from there on is kept"
        assert all(np.isfinite(values).all() for values in run.arrays.values())


def test_a_number_that_is_none_is_a_doubt_and_never_passes() -> None:
    run = simulate(load_rig_text(pendulum()), Scenario(duration=0.05, positions={"hinge": 0.3}))
    assert run.outcome.completed
    assert not invalid(run)
    arrays = {**run.arrays, "energy_potential": np.full(len(run.time), np.nan)}
    odd = replace(run, arrays=arrays, kept=None)
    assert "no finite number" in doubt(odd)
    assert any("no finite number" in words for words in trust(odd).doubts)
    assert invalid(odd)


class EnoughError(Exception):
    """What a listener raises."""


def after(beats: int) -> Callable[..., None]:
    """Raises at that beat."""
    left = iter(range(beats))

    def hear(*_: float) -> None:
        if next(left, None) is None:
            raise EnoughError

    return hear


@pytest.mark.parametrize("engine", ENGINES)
def test_everything_before_a_run_can_be_ended_by_who_listens(engine: str) -> None:
    machine = load_rig_text(mass_on_cylinder(), "m")
    hold = load_rig_text(arm(extra='<hold name="h" point="tip" axes="z" target="-0.1"/>'))
    with listening(after(3)), pytest.raises(EnoughError):
        start_state(hold, Scenario())  # assembly
    case = Scenario(duration=0.5, engine=engine)
    with listening(after(2)), pytest.raises(EnoughError):
        simulate(machine, case)  # preparation and run
    _, rates = MARCHES[engine](Case(machine, case).dynamics)
    states = np.tile(Case(machine, case).dynamics.initial(), (300_000, 1))
    with listening(after(1)), pytest.raises(EnoughError):
        rates(np.zeros(len(states)), states)  # choice of the method, modes: of many dofs it takes long


@pytest.mark.parametrize("method", ["RK4", "DOP853", "RODAS", "ExpAdams", "Radau", "LSODA"])
def test_a_run_of_any_method_can_be_ended_by_who_listens(method: str) -> None:
    fields = {"integrator": {"method": method, "step": 1e-6}, "stabilization": {"projection": False}}
    case = Case(load_rig_text(arm(stiffness="1e9")), Scenario(duration=50.0, output_rate=10.0, **fields))
    with listening(after(2)), pytest.raises(EnoughError):
        case.solve()


def test_the_aim_at_a_hole_can_be_ended_by_who_listens() -> None:
    from drillrig_pin import load_rig

    with listening(after(5)), pytest.raises(EnoughError):
        aim_at(load_rig("mkz49"), Hole(at=(0.0, 0.0, 1.0)))


@pytest.mark.parametrize("engine", ENGINES)
def test_a_run_that_would_take_too_long_says_what_is_stiff(engine: str) -> None:
    stiff = load_rig_text(arm(stiffness="1e16", damping="0"))
    integrator = {"method": "DOP853", "budget": 0.05}
    run = simulate(stiff, Scenario(duration=20.0, engine=engine, integrator=integrator))
    assert run.outcome.status is Status.TOO_LONG
    assert "the stiffness of 'hose'" in run.outcome.cause
    assert "Hz in " in run.outcome.cause
    assert "of 20 s" in run.outcome.cause, "how far it came"
    assert "integrator.budget" in run.outcome.status.advice
    damped = load_rig_text(arm(damping="1e16"))
    run = simulate(damped, Scenario(duration=20.0, engine=engine, integrator=integrator))
    assert "by the damping of 'hose'" in run.outcome.cause


def test_a_budget_looks_at_the_pace_and_forgives_a_slow_start(monkeypatch: pytest.MonkeyPatch) -> None:
    now = 0.0
    monkeypatch.setattr("time.thread_time", lambda: now)
    budget, none = Budget(100.0, 10.0), Budget(None, 10.0)
    now = 0.5
    budget.spend(1e-3)  # by this pace 5000 s, but little was spent
    now = 0.7
    budget.spend(1.0)  # then faster
    now = 50.0
    budget.spend(6.0)
    none.spend(0.0)
    now = 90.0
    with pytest.raises(OverspentError, match="the whole run would take 129 s"):
        budget.spend(7.0)


@pytest.mark.parametrize(("field", "method"), [("step", "RK4"), ("max_step", "DOP853")])
def test_more_steps_than_anybody_would_wait_for_are_refused(field: str, method: str) -> None:
    scenario = Scenario(integrator={"method": method, field: 1e-10})
    with pytest.raises(ScenarioError, match=rf"scenario.integrator.{field} = 1e-10 s asks for 1e\+11 steps"):
        simulate(load_rig_text(pendulum()), scenario)
