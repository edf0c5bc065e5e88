"""No command loses data: not what it reads, not another run's result, not a file of somebody else, no device."""

from __future__ import annotations

import os
import stat
import threading
from pathlib import Path

import pytest
from command import Command, one_sentence
from hypothesis import given, settings
from hypothesis import strategies as st
from processes import PATIENCE

from drillrig_pin.cli.targets import free_name, written_here
from drillrig_pin.files import write_aside
from drillrig_pin.trajectory import load_trajectory

SHORT = ("--set", "scenario.duration=0.05", "--no-estimate", "-q")
#: Every command that writes one file, with what it is called by.
WRITERS = {
    "csv": ("export", "run.nc", "--csv"),
    "mat": ("export", "run.nc", "--mat"),
    "report": ("report", "run.nc", "-o"),
    "page": ("replay", "run.nc", "--html"),
    "expanded": ("expand", "mkz49", "-o"),
    "run": ("run", *SHORT, "-o"),
}


@pytest.fixture
def made(drillrig: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    assert drillrig("run", *SHORT, "-o", "run.nc").code == 0
    return tmp_path


@pytest.mark.parametrize("writer", ["csv", "mat", "report", "page"])
@pytest.mark.parametrize("way", ["run.nc", "./run.nc", "link.nc", "hard.nc"])
def test_a_result_is_never_written_over_by_what_reads_it(drillrig: Command, made: Path, writer: str, way: str) -> None:
    before = Path("run.nc").read_bytes()
    Path("link.nc").symlink_to("run.nc")
    os.link("run.nc", "hard.nc")
    for force in ((), ("--force",)):
        one_sentence(drillrig(*WRITERS[writer], way, *force), way.removeprefix("./"), "is read by this command")
    assert Path("run.nc").read_bytes() == before
    assert Path("link.nc").is_symlink()


def test_files_of_a_model_are_not_written_over(drillrig: Command, made: Path) -> None:
    Path("part.xacro").write_text('<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><link name="a"/></robot>')
    Path("one.xacro").write_text(
        '<robot name="one" xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:include filename="part.xacro"/></robot>'
    )
    for name in ("one.xacro", "part.xacro"):
        before = Path(name).read_bytes()
        one_sentence(drillrig("expand", "one.xacro", "-o", name, "--force"), name, "is read by this command")
        assert Path(name).read_bytes() == before
    Path("case.yaml").write_text("duration: 0.05\n")
    one_sentence(drillrig("run", "-s", "case.yaml", "-o", "case.yaml", "--force"), "case.yaml", "is read")


@pytest.mark.parametrize("writer", [*WRITERS, "other result"])
def test_a_file_of_somebody_else_is_replaced_with_force_only(drillrig: Command, made: Path, writer: str) -> None:
    target = Path("theirs")
    if writer == "other result":
        # A page or table must not take the place of another run's result either.
        assert drillrig("run", *SHORT, "-o", str(target)).code == 0
        words = WRITERS["report"]
    else:
        target.write_text("ten days of notes about drillrig-pin and <drillrig>\n")
        words = WRITERS[writer]
    before = target.read_bytes()
    one_sentence(drillrig(*words, "theirs"), "theirs", "is there already", "--force")
    assert target.read_bytes() == before
    assert drillrig(*words, "theirs", "--force").code == 0
    assert target.read_bytes() != before


@pytest.mark.parametrize("writer", WRITERS)
def test_what_was_written_before_is_written_again(drillrig: Command, made: Path, writer: str) -> None:
    assert drillrig(*WRITERS[writer], "out").code == 0
    again = drillrig(*WRITERS[writer], "out")
    assert again.code == 0, again.err


def test_figures_are_drawn_again_and_foreign_ones_kept(drillrig: Command, made: Path) -> None:
    draw = ("plot", "run.nc", "-o", "figures", "-f", "survey")
    assert drillrig(*draw).code == 0
    assert drillrig(*draw).code == 0
    Path("figures/survey.svg").write_text("<svg>mine</svg>")
    one_sentence(drillrig(*draw), "survey.svg", "--force")
    assert Path("figures/survey.svg").read_text() == "<svg>mine</svg>"


def test_run_without_a_name_leaves_the_last_result(drillrig: Command, made: Path) -> None:
    before = Path("run.nc").read_bytes()
    answer = drillrig("run", "--set", "scenario.duration=0.04", "--no-estimate")
    assert answer.code == 0
    assert "Saved to run-2.nc (run.nc is left as it is)" in answer.out
    assert "drillrig plot run-2.nc" in answer.out
    assert Path("run.nc").read_bytes() == before
    assert load_trajectory("run-2.nc").time[-1] == pytest.approx(0.04)
    assert drillrig("run", *SHORT, "--json").document["output"] == "run-3.nc"


def test_two_outputs_of_one_name_are_refused(drillrig: Command, made: Path) -> None:
    one_sentence(drillrig("export", "run.nc", "--csv", "out", "--mat", "./out"), "out", "given twice")
    assert not Path("out").exists()


def test_study_that_is_the_result_of_its_search_is_kept(drillrig: Command, made: Path) -> None:
    text = (
        "axes: [{name: model.boom_length, range: {start: 1.9, stop: 2.0, count: 2}}]\noptimize: {minimize: S.z.rms}\n"
    )
    Path("best.yaml").write_text(text)
    one_sentence(drillrig("optimize", "best.yaml", "-o", "."), "best.yaml", "is read")
    assert Path("best.yaml").read_text() == text
    assert not Path("journal").exists()


def test_a_link_is_followed_and_keeps_the_permissions_of_its_file(tmp_path: Path) -> None:
    real, link = tmp_path / "deep" / "real.txt", tmp_path / "link.txt"
    real.parent.mkdir()
    real.write_text("old")
    real.chmod(0o640)
    link.symlink_to(real)
    with write_aside(link) as aside:
        aside.write_text("new")
    assert link.is_symlink()
    assert real.read_text() == "new"
    assert stat.S_IMODE(real.stat().st_mode) == 0o640
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["deep", "link.txt", "real.txt"]


def test_a_link_to_nothing_makes_the_file_it_names(tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to(tmp_path / "new")
    with write_aside(tmp_path / "link") as aside:
        aside.write_text("new")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "new").read_text() == "new"


def drained(path: Path) -> tuple[threading.Thread, list[bytes]]:
    """Read a FIFO to its end, in a thread: opening it waits for the other side."""
    got: list[bytes] = []
    thread = threading.Thread(target=lambda: got.append(path.read_bytes()), daemon=True)
    thread.start()
    return thread, got


@pytest.mark.parametrize("writer", ["csv", "run", "expanded"])
def test_a_fifo_is_written_into(drillrig: Command, made: Path, writer: str) -> None:
    os.mkfifo("pipe")
    Path("link").symlink_to("pipe")
    assert drillrig(*WRITERS[writer], "file").code == 0
    for way in ("pipe", "link"):
        thread, got = drained(Path("pipe"))
        answer = drillrig(*WRITERS[writer], way)
        thread.join(PATIENCE)
        assert answer.code == 0, answer.err
        # A result holds the time it took; all else is the same.
        assert len(got[0]) == pytest.approx(len(Path("file").read_bytes()), rel=0.01)
        assert stat.S_ISFIFO(os.lstat("pipe").st_mode)
        assert Path("link").is_symlink()


def test_a_character_device_is_written_into(tmp_path: Path) -> None:
    # The near end of a pseudo-terminal stands for a device node.
    far, near = os.openpty()
    name = Path(os.ttyname(near))
    before = os.stat(name)
    with write_aside(name) as aside:
        aside.write_text("7")
    assert os.read(far, 10) == b"7"
    assert os.stat(name).st_ino == before.st_ino
    assert stat.S_ISCHR(os.stat(name).st_mode)
    os.close(near)
    os.close(far)


def test_words_do_not_spoil_a_stream(drillrig: Command, made: Path) -> None:
    os.mkfifo("pipe")
    thread, got = drained(Path("pipe"))
    answer = drillrig("export", "run.nc", "--csv", "pipe")
    thread.join(PATIENCE)
    assert answer.out == ""
    assert "pipe written" in answer.err
    assert got[0].startswith(b"time [s],")


def test_a_socket_is_refused(drillrig: Command, made: Path) -> None:
    import socket

    with socket.socket(socket.AF_UNIX) as end:
        end.bind("socket")
        one_sentence(drillrig("export", "run.nc", "--csv", "socket"), "socket", "no file")
        assert stat.S_ISSOCK(os.lstat("socket").st_mode)


@settings(max_examples=60, deadline=None)
@given(content=st.binary(max_size=300), start=st.sampled_from([b"", b"\x89HDF\r\n\x1a\n", b"time [s],S_z [mm]\n0,1\n"]))
def test_no_other_file_is_taken_for_a_result(
    tmp_path_factory: pytest.TempPathFactory, content: bytes, start: bytes
) -> None:
    path = tmp_path_factory.getbasetemp() / "any"
    path.write_bytes(start + content)
    for kind in ("result", "page", "csv", "mat", "png", "svg", "film", "parquet", "json", "yaml"):
        assert not written_here(path, kind)


@settings(max_examples=25, deadline=None)
@given(taken=st.sets(st.integers(1, 9)))
def test_a_free_name_is_the_first_that_is_free(tmp_path_factory: pytest.TempPathFactory, taken: set[int]) -> None:
    folder = tmp_path_factory.mktemp("names")
    names = ["run.nc", *(f"run-{i}.nc" for i in range(2, 12))]
    for i in taken:
        (folder / names[i - 1]).write_text("x")
    assert free_name(folder / "run.nc").name == next(n for i, n in enumerate(names, 1) if i not in taken)


def test_an_open_descriptor_is_written_where_it_stands(tmp_path: Path) -> None:
    path = tmp_path / "redirected"
    with path.open("w") as stream:
        stream.write("before ")
        stream.flush()
        with write_aside(Path(f"/dev/fd/{stream.fileno()}")) as aside:
            aside.write_text("content ")
        stream.write("after")
    assert path.read_text() == "before content after"
