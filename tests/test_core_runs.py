"""Whole runs of the compiled core against the Python engine: same motion, same ends, same record."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from processes import processor_time
from rigs import (
    bennett,
    double_pendulum,
    floating_body,
    four_bar,
    mass_on_cylinder,
    point_mass,
    slider_crank,
    tree,
)

from drillrig_pin import (
    Rig,
    Scenario,
    ScenarioError,
    Status,
    Trajectory,
    load_rig,
    load_rig_text,
    load_scenario,
    load_trajectory,
    simulate,
)
from drillrig_pin.elements import Name, PluginElement, quantity, reference
from drillrig_pin.files import shipped_scenarios
from drillrig_pin.simulation import prepare
from drillrig_pin.trajectory import VARIABLES

pytest.importorskip("drillrig_pin.core", reason="the package was built without a C++ compiler")

#: Both engines take the same steps but for rounding; what they differ by is rounding, grown over some thousand steps.
SAME = 1e-9
DOP853 = {"integrator.method": "DOP853"}
#: So tight that a step which rounding makes a little longer in one engine shows nowhere.
TIGHT = {"integrator.rtol": 1e-11, "integrator.atol": 1e-13}


def both(rig: Rig, case: Scenario) -> tuple[Trajectory, Trajectory]:
    core, python = (simulate(rig, case.changed({"engine": engine})) for engine in ("core", "python"))
    assert (core.engine, python.engine) == ("core", "python")
    return core, python


def terms_of_acceleration(rig: Rig, case: Scenario) -> float:
    """What accelerations are sums of: |M^-1| |rows|^T |F| at the start, some thousand times what remains of it."""
    dynamics = prepare(rig, case)
    dynamics.rate(0.0, dynamics.initial())
    forces = np.abs(dynamics.space.rows).T @ np.abs(dynamics.F)
    return float((np.abs(np.linalg.inv(dynamics.equations.M)) @ forces).max(initial=0.0))


def scales(run: Trajectory) -> dict[str, float]:
    """What each variable is to be compared with: its own size, or that of what it is a difference of."""
    size = {name: float(np.abs(run.arrays[name]).max(initial=0.0)) for name in VARIABLES}
    # Residuals are rounding of lengths and velocities; displacements of positions; all energies are one balance.
    size["constraint_error"] = max(size["constraint_error"], size["point_position"], 1e-3)
    size["constraint_rate"] = max(size["constraint_rate"], size["v"])
    size["point_displacement"] = size["point_position"]
    size["reaction"] = max(size["reaction"], size["cylinder_force"], size["element_force"])
    energies = [name for name in VARIABLES if name.startswith(("energy", "work"))]
    return size | dict.fromkeys(energies, max(size[name] for name in energies))


def assert_same(core: Trajectory, python: Trajectory, forces: float = 0.0, same: float = SAME) -> None:
    np.testing.assert_array_equal(core.time, python.time)
    assert core.labels == python.labels
    assert core.outcome.status is python.outcome.status
    assert core.outcome.cause == python.outcome.cause
    assert np.abs(core.q - python.q).max() < same
    scale = scales(python)
    scale["a"] = max(scale["a"], forces)
    worst = {n: float(np.abs(core.arrays[n] - python.arrays[n]).max(initial=0.0)) for n in VARIABLES}
    bad = {name: (worst[name], scale[name]) for name in VARIABLES if worst[name] > same * scale[name]}
    assert not bad, bad


# --- the shipped rig ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", ["RK4", "DOP853"])
@pytest.mark.parametrize("name", sorted(shipped_scenarios()))
def test_every_shipped_scenario_runs_alike(name: str, method: str) -> None:
    case = load_scenario(name, **{"duration": 0.3, "integrator.method": method, **TIGHT})
    rig = load_rig(case.model)
    core, python = both(rig, case)
    assert core.outcome.completed
    assert_same(core, python, terms_of_acceleration(rig, case))
    # At 1e-11 the error estimate is mostly rounding, and so are some of the choices of a step.
    # The core does not evaluate the end of a step that is about to be projected: RK4 saves one of five.
    assert 0.75 < core.cost["evaluations"] / python.cost["evaluations"] < 1.1


@pytest.mark.parametrize(
    "changes",
    [
        {"formulation": "null_space"},
        {"formulation": "damped"},
        {"stabilization.projection": False},
        {"stabilization.method": "none"},
        {"stabilization.method": "sliding_mode"},
        {"stabilization.method": "sliding_mode", "stabilization.projection": False, "formulation": "null_space"},
        {"loads": "none", "velocities": {"boom_swing": 0.1}},
        {"integrator.max_step": 2e-4},
        {"output_rate": 70.0},
    ],
    ids=lambda changes: " ".join(f"{name}={value}" for name, value in changes.items()),
)
def test_the_shipped_rig_runs_alike_however_it_is_solved(mkz49: Rig, changes: dict[str, object]) -> None:
    case = Scenario(duration=0.2).changed({**DOP853, **TIGHT, **changes})
    core, python = both(mkz49, case)
    assert core.outcome.completed
    assert_same(core, python, terms_of_acceleration(mkz49, case))


# --- small machines -------------------------------------------------------------------------------------------------

SAMPLES = "\n".join(f"{0.01 * k:.2f},{20 * np.sin(0.9 * k):.6f}" for k in range(41))
TABLE = f'<load name="l" kind="force" point="P" axis="1 0 0">\n<table>\n{SAMPLES}\n</table></load>'
GROUND = (
    '<hold name="rail" point="P" axes="x y"/><contact name="ground" point="P" axis="0 0 -1" stiffness="2e4" '
    'preload="19.62" damping="40" mode="unilateral"/>'
)
ON_TREE = (
    '<hold name="h" point="R" axes="x z"/><joint_spring name="s" joint="elbow" stiffness="300" damping="4"/>'
    '<load name="blow" kind="force" point="R" axis="0 1 0"><constant value="30" ramp="0.1"/></load>'
)


class Buffer(PluginElement):
    """F = -k3 x^3 - d x_dot |x_dot|; counts how often it is asked."""

    tag = "buffer"
    joint: Name = reference("joint")
    k3: float = quantity("N/m^3", "cubic stiffness")
    d: float = quantity("N*s^2/m^2", "quadratic damping")

    def coordinate(self, resolver):
        return resolver.joint(self.joint)

    def force(self, x, xdot, t):
        assert len(x) == 1
        return -self.k3 * x**3 - self.d * xdot * np.abs(xdot)

    def energy(self, x):
        return self.k3 * x**4 / 4

    def dissipation(self, x, xdot):
        return self.d * np.abs(xdot) ** 3


class Stop(PluginElement):
    """A rubber stop at x = 0, on one side only: its law switches there."""

    tag = "stop"
    joint: Name = reference("joint")
    k: float = quantity("N/m", "stiffness")

    def coordinate(self, resolver):
        return resolver.joint(self.joint)

    def force(self, x, xdot, t):
        return -self.k * np.maximum(x, 0.0)

    def energy(self, x):
        return self.k * np.maximum(x, 0.0) ** 2 / 2

    def switches(self, x, xdot):
        return np.ravel(x)


def _buffered() -> Rig:
    return load_rig_text(point_mass(extension=TABLE), elements=[Buffer(name="b", joint="x", k3=5e4, d=3.0)])


def _stopped() -> Rig:
    spring = '<joint_spring name="s" joint="x" stiffness="200" damping="1"/>'
    return load_rig_text(point_mass(extension=spring), elements=[Stop(name="stop", joint="x", k=3e4)])


BENNETT_CASE = {"positions": {"j1": 1.0, "j2": 2.0, "j3": -1.0}, "velocities": {"j1": 1.0}}

HINGE = 'translations="x y z" rotations="x y"'
BAR, BAR_SPIN = {"crank_joint": 0.4, "coupler_joint": 0.3, "rocker_joint": 1.2}, {"crank_joint": 8.0}

MACHINES: dict[str, tuple[Callable[[], Rig], dict[str, object]]] = {
    "load table": (lambda: load_rig_text(point_mass(extension=TABLE)), {}),
    "unilateral contact": (lambda: load_rig_text(point_mass(extension=GROUND)), {"velocities": {"z": 1.0}}),
    "element of a user": (_buffered, {"velocities": {"x": 2.0}}),
    "switching element of a user": (_stopped, {"velocities": {"x": -2.0}}),
    "redundant loop": (lambda: load_rig_text(four_bar(closure=HINGE)), {"positions": BAR, "velocities": BAR_SPIN}),
    "overconstrained loop": (lambda: load_rig_text(bennett()), BENNETT_CASE),
    # A stage of RK4 leaves the unit circle of (cos, sin) by (h v)^2, where the two engines' sums differ: short steps.
    "continuous joint": (
        lambda: load_rig_text(slider_crank()),
        {"positions": {"crank_joint": 0.3}, "velocities": {"crank_joint": 5.0}, "integrator.step": 1e-4},
    ),
    "floating base": (lambda: load_rig_text(tree(ON_TREE)), {"velocities": {"spin": 3.0}}),
    "free body": (lambda: load_rig_text(floating_body()), {"velocities": {"free.wx": 2.0, "free.wy": 0.5}}),
    "oil": (lambda: load_rig_text(mass_on_cylinder(options='friction="500"')), {"velocities": {"slide": 0.1}}),
}


@pytest.mark.parametrize("formulation", ["multipliers", "null_space"])
@pytest.mark.parametrize("method", ["RK4", "DOP853"])
@pytest.mark.parametrize("name", MACHINES)
def test_small_machines_run_alike(name: str, method: str, formulation: str) -> None:
    make, changes = MACHINES[name]
    case = Scenario(duration=0.4, formulation=formulation).changed({"integrator.method": method, **TIGHT, **changes})
    core, python = both(make(), case)
    assert core.outcome.completed
    assert core.cost["switches"] == python.cost["switches"]
    assert (core.cost["switches"] > 0) == (name in ("unilateral contact", "switching element of a user"))
    assert_same(core, python)


def test_python_is_called_back_for_the_users_element_only(monkeypatch: pytest.MonkeyPatch) -> None:
    from drillrig_pin.elements.loads import TableLaw
    from drillrig_pin.elements.springs import SpringDamper

    calls = {"own": 0, "built-in": 0}
    own = Buffer.force

    def counted(self, x, xdot, t):
        calls["own"] += 1
        return own(self, x, xdot, t)

    def never(*_: object) -> None:
        calls["built-in"] += 1

    rig = _buffered()
    monkeypatch.setattr(Buffer, "force", counted)
    monkeypatch.setattr(TableLaw, "force", never)
    monkeypatch.setattr(SpringDamper, "force", never)
    run = simulate(rig, Scenario(duration=0.1, engine="core").changed(DOP853))
    assert calls["built-in"] == 0
    assert calls["own"] >= run.cost["evaluations"]


def test_an_error_in_a_users_switching_function_reaches_the_user(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(self: Stop, x: np.ndarray, xdot: np.ndarray) -> np.ndarray:
        if x[0] < -1e-3:
            raise ZeroDivisionError("the user's own mistake")
        return np.ravel(x)

    rig = _stopped()
    monkeypatch.setattr(Stop, "switches", broken)
    with pytest.raises(ZeroDivisionError, match="the user's own mistake"):
        simulate(rig, Scenario(duration=0.1, velocities={"x": -2.0}, engine="core"))


def test_another_pinocchio_than_the_core_was_built_with_is_refused() -> None:
    from drillrig_pin.core import require_version
    from drillrig_pin.errors import EngineError

    require_version("4.1.0", "4.1.0")
    with pytest.raises(EngineError, match=r"built with pin 4\.1\.0, but pin 4\.2\.0 is installed.*pin==4\.1\.0"):
        require_version("4.1.0", "4.2.0")


# --- ends -----------------------------------------------------------------------------------------------------------


def assert_ends_alike(rig: Rig, case: Scenario, status: Status) -> Trajectory:
    core, python = both(rig, case)
    assert core.outcome.status is python.outcome.status is status
    assert core.outcome.cause == python.outcome.cause
    assert core.outcome.time == pytest.approx(python.outcome.time, rel=1e-3)
    # What is kept is the same motion, finite, and belongs together; the last step to the end may differ by a sample.
    n = min(len(core.time), len(python.time))
    assert abs(len(core.time) - len(python.time)) <= 1
    assert n >= 1
    np.testing.assert_allclose(core.q[:n], python.q[:n], atol=SAME)
    assert all(len(values) == len(core.time) and np.isfinite(values).all() for values in core.arrays.values())
    return core


@pytest.mark.parametrize("method", ["RK4", "DOP853"])
@pytest.mark.parametrize("speed", [150.0, -150.0])
def test_a_cylinder_that_leaves_its_stroke_ends_alike(method: str, speed: float) -> None:
    case = Scenario(duration=0.1, output_rate=5000, velocities={"slide": speed})
    rig = load_rig_text(mass_on_cylinder())
    run = assert_ends_alike(rig, case.changed({"integrator.method": method, "integrator.step": 5e-5}), Status.DIVERGED)
    assert "cylinder 'oil'" in run.outcome.cause


@pytest.mark.parametrize("method", ["RK4", "DOP853"])
def test_a_singular_configuration_ends_alike(method: str) -> None:
    case = Scenario(
        duration=1.0,
        positions={"crank_joint": 0.3, "rod_joint": -0.6, "slide": 0.76},
        velocities={"crank_joint": 20.0},
        integrator={"method": method},
    )
    run = assert_ends_alike(load_rig_text(slider_crank(0.4, 0.4, gravity=False)), case, Status.SINGULAR)
    assert "wrist.x, wrist.y" in run.outcome.cause


class Faulty(PluginElement):
    """Breaks at t = 0.05: gives no number, or raises."""

    tag = "faulty"
    joint: Name = reference("joint")
    raises: bool = True

    def coordinate(self, resolver):
        return resolver.joint(self.joint)

    def force(self, x, xdot, t):
        if t > 0.05 and self.raises:
            raise ZeroDivisionError("the user's own mistake")
        return np.full_like(x, np.nan if t > 0.05 else 1.0)


@pytest.mark.parametrize("engine", ["core", "python"])
def test_what_an_element_of_the_user_raises_reaches_the_user(engine: str) -> None:
    rig = load_rig_text(point_mass(), elements=[Faulty(name="f", joint="x")])
    with pytest.raises(ZeroDivisionError, match="the user's own mistake") as caught:
        simulate(rig, Scenario(duration=0.1, engine=engine).changed(DOP853))
    # With the place where it happened.
    assert any(entry.name == "force" for entry in caught.traceback)


@pytest.mark.parametrize("method", ["RK4", "DOP853"])
def test_a_force_that_is_no_number_ends_alike(method: str) -> None:
    rig = load_rig_text(point_mass(), elements=[Faulty(name="f", joint="x", raises=False)])
    status = Status.DIVERGED if method == "RK4" else Status.STEP_TOO_SMALL
    core, python = both(rig, Scenario(duration=0.1, integrator={"method": method}))
    assert core.outcome.status is python.outcome.status is status
    assert core.outcome.time == pytest.approx(python.outcome.time, abs=1e-6)
    assert np.isfinite(core.a).all()


# --- progress, interruption, record ---------------------------------------------------------------------------------

#: Long enough for progress to be called many times, however fast the machine: 1e7 steps if nobody stops it.
LONG = {"duration": 1000.0, "output_rate": 10.0, "engine": "core", "integrator": {"method": "RK4", "step": 1e-4}}


def test_progress_is_called_in_order_and_may_stop_the_run() -> None:
    seen: list[float] = []

    def progress(t: float) -> None:
        seen.append(t)
        if len(seen) == 3:
            raise KeyboardInterrupt

    run = simulate(load_rig_text(double_pendulum()), Scenario(**LONG), progress=progress)
    assert seen == sorted(seen)
    assert seen[0] > 0.0
    assert run.outcome.status is Status.INTERRUPTED
    assert 0 < len(run.time) < 10001
    assert run.time[-1] <= seen[-1]
    assert all(np.isfinite(values).all() for values in run.arrays.values())


def test_an_error_in_progress_reaches_the_caller() -> None:
    def progress(t: float) -> None:
        raise RuntimeError("window closed")

    with pytest.raises(RuntimeError, match="window closed"):
        simulate(load_rig_text(double_pendulum()), Scenario(**LONG), progress=progress)


CTRL_C = """
import sys, time
sys.path.insert(0, {tests!r})
from rigs import double_pendulum
from drillrig_pin import Scenario, load_rig_text, simulate

