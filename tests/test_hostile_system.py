"""Streams closed or full, letters nobody can show, signals, refusals of the system: sentences and exit codes."""

from __future__ import annotations

import contextlib
import errno
import io
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from command import Command, one_sentence

import drillrig_pin.cli.run
import drillrig_pin.cli.signals
import drillrig_pin.simulation
from drillrig_pin.cli import streams
from drillrig_pin.cli.output import print_json
from drillrig_pin.cli.signals import ending_softly, holding, interrupted_code
from drillrig_pin.litter import DAY, marked, remove_litter, temporary_folder
from drillrig_pin.trajectory import load_trajectory

DRILLRIG = str(Path(sys.executable).with_name("drillrig"))
SHORT = ("--set", "scenario.duration=0.05")


def shell(words: str, folder: Path) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "D": DRILLRIG}
    return subprocess.run(words, shell=True, cwd=folder, env=environment, capture_output=True, text=True)


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        ('"$D" models >&-', 1, "standard output: cannot be written (Bad file descriptor)"),
        ('"$D" models --json >/dev/full', 1, "standard output: cannot be written (No space left"),
        ('"$D" run --set x=1 2>&-', 1, ""),
        ('"$D" run --set x=1 2>/dev/full', 1, ""),
        ('"$D" models <&- >&- 2>&-', 1, ""),
        ('mkdir gone; cd gone; rmdir ../gone; "$D" models', 1, "the folder this command was started in is gone"),
    ],
)
def test_a_stream_that_takes_nothing_is_a_sentence(tmp_path: Path, words: str, code: int, said: str) -> None:
    answer = shell(words, tmp_path)
    assert answer.returncode == code
    assert answer.stdout == ""
    assert said in answer.stderr
    assert len(answer.stderr.splitlines()) == bool(said)


def test_a_reader_that_leaves_changes_neither_work_nor_exit_code(tmp_path: Path) -> None:
    read, write = os.pipe()
    os.close(read)
    raw = streams._Descriptor(write, complaints=False)
    assert raw.write(b"nobody reads it") == 15
    assert raw.deaf
    os.close(write)


@pytest.mark.parametrize("encoding", ["ascii", "latin-1", "utf-8"])
def test_every_letter_is_shown_somehow(monkeypatch: pytest.MonkeyPatch, encoding: str) -> None:
    streams.settle()
    out = io.TextIOWrapper(io.BytesIO(), encoding=encoding, errors="drillrig-plain")
    print("5 µm ≤ ⌀ 80 mm – Trầm \udcff ✓", file=out)
    out.flush()
    shown = out.buffer.getvalue().decode(encoding)  # type: ignore[attr-defined]
    if encoding == "ascii":
        assert shown == "5 um <= dia  80 mm - Tram \\xff ?\n"
    assert "mm" in shown
    assert "\\xff" in shown
    # A document stays one, whatever the letters.
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(io.BytesIO(), encoding=encoding, errors="strict"))
    print_json({"µ": "x\udcff"})
    sys.stdout.flush()
    assert b"\\udcff" in sys.stdout.buffer.getvalue()  # type: ignore[attr-defined]


@pytest.mark.parametrize("columns", ["0", "1", "-5", "abc", "99999999"])
def test_a_width_that_no_terminal_has_is_passed_over(
    drillrig: Command, monkeypatch: pytest.MonkeyPatch, columns: str
) -> None:
    monkeypatch.setenv("COLUMNS", columns)
    assert "mkz49" in drillrig("models").out


LONG = "a" * 300


@pytest.mark.parametrize(
    "words",
    [
        ("run", "-o", LONG),
        ("run", LONG),
        ("run", "-s", LONG),
        ("run", "--package", f"a={LONG}"),
        ("report", LONG),
        ("replay", LONG),
        ("compare", LONG, LONG),
        ("sweep", "percussion_frequency", "-o", LONG),
        ("sweep-report", LONG),
    ],
    ids=lambda words: " ".join(words).replace(LONG, "LONG"),
)
def test_a_name_too_long_is_no_bug(drillrig: Command, words: tuple[str, ...]) -> None:
    one_sentence(drillrig(*words), "aaa")


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (MemoryError("Unable to allocate 82.4 MiB for an array with shape (9,)"), ("memory", "82.4 MiB")),
        (MemoryError("std::bad_alloc"), ("not enough memory",)),
        (ImportError("libarrow.so: failed to map segment from shared object"), ("libarrow.so", "ulimit")),
        (RuntimeError("can't start new thread"), ("ulimit -u",)),
        (OSError(errno.EMFILE, "Too many open files", "x.nc"), ("x.nc", "ulimit -n")),
        (OSError(errno.EDQUOT, "Disk quota exceeded"), ("quota", "room")),
    ],
)
def test_what_the_system_refuses_is_no_bug(
    drillrig: Command, monkeypatch: pytest.MonkeyPatch, error: Exception, words: tuple[str, ...]
) -> None:
    def refused(*_: object, **__: object) -> None:
        raise error

    monkeypatch.setattr(drillrig_pin.simulation, "simulate", refused)
    one_sentence(drillrig("run", *SHORT), *words)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_every_signal_that_ends_keeps_what_a_run_has(
    drillrig: Command, monkeypatch: pytest.MonkeyPatch, number: signal.Signals
) -> None:
    @contextlib.contextmanager
    def impatient(*_: object, **__: object) -> Iterator[Callable[[float], None]]:
        def tick(t: float) -> None:
            if t > 0.02:
                signal.raise_signal(number)
                # `timeout` and terminals send it twice.
                signal.raise_signal(number)

        yield tick

    monkeypatch.setattr(drillrig_pin.cli.run, "_progress", impatient)
    answer = drillrig("run", *SHORT, "--set", "scenario.engine=python")
    assert answer.code == 128 + number
    assert 20 < len(load_trajectory("run.nc").time) < 30
    assert signal.getsignal(number) in (signal.SIG_DFL, signal.default_int_handler)


