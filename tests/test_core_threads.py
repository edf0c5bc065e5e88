"""Compiled runs side by side: the same bits as one after another, and Python goes on meanwhile."""

from __future__ import annotations

import threading
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from rigs import bennett, double_pendulum, point_mass, slider_crank, tree
from test_core_runs import BENNETT_CASE, GROUND, LONG, ON_TREE

from drillrig_pin import Rig, Scenario, Trajectory, load_rig_text, simulate
from drillrig_pin.recorder import Recorder
from drillrig_pin.sampling import plan_rows
from drillrig_pin.simulation import prepare
from drillrig_pin.stepping import Settings

core = pytest.importorskip("drillrig_pin.core", reason="the package was built without a C++ compiler")


def eight(mkz49: Rig) -> list[tuple[Rig, Scenario]]:
    """Different machines and settings; some share one rig."""
    short = Scenario(duration=0.3, engine="core", integrator={"method": "DOP853"})
    return [
        (mkz49, short),
        (mkz49, short.changed({"formulation": "null_space"})),
        (mkz49, short.changed({"integrator.method": "RK4"})),
        (mkz49, short.changed({"velocities": {"boom_swing": 0.01}, "stabilization.method": "sliding_mode"})),
        (load_rig_text(bennett()), short.changed(BENNETT_CASE)),
        (load_rig_text(slider_crank()), short.changed({"velocities": {"crank_joint": 20.0}})),
        (load_rig_text(tree(ON_TREE)), short.changed({"velocities": {"spin": 3.0}})),
        (load_rig_text(point_mass(extension=GROUND)), short.changed({"velocities": {"z": 1.0}})),
    ]


def assert_same_bits(one: Trajectory, other: Trajectory) -> None:
    assert one.outcome == other.outcome
    assert one.engine == other.engine == "core"
    np.testing.assert_array_equal(one.time, other.time)
    for name, values in one.arrays.items():
        np.testing.assert_array_equal(values, other.arrays[name], err_msg=name)


def test_eight_at_once_equal_the_same_eight_one_after_another_bit_for_bit(mkz49: Rig) -> None:
    cases = eight(mkz49)
    alone = [simulate(*case) for case in cases]
    with ThreadPoolExecutor(8) as pool:
        together = list(pool.map(lambda case: simulate(*case), cases))
    for one, other in zip(alone, together, strict=True):
        assert one.outcome.completed
        assert_same_bits(one, other)


def test_one_compiled_model_serves_eight_threads_at_once(mkz49: Rig) -> None:
    scenario = Scenario(duration=0.3)
    dynamics = prepare(mkz49, scenario)
    compiled, y0 = core.CompiledDynamics(dynamics), dynamics.initial()
    plan = plan_rows(scenario, dynamics, "DOP853")
    settings = Settings("DOP853", 1e-4, 1e-8, np.full(dynamics.size, 1e-9), np.inf, True)
    start = threading.Barrier(8)

    def run(_: int) -> list[np.ndarray]:
        arrays = Recorder(dynamics, plan, "core", "DOP853").arrays()
        start.wait()
        assert compiled.run(y0, settings, plan, arrays, None).rows == len(plan.times)
        return arrays

    with ThreadPoolExecutor(8) as pool:
        first, *others = pool.map(run, range(8))
    for arrays in others:
        for mine, reference in zip(arrays, first, strict=True):
            np.testing.assert_array_equal(mine, reference)


def test_python_goes_on_while_the_core_runs() -> None:
    rig, ended = load_rig_text(double_pendulum()), threading.Event()

    def run() -> None:
        simulate(rig, Scenario(**LONG).changed({"duration": 100.0}))
        ended.set()

    worker = threading.Thread(target=run)
    worker.start()
    turns = 0
    while not ended.is_set():
        time.sleep(1e-3)
        turns += 1
    worker.join()
    # With the lock held for the run this thread would have slept through it, but for preparation and record.
    assert turns > 100