said = []
def progress(t):
    if not said:
        said.append(print("running", flush=True))

run = simulate(load_rig_text(double_pendulum()), Scenario(**{case!r}), progress=progress)
print(time.process_time(), run.outcome.status.name, len(run.time))
"""


def _computed_after_ctrl_c() -> float:
    """Processor time a run still takes from Ctrl-C to the result in the caller's hands [s]."""
    import signal

    code = CTRL_C.format(tests=str(Path(__file__).parent), case=LONG)
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True) as child:
        assert child.stdout is not None
        assert child.stdout.readline() == "running\n"
        before = processor_time(child.pid)
        child.send_signal(signal.SIGINT)
        after, status, samples = child.stdout.readline().split()
    assert child.returncode == 0
    assert status == "INTERRUPTED"
    assert int(samples) > 0
    return float(after) - before


def test_ctrl_c_ends_a_run_within_a_fifth_of_a_second_of_computing_and_keeps_its_samples() -> None:
    # The core looks up twenty times a second; on a busy machine it computes less in that time, never more.
    assert _computed_after_ctrl_c() < 0.2


def test_the_engine_is_recorded_and_survives_a_file(tmp_path: Path) -> None:
    rig = load_rig_text(double_pendulum())
    for engine in ("core", "python"):
        run = simulate(rig, Scenario(duration=0.01, engine=engine).changed(DOP853))
        run.save(tmp_path / "run.nc")
        assert load_trajectory(tmp_path / "run.nc").engine == run.engine == engine


def test_auto_takes_the_core_where_it_has_the_method() -> None:
    rig = load_rig_text(double_pendulum())
    for method, engine in (("RK4", "core"), ("DOP853", "core"), ("Radau", "python")):
        assert simulate(rig, Scenario(duration=0.01, integrator={"method": method})).engine == engine


@pytest.mark.parametrize("method", ["Radau", "LSODA"])
def test_the_core_refuses_a_method_it_does_not_have_in_a_sentence(method: str) -> None:
    with pytest.raises(ScenarioError, match=rf"core has .*RK4.*DOP853.*{method}.*engine"):
        Scenario(engine="core", integrator={"method": method}, stabilization={"projection": False})
