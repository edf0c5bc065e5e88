"""The shipped model is the machine of [Tram2023]: geometry, masses, sources of its numbers; other tools read it too."""

from __future__ import annotations

import io

import mujoco
import numpy as np
import pinocchio as pin
import pytest
import yourdfpy

from drillrig_pin import ModelError, Rig, Scenario, load_rig, load_scenario, simulate
from drillrig_pin.elements.cylinder import ATMOSPHERE, Cylinder
from drillrig_pin.files import shipped_scenarios
from drillrig_pin.simulation import start_state
from drillrig_pin.statics import Equilibrium
from drillrig_pin.workspace import Workspace

#: Origins of the DH frames at hole no. 9, computed from table 1 apart from this package; printed to 0.1 mm.
ORIGINS = {
    "swing_base": (0.1548, 0.0081, 0.8690),
    "upper_boom": (1.9635, 0.1029, 1.5642),
    "boom_head": (2.2525, 0.1180, 1.6753),
    "bracket": (2.3384, 0.1206, 1.8979),
    "feed_beam": (2.3384, 0.1206, 1.8979),
}
MASSES = {
    "swing_base": 27.377,
    "lower_boom": 79.143,
    "upper_boom": 19.929,
    "boom_head": 32.997,
    "bracket": 24.560,
    "feed_beam": 87.032,
}
#: Table 6; for the three long links turned about y, so that the small moment lies on z (reading `aligned`).
MOMENTS = {
    "swing_base": (0.3295, 0.8525, 1.024),
    "lower_boom": (12.6658, 12.664, 0.8597),
    "upper_boom": (2.9135, 2.9135, 0.2135),
    "boom_head": (0.3600, 1.0170, 1.0236),
    "bracket": (0.1994, 0.5367, 0.6227),
    "feed_beam": (48.8433, 48.7536, 0.6551),
}
JOINTS = ["boom_swing", "boom_lift", "boom_extension", "head_rotation", "bracket_swing", "feed_lift"]


def frames(rig: Rig, q: np.ndarray) -> dict[str, pin.SE3]:
    data = rig.model.createData()
    pin.framesForwardKinematics(rig.model, data, q)
    return {frame.name: data.oMf[i] for i, frame in enumerate(rig.model.frames) if frame.type == pin.FrameType.BODY}


def body_inertia(rig: Rig, link: str) -> pin.Inertia:
    """Inertia of one link in its own frame; the tree merges nothing into a joint but that one body."""
    frame = rig.model.frames[rig.model.getBodyId(link)]
    return frame.placement.actInv(rig.model.inertias[frame.parentJoint])


def test_dh_frames_lie_where_table_1_puts_them(mkz49: Rig, hole_9: Equilibrium) -> None:
    placed = frames(mkz49, hole_9.assembly.q)
    for link, origin in ORIGINS.items():
        np.testing.assert_allclose(placed[link].translation, origin, atol=5.1e-5, err_msg=link)
    np.testing.assert_allclose(placed["feed_beam"].rotation[:, 2], (0.8862, 0.0383, -0.4618), atol=5.1e-5)


def test_pose_hole_9_is_the_printed_one(mkz49: Rig, hole_9: Equilibrium) -> None:
    assert mkz49.joints == JOINTS
    printed = np.array([3.0, 69.0, np.degrees(1.940), 90.0, -90.7, -41.5])
    np.testing.assert_allclose(np.degrees(hole_9.assembly.q), printed, atol=1e-12)


def test_the_tip_lies_where_the_printed_angles_put_it(mkz49: Rig, hole_9: Equilibrium) -> None:
    space = Workspace(mkz49, ())
    space.update(hole_9.assembly.q, np.zeros(6))
    tip = space.points()[mkz49.tracked.index("E")]
    np.testing.assert_allclose(
        tip, np.array(ORIGINS["feed_beam"]) + 1.929 * np.array([0.8862, 0.0383, -0.4618]), atol=2e-4
    )


