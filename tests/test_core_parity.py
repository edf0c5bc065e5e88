"""The compiled core against the Python engine at single states: laws, kinematics, equations, solutions."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pinocchio as pin
import pytest
from rigs import (
    NO_GRAVITY,
    bennett,
    floating_body,
    four_bar,
    mass_on_cylinder,
    pendulum,
    point_mass,
    slider_crank,
    tree,
)

from drillrig_pin import Rig, Scenario, load_rig, load_rig_text
from drillrig_pin.dynamics import Dynamics
from drillrig_pin.elements import Name, PluginElement, reference
from drillrig_pin.elements.base import Law
from drillrig_pin.elements.loads import TableLaw
from drillrig_pin.kinematics import Array
from drillrig_pin.simulation import prepare

core = pytest.importorskip("drillrig_pin.core", reason="the package was built without a C++ compiler")

STATES = 1000
FORMULATIONS = ("multipliers", "null_space", "damped")
CORRECTIONS = ("none", "baumgarte", "sliding_mode")


# --- laws -----------------------------------------------------------------------------------------------------------


class Cubic(PluginElement):
    """F = -x^3 - x_dot |x_dot|: what a user writes in Python."""

    tag = "cubic"
    joint: Name = reference("joint")

    def coordinate(self, resolver):
        return resolver.joint(self.joint)

    def force(self, x, xdot, t):
        return -(x**3) - xdot * np.abs(xdot)

    def dissipation(self, x, xdot):
        return np.abs(xdot) ** 3


def _loaded(law: str) -> Rig:
    return load_rig_text(point_mass(extension=f'<load name="l" kind="force" point="P" axis="1 0 0">{law}</load>'))


def _on_ground(mode: str) -> Rig:
    contact = f'<contact name="c" point="P" axis="1 0 0" stiffness="2e6" damping="300" preload="50" mode="{mode}"/>'
    return load_rig_text(point_mass(extension=NO_GRAVITY + contact))


def _with_friction(law: str) -> Rig:
    return load_rig_text(mass_on_cylinder(options=f'law="{law}" friction="2e3" precharge="3e5"'))


TERMS = "".join(f'<term amplitude="{100 * k}" frequency="{40.5 * k}" phase="{0.3 * k}"/>' for k in range(1, 6))
TABLE = "\n".join(f"{0.01 * k:.2f},{np.sin(0.7 * k) * 1e3:.6f}" for k in range(101))
RIGS: dict[str, Callable[[], Rig]] = {
    "locked oil": lambda: _with_friction("geometric"),
    "locked oil as printed": lambda: _with_friction("printed"),
    "joint spring": lambda: load_rig_text(
        pendulum(extension='<joint_spring name="s" joint="hinge" stiffness="4e3" damping="7"/>')
    ),
    "joint torque": lambda: load_rig_text(pendulum(extension='<joint_torque name="s" joint="hinge" value="12.5"/>')),
    "joint friction": lambda: load_rig_text(
        pendulum(extension='<joint_friction name="s" joint="hinge" damping="7" friction="12" creep="0.5"/>')
    ),
    "bilateral contact": lambda: _on_ground("bilateral"),
    "unilateral contact": lambda: _on_ground("unilateral"),
    "constant load": lambda: _loaded('<constant value="3e3" ramp="0.6"/>'),
    "constant load at once": lambda: _loaded('<constant value="3e3"/>'),
    "harmonics": lambda: _loaded(f'<harmonics mean="250" ramp="0.4">{TERMS}</harmonics>'),
    "table": lambda: _loaded(f"<table>\n{TABLE}\n</table>"),
    "plugin": lambda: load_rig_text(point_mass(), elements=[Cubic(name="c", joint="x")]),
}


def size_of_terms(law: Law, x: float, x_dot: float, t: float) -> float:
    """Sum of the absolute values of what a law adds up: the scale of its rounding."""
    if hasattr(law, "E0"):
        u = x - law.x0
        other = np.log1p((1 if type(law).__name__ == "LockedOilAsPrinted" else -1) * u / law.l_B)
        oil = law.S_A * (law.p_A0 + law.E0 * abs(np.log1p(u / law.l_A)))
        return float(oil + law.S_B * (law.p_B0 + law.E0 * abs(other)) + law.k * abs(x_dot))
    if hasattr(law, "c"):
        held = abs(getattr(law, "F0", getattr(law, "N0", 0.0)))
        return float(held + law.c * (abs(x) + abs(law.x0)) + law.k * abs(x_dot))
    if hasattr(law, "amplitude"):
        # A sine of an argument of up to 2 pi f t = 1e3 rad; both engines form the same argument.
        return float(abs(law.mean) + np.abs(law.amplitude).sum())
    if isinstance(law, TableLaw):
        return float(np.abs(law.knots()[:, 1:] * [1e-6, 1e-4, 1e-2, 1.0]).sum(axis=1).max())
    return float(abs(np.ravel(law.force(np.array([x]), np.array([x_dot]), t))[0]))


@pytest.mark.parametrize("name", RIGS)
def test_each_law_gives_the_same_force_and_power(name: str, rng: np.random.Generator) -> None:
    dynamics = prepare(RIGS[name](), Scenario(duration=1.0))
    compiled = core.CompiledDynamics(dynamics)
    (law,), nq = dynamics.laws, dynamics.rig.model.nq
    moved = False
    for _ in range(STATES):
        y = dynamics.initial()
        y[:nq] += rng.uniform(-0.05, 0.05, nq)
        y[nq:-2] = rng.uniform(-3, 3, nq)
        t = rng.uniform(0.0, 1.0)
        out = compiled.evaluate(t, y)
        # The law at the core's own x and x_dot: those differ from Python's by the rounding of the kinematics.
        x, x_dot = out["x"], out["x_dot"]
        force = float(np.ravel(law.force(x, x_dot, t))[0])
        scale = size_of_terms(law, x[0], x_dot[0], t)
        # 1e-14 is about fifty roundings of double precision: logarithm, sine and Horner's scheme stay below.
        assert abs(out["F"][0] - force) <= 1e-14 * scale
        supplied, lost = out["rate"][-2:]
        is_load = dynamics.forces[0].load
        expected = (force * x_dot[0], 0.0) if is_load else (0.0, float(np.ravel(law.dissipation(x, x_dot))[0]))
        assert abs(supplied - expected[0]) <= 1e-14 * scale * abs(x_dot[0])
        assert abs(lost - expected[1]) <= 1e-14 * max(scale * abs(x_dot[0]), expected[1])
        moved |= force != 0.0
    assert moved, "zero would prove nothing"


@pytest.mark.parametrize("name", ["unilateral contact"])
def test_a_contact_switches_on_the_same_side_of_its_switch(name: str) -> None:
    dynamics = prepare(RIGS[name](), Scenario())
    compiled, law = core.CompiledDynamics(dynamics), dynamics.laws[0]
    touch = law.x0 - law.N0 / law.c
    for x in (touch, np.nextafter(touch, 1), np.nextafter(touch, -1), touch + 1e-9, touch - 1e-9, 0.0):
        for x_dot in (0.0, 1.0, -1.0, 1e-9):
            y = dynamics.initial()
            y[0], y[3] = x, x_dot
            out = compiled.evaluate(0.0, y)
            assert out["F"][0] == law.force(out["x"], out["x_dot"], 0.0)[0]


def test_a_table_is_kept_at_its_ends_outside_its_range() -> None:
    dynamics = prepare(RIGS["table"](), Scenario(duration=1.0))
    compiled, law = core.CompiledDynamics(dynamics), dynamics.laws[0]
    for t in (-1.0, 0.0, 0.5, 1.0, 2.0):
        force = compiled.evaluate(t, dynamics.initial())["F"][0]
        assert force == pytest.approx(law.force(np.zeros(1), np.zeros(1), t)[0], rel=1e-14, abs=1e-11)


# --- states ---------------------------------------------------------------------------------------------------------

BAR = {"crank_joint": 0.4, "coupler_joint": 0.3, "rocker_joint": 1.2}
CRANK = {"crank_joint": 0.3, "rod_joint": -0.4, "slide": 0.76}
BENNETT = {"j1": 1.0, "j2": 2.0, "j3": -1.0}
HINGE = 'translations="x y z" rotations="x y"'
ON_TREE = (
    '<joint_spring name="s" joint="elbow" stiffness="300" damping="4" rest="0.2"/>'
    '<spring name="cord" from="O" to="L" stiffness="80" damping="2" rest_length="0.9"/>'
    '<load name="blow" kind="force" point="R" axis="0 1 0"><constant value="30" ramp="0.5"/></load>'
    '<load name="screw" kind="torque" point="L" axis="0 0 1"><constant value="5"/></load>'
)

#: Trees of revolute and prismatic joints go through the core's own pass, the others through Pinocchio's algorithms.
MACHINES: dict[str, tuple[Callable[[], Rig], dict[str, float]]] = {
    "mkz49": (lambda: load_rig("mkz49"), {}),
    "four-bar": (lambda: load_rig_text(four_bar()), BAR),
    "hinge, redundant": (lambda: load_rig_text(four_bar(closure=HINGE)), BAR),
    "Bennett, redundant in space": (lambda: load_rig_text(bennett()), BENNETT),
    "slider-crank, continuous": (lambda: load_rig_text(slider_crank()), CRANK),
    "floating, held": (lambda: load_rig_text(floating_body('<hold name="h" point="P" axes="x z"/>')), {}),
    "floating, free": (lambda: load_rig_text(floating_body()), {}),
    "tree, held": (lambda: load_rig_text(tree('<hold name="h" point="R" axes="x z"/>' + ON_TREE)), {}),
    "tree, hinge": (lambda: load_rig_text(tree(f'<loop name="h" from="O" to="B" {HINGE}/>' + ON_TREE)), {}),
    "tree, weld": (
        lambda: load_rig_text(tree('<loop name="w" from="O" to="B" translations="x y z" rotations="x y z"/>')),
        {},
    ),
}
# Bennett's linkage stands on its closed form, where f is nothing but rounding that Baumgarte's beta^2 would blow up.
CASES = [
    (name, form, "none" if name.startswith("Bennett") else "baumgarte") for name in MACHINES for form in FORMULATIONS
]
CASES += [("mkz49", form, kind) for form in FORMULATIONS for kind in CORRECTIONS if kind != "baumgarte"]


def bound(name: str, formulation: str, correction: str = "baumgarte") -> Dynamics:
    make, positions = MACHINES[name]
    return prepare(make(), Scenario(positions=positions, formulation=formulation, stabilization={"method": correction}))


def random_state(dynamics: Dynamics, rng: np.random.Generator) -> Array:
    """Around the initial configuration, on the closed form where rank depends on being on the constraints."""
    model, y = dynamics.rig.model, dynamics.initial()
    nq, nv = model.nq, model.nv
    v = rng.uniform(-2.0, 2.0, nv)
    if dynamics.rig.joints == ["j1", "j2", "j3"]:
        # Bennett: tan(q1/2) tan(q2/2) is constant and q3 = -q1; elsewhere its rows are not redundant.
        ratio = np.sin((1.1 + 0.6) / 2) / np.sin((1.1 - 0.6) / 2)
        q1 = rng.choice([-1, 1]) * rng.uniform(0.5, 2.6)
        q2 = 2 * np.arctan(ratio / np.tan(q1 / 2))
        y[:3] = q1, q2, -q1
        y[3:6] = v[0] * np.array([1.0, -np.sin(q2) / np.sin(q1), -1.0])
        return y
    # 0.05 rad or m on every joint moves the cylinders of the shipped rig through a good part of their strokes.
    y[:nq] = pin.integrate(model, y[:nq], rng.uniform(-0.05, 0.05, nv))
    y[nq : nq + nv] = v
    return y


def error(ours: Array, theirs: Array, scale: float) -> float:
    """Largest difference in units of the scale; nothing where there is nothing."""
    return float(np.abs(ours - theirs).max(initial=0.0)) / max(scale, 1e-300)


def size(*values: Array) -> float:
    return max(float(np.abs(value).max(initial=0.0)) for value in values)


@pytest.mark.parametrize("name", MACHINES)
def test_kinematics_mass_matrix_and_bias_agree(name: str, rng: np.random.Generator) -> None:
    dynamics = bound(name, "multipliers")
    compiled, model, space = core.CompiledDynamics(dynamics), dynamics.rig.model, dynamics.space
    worst = dict.fromkeys(("M", "bias", "x", "rows", "gamma"), 0.0)
    for _ in range(STATES):
        y = random_state(dynamics, rng)
        q, v = y[: model.nq], y[model.nq : -2]
        out = compiled.evaluate(0.3, y)
        space.update(q, v)
        x, rows = space.coordinates.x, space.coordinates.rows
        M = pin.crba(model, space.kinematics.data, q)
        bias = pin.nonLinearEffects(model, space.kinematics.data, q, v)
        gamma = space.bias(v) if space.m else np.zeros(0)
        # Coordinates are differences of positions of up to some metres. J_dot v sums products of J and two velocities,
        # and the core takes gravity off accelerations and puts it on again. All may vanish where their terms do not.
        scales = {
            "M": size(M),
            "bias": size(bias),
            "x": size(x, np.ones(1)),
            "rows": size(rows),
            "gamma": size(gamma, model.gravity.linear, np.array([size(rows) * size(v) ** 2])),
        }
        for key, ours in (("M", M), ("bias", bias), ("x", x), ("rows", rows), ("gamma", gamma)):
            worst[key] = max(worst[key], error(ours, out[key], scales[key]))
    assert max(worst.values()) < 1e-12, worst


@pytest.mark.parametrize(("name", "formulation", "correction"), CASES)
def test_accelerations_and_multipliers_agree(
    name: str, formulation: str, correction: str, rng: np.random.Generator
) -> None:
    dynamics = bound(name, formulation, correction)
    compiled = core.CompiledDynamics(dynamics)
    worst = dict.fromkeys(("a", "reaction", "rate"), 0.0)
    for _ in range(STATES):
        y, t = random_state(dynamics, rng), rng.uniform(0.0, 1.0)
        rate, out = dynamics.rate(t, y), compiled.evaluate(t, y)
        # Both engines sum forces of 1e5..1e6 N that nearly cancel, and x itself carries a rounding that the oil
        # (5e7 N/m) turns into 1e-8 N; the scale of a and lambda is therefore that of the terms they are sums of:
        # a = M^-1 (p1 + J^T lambda), lambda = S^-1 (p2 - J M^-1 p1) with S = J M^-1 J^T known to a rounding only.
        eq = dynamics.equations
        inverse = np.abs(np.linalg.inv(eq.M))
        p1 = np.abs(dynamics.F) @ np.abs(dynamics.space.rows) + np.abs(eq.p1)
        p1 += np.abs(eq.J).T @ np.abs(dynamics.multipliers)
        scale_l = 1.0
        if len(eq.p2):
            S = eq.J @ np.linalg.solve(eq.M, eq.J.T)
            terms = np.abs(eq.p2) + np.abs(eq.J) @ inverse @ p1
            scale_l = size(np.abs(np.linalg.pinv(S, rcond=1e-9, hermitian=True)) @ terms, dynamics.multipliers)
        scale_a = size(inverse @ p1)
        worst["a"] = max(worst["a"], error(dynamics.a, out["a"], scale_a))
        worst["reaction"] = max(worst["reaction"], error(dynamics.multipliers, out["reaction"], scale_l))
        worst["rate"] = max(worst["rate"], error(rate[:-2], out["rate"][:-2], max(scale_a, size(rate[:-2]))))
    assert max(worst.values()) < 1e-12, worst


def test_the_shipped_rig_agrees_at_its_very_start(mkz49: Rig) -> None:
    dynamics = prepare(mkz49, Scenario())
    rate, out = (
        dynamics.rate(0.0, dynamics.initial()),
        core.CompiledDynamics(dynamics).evaluate(0.0, dynamics.initial()),
    )
    # At rest, before the loads have risen: held forces of 1e5 N balance, what remains is their rounding over masses.
    np.testing.assert_allclose(out["rate"], rate, atol=1e-9)
    assert out["status"] == 0
