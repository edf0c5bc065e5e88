"""What every force element must satisfy, asked of all of them: a new one is covered by being listed."""

from __future__ import annotations

import math
from typing import Any, Literal, get_args, get_origin

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from drillrig_pin.constraints import CONSTRAINTS
from drillrig_pin.declarations import DECLARATIONS
from drillrig_pin.elements.base import Element, Law
from drillrig_pin.elements.contact import Contact
from drillrig_pin.elements.fields import Direction, InitialOrNumber, Name
from drillrig_pin.elements.loads import LAWS, Constant, Harmonics, Load, Table, Term
from drillrig_pin.elements.registry import FORCES
from drillrig_pin.kinematics import Array

#: Legal words of the units in the grammar.
UNITS = {"m", "rad", "kg", "s", "N", "Pa", "Hz", "N/m", "N*s/m", "N*m", "N*m/rad", "N*m*s/rad", "m/s^2", "-"}
UNITS |= {"m/s", "rad/s"}


def _number(field: Any) -> st.SearchStrategy[float]:
    """Numbers within the bounds of a field; bounded where the grammar does not bound them."""
    low, high = -1e3, 1e3
    for bound in field.metadata:
        low = max(low, getattr(bound, "ge", -math.inf), getattr(bound, "gt", -math.inf))
        high = min(high, getattr(bound, "le", math.inf), getattr(bound, "lt", math.inf))
    above = any(hasattr(bound, "gt") for bound in field.metadata)
    return st.floats(low + 1e-3 if above else low, high)


def _value(name: str, field: Any) -> st.SearchStrategy[Any]:
    annotation = field.annotation
    if get_origin(annotation) is Literal:
        return st.sampled_from(get_args(annotation))
    if annotation is float:
        return _number(field)
    if annotation is str:
        return st.just("a_name")
    if "initial" in str(annotation):
        return st.just("initial") | st.floats(-1, 1)
    if "tuple" in str(annotation):
        return st.sampled_from([(1.0, 0.0, 0.0), (0.6, 0.0, -0.8)])
    raise AssertionError(f"no way is known to draw {name}: {annotation}; teach this test")


#: Sizes that make a cylinder; drawn at random from wide bounds hardly any would be one.
SIZES = {
    "bore": st.floats(0.05, 0.2),
    "rod": st.floats(0.01, 0.045),
    "length_retracted": st.floats(0.4, 1.5),
    "dead_length_a": st.floats(0.0, 0.1),
    "dead_length_b": st.floats(0.0, 0.1),
    "bulk_modulus": st.floats(1e8, 3e9),
    "precharge": st.floats(0, 1e7),
    "relief_pressure": st.just(2e7),
}


@st.composite
def elements(draw: Any, cls: type[Element]) -> Element:
    values = {
        name: draw(SIZES[name] if name in SIZES else _value(name, field)) for name, field in cls.model_fields.items()
    }
    element = cls(**values)
    assume(element.fault() is None)
    return element


@st.composite
def bound_laws(draw: Any, cls: type[Element]) -> tuple[Law, float, float]:
    """A law with an x in its domain and its x_dot."""
    element = draw(elements(cls))
    low, high = getattr(element, "length_range", (-1.0, 1.0))
    x0 = low + (high - low) * draw(st.floats(0.05, 0.95))
    # The printed law of the cylinder knows the shorter of the two ways only, so x stays within it on both sides.
    x = x0 + 0.9 * min(x0 - low, high - x0) * draw(st.floats(-1, 1))
    held = draw(st.floats(-1e4, 1e4)) if element.holding else 0.0
    return element.bind(x0, held), x, draw(st.floats(-2, 2))


def _one(value: Any) -> float:
    return float(np.ravel(value)[0])


def evaluate(law: Law, x: float, x_dot: float) -> tuple[float, float, float]:
    at, rate = np.array([x]), np.array([x_dot])
    return _one(law.force(at, rate, 0.0)), _one(law.energy(at)), _one(law.dissipation(at, rate))


FORCE_CLASSES = [cls for cls in FORCES.values() if not cls.load]


@pytest.mark.parametrize("cls", FORCE_CLASSES, ids=lambda cls: cls.tag)
@given(data=st.data())
def test_force_times_rate_is_what_leaves_the_store_less_what_is_lost(cls: type[Element], data: st.DataObject) -> None:
    law, x, x_dot = data.draw(bound_laws(cls))
    F, U, D = evaluate(law, x, x_dot)
    h = 1e-6
    # Where a law switches its energy has a kink in the second derivative, which a central difference of 1e-6 rounds.
    slope = (evaluate(law, x + h, 0.0)[1] - evaluate(law, x - h, 0.0)[1]) / (2 * h)
    scale = abs(F * x_dot) + abs(slope * x_dot) + D
    rounding = 1e-15 * abs(U) / h * abs(x_dot)
    curvature = 1e7 * h * abs(x_dot)
    assert abs(F * x_dot + slope * x_dot + D) <= 1e-5 * scale + 10 * rounding + curvature