def test_masses_and_tensors_are_those_of_table_6(mkz49: Rig) -> None:
    for link, mass in MASSES.items():
        inertia = body_inertia(mkz49, link)
        assert inertia.mass == pytest.approx(mass, rel=1e-12), link
        np.testing.assert_allclose(np.diag(inertia.inertia), MOMENTS[link], rtol=1e-9, err_msg=link)
    moving = pin.computeTotalMass(mkz49.model)
    assert moving == pytest.approx(sum(MASSES.values()), rel=1e-12)


def test_centres_of_mass_are_those_of_table_2(mkz49: Rig) -> None:
    expected = {
        "swing_base": (-0.058, 0.046, 0),
        "lower_boom": (0, 0, 0.684),
        "upper_boom": (0, 0, -0.530),
        "boom_head": (0, 0.310, 0),
        "bracket": (-0.237, 0.047, 0),
        "feed_beam": (0, 0, 0.561),
    }
    for link, centre in expected.items():
        np.testing.assert_allclose(body_inertia(mkz49, link).lever, centre, atol=1e-12, err_msg=link)


def test_printed_readings_can_be_chosen() -> None:
    printed = load_rig(
        "mkz49", inertia_reading="printed", com_reading="printed", cylinder_law="printed", load_reading="printed"
    )
    np.testing.assert_allclose(body_inertia(printed, "feed_beam").lever, (0, 0.561, 0), atol=1e-12)
    np.testing.assert_allclose(
        np.diag(body_inertia(printed, "upper_boom").inertia), (0.2135, 2.9135, 2.9135), rtol=1e-9
    )
    elements = {element.name: element for element in printed.forces}
    assert elements["lift_cylinder"].law == "printed"
    assert elements["drilling_force"].frame == "world"


def test_every_number_of_the_model_has_a_unit_and_a_source(mkz49: Rig) -> None:
    table = mkz49.file.parameters()
    assert len(table) > 100
    for name, row in table.items():
        assert row.unit, name
        assert row.text, name
        assert row.source.split(":")[0] in ("paper", "derived", "assumed"), name
        assert row.source.split(":", 1)[1].strip(), name
    assert mkz49.file.declared == set(table), "every argument has its row and every row its argument"


def test_each_cylinder_starts_with_a_tenth_of_its_stroke_to_spare(mkz49: Rig, hole_9: Equilibrium) -> None:
    cylinders = [element for element in mkz49.forces if isinstance(element, Cylinder)]
    assert len(cylinders) == 5
    for cylinder in cylinders:
        used = (hole_9.x0[cylinder.name] - cylinder.length_retracted) / cylinder.stroke
        assert 0.1 <= used <= 0.9, cylinder.name


def test_each_cylinder_that_turns_a_joint_has_a_lever_arm_of_a_tenth_of_a_metre(
    mkz49: Rig, hole_9: Equilibrium
) -> None:
    cylinders = [element for element in mkz49.forces if isinstance(element, Cylinder)]
    space = Workspace(mkz49, cylinders)
    space.update(hole_9.assembly.q, np.zeros(6))
    joint_of = dict(zip([c.name for c in cylinders], (0, 1, 2, 4, 5), strict=True))
    for cylinder, i in zip(cylinders, space.index, strict=True):
        row = space.rows[i]
        own = joint_of[cylinder.name]
        assert np.flatnonzero(np.abs(row) > 1e-12).tolist() == [own], "a cylinder acts on one joint"
        if own != 2:
            assert abs(row[own]) >= 0.1, cylinder.name


def test_static_pressures_are_those_of_a_machine(mkz49: Rig, hole_9: Equilibrium) -> None:
    for element in mkz49.forces:
        if isinstance(element, Cylinder):
            for pressure in hole_9.pressures[element.name]:
                # Above 1 bar absolute, below what the relief valve lets stand.
                assert 1e5 - ATMOSPHERE < pressure < element.relief_pressure, element.name


def test_pinocchio_yourdfpy_and_mujoco_read_the_expanded_file(mkz49: Rig) -> None:
    text = mkz49.file.text
    assert list(pin.buildModelFromXML(text).names)[1:] == JOINTS
    assert yourdfpy.URDF.load(io.StringIO(text), load_meshes=False).actuated_joint_names == JOINTS
    other = mujoco.MjModel.from_xml_string(text)
    assert [other.joint(i).name for i in range(other.njnt)] == JOINTS


