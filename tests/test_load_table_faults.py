"""Load tables of a measurement: what is wrong with them is said with the line, and nothing else is read for them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from rigs import NO_GRAVITY, point_mass

from drillrig_pin import ModelError, Scenario, ScenarioError, load_rig, load_rig_text, simulate

GOOD = "time,force\n" + "\n".join(f"{i / 10},{i}" for i in range(11))


def model(folder: Path, table: str | bytes | None, attribute: str = 'file="load.csv"') -> Path:
    """A model that names a table beside it."""
    if table is not None:
        (folder / "load.csv").write_bytes(table if isinstance(table, bytes) else table.encode())
    load = f'<load name="drill" kind="force" point="P" axis="1 0 0" frame="world"><table {attribute}/></load>'
    path = folder / "rig.urdf"
    path.write_text(point_mass(2.0, NO_GRAVITY + load))
    return path


@pytest.mark.parametrize(
    ("table", "words"),
    [
        (GOOD.replace("0.3,3", "0.3,"), ("line 5", "'0.3,'")),
        (GOOD.replace("0.3,3", "0.3"), ("line 5",)),
        (GOOD.replace("0.3,3", "0.3,3,4"), ("line 5",)),
        (GOOD.replace("0.3,3", "0.3,three"), ("line 5", "three")),
        (GOOD.replace("0.3,3", "0.3,nan"), ("line 5", "not finite")),
        (GOOD.replace("0.3,3", "inf,3"), ("line 5", "not finite")),
        (GOOD.replace("0.3,3", "0.2,3\n0.2,4"), ("line 6", "does not increase", "third row at one time")),
        (GOOD.replace("0.3,3", "0.1,3"), ("line 5", "does not increase")),
        (GOOD + "\n3.0,1\n3.1,1", ("gap from t = 1 to 3 s",)),
        ("time,force\n0,1\n1,2\n2,3", ("fewer than four",)),
        ("", ("fewer than four",)),
        (b"0,1\n1,\xff\n", ("UTF-8",)),
        (b"0,1\n1,\x00\n2,1\n3,1\n", ("load",)),
    ],
    ids=[
        "hole", "one column", "three columns", "word", "nan", "inf", "repeated time", "time runs back", "gap", "short",
        "empty", "encoding", "binary",
    ],
)  # fmt: skip
def test_a_faulty_table_is_refused_in_one_sentence(tmp_path: Path, table: str | bytes, words: tuple[str, ...]) -> None:
    with pytest.raises(ModelError) as caught:
        load_rig(model(tmp_path, table))
    sentence = str(caught.value)
    assert "\n" not in sentence
    for word in words:
        assert word in sentence, sentence


def test_a_table_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match=r"load\.csv.*cannot be read"):
        load_rig(model(tmp_path, None))


@pytest.mark.parametrize("way", ["../secret.csv", "{outside}", "link.csv"])
def test_a_table_outside_the_models_folder_is_not_read(tmp_path: Path, way: str) -> None:
    inside = tmp_path / "inside"
    inside.mkdir()
    secret = tmp_path / "secret.csv"
    secret.write_text(GOOD)
    (inside / "link.csv").symlink_to(secret)
    attribute = f'file="{way.format(outside=secret)}"'
    with pytest.raises(ModelError, match="outside the model's folder"):
        load_rig(model(inside, None, attribute))


@pytest.mark.parametrize(("start", "end", "duration"), [(0.0, 1.0, 1.2), (0.1, 2.0, 1.0)])
def test_a_run_longer_than_its_table_is_refused_with_both_spans(start: float, end: float, duration: float) -> None:
    times = np.linspace(start, end, 21).tolist()
    table = "\n".join(f"{t!r},1" for t in times)
    load = f'<load name="drill" kind="force" point="P" axis="1 0 0" frame="world"><table>{table}</table></load>'
    rig = load_rig_text(point_mass(2.0, load))
    with pytest.raises(ScenarioError, match=rf"'drill' is known from {start:g} to {end:g} s.*0 to {duration:g} s"):
        simulate(rig, Scenario(duration=duration))
    # Switched off, it is no obstacle.
    assert simulate(rig, Scenario(duration=0.01, loads="none")).outcome.completed


def test_the_expanded_model_carries_its_table_along(tmp_path: Path) -> None:
    rig = load_rig(model(tmp_path, GOOD))
    (tmp_path / "load.csv").unlink()
    again = load_rig_text(rig.file.text)
    runs = [simulate(r, Scenario(duration=1.0, output_rate=20)).load_value for r in (rig, again)]
    np.testing.assert_array_equal(*runs)
    np.testing.assert_allclose(runs[0][::2, 0], np.arange(11), atol=1e-12)


def test_windows_line_ends_and_a_byte_order_mark_are_no_fault(tmp_path: Path) -> None:
    rig = load_rig(model(tmp_path, b"\xef\xbb\xbf" + GOOD.replace("\n", "\r\n").encode()))
    assert len(rig.forces[0].law.samples) == 11