def test_what_is_being_saved_is_saved_before_a_signal_is_heard() -> None:
    saved: list[bool] = []

    def save() -> None:
        with holding():
            signal.raise_signal(signal.SIGTERM)
            saved.append(True)

    with ending_softly():
        with pytest.raises(KeyboardInterrupt):
            save()
        assert saved
        assert interrupted_code() == 143


def test_a_second_signal_ends_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    left: list[int] = []
    monkeypatch.setattr(os, "_exit", left.append)
    monkeypatch.setattr(drillrig_pin.cli.signals, "ONE", 0.0)
    with ending_softly():
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGTERM)
        time.sleep(0.001)
        signal.raise_signal(signal.SIGTERM)
    assert left == [143]


def test_what_is_to_be_ignored_stays_ignored() -> None:
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with ending_softly():
            signal.raise_signal(signal.SIGHUP)
    finally:
        signal.signal(signal.SIGHUP, before)


DIES = """
import os, sys
from pathlib import Path
from drillrig_pin.files import write_aside
from drillrig_pin.litter import temporary_folder
with write_aside(Path("out.nc")), temporary_folder():
    os.kill(os.getpid(), 9)
"""


def test_what_a_killed_process_left_goes_with_the_next_command_and_what_is_alive_stays(
    drillrig: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", None)
    theirs = [".out.nc.original", ".out.nc.12-34", "drillrig.notes"]
    for name in theirs:
        Path(name).write_text("not ours")
    subprocess.run([sys.executable, "-c", DIES], cwd=tmp_path)
    left = {path.name for path in tmp_path.iterdir()} - set(theirs)
    assert len(left) == 2
    alive = Path(marked(".out.nc"))
    alive.write_text("being written")
    # Of a machine or a container that cannot be looked into: a day, or nobody else may be there.
    foreign = [Path(f".out.nc.7-7-{where}-00000000") for where in ("00000001", "00000002")]
    for path in foreign:
        path.write_text("who knows")
    os.utime(foreign[0], (0, time.time() - 2 * DAY))
    assert drillrig("run", *SHORT, "--no-estimate", "-q", "-o", "out.nc").code == 0
    with temporary_folder():
        pass
    assert {path.name for path in tmp_path.iterdir()} == {*theirs, alive.name, foreign[1].name, "out.nc"}
    remove_litter(tmp_path, alone=True)
    assert {path.name for path in tmp_path.iterdir()} == {*theirs, alive.name, "out.nc"}


def test_names_of_any_length_can_be_written(drillrig: Command, tmp_path: Path) -> None:
    name = "ü" * 126 + ".nc"
    assert drillrig("run", *SHORT, "--no-estimate", "-q", "-o", name).code == 0
    assert [path.name for path in tmp_path.iterdir()] == [name]


def test_links_that_lead_in_a_circle_are_refused(drillrig: Command) -> None:
    Path("a").symlink_to("b")
    Path("b").symlink_to("a")
    one_sentence(drillrig("run", *SHORT, "-o", "a"), "a", "symbolic links")
    assert Path("a").is_symlink()


@pytest.mark.parametrize("kind", ["fifo", "folder"])
def test_a_figure_takes_the_place_of_files_only(drillrig: Command, kind: str) -> None:
    assert drillrig("run", *SHORT, "--no-estimate", "-q").code == 0
    Path("figures").mkdir()
    place = Path("figures/survey.png")
    os.mkfifo(place) if kind == "fifo" else place.mkdir()
    one_sentence(drillrig("plot", "run.nc", "-o", "figures", "-f", "survey"), "survey.png")
    assert not place.is_file()


def test_a_device_without_an_end_is_not_read_to_it(drillrig: Command) -> None:
    assert drillrig("run", *SHORT, "--no-estimate", "-q").code == 0
    one_sentence(drillrig("plot", "run.nc", "--measured", "/dev/zero", "--measured-unit", "mm"), "larger than")
    one_sentence(drillrig("serve", "--token-file", "/dev/zero"), "token")