def test_yourdfpy_places_the_links_where_we_do(mkz49: Rig, hole_9: Equilibrium) -> None:
    urdf = yourdfpy.URDF.load(io.StringIO(mkz49.file.text), load_meshes=False, build_scene_graph=True)
    urdf.update_cfg(hole_9.assembly.q)
    for link, placement in frames(mkz49, hole_9.assembly.q).items():
        # Its origins go through roll, pitch and yaw once more.
        np.testing.assert_allclose(urdf.get_transform(link), placement.homogeneous, atol=1e-12, err_msg=link)


def test_mujoco_agrees_on_mass_matrix_and_bias_at_random_states(mkz49: Rig, rng: np.random.Generator) -> None:
    other = mujoco.MjModel.from_xml_string(mkz49.file.text)
    state, data = mujoco.MjData(other), mkz49.model.createData()
    np.testing.assert_array_equal(other.opt.gravity, mkz49.model.gravity.linear)
    for _ in range(100):
        q, v = rng.uniform(-2, 2, 6), rng.uniform(-2, 2, 6)
        state.qpos[:], state.qvel[:] = q, v
        mujoco.mj_forward(other, state)
        theirs = np.zeros((6, 6))
        mujoco.mj_fullM(other, state, theirs)
        ours = pin.crba(mkz49.model, data, q)
        assert np.abs(theirs - ours).max() <= 1e-9 * np.abs(ours).max()
        bias = pin.nonLinearEffects(mkz49.model, data, q, v)
        assert np.abs(state.qfrc_bias - bias).max() <= 1e-9 * np.abs(bias).max()


def test_the_rig_changes_shape_with_its_parameters(mkz49: Rig, hole_9: Equilibrium) -> None:
    longer = load_rig("mkz49", boom_length=2.1)
    q = start_state(longer, Scenario()).assembly.q
    moved = frames(longer, q)["upper_boom"].translation - frames(mkz49, hole_9.assembly.q)["upper_boom"].translation
    assert np.linalg.norm(moved) == pytest.approx(0.16, rel=1e-9)
    assert longer.file.parameters()["boom_length"].changed
    wider = load_rig("mkz49", boom_lift_bore=0.09)
    assert {e.name: e for e in wider.forces}["lift_cylinder"].bore == 0.09


def test_an_unknown_argument_is_refused_with_the_nearest_one() -> None:
    with pytest.raises(ModelError, match=r"no argument 'boom_lenght'.*Did you mean 'boom_length'"):
        load_rig("mkz49", boom_lenght=2.1)


@pytest.mark.parametrize("argument", ["abc", "nan", "inf", "", "1,9"])
def test_an_argument_that_is_no_number_is_refused_by_name(argument: str) -> None:
    with pytest.raises(ModelError, match="boom_length"):
        load_rig("mkz49", boom_length=argument)


@pytest.mark.parametrize("name", sorted(shipped_scenarios()))
def test_every_shipped_scenario_runs(name: str) -> None:
    scenario = load_scenario(name, duration=0.05)
    run = simulate(load_rig(scenario.model, **scenario.arguments), scenario)
    assert run.outcome.completed
    assert np.abs(run.constraint_error).max() <= 1e-12


def test_the_default_scenario_is_the_shipped_hole_9(mkz49: Rig, hole_9: Equilibrium) -> None:
    shipped = load_scenario("hole_9")
    # The default names no pose and takes the model's first one.
    assert shipped.model_dump(exclude={"text", "pose"}) == Scenario().model_dump(exclude={"text", "pose"})
    np.testing.assert_array_equal(start_state(mkz49, shipped).assembly.q, hole_9.assembly.q)


def test_the_second_scenario_holds_the_tip_at_the_printed_place(mkz49: Rig) -> None:
    (name,) = set(shipped_scenarios()) - {"hole_9"}
    run = simulate(mkz49, load_scenario(name, duration=0.1))
    np.testing.assert_allclose(run.of("point_position", "E", "y"), 0.350, atol=1e-12)
    np.testing.assert_allclose(run.of("point_position", "E", "z"), 1.710, atol=1e-12)
    assert any(note.startswith("assembly moved") for note in run.notes)
