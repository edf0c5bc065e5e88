"""Every force law at numbers worked out here from the formulas of its docstring, one member at a time."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from drillrig_pin.coordinates import Line, Slide, Turn
from drillrig_pin.elements.contact import BilateralContact, Contact, UnilateralContact
from drillrig_pin.elements.cylinder import Cylinder, LockedOil, LockedOilAsPrinted
from drillrig_pin.elements.loads import Constant, HarmonicLaw, Harmonics, Load, Table, TableLaw, Term
from drillrig_pin.elements.springs import ConstantForce, JointSpring, JointTorque, Spring, SpringDamper
from drillrig_pin.kinematics import Anchor
from drillrig_pin.stabilization import Baumgarte, NoCorrection, SlidingMode, automatic_rate

#: Two members at once, neither of them with a number that makes a term vanish.
X, X_DOT = np.array([1.03, 0.9]), np.array([0.2, -0.7])
OIL = (np.array([1.0, 0.95]), 2e9, 3e-3, 2e-3, 0.3, np.array([0.4, 0.25]), 5e6, 2e6, 40.0)
EXACT = {"rtol": 1e-13}


def worked_out(sign_b: float) -> list[tuple[float, float, float, float, float]]:
    """p_A, p_B, F, U, D of both members."""
    answers = []
    for i in range(2):
        x0, E0, S_A, S_B, l_A, l_B, p_A0, p_B0, k = (float(np.broadcast_to(value, 2)[i]) for value in OIL)
        u = float(X[i]) - x0
        p_A = p_A0 - E0 * math.log(1 + u / l_A)
        p_B = p_B0 - sign_b * E0 * math.log(1 - sign_b * u / l_B)
        steps = 20_000
        # The energy is the work against the force at no speed, here by the midpoint rule.
        U = 0.0
        for j in range(steps):
            w = u * (j + 0.5) / steps
            a = p_A0 - E0 * math.log(1 + w / l_A)
            b = p_B0 - sign_b * E0 * math.log(1 - sign_b * w / l_B)
            U -= (a * S_A - b * S_B) * u / steps
        F = p_A * S_A - p_B * S_B - k * float(X_DOT[i])
        answers.append((p_A, p_B, F, U, k * float(X_DOT[i]) ** 2))
    return answers


@pytest.mark.parametrize(("law", "sign_b"), [(LockedOil, 1.0), (LockedOilAsPrinted, -1.0)])
def test_locked_oil(law: type[LockedOil], sign_b: float) -> None:
    oil = law(*OIL)
    p_A, p_B, F, U, D = np.array(worked_out(sign_b)).T
    for strains in (None, oil.strains(X)):
        assert_allclose(oil.pressures(X, strains), (p_A, p_B), rtol=1e-11)
        assert_allclose(oil.energy(X, strains), U, rtol=1e-7)
    assert_allclose(oil.force(X, X_DOT, 0.0), F, rtol=1e-11)
    assert_allclose(oil.dissipation(X, X_DOT), D, **EXACT)
    assert_allclose(oil.stiffness(), 2e9 * (3e-3 / 0.3 + 2e-3 / np.array([0.4, 0.25])), **EXACT)
    assert oil.switches(X, X_DOT) is None
    assert oil.breakpoints().size == 0


def cylinder(**changes: Any) -> Cylinder:
    sizes = {"bore": 0.1, "rod": 0.06, "length_retracted": 0.7, "dead_length_a": 0.05, "dead_length_b": 0.15}
    given = {"name": "oil", "from": "A", "to": "B", "bulk_modulus": 2e9, "friction": 7.0, "precharge": 3e5, **sizes}
    return Cylinder.model_validate({**given, **changes})


S_A, S_B = math.pi * 0.1**2 / 4, math.pi * (0.1**2 - 0.06**2) / 4


def test_a_cylinder_is_what_its_sizes_say() -> None:
    oil = cylinder()
    assert oil.holding
    assert (oil.piston_area, oil.annulus_area) == pytest.approx((S_A, S_B), rel=1e-14)
    assert oil.stroke == pytest.approx(0.5)
    assert oil.length_range == pytest.approx((0.7, 1.2))
    assert oil.fault() is None
    assert "not thinner than the bore" in str(cylinder(rod=0.1).fault())
    assert "no stroke" in str(cylinder(dead_length_a=0.55).fault())
    assert cylinder(dead_length_a=0.549).fault() is None


@pytest.mark.parametrize("held", [5e3, -5e3, 3e5 * (S_A - S_B), 3e5 * (S_A - S_B) - 1.0, 1e3])
def test_the_less_loaded_chamber_rests_at_the_precharge_and_both_carry_the_static_force(held: float) -> None:
    p_A, p_B = cylinder().rest_pressures(held)
    assert p_A * S_A - p_B * S_B == pytest.approx(held, rel=1e-12)
    assert min(p_A, p_B) == pytest.approx(3e5, rel=1e-12), "the other chamber holds more"


@pytest.mark.parametrize(("word", "law"), [("geometric", LockedOil), ("printed", LockedOilAsPrinted)])
def test_a_cylinder_shut_at_a_length_starts_with_its_columns_and_its_force(word: str, law: type[LockedOil]) -> None:
    bound = cylinder(law=word).bind(0.9, 5e3)
    assert type(bound) is law
    p_A, p_B = cylinder().rest_pressures(5e3)
    expected = (0.9, 2e9, S_A, S_B, 0.2, 0.3, p_A, p_B, 7.0)
    found = (bound.x0, bound.E0, bound.S_A, bound.S_B, bound.l_A, bound.l_B, bound.p_A0, bound.p_B0, bound.k)
    assert found == pytest.approx(expected, rel=1e-12)
    assert bound.force(np.array([0.9]), np.zeros(1), 0.0) == pytest.approx(5e3)


def test_a_bilateral_contact() -> None:
    law = BilateralContact(np.array([1.0, 0.8]), 5.0, 2e3, np.array([30.0, 60.0]))
    u = X - np.array([1.0, 0.8])
    assert_allclose(law.force(X, X_DOT, 0.0), [-(5 + 60 + 6), -(5 + 200 - 42)], **EXACT)
    assert_allclose(law.energy(X), 5 * u + 1e3 * u**2, **EXACT)
    assert_allclose(law.dissipation(X, X_DOT), [30 * 0.04, 60 * 0.49], **EXACT)


#: u, u_dot, and what the contact of stiffness 100 N/m, damping 10 N s/m and preload 20 N does: -F, U, D, switches.
TOUCHING = [
    (0.1, 0.5, 35.0, 4.5, 10 * 0.25, (0.3, 35.0)),  # presses, inwards
    (0.1, -1.0, 20.0, 4.5, 10.0, (0.3, 20.0)),  # presses, outwards
    (0.1, -5.0, 0.0, 4.5, 30.0 * 5.0, (0.3, -20.0)),  # leaves faster than the rock follows: the stored force is lost
    (-0.3, 5.0, 0.0, 0.0, 0.0, (-0.1, 40.0)),  # lifted off, coming back
    (-0.3, -5.0, 0.0, 0.0, 0.0, (-0.1, -60.0)),  # lifted off, going away
    (-0.25, 1.0, 0.0, 0.0, 0.0, (-0.05, 5.0)),  # nearly touching
    (0.0, 0.0, 20.0, 2.0, 0.0, (0.2, 20.0)),  # at rest: the preload
]


def test_a_unilateral_contact_in_each_of_its_states() -> None:
    x0 = 0.5
    law = UnilateralContact(x0, 20.0, 100.0, 10.0)
    table = np.array([row[:5] for row in TOUCHING])
    x, x_dot = x0 + table[:, 0], table[:, 1]
    assert_allclose(law.force(x, x_dot, 0.0), -table[:, 2], atol=1e-12)
    assert_allclose(law.energy(x), table[:, 3], atol=1e-12)
    assert_allclose(law.dissipation(x, x_dot), table[:, 4], atol=1e-12)
    for i, (*_, expected) in enumerate(TOUCHING):
        assert_allclose(law.switches(x[i : i + 1], x_dot[i : i + 1]), expected, atol=1e-12)


def test_a_contact_that_presses_on_nothing_at_no_depth_pushes_nothing() -> None:
    """Touching begins beyond zero depth: at zero the damper of an approaching tip does not push yet."""
    law = UnilateralContact(0.0, 0.0, 100.0, 10.0)
    assert law.force(np.zeros(1), np.ones(1), 0.0) == 0.0


def contact(**changes: Any) -> Contact:
    return Contact.model_validate({"name": "rock", "point": "P", "stiffness": 9, "damping": 3, "preload": 2, **changes})


@pytest.mark.parametrize(("mode", "law"), [("bilateral", BilateralContact), ("unilateral", UnilateralContact)])
def test_a_contact_is_bound_where_it_starts(mode: str, law: type[BilateralContact]) -> None:
    bound = contact(mode=mode).bind(0.4, 0.0)
    assert type(bound) is law
    assert (bound.x0, bound.N0, bound.c, bound.k) == (0.4, 2.0, 9.0, 3.0)
    assert not contact().holding


def test_a_spring_and_damper() -> None:
    law = SpringDamper(0.5, np.array([3.0, -2.0]), 200.0, 8.0)
    u = X - 0.5
    assert_allclose(law.force(X, X_DOT, 0.0), [3 - 106 - 1.6, -2 - 80 + 5.6], **EXACT)
    assert_allclose(law.energy(X), -np.array([3.0, -2.0]) * u + 100 * u**2, **EXACT)
    assert_allclose(law.dissipation(X, X_DOT), [8 * 0.04, 8 * 0.49], **EXACT)


def test_a_constant_force() -> None:
    law = ConstantForce(np.array([3.0, -2.0]))
    assert law.force(X, X_DOT, 0.0).tolist() == [3.0, -2.0]
    assert ConstantForce(4.0).force(X, X_DOT, 0.0).tolist() == [4.0, 4.0]
    assert_allclose(law.energy(X), [-3.09, 1.8], **EXACT)
    assert JointTorque(name="t", joint="j", value=7.0).bind(1.0, 2.0) == ConstantForce(7.0)


@pytest.mark.parametrize(
    ("make", "rest"),
    [
        (lambda **given: JointSpring(name="s", joint="j", stiffness=20.0, damping=3.0, **given), "rest"),
        (
            lambda **given: Spring.model_validate(
                {"name": "s", "from": "A", "to": "B", "stiffness": 20.0, "damping": 3.0, **given}
            ),
            "rest_length",
        ),
    ],
    ids=["joint_spring", "spring"],
)
def test_a_spring_is_relaxed_where_it_starts_or_where_it_says(make: Any, rest: str) -> None:
    assert make().bind(0.4, 6.0) == SpringDamper(0.4, 6.0, 20.0, 3.0)
    assert make(**{rest: "initial"}).holding
    told = make(**{rest: 0.1})
    assert told.bind(0.4, 0.0) == SpringDamper(0.1, 0.0, 20.0, 3.0)
    assert not told.holding


def test_a_spring_without_stiffness_carries_nothing_at_rest() -> None:
    assert not JointSpring(name="s", joint="j", stiffness=0.0).holding
    assert not Spring.model_validate({"name": "s", "from": "A", "to": "B", "stiffness": 0}).holding
    assert JointSpring(name="s", joint="j", stiffness=0.5).holding
    assert Spring.model_validate({"name": "s", "from": "A", "to": "B", "stiffness": 0.5}).holding


def harmonics() -> HarmonicLaw:
    series = Harmonics(
        mean=10.0, ramp=2.0, terms=(Term(amplitude=3.0, frequency=0.5, phase=0.3), Term(amplitude=1.0, frequency=2.0))
    )
    law = series.law()
    assert isinstance(law, HarmonicLaw)
    return law


def series_at(t: float) -> float:
    return 10 + 3 * math.sin(math.pi * t + 0.3) + math.sin(4 * math.pi * t)


@pytest.mark.parametrize("t", [0.0, 0.3, 1.0, 1.7, 2.0, 2.9, 77.7])
def test_a_series_of_sines_after_a_smooth_start(t: float) -> None:
    s = min(t / 2.0, 1.0)
    expected = (6 * s**5 - 15 * s**4 + 10 * s**3) * series_at(t)
    law = harmonics()
    assert float(law.force(np.zeros(1), np.zeros(1), t)) == pytest.approx(expected, rel=1e-12, abs=1e-12)
    assert law.breakpoints().tolist() == [2.0]
    together = HarmonicLaw.stack([law, Constant(value=4.0).law(), Constant(value=5.0, ramp=1.0).law()])
    r = min(t, 1.0)
    others = [4.0, 5.0 * (6 * r**5 - 15 * r**4 + 10 * r**3)]
    assert_allclose(together.force(np.zeros(3), np.zeros(3), t), [expected, *others], rtol=1e-12, atol=1e-12)
    assert together.breakpoints().tolist() == [2.0, 0.0, 1.0]


def table() -> TableLaw:
    times = np.array([0.5, 1.0, 1.4, 2.0, 2.6, 3.0])
    law = Table(samples=tuple(zip(times.tolist(), (times**3 - 2 * times).tolist(), strict=True)), scale=2.0).law()
    assert isinstance(law, TableLaw)
    return law


@pytest.mark.parametrize(("t", "at"), [(0.5, 0.5), (0.8, 0.8), (2.2, 2.2), (3.0, 3.0), (0.1, 0.5), (9.0, 3.0)])
def test_a_table_is_a_spline_that_follows_a_cubic_exactly_and_keeps_its_end_values(t: float, at: float) -> None:
    law = table()
    value = law.force(np.zeros(1), np.zeros(1), t)
    assert value.shape == (1,)
    assert value[0] == pytest.approx(2 * (at**3 - 2 * at), rel=1e-12)
    assert law.breakpoints().tolist() == [0.5, 1.0, 1.4, 2.0, 2.6, 3.0]


def test_the_knots_of_a_table_are_its_cubics() -> None:
    rows = table().knots()
    assert rows.shape == (6, 5)
    assert_allclose(rows[-1], [3.0, 0, 0, 0, 0])
    for time, *cubic in rows[:-1]:
        # 2 (t^3 - 2 t) about t = time.
        assert_allclose(cubic, [2.0, 6 * time, 6 * time**2 - 4, 2 * (time**3 - 2 * time)], rtol=1e-9, atol=1e-9)


class Places:
    """A resolver that remembers what it was asked for."""

    def point(self, name: str) -> Anchor:
        return {"A": Anchor(1, (1.0, 0.0, 0.0)), "B": Anchor(2, (0.0, 1.0, 0.0)), "P": Anchor(3, (0.0, 0.0, 1.0))}[name]

    def direction(self, point: str, axis: tuple[float, float, float], frame: str) -> Anchor:
        return Anchor(0 if frame == "world" else self.point(point).joint, axis, 0)

    def joint(self, name: str) -> Any:
        return f"joint {name}"


def load(**changes: Any) -> Load:
    given = {"name": "l", "kind": "force", "point": "P", "axis": (0.0, 0.6, 0.8), "law": Constant(value=1.0)}
    return Load.model_validate({**given, **changes})


def test_elements_act_along_the_coordinates_they_name() -> None:
    places = Places()
    assert cylinder().coordinate(places) == Line(places.point("A"), places.point("B"))
    spring = Spring.model_validate({"name": "s", "from": "B", "to": "A", "stiffness": 1})
    assert spring.coordinate(places) == Line(places.point("B"), places.point("A"))
    assert JointSpring(name="s", joint="j", stiffness=1.0).coordinate(places) == "joint j"
    assert JointTorque(name="t", joint="k", value=1.0).coordinate(places) == "joint k"
    slide = contact(axis="0 1 0").coordinate(places)
    assert slide == Slide(places.point("P"), Anchor(0, (0.0, 1.0, 0.0), 0), Anchor(0, (0.0, 0.0, 0.0)))


@pytest.mark.parametrize(("frame", "joint"), [("world", 0), ("body", 3)])
def test_a_load_pushes_along_its_axis_or_turns_about_it(frame: str, joint: int) -> None:
    places = Places()
    direction = Anchor(joint, (0.0, 0.6, 0.8), 0)
    pushing, turning = (load(kind=kind, frame=frame).coordinate(places) for kind in ("force", "torque"))
    assert pushing == Slide(places.point("P"), direction, Anchor(0, (0.0, 0.0, 0.0)))
    assert turning == Turn(3, direction)
    assert load().frame == "body"


def test_a_load_knows_over_which_time_it_is_known() -> None:
    law = Table(samples=((0.5, 1.0), (1.0, 2.0), (1.5, 2.0), (2.0, 0.0)))
    assert (load(law=law).start_of_table(), load(law=law).end_of_table()) == (0.5, 2.0)
    assert (load().start_of_table(), load().end_of_table()) == (-math.inf, math.inf)
    assert isinstance(load().bind(3.0, 4.0), HarmonicLaw)


def test_the_corrections_of_a_constraint() -> None:
    f, f_dot = np.array([1e-3, -2e-3]), np.array([0.3, 0.1])
    assert NoCorrection()(f, f_dot).tolist() == [0.0, 0.0]
    assert_allclose(Baumgarte(5.0, 7.0)(f, f_dot), -10 * f_dot - 49 * f, **EXACT)
    sliding = SlidingMode(20.0, 3.0, 0.5)
    expected = [-20 * d - 3 * math.tanh((d + 20 * e) / 0.5) for e, d in zip(f, f_dot, strict=True)]
    assert_allclose(sliding(f, f_dot), expected, **EXACT)
    assert automatic_rate(1e-3) == pytest.approx(200.0)
    assert (NoCorrection().parameters, Baumgarte(5.0, 7.0).parameters, sliding.parameters) == (
        (0, [0.0, 0.0, 0.0]),
        (1, [5.0, 7.0, 0.0]),
        (2, [20.0, 3.0, 0.5]),
    )


def test_half_way_up_a_short_ramp_a_load_has_half_its_value() -> None:
    law = Constant(value=8.0, ramp=0.4).law()
    assert law.force(np.zeros(1), np.zeros(1), 0.2) == pytest.approx(4.0)
    assert law.force(np.zeros(1), np.zeros(1), 0.1) == pytest.approx(8.0 * (10 / 4**3 - 15 / 4**4 + 6 / 4**5))
