"""Kinds of files, and what their user does with them next."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import Any

from drillrig_pin import Rig, Scenario, load_rig, load_rig_text, load_scenario, load_trajectory, simulate
from drillrig_pin.analysis.limits import read_limits
from drillrig_pin.analysis.measured import compare_with, read_measurement
from drillrig_pin.analysis.metrics import measure
from drillrig_pin.batch.cases import Plan, unfold
from drillrig_pin.batch.store import Store
from drillrig_pin.batch.study import load_study
from fuzz import cases, seeds
from fuzz.moment import moment
from fuzz.mutators import (
    WORDS,
    spoil_json_lines,
    spoil_table,
    spoil_xml,
    spoil_yaml,
    spoiled,
)
from fuzz.oracle import loaded, use_case
from fuzz.results import spoil_result

Files = dict[str, bytes]


@dataclass(frozen=True)
class Kind:
    """A kind of input.

    Attributes:
        name: of the files.
        share: how many of a hundred inputs are of it.
        make: the spoiled files by name.
        use: what is done with the folder they lie in.
    """

    name: str
    share: int
    make: Callable[[Random], Files]
    use: Callable[[Path], None]


def run_a_moment(rig: Rig, case: Scenario) -> None:
    """Simulate, and look at the numbers."""
    run = None
    with moment():
        run = simulate(rig, case)
    if run is not None and len(run.time) >= 2:
        measure(run)


def use_model(path: Path) -> None:
    """Check it, load it, run it for a moment, look at its numbers."""
    rig = loaded(path, check=True)
    # Which engine and which formulation follows from the file, so that all are met and every input is the same again.
    engine, formulation = _WAYS[len(rig.file.text) % len(_WAYS)]
    run_a_moment(rig, Scenario(duration=0.002, output_rate=2000, engine=engine, formulation=formulation))


_WAYS = (("auto", "multipliers"), ("auto", "null_space"), ("python", "multipliers"), ("python", "null_space"))


def _model(random: Random) -> Files:
    return {"rig.urdf": spoiled(random.choice(seeds.models()), random, spoil_xml)}


def _xacro(random: Random) -> Files:
    name = random.choice(("rig.urdf.xacro", "rig.urdf.xacro", "part.xacro"))
    return {**seeds.XACRO, name: spoiled(seeds.XACRO[name], random, spoil_xml)}


def _numbers(random: Random) -> Files:
    return {**seeds.XACRO, "numbers.yaml": spoiled(seeds.XACRO["numbers.yaml"], random, spoil_yaml)}


def _load_table(random: Random) -> Files:
    return {"rig.urdf": seeds.model_with_table(), "push.csv": spoiled(seeds.LOAD_TABLE, random, spoil_table)}


def _scenario(random: Random) -> Files:
    return {"case.yaml": spoiled(random.choice(seeds.SCENARIOS), random, spoil_yaml)}


@lru_cache(maxsize=1)
def _double_pendulum() -> Any:
    return load_rig_text(seeds.models()[1].decode())


def use_scenario(path: Path) -> None:
    """Load it and run it for a moment on the machine it is meant for."""
    case = load_scenario(path)
    if case.duration * case.output_rate <= 1e5:
        run_a_moment(_double_pendulum(), case)


def _study(random: Random) -> Files:
    return {**seeds.XACRO, "study.yaml": spoiled(random.choice(seeds.STUDIES), random, spoil_yaml)}


def use_study(path: Path) -> None:
    """Load it and unfold it."""
    study = load_study(path)
    if math.prod(sum(1 for _ in itertools.islice(axis.points(), 2000)) for axis in study.axes) < 2000:
        unfold(study)


def _limits(random: Random) -> Files:
    if random.random() < 0.7:
        return {"limits.yaml": spoiled(seeds.LIMITS, random, spoil_yaml)}
    return {"setting": random.choice((b"", b"toe_6m=", b"angle=", b"toe_1e3m=")) + random.choice(WORDS).encode()}


def use_limits(folder: Path) -> None:
    """Read the file, or a setting of the command line."""
    for file in folder.glob("*.yaml"):
        read_limits(file)
    for file in folder.glob("setting"):
        read_limits(None, [file.read_text()])


def _measurement(random: Random) -> Files:
    return {"gauge.csv": spoiled(seeds.MEASUREMENT, random, spoil_table)}


def use_measurement(path: Path) -> None:
    """Read it and lay it over a run."""
    import numpy as np

    t = np.arange(0.0, 0.5, 1e-3)
    compare_with(t, np.sin(20 * t), read_measurement(path, "mm"))


def _result(random: Random) -> Files:
    return {"run.nc": spoil_result(seeds.result(), random)}


def use_result(path: Path) -> None:
    """Load it, look at its numbers, and load the model it carries."""
    run = load_trajectory(path)
    if len(run.time) >= 2:
        measure(run)
    load_rig_text(run.model)
    _ = run.content_hash


@lru_cache(maxsize=1)
def _plan() -> Plan:
    with TemporaryDirectory() as folder:
        for name, data in {**seeds.XACRO, "study.yaml": seeds.STUDIES[1]}.items():
            Path(folder, name).write_bytes(data)
        return unfold(load_study(Path(folder, "study.yaml")))


def _journal(random: Random) -> Files:
    text = seeds.JOURNAL
    for i, case in enumerate(_plan().cases[:4]):
        text = text.replace(b"{%d}" % i, case.question.key.encode())
    return {"000001-a.jsonl": spoiled(text, random, spoil_json_lines)}


def use_journal(folder: Path) -> None:
    """Go on with a study and write its table."""
    journal = folder / "journal"
    journal.mkdir()
    for file in folder.glob("*.jsonl"):
        file.rename(journal / file.name)
    store = Store(folder)
    try:
        store.write_table(_plan())
    finally:
        store.close()


def use_legal_study(folder: Path) -> None:
    """Load it, unfold it, and run its first case."""
    study = load_study(folder / "study.yaml")
    if math.prod(sum(1 for _ in itertools.islice(axis.points(), 2000)) for axis in study.axes) < 2000:
        plan = unfold(study)
        case = plan.base.changed(plan.cases[0].question.changes)
        run_a_moment(load_rig(case.model, **case.arguments), case)


#: Files spoiled in their bytes and their structure; files as the grammar allows them. Of each a hundred.
SPOILED = (
    Kind("model (URDF)", 40, _model, lambda folder: use_model(folder / "rig.urdf")),
    Kind("model (xacro)", 8, _xacro, lambda folder: use_model(folder / "rig.urdf.xacro")),
    Kind("parameters (YAML)", 8, _numbers, lambda folder: use_model(folder / "rig.urdf.xacro")),
    Kind("load table (CSV)", 9, _load_table, lambda folder: use_model(folder / "rig.urdf")),
    Kind("scenario (YAML)", 12, _scenario, lambda folder: use_scenario(folder / "case.yaml")),
    Kind("study (YAML)", 5, _study, lambda folder: use_study(folder / "study.yaml")),
    Kind("limits (YAML)", 6, _limits, use_limits),
    Kind("measurement (CSV)", 6, _measurement, lambda folder: use_measurement(folder / "gauge.csv")),
    Kind("result (NetCDF)", 3, _result, lambda folder: use_result(folder / "run.nc")),
    Kind("journal of a study", 3, _journal, use_journal),
)
LEGAL = (
    Kind("legal machine and case", 86, cases.case_and_machine, use_case),
    Kind("legal case of a sound machine", 8, cases.case_of_a_sound_machine, use_case),
    Kind("legal study", 2, cases.study, use_legal_study),
    Kind("legal limits", 2, cases.limits, use_limits),
    Kind("legal measurement", 2, cases.measurement, lambda folder: use_measurement(folder / "gauge.csv")),
)
TABLES = {"spoiled": SPOILED, "legal": LEGAL}
assert all(sum(kind.share for kind in table) == 100 for table in TABLES.values())


def kind_of(number: int, table: str = "spoiled") -> Kind:
    """The kind of an input, by its number: in every hundred each has its share."""
    place = number * 37 % 100
    for kind in TABLES[table]:
        place -= kind.share
        if place < 0:
            return kind
    raise AssertionError("the shares are of a hundred")


def files_of(seed: int, number: int, table: str = "spoiled") -> Files:
    """The files of one input."""
    return kind_of(number, table).make(Random(f"{seed}:{number}"))