@pytest.mark.parametrize("cls", FORCE_CLASSES, ids=lambda cls: cls.tag)
@given(data=st.data())
def test_nothing_but_a_load_brings_energy_in(cls: type[Element], data: st.DataObject) -> None:
    law, x, x_dot = data.draw(bound_laws(cls))
    F, U, D = evaluate(law, x, x_dot)
    # Not negative but for rounding of the products it may be a difference of.
    assert -1e-12 * (abs(F * x_dot) + abs(U) + 1) <= D
    assert evaluate(law, x, 0.0)[2] == 0.0, "at rest nothing is lost"


HOLDING = [cls for cls in FORCE_CLASSES if cls.holding is not Element.holding]


@pytest.mark.parametrize("cls", HOLDING, ids=lambda cls: cls.tag)
@given(data=st.data())
def test_a_holding_element_starts_with_the_force_it_was_found_to_hold(cls: type[Element], data: st.DataObject) -> None:
    element = data.draw(elements(cls))
    assume(element.holding)
    low, high = getattr(element, "length_range", (-1.0, 1.0))
    x0, held = low + 0.3 * (high - low), data.draw(st.floats(-1e5, 1e5))
    F, U, _ = evaluate(element.bind(x0, held), x0, 0.0)
    assert pytest.approx(held, rel=1e-12, abs=1e-8) == F
    assert pytest.approx(0.0, abs=1e-12) == U


@pytest.mark.parametrize("cls", FORCE_CLASSES, ids=lambda cls: cls.tag)
@given(data=st.data())
def test_stacked_laws_are_the_laws_themselves(cls: type[Element], data: st.DataObject) -> None:
    drawn = [data.draw(bound_laws(cls)) for _ in range(3)]
    laws = [law for law, _, _ in drawn]
    assume(len({type(law) for law in laws}) == 1)
    if not laws[0].stackable:
        return
    together = type(laws[0]).stack(laws)
    x, x_dot = (np.array([entry[i] for entry in drawn]) for i in (1, 2))
    alone = np.array([evaluate(*entry) for entry in drawn])
    for column, values in enumerate(
        (together.force(x, x_dot, 0.0), together.energy(x), together.dissipation(x, x_dot))
    ):
        np.testing.assert_allclose(values, alone[:, column], rtol=1e-13, atol=1e-300)
    switches = together.switches(x, x_dot)
    assert (switches is None) == (laws[0].switches(x[:1], x_dot[:1]) is None)


EVERY_TAG = {**FORCES, **CONSTRAINTS, **DECLARATIONS, **LAWS, "term": Term}


@pytest.mark.parametrize("tag", EVERY_TAG)
def test_every_element_says_what_it_is_and_every_number_its_unit(tag: str) -> None:
    cls = EVERY_TAG[tag]
    assert cls.tag == tag
    assert cls.__doc__
    assert not cls.__doc__.startswith("Base"), "a docstring of its own"
    for name, field in cls.model_fields.items():
        if name in ("name", "law", "terms", "samples", "header_units", "joints"):
            continue
        assert field.description, f"{tag}.{name} has no description"
        unit = (field.json_schema_extra or {}).get("unit")
        assert unit is not None, f"{tag}.{name} is made by neither quantity nor reference"
        if "float" in str(field.annotation):
            assert unit, f"{tag}.{name} is a number without a unit"
            assert set(unit.split(" or ")) <= UNITS, f"{tag}.{name}: unknown unit {unit!r}"


@pytest.mark.parametrize("cls", [Load], ids=["load"])
@pytest.mark.parametrize(
    "law",
    [
        Constant(value=3.0),
        Harmonics(mean=1.0, terms=(Term(amplitude=2.0, frequency=5.0),)),
        Table(samples=tuple((t / 10, t**2) for t in range(8))),
    ],
    ids=["constant", "harmonics", "table"],
)
def test_a_load_depends_on_time_alone(cls: type[Load], law: Any) -> None:
    element = cls(name="l", kind="force", point="P", axis=(0.0, 0.0, 2.0), law=law)
    bound = element.bind(0.0, 0.0)
    stacked = type(bound).stack([bound]) if bound.stackable else bound

    def at(x: Array, x_dot: Array) -> float:
        return _one(stacked.force(x, x_dot, 0.33))

    assert at(np.zeros(1), np.zeros(1)) == at(np.array([5.0]), np.array([-3.0]))
    assert element.load
    assert not element.holding


def test_a_direction_is_made_a_unit_vector() -> None:
    from pydantic import TypeAdapter, ValidationError

    assert TypeAdapter(Direction).validate_python("0 0 2") == (0.0, 0.0, 1.0)
    assert TypeAdapter(Direction).validate_python((3.0, 0.0, 4.0)) == pytest.approx((0.6, 0.0, 0.8))
    for bad in ("0 0 0", "1 2", "a b c"):
        with pytest.raises(ValidationError):
            TypeAdapter(Direction).validate_python(bad)
    for bad in ("nan 0 0", "inf 0 0", "0 -inf 1"):
        with pytest.raises(ValidationError):
            Contact(name="c", point="P", axis=bad, stiffness=1.0)
    for bad in ("", "a b", "1a", "a" * 101, "<x>"):
        with pytest.raises(ValidationError):
            TypeAdapter(Name).validate_python(bad)
    for bad in ("nan", "inf", "first"):
        with pytest.raises(ValidationError):
            TypeAdapter(InitialOrNumber, config={"allow_inf_nan": False}).validate_python(bad)
