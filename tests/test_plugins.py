"""Elements of users: a Python class given to the model, or named in the model file through an entry point."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from rigs import point_mass

from drillrig_pin import ModelError, Scenario, load_rig, load_rig_text, simulate
from drillrig_pin.elements import Name, PluginElement, quantity, reference, registry
from drillrig_pin.errors import AccuracyWarning

TIGHT = {"rtol": 1e-11, "atol": 1e-12}


class HardeningDamper(PluginElement):
    """F = -k3 x^3 - d x_dot |x_dot|: a rubber buffer with turbulent damping."""

    tag = "hardening_damper"

    joint: Name = reference("joint it sits on")
    k3: float = quantity("N/m^3", "cubic stiffness", ge=0)
    d: float = quantity("N*s^2/m^2", "quadratic damping", ge=0)

    def coordinate(self, resolver):
        return resolver.joint(self.joint)

    def force(self, x, xdot, t):
        return -self.k3 * x**3 - self.d * xdot * np.abs(xdot)

    def energy(self, x):
        return self.k3 * x**4 / 4

    def dissipation(self, x, xdot):
        return self.d * np.abs(xdot) ** 3


MODULE = '''
import numpy as np
from drillrig_pin.elements import Name, PluginElement, quantity, reference


class Magnet(PluginElement):
    """F = m / (gap - x)^2, pulls towards the gap's end."""

    tag = "magnet"

    joint: Name = reference("joint it pulls")
    strength: float = quantity("N*m^2", "strength m", gt=0)
    gap: float = quantity("m", "distance of the pole", gt=0)

    def coordinate(self, resolver):
        return resolver.joint(self.joint)

    def force(self, x, xdot, t):
        return self.strength / (self.gap - x) ** 2

    def energy(self, x):
        return -self.strength / (self.gap - x)


class NotAnElement:
    pass
