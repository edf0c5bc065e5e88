"""Joints that follow others, by URDF's <mimic> or a <gear>: their motion, their reaction, their statics."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rigs import NO_GRAVITY, joint, link, point, robot

from drillrig_pin import ModelError, Scenario, load_rig_text, simulate
from drillrig_pin.check import check_text
from drillrig_pin.simulation import prepare, start_state

ENGINES = ["core", "python"]


def linkage(multiplier: float = -1.0, offset: float = 0.0, extension: str = "", mimic: str | None = None) -> str:
    """A boom of 400 kg on a spring with a head of 50 kg that a linkage keeps parallel; hinges about y."""
    written = f'<mimic joint="boom_pin" multiplier="{multiplier!r}" offset="{offset!r}"/>' if mimic is None else mimic
    head = joint("head_pin", "revolute", "boom", "head", (3, 0, 0), (0, 1, 0))
    return robot(
        link("boom", 400.0, (1.5, 0, 0), (10, 300, 300)),
        joint("boom_pin", "revolute", "world", "boom", (0, 0, 1), (0, 1, 0)),
        link("head", 50.0, (0.3, 0, 0), (1, 3, 3)),
        head.replace("</joint>", f"{written}</joint>"),
        extension='<joint_spring name="hold" joint="boom_pin" stiffness="1e6" damping="1e3"/>'
        + point("tip", "boom", (3, 0, 0))
        + extension,
    )


@pytest.mark.parametrize("engine", ENGINES)
def test_a_head_kept_parallel_moves_as_a_mass_on_a_translating_arm(engine: str) -> None:
    rig = load_rig_text(linkage())
    run = simulate(rig, Scenario(duration=0.5, velocities={"boom_pin": 0.5, "head_pin": -0.5}, engine=engine))
    boom, head = run.q.T
    # Rounding of the projection.
    np.testing.assert_allclose(head, -boom, atol=1e-12)
    assert np.ptp(boom) > 0.01
    # The head does not turn: boom about its pin, head as a point at 3 m, and its own turning force cannot be seen.
    # (I + m l^2) a = k and damper less gravity; k (q - q0) and the static moment cancel at the start.
    inertia = 300 + 400 * 1.5**2 + 50 * 3.0**2
    weight = 9.81 * (400 * 1.5 + 50 * 3.0)
    q0 = boom[0]
    moment = -1e6 * (boom - q0) - 1e3 * run.v[:, 0] + weight * (np.cos(boom) - np.cos(q0))
    np.testing.assert_allclose(run.a[:, 0], moment / inertia, atol=1e-6 * np.abs(run.a).max())
    # What the linkage must give: head's moment about its pin, m (g - acceleration) x lever; it does no work.
    assert run.labels["constraint"] == ["head_pin.mimic.angle"]
    assert np.abs(run.energy_residual).max() < 1e-8 * run.energy_kinetic[0]


def test_at_rest_the_linkage_carries_the_head_and_leads_it_back_to_the_boom() -> None:
    state = start_state(load_rig_text(linkage()), Scenario())
    # The head's weight of 50 g at 0.3 m turns it down, about +y; the linkage holds it with the opposite.
    assert state.reaction == pytest.approx([-50 * 9.81 * 0.3], rel=1e-9)
    # And the boom's spring carries boom and head as if the head's mass sat on its pin.
    assert state.held["hold"] == pytest.approx(-9.81 * (400 * 1.5 + 50 * 3.0), rel=1e-9)
    assert state.at_rest


def test_a_follower_starts_where_its_leader_puts_it() -> None:
    rig = load_rig_text(linkage(-0.5, 0.2))
    for boom in (0.0, 0.3, -0.4):
        q = start_state(rig, Scenario(positions={"boom_pin": boom})).assembly.q
        np.testing.assert_allclose(q, [boom, 0.2 - 0.5 * boom], atol=1e-13)
    # Both given: the machine is assembled with the smallest change of both.
    q = start_state(rig, Scenario(positions={"boom_pin": 0.1, "head_pin": 0.0})).assembly.q
    assert q[1] == pytest.approx(0.2 - 0.5 * q[0])


@settings(max_examples=10, deadline=None)
@given(
    ratios=st.lists(st.floats(-2.0, 2.0).filter(lambda r: abs(r) > 0.05), min_size=1, max_size=3),
    offset=st.floats(-0.5, 0.5),
    kinds=st.lists(st.sampled_from(["revolute", "prismatic", "continuous"]), min_size=4, max_size=4),
)
def test_a_chain_of_followers_is_one_body_of_the_inertia_it_reflects(
    ratios: list[float], offset: float, kinds: list[str]
) -> None:
    # Wheels and carriages side by side on the ground, each following the one before: m_eff = sum m_i prod ratio^2.
    parts, reflected, ratio = [], 0.0, 1.0
    for i, kind in enumerate(kinds[: len(ratios) + 1]):
        ratio *= ratios[i - 1] if i else 1.0
        reflected += (2.0 + i if kind == "prismatic" else 0.1 * (1 + i)) * ratio**2
        text = joint(f"j{i}", kind, "world", f"b{i}", (i, 0, 0))
        if i:
            follows = f'<mimic joint="j{i - 1}" multiplier="{ratios[i - 1]!r}" offset="{offset!r}"/>'
            text = text.replace("</joint>", f"{follows}</joint>")
        parts += [link(f"b{i}", 2.0 + i, inertia=(0.1 * (1 + i),) * 3), text]
    push = '<joint_torque name="push" joint="j0" value="3"/>'
    rig = load_rig_text(robot(*parts, extension=NO_GRAVITY + push))
    runs = [simulate(rig, Scenario(duration=0.2, output_rate=50, engine=engine)) for engine in ENGINES]
    for run in runs:
        np.testing.assert_allclose(run.a[:, 0], 3.0 / reflected, rtol=1e-9)
        for i, gear in enumerate(ratios):
            np.testing.assert_allclose(run.q[:, i + 1], gear * run.q[:, i] + offset, atol=1e-11)
    np.testing.assert_allclose(runs[0].reaction, runs[1].reaction, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("formulation", ["multipliers", "null_space", "damped"])
def test_both_engines_agree_on_gears_beside_loops_and_holds(formulation: str) -> None:
    core = pytest.importorskip("drillrig_pin.core")
    held = '<hold name="face" point="tip" axes="x"/><gear name="g" joint="slide" mimics="boom_pin" ratio="0.3"/>'
    text = linkage(extension=held + point("Q", "sled")).replace(
        "<drillrig>",
        link("sled", 5.0) + joint("slide", "prismatic", "head", "sled", (0.1, 0, 0), (0, 0.6, 0.8)) + "<drillrig>",
    )
    dynamics = prepare(load_rig_text(text), Scenario(formulation=formulation, positions={"boom_pin": 0.2}))
    compiled = core.CompiledDynamics(dynamics)
    assert [row.name for row in dynamics.rig.rows] == ["face.x", "g.slide", "head_pin.mimic.angle"]
    rng = np.random.default_rng(5)
    for _ in range(20):
        y = dynamics.initial()
        y[:-2] += rng.uniform(-0.2, 0.2, len(y) - 2)
        rate = dynamics.rate(0.0, y)
        out = compiled.evaluate(0.0, y)
        np.testing.assert_allclose(out["rate"], rate, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(out["gamma"], dynamics.space.bias(y[dynamics.rig.model.nq : -2]), atol=1e-9)


def test_gears_that_cannot_be_are_one_sentence_with_its_line() -> None:
    for mimic, words in (
        ('<mimic joint="head_pin"/>', "a joint cannot follow itself"),
        ('<mimic joint="boom_pim"/>', "no moving joint 'boom_pim'"),
    ):
        with pytest.raises(ModelError, match=words):
            load_rig_text(linkage(mimic=mimic))


def test_check_takes_a_mimic_and_a_page_of_results_names_its_moment() -> None:
    assert not [problem for problem in check_text(linkage(), "linkage.urdf") if problem.severity == "error"]
    written = linkage(mimic="", extension='<gear name="rods" joint="head_pin" mimics="boom_pin" ratio="-1"/>')
    runs = [simulate(load_rig_text(text), Scenario(duration=0.1)) for text in (linkage(), written)]
    np.testing.assert_allclose(runs[0].q, runs[1].q, atol=1e-12)
    assert runs[1].labels["constraint"] == ["rods.angle"]
