"""The comparison with other engines: how times at equal error are read off, and what a missing engine does to it."""

from __future__ import annotations

import importlib

import numpy as np
import pytest
from peers import race, registry
from peers.problem import Setting, Stopwatch, drilling, plain_urdf

from drillrig_pin import load_rig


def point(method: str, error: float, *seconds: float) -> race.Point:
    return race.Point("core", "an engine", Setting(method), error, [watch(s) for s in seconds])


def watch(seconds: float) -> Stopwatch:
    stopped = Stopwatch()
    stopped.wall = stopped.processor = seconds
    return stopped


def test_time_at_an_error_lies_between_settings_on_a_straight_line_of_the_logarithms() -> None:
    points = [point("m", 1e-4, 1.0), point("m", 1e-6, 4.0, 9.0)]
    found = race.time_at(points, 1e-5)
    assert found is not None
    assert found[0] == pytest.approx(2.0)


def test_the_quickest_method_that_is_sharp_enough_counts() -> None:
    points = [point("quick", 1e-5, 0.1), point("slow", 1e-5, 1.0), point("slow", 1e-9, 3.0)]
    assert race.time_at(points, 1e-4)[0] == 0.1, "beyond its coarsest setting a method is credited with that one"
    assert race.time_at(points, 1e-9)[0] == pytest.approx(3.0)
    assert race.time_at(points, 1e-10) is None


def test_a_setting_beaten_in_error_and_time_does_not_bend_the_line() -> None:
    points = [point("m", 1e-4, 1.0), point("m", 1e-4, 2.0), point("m", 2e-4, 5.0), point("m", 1e-6, 4.0)]
    assert race.time_at(points, 1e-5)[0] == pytest.approx(2.0)


def test_an_engine_that_cannot_be_loaded_is_named_and_the_others_go_on(monkeypatch: pytest.MonkeyPatch) -> None:
    real = importlib.import_module

    def without_exudyn(name: str) -> object:
        if name == "peers.exudyn":
            raise ImportError("no module named exudyn")
        return real(name)

    monkeypatch.setattr(registry.importlib, "import_module", without_exudyn)
    ready, missing = registry.bound(drilling(0.1), ["exudyn", "scipy"])
    assert list(ready) == ["scipy"]
    assert "exudyn" in missing["exudyn"]


def test_other_engines_get_a_model_of_links_and_joints_alone() -> None:
    text = plain_urdf(load_rig("mkz49"))
    for word in ("drillrig", "visual", "collision", "material"):
        assert f"<{word}" not in text


def test_measured_orders_leave_out_what_lies_on_the_floor() -> None:
    class Engine:
        orders = {"m": 2}  # noqa: RUF012

    steps = np.array([8e-3, 4e-3, 2e-3, 1e-3])
    points = [race.Point("k", "e", Setting("m", h), float(h**2), [watch(1.0)]) for h in steps]
    points.append(race.Point("k", "e", Setting("m", 1e-6), 1e-9, [watch(1.0)]))
    assert race.orders(Engine(), "k", points, 1e-8)["m"] == pytest.approx(2.0)