'''


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """A small package on the path that offers elements, as an installed one would."""
    (tmp_path / "magnets.py").write_text(MODULE)
    info = tmp_path / "magnets-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: magnets\nVersion: 1.0\n")
    offers = "magnet = magnets:Magnet\nbroken = magnets:NotAnElement\nabsent = magnets:Nothing\n"
    (info / "entry_points.txt").write_text(f"[{registry.GROUP}]\n{offers}")
    monkeypatch.syspath_prepend(tmp_path)
    registry.plugin_tags.cache_clear()
    yield
    registry.plugin_tags.cache_clear()
    sys.modules.pop("magnets", None)


def test_an_element_made_in_python_acts_and_is_audited() -> None:
    buffer = HardeningDamper(name="buffer", joint="x", k3=5e4, d=3.0)
    rig = load_rig_text(point_mass(2.0), elements=[buffer])
    run = simulate(rig, Scenario(duration=2.0, velocities={"x": 2.0}, integrator=TIGHT))
    start = 0.5 * 2.0 * 2.0**2
    assert run.work_dissipated[-1] > 0.3 * start
    assert np.ptp(run.energy_elastic) > 0.3 * start
    assert np.abs(run.energy_residual).max() < 1e-9 * start
    assert run.labels["element"] == ["buffer"]
    np.testing.assert_allclose(run.of("element_force", "buffer"), 2.0 * run.a[:, 0], rtol=1e-12, atol=1e-12)


def test_two_elements_of_one_class_keep_their_own_numbers() -> None:
    buffers = [HardeningDamper(name=n, joint=j, k3=k, d=0.0) for n, j, k in (("one", "x", 1e4), ("two", "y", 4e4))]
    rig = load_rig_text(point_mass(2.0), elements=buffers)
    run = simulate(rig, Scenario(duration=0.1, velocities={"x": 1.0, "y": 1.0}))
    np.testing.assert_allclose(run.of("element_force", "one"), -1e4 * run.q[:, 0] ** 3, rtol=1e-12)
    np.testing.assert_allclose(run.of("element_force", "two"), -4e4 * run.q[:, 1] ** 3, rtol=1e-12)


def test_an_element_of_an_installed_package_is_named_in_the_model_file(installed: None) -> None:
    rig = load_rig_text(point_mass(2.0, '<magnet name="pole" joint="x" strength="0.5" gap="0.3"/>'))
    run = simulate(rig, Scenario(duration=0.3, integrator=TIGHT))
    assert 0.01 < run.q[-1, 0] < 0.2
    np.testing.assert_allclose(run.of("element_force", "pole"), 0.5 / (0.3 - run.q[:, 0]) ** 2, rtol=1e-12)
    # Conservative: what it gains in motion comes out of the field.
    gained = 0.5 * 2.0 * run.v[:, 0] ** 2
    np.testing.assert_allclose(gained, 0.5 / (0.3 - run.q[:, 0]) - 0.5 / 0.3, atol=1e-9)
    assert np.abs(run.energy_residual).max() < 1e-9 * gained.max()


def test_its_attributes_are_checked_like_any_others(installed: None) -> None:
    with pytest.raises(ModelError, match=r"<magnet 'pole'> has no attribute 'strenght'.*Did you mean 'strength'"):
        load_rig_text(point_mass(2.0, '<magnet name="pole" joint="x" strenght="0.5" gap="0.3"/>'))
    with pytest.raises(ModelError, match="gap"):
        load_rig_text(point_mass(2.0, '<magnet name="pole" joint="x" strength="0.5" gap="-1"/>'))


def test_unknown_elements_are_refused_with_the_plugins_among_the_legal_names(installed: None) -> None:
    with pytest.raises(ModelError, match=r"unknown element <magnett>.*Did you mean 'magnet'"):
        load_rig_text(point_mass(2.0, '<magnett name="pole"/>'))


@pytest.mark.parametrize("tag", ["broken", "absent"])
def test_an_entry_point_that_offers_no_element_is_a_model_error(installed: None, tag: str) -> None:
    with pytest.raises(ModelError, match=tag):
        load_rig_text(point_mass(2.0, f'<{tag} name="b"/>'))


def test_an_added_element_with_a_name_already_taken_is_refused() -> None:
    with pytest.raises(ModelError, match="'P' is already defined"):
        load_rig_text(point_mass(2.0), elements=[HardeningDamper(name="P", joint="x", k3=1.0, d=0.0)])


def test_an_added_element_that_names_no_joint_is_refused_with_the_legal_ones() -> None:
    with pytest.raises(ModelError, match=r"no moving joint 'w'.*x, y, z"):
        load_rig_text(point_mass(2.0), elements=[HardeningDamper(name="b", joint="w", k3=1.0, d=0.0)])


def test_an_element_can_be_added_to_the_shipped_rig() -> None:
    buffer = HardeningDamper(name="buffer", joint="boom_swing", k3=1e9, d=100.0)
    run = simulate(load_rig("mkz49", elements=[buffer]), Scenario(duration=0.05))
    assert run.outcome.completed
    assert np.abs(run.energy_residual).max() < 1e-6 * np.abs(run.work_input).max() + 1e-9


class Pulse(PluginElement):
    """A half sine of force over a millisecond that names no breakpoints."""

    tag = "pulse"
    load = True

    joint: Name = reference("joint it pushes")
    start: float = quantity("s", "its start")

    def coordinate(self, resolver):
        return resolver.joint(self.joint)

    def force(self, x, xdot, t):
        s = (t - self.start) / 1e-3
        return 1000.0 * np.sin(np.pi * s) * np.ones_like(x) if 0.0 < s < 1.0 else np.zeros_like(x)


@pytest.mark.parametrize("engine", ["core", "python"])
@pytest.mark.parametrize("rate", [10.0, 1000.0])
def test_a_short_pulse_of_a_plugin_is_not_stepped_over_however_few_samples_are_asked_for(
    engine: str, rate: float
) -> None:
    still = '<gravity xyz="0 0 0"/><joint_spring name="s" joint="x" stiffness="1" damping="0"/>'
    for start in (0.0123, 0.05037):
        rig = load_rig_text(point_mass(2.0, still), elements=[Pulse(name="p", joint="x", start=start)])
        run = simulate(rig, Scenario(duration=0.1, output_rate=rate, engine=engine))
        assert run.method == "DOP853", "a law of a user may do anything between two steps"
        # Its impulse is 2 / pi of its peak times its length; the spring has done nothing yet a millisecond later.
        assert np.abs(run.record.v).max() == pytest.approx(1000.0 * 1e-3 * 2 / np.pi / 2.0, rel=1e-4)


class Leak(HardeningDamper):
    """Reports twice the power it dissipates: the energy cannot balance."""

    tag = "leak"

    def dissipation(self, x, xdot):
        return 2 * self.d * np.abs(xdot) ** 3


def test_a_run_whose_energy_does_not_balance_warns_in_python_and_says_so_when_printed() -> None:
    rig = load_rig_text(point_mass(2.0), elements=[Leak(name="b", joint="x", k3=1e4, d=3.0)])
    with pytest.warns(AccuracyWarning, match="the energy balance misses"):
        run = simulate(rig, Scenario(duration=0.2, velocities={"x": 2.0}))
    assert "not accurate" in repr(run)
