"""A tip that leaves the face is never given an all-clear: closed forms, and a second judgement from the arrays."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rigs import NO_GRAVITY, joint, link, point, robot

from drillrig_pin import Scenario, Trajectory, load_rig_text, simulate
from drillrig_pin.analysis.design import design_of
from drillrig_pin.analysis.forces import ReactionRange, reaction_groups
from drillrig_pin.analysis.metrics import measure
from drillrig_pin.analysis.quantities import quantities
from drillrig_pin.analysis.verdict import Finding, Level, findings

MASS, SPRING, ROCK = 10.0, 4e4, 3.6e5
ENGINES = ["core", "python"]


def bilinear(mode: str = "unilateral", preload: float = 0.0, extension: str = "", damping: float = 0.0) -> str:
    """A mass on a spring both ways, and on rock one way; everything relaxed at zero."""
    contact = f'stiffness="{ROCK!r}" damping="{damping!r}" preload="{preload!r}" mode="{mode}"'
    return robot(
        link("mass", MASS),
        joint("slide", "prismatic", "world", "mass"),
        extension=NO_GRAVITY
        + point("P", "mass")
        + f'<joint_spring name="k" joint="slide" stiffness="{SPRING!r}" rest="0"/>\n'
        + f'<contact name="rock" point="P" axis="0 0 -1" {contact}/>\n'
        + extension,
    )


def bounced(model: str, speed: float = -1.0, **fields: object) -> Trajectory:
    case = {"duration": 2.0, "output_rate": 2000, "velocities": {"slide": speed}, **fields}
    return simulate(load_rig_text(model), Scenario(**case))  # type: ignore[arg-type]


def of_rock(run: Trajectory) -> ReactionRange:
    return next(r for r in measure(run).reactions if r.name == "rock")


def told(run: Trajectory) -> list[Finding]:
    metrics = measure(run)
    return [f for f in findings(metrics, design_of(run), metrics.hole, {}, run.outcome) if f.title == "rock"]


@pytest.mark.parametrize("engine", ENGINES)
def test_a_mass_that_bounces_on_rock_is_in_the_air_for_the_time_of_the_closed_form(engine: str) -> None:
    """In the air pi sqrt(m/k) of every period pi (sqrt(m/k) + sqrt(m/(k+c))): 75.97 % of 65.381 ms."""
    air, pressed = math.pi * math.sqrt(MASS / SPRING), math.pi * math.sqrt(MASS / (SPRING + ROCK))
    assert air + pressed == pytest.approx(65.381e-3, abs=1e-6)
    periods = 20
    run = bounced(bilinear(), duration=periods * (air + pressed), engine=engine)
    found = of_rock(run)
    assert found.lift_off is not None
    # Straight lines between rows of 0.5 ms miss a crossing by less than a tenth of a row, twice a period.
    assert found.tension == pytest.approx(air / (air + pressed), abs=2e-3)
    assert found.lift_off.impacts in (periods - 1, periods)
    assert found.lift_off.least == found.greatest == 0
    # All kinetic energy in the spring: gap = v sqrt(m / k); rows near the top of a flat arc.
    assert found.lift_off.gap == pytest.approx(math.sqrt(MASS / SPRING), rel=1e-4)
    assert all(finding.level is Level.BAD for finding in told(run))
    assert not any("pressed on" in finding.sentence for finding in told(run))


def test_no_advice_leads_from_a_red_verdict_to_a_green_one() -> None:
    pulled, free = told(bounced(bilinear("bilateral"))), told(bounced(bilinear()))
    assert {f.level for f in (*pulled, *free)} == {Level.BAD}
    assert "does not make the lift-off go away" in pulled[0].advice


#: What the preload of the contact carries.
PRESS = (
    '<load name="press" kind="force" point="P" axis="0 0 -1" frame="world"><constant value="8000" ramp="0"/></load>\n'
)


def test_a_tip_that_stays_on_is_said_to_and_its_share_is_nothing() -> None:
    run = bounced(bilinear(preload=8000.0, extension=PRESS), -0.01)
    (finding,) = told(run)
    found = of_rock(run)
    assert found.lift_off is not None
    assert (finding.level, found.tension, found.lift_off.impacts) == (Level.GOOD, 0.0, 0)
    assert "stays pressed on" in finding.sentence
    assert found.lift_off.least == pytest.approx(-run.of("element_force", "rock").max(), rel=1e-3)


HOLD = '<hold name="face" point="P" axes="x y"/>\n'
ELSEWHERE = '<point name="far" link="other"/>\n<hold name="post" point="far" axes="x"/>\n'


def held(extension: str) -> Trajectory:
    """The bouncing mass on a carriage that may move sideways too, and a second mass beside it."""
    model = robot(
        *(link(name) for name in ("a", "carriage", "other")),
        link("mass", MASS),
        joint("x", "prismatic", "world", "a", axis=(1, 0, 0)),
        joint("slide", "prismatic", "a", "carriage"),
        joint("bolted", "fixed", "carriage", "mass"),
        joint("side", "prismatic", "world", "other", axis=(1, 0, 0)),
        extension=NO_GRAVITY
        + point("P", "mass")
        + point("on_carriage", "carriage", (0.1, 0, 0))
        + point("ground", "world")
        + f'<joint_spring name="k" joint="slide" stiffness="{SPRING!r}" rest="0"/>\n'
        + f'<contact name="rock" point="P" axis="0 0 -1" stiffness="{ROCK!r}" mode="unilateral"/>\n'
        + extension,
    )
    return bounced(model, duration=0.5)


@pytest.mark.parametrize(
    ("extension", "name"),
    [
        ('<hold name="face" point="P" axes="x"/>\n', "Hold face (x of P)"),
        ('<hold name="guide" point="on_carriage" axes="x"/>\n', "Hold guide (x of on_carriage)"),
        ('<loop name="rail" from="ground" to="P" translations="x"/>\n', "Loop rail"),
        (ELSEWHERE, None),
    ],
)
def test_what_holds_the_body_of_a_tip_in_the_air_is_named(extension: str, name: str | None) -> None:
    sentences = " ".join(finding.sentence for finding in told(held(extension)))
    assert "off the face" in sentences
    assert ("holding" in sentences) == (name is not None)
    assert name is None or name in sentences


def test_reactions_stand_under_what_they_are() -> None:
    extension = '<hold name="face" point="P" axes="x"/>\n' + ELSEWHERE
    extension += '<loop name="rail" from="ground" to="far" translations="y"/>\n'
    groups = reaction_groups(measure(held(extension)).reactions)
    names = {title: [row.name for row in rows] for title, rows in groups.items()}
    assert names == {
        "Force of the face on the tip": ["face.x", "rock"],
        "Force of what holds the machine": ["post.x"],
        "Force and moment within loops": ["rail.y"],
    }


@settings(max_examples=20, deadline=None)
@given(
    mode=st.sampled_from(["bilateral", "unilateral"]),
    preload=st.floats(0, 5e3),
    speed=st.floats(-1, 1),
    damping=st.floats(0, 500),
)
def test_share_impacts_and_verdict_agree_with_the_arrays(
    mode: str, preload: float, speed: float, damping: float
) -> None:
    """The judgement a second time, from nothing but the stored force: rows without push, and changes between rows."""
    run = bounced(bilinear(mode, preload, damping=damping), speed, duration=0.5)
    found, force = of_rock(run), run.of("element_force", "rock")
    assert found.lift_off is not None
    tiny = 1e-9 * np.abs(force).max()
    off = force >= -tiny if mode == "unilateral" else force > tiny
    landings = int((off[:-1] & ~off[1:]).sum())
    # Each crossing lies within one row of where the force changes.
    assert found.tension == pytest.approx(off.mean(), abs=(2 * landings + 3) / len(force))
    assert found.lift_off.impacts == landings
    numbers = quantities(measure(run), None, ())
    assert numbers["rock.tension"].value == found.tension
    assert numbers["rock.impacts"].value == landings
    words = told(run)
    pressed_on = any("stays pressed on" in finding.sentence for finding in words)
    assert pressed_on == (found.tension == 0)
    if off.any():
        assert not pressed_on
        assert words[0].level is Level.BAD
