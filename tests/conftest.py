"""Fixtures shared by the tests: the shipped rig, and its case at hole 9."""

from __future__ import annotations

import signal
from pathlib import Path

import numpy as np
import pytest
from command import Answer, Command

from drillrig_pin import Rig, Scenario, load_rig
from drillrig_pin.cli import main
from drillrig_pin.simulation import start_state
from drillrig_pin.statics import Equilibrium


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
