"""Fixtures shared by the tests: the shipped rig, and its case at hole 9."""

from __future__ import annotations

import signal
from pathlib import Path

import numpy as np
import pytest
from command import Answer, Command
from hypothesis import HealthCheck, settings

from drillrig_pin import Rig, Scenario, load_rig
from drillrig_pin.cli import main
from drillrig_pin.simulation import start_state
from drillrig_pin.statics import Equilibrium

# An example that takes long, or whose making does, is no fault: a busy machine stops a process for longer than that.
settings.register_profile("any machine", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("any machine")

#: Files that take longest, in this order: a worker that is given one of them last works alone at the end.
LONGEST = (
    "test_validation.py",
    "test_page.py",
    "test_wheel.py",
    "test_report_browser.py",
    "test_replay_page.py",
    "test_service_faults.py",
    "test_service_api.py",
    "test_batch.py",
    "test_optimize.py",
    "test_sensitivity.py",
    "test_service_contract.py",
    "test_core_runs.py",
    "test_replay_live.py",
    "test_contact.py",
)


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Begin with the longest files, unless chance is asked to choose."""
    if not config.pluginmanager.hasplugin("randomly"):
        rank = {name: place for place, name in enumerate(LONGEST)}
        items.sort(key=lambda item: rank.get(item.path.name, len(rank)))


def pytest_configure() -> None:
    """Hear Ctrl-C also where a shell started the suite deaf to it, in the background: what is tested inherits that."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session")
def mkz49() -> Rig:
    """The shipped rig with its default parameters."""
    return load_rig("mkz49")


@pytest.fixture(scope="session")
def hole_9(mkz49: Rig) -> Equilibrium:
    """The shipped rig at hole no. 9: assembled, with its static forces."""
    return start_state(mkz49, Scenario())


@pytest.fixture
def rng() -> np.random.Generator:
    """Random numbers that are the same in every run, so that a failure can be met again."""
    return np.random.default_rng(20230417)


@pytest.fixture
def drillrig(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Command:
    """Run one command line in an empty folder."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "100")

    def command(*words: str) -> Answer:
        capsys.readouterr()
        with pytest.raises(SystemExit) as left:
            main(words)
        out, err = capsys.readouterr()
        assert "Traceback" not in out + err
        return Answer(int(left.value.code or 0), out, err)

    return command
