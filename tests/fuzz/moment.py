"""A moment of computing, ended as a user would end it, by Ctrl-C; and what must happen before the first of them."""

from __future__ import annotations

import importlib
import signal
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from drillrig_pin import DrillrigError
from drillrig_pin.errors import AccuracyWarning

#: A run that takes longer is ended [s of processor time]: on a busy machine the wall clock says little.
PATIENCE = 0.4
#: Not heard, it is said again after this time [s of processor time].
AGAIN = 0.5
#: Parts of the package that no input reaches, and that take long to import.
ELSEWHERE = ("drillrig_pin.service", "drillrig_pin.cli.serve", "drillrig_pin.replay.video")


@dataclass
class Moment:
    """Whether it was over before the work was done."""

    over: bool = False


@contextmanager
def moment(patience: float = PATIENCE) -> Iterator[Moment]:
    """Work inside ends with KeyboardInterrupt after ``patience`` [s of processor time]; the block then ends quietly."""
    state, armed = Moment(), True

    def stop(*_: Any) -> None:
        if armed:
            state.over = True
            raise KeyboardInterrupt

    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, patience, AGAIN)
    try:
        yield state
    except KeyboardInterrupt:
        if not state.over:
            raise
    finally:
        armed = False
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)


def warm_up() -> None:
    """Import all that inputs reach and run every engine and method once, so that no moment strikes an import."""
    import drillrig_pin

    root = Path(drillrig_pin.__file__).parent
    for file in sorted(root.rglob("*.py")):
        name = ".".join(("drillrig_pin", *file.relative_to(root).with_suffix("").parts)).removesuffix(".__init__")
        if not name.startswith(ELSEWHERE) and file.stem != "__main__":
            importlib.import_module(name)
    from drillrig_pin import Scenario, load_rig_text, load_trajectory, simulate
    from drillrig_pin.analysis.metrics import measure
    from drillrig_pin.scenario import CORE_METHODS, PYTHON_METHODS
    from fuzz import seeds

    rig = load_rig_text(seeds.models()[1].decode())
    ways = [("core", method) for method in CORE_METHODS] + [("python", method) for method in PYTHON_METHODS]
    for formulation in ("multipliers", "null_space", "damped"):
        for engine, method in ways:
            case = Scenario(
                duration=0.002,
                output_rate=2000,
                engine=engine,
                formulation=formulation,
                integrator={"method": method},
                stabilization={"projection": method != "LSODA"},
            )
            measure(simulate(rig, case))
    with TemporaryDirectory() as folder:
        Path(folder, "run.nc").write_bytes(seeds.result())
        measure(load_trajectory(Path(folder, "run.nc")))


@contextmanager
def no_warning() -> Iterator[None]:
    """Raise :class:`WarnedError` if anything but the package's own doubt was warned of inside."""
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        try:
            yield
        except DrillrigError as error:
            _require_silence(said, error)
            raise
        _require_silence(said)


def _require_silence(said: list[warnings.WarningMessage], error: Exception | None = None) -> None:
    for warning in said:
        if not issubclass(warning.category, AccuracyWarning):
            place = f"{warning.filename.rpartition('/')[2]}:{warning.lineno}"
            raise WarnedError(f"{warning.category.__name__}: {str(warning.message)[:200]} at {place}") from error


class WarnedError(Exception):
    """A library warned of what the package should have said itself."""
