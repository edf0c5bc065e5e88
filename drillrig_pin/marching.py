"""Carry a bound rig through time, in Python or in the compiled core, into the same recorder."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from functools import lru_cache

import numpy as np

from drillrig_pin.budget import OverspentError
from drillrig_pin.constraint_watch import ConstraintWatch, left_words, lost_words
from drillrig_pin.dynamics import Dynamics
from drillrig_pin.elements.cylinder import Cylinder
from drillrig_pin.errors import Status
from drillrig_pin.inside import Kind
from drillrig_pin.kinematics import Array
from drillrig_pin.recorder import Recorder
from drillrig_pin.stepping import Counter, Settings, StoppedError

Progress = Callable[[float], None]
#: Integrates over the rows planned by the recorder, and into it; StoppedError if it cannot go on.
March = Callable[[Settings, Recorder, Counter, Progress], None]
#: dy/dt (k, size) at times (k) and states (k, size).
Rates = Callable[[Array, Array], Array]


def march_python(dynamics: Dynamics) -> tuple[March, Rates]:
    """A bound rig in Python, to be marched and to be looked at."""

    def march(settings: Settings, recorder: Recorder, counter: Counter, progress: Progress) -> None:
        # SciPy's integrators take a third of a second to import, which a run in the core need not wait for.
        from drillrig_pin.integrators import integrate

        watch = ConstraintWatch(dynamics, settings.rtol)
        plan = recorder.plan
        every = max(1, len(plan.times) // 200)
        with np.errstate(all="ignore"):
            start = dynamics.initial()
            watch.begin(float(plan.times[0]), start, dynamics.rate(float(plan.times[0]), start))
            t, y = float(plan.times[0]), start
            rows = integrate(dynamics, start, plan, settings, counter, watch.step)
            while True:
                try:
                    kind, t, y = next(rows)
                except StopIteration:
                    return
                except OverspentError as error:
                    raise StoppedError(Status.TOO_LONG, t, error.what, y) from None
                broken = broken_cylinder(dynamics) if kind is not Kind.EXTRA else ""
                if broken:
                    raise StoppedError(Status.DIVERGED, t, broken, y)
                recorder.record(t, y, extra=kind is Kind.EXTRA)
                if recorder.count % every == 0:
                    progress(t)

    def rates(times: Array, states: Array) -> Array:
        with np.errstate(all="ignore"):
            return np.array([dynamics.rate(t, y) for t, y in zip(times.tolist(), states, strict=True)])

    return march, rates


def march_core(dynamics: Dynamics) -> tuple[March, Rates]:
    """The same in the compiled core, which marches without the GIL."""
    from drillrig_pin.core import CompiledDynamics

    compiled = CompiledDynamics(dynamics)

    def march(settings: Settings, recorder: Recorder, counter: Counter, progress: Progress) -> None:
        report = compiled.run(dynamics.initial(), settings, recorder.plan, recorder.arrays(), progress)
        recorder.count = report.rows
        recorder.extra.append(report.extra)
        counter.steps, counter.evaluations, counter.switches = report.steps, report.evaluations, report.switches
        if isinstance(report.error, OverspentError):
            raise StoppedError(Status.TOO_LONG, report.time, report.error.what, report.state) from None
        if report.error is not None:
            raise report.error
        progress(report.time)
        cause = report.cause
        if report.status is Status.SINGULAR:
            cause = lost_words(dynamics)
        elif report.status is Status.DRIFTED:
            dynamics.space.update(*np.split(report.state[:-2], [dynamics.rig.model.nq]))
            cause = left_words(dynamics, dynamics.space.x_constraint - dynamics.targets)
        if report.status is not Status.COMPLETED:
            raise StoppedError(report.status, report.time, cause, report.state)

    return march, compiled.rates


@lru_cache(maxsize=1)
def core_is_installed() -> bool:
    """True if the package was built with a C++ compiler."""
    return importlib.util.find_spec("drillrig_pin._drillrig") is not None


def broken_cylinder(dynamics: Dynamics, spare: float = 0.0) -> str:
    """Says which cylinder left its stroke, or moves towards an end that is nearer than ``spare`` of its stroke."""
    for element, i in zip(dynamics.forces, dynamics.space.index, strict=True):
        if isinstance(element, Cylinder):
            shortest, longest = element.length_range
            length, rate = float(dynamics.x[i]), float(dynamics.x_dot[i])
            margin = spare * element.stroke
            if length <= shortest or length >= longest:
                return f"cylinder {element.name!r} left its stroke (length {length:.4f} m)"
            if (length <= shortest + margin and rate < 0) or (length >= longest - margin and rate > 0):
                return f"cylinder {element.name!r} runs against the end of its stroke (length {length:.4f} m)"
    return ""
