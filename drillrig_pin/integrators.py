"""Step through time: SciPy's integrators and a fixed-step RK4 behind one loop.

Stops of the plan, breakpoints of the laws among them, and switches of the laws end a step, so no kink of a load or
contact is stepped over. Rows between stops lie inside a step, which does not depend on them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from scipy.integrate import DOP853, LSODA, DenseOutput, OdeSolver, Radau
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import brentq

from drillrig_pin.errors import Status
from drillrig_pin.inside import Inside, Kind, State, System
from drillrig_pin.kinematics import Array
from drillrig_pin.stepping import NOT_FINITE, Counter, Plan, Settings, StoppedError

#: Points inside a step at which switching functions are looked at, as fractions: a short contact is not missed.
LOOKS = (0.25, 0.5, 0.75, 1.0)
#: Part of a step by which a sample must lie before a singular position to be kept: its time is known no better.
EARLY = 0.01
#: How exactly a switch is located [s].
SWITCH_TIME = 1e-13


#: Takes in an integrator behind an accepted step.
Look = Callable[[Any], None]


class RK4(OdeSolver):  # type: ignore[misc]
    """Classical fourth-order Runge-Kutta with a fixed step, shortened only to land on the bound."""

    t: float
    y: Array

    def __init__(self, fun: Any, t0: float, y0: Array, t_bound: float, *, step: float) -> None:
        super().__init__(fun, t0, y0, t_bound, vectorized=False)
        self.h = step
        self.y_old: Array = y0
        self.f = self.fun(t0, y0)

    def _step_impl(self) -> tuple[bool, str | None]:
        t, y = self.t, self.y
        rest = self.t_bound - t
        # A rest of one and a bit steps is split evenly rather than leaving a sliver.
        h = rest / np.ceil(rest / self.h - 1e-9) if rest > 0 else rest
        k1, fun = self.f, self.fun
        k2 = fun(t + h / 2, y + h / 2 * k1)
        k3 = fun(t + h / 2, y + h / 2 * k2)
        k4 = fun(t + h, y + h * k3)
        self.f_old, self.y_old = k1, y
        self.y = y + h / 6 * (k1 + 2 * (k2 + k3) + k4)
        self.t = self.t_bound if h == rest else t + h
        self.f = fun(self.t, self.y)
        return True, None

    def _dense_output_impl(self) -> DenseOutput:
        curve = CubicHermiteSpline([self.t_old, self.t], [self.y_old, self.y], [self.f_old, self.f])
        output = DenseOutput(self.t_old, self.t)
        output._call_impl = curve
        return output


def integrate(
    system: System, y0: Array, plan: Plan, settings: Settings, counter: Counter, look: Look = lambda solver: None
) -> Iterator[State]:
    """Yield (kind, t, y) at every row; ``system.rate(t, y)`` was then the last thing evaluated, behind any jump.

    Planned rows come in order; further ones, where a law switches, behind those of the step they belong to.

    Args:
        system: right-hand side, projection, switches.
        y0: state at the first row.
        plan: rows, and at which of them a step must end.
        settings: method and tolerances.
        counter: counts accepted steps and evaluations.
        look: called behind every accepted step with SciPy's integrator; ``system.rate`` was evaluated at its end and
            still is when it returns. What it raises ends the run before anything of the step is yielded.

    Raises:
        StoppedError: tolerance not reachable, or the state is no longer finite.
    """
    start = float(plan.times[0])
    system.rate(start, y0)
    yield Kind.ROW, start, y0
    march = _multistep if settings.method == "LSODA" else _one_step
    yield from march(system, y0, plan, settings, counter, look)


def _solver(system: System, t: float, y: Array, bound: float, settings: Settings, first: float | None = None) -> Any:
    if settings.method == "RK4":
        return RK4(system.rate, t, y, bound, step=settings.step)
    cls = {"DOP853": DOP853, "Radau": Radau, "LSODA": LSODA}[settings.method]
    first = None if first is None or not first > 0 or bound <= t else min(first, bound - t)
    tolerances: dict[str, Any] = {"rtol": settings.rtol, "atol": settings.atol}
    if settings.endless and cls is LSODA:
        # It hands them on at once; SciPy warns of relative tolerances below a hundred roundings.
        tolerances["rtol"] = np.maximum(settings.relative, 100 * np.finfo(float).eps)
    solver = cls(system.rate, t, y, bound, max_step=settings.max_step, first_step=first, **tolerances)
    if settings.endless and cls is not LSODA:
        # Radau wants one number to begin with, and like DOP853 reads it by component at every step.
        solver.rtol = settings.relative
    return solver


def _advance(solver: Any, counter: Counter) -> None:
    """One accepted step, or StoppedError."""
    before, state = solver.nfev, solver.y
    try:
        message = solver.step()
    except ValueError as error:
        # Radau's linear algebra refuses what is not finite.
        if isinstance(error, np.linalg.LinAlgError) or "infs or NaNs" not in str(error):
            raise
        raise StoppedError(Status.DIVERGED, float(solver.t), NOT_FINITE, state) from None
    counter.evaluations += solver.nfev - before
    if solver.status == "failed":
        raise StoppedError(Status.STEP_TOO_SMALL, float(solver.t), " ".join((message or "").split()).rstrip("."), state)
    if not np.isfinite(solver.y).all():
        raise StoppedError(Status.DIVERGED, float(solver.t), NOT_FINITE, state)
    counter.steps += 1


def _one_step(
    system: System, y0: Array, plan: Plan, settings: Settings, counter: Counter, look: Look
) -> Iterator[State]:
    watch = _Watch(system, y0)
    system.rate(plan.times[0], y0)
    inside = Inside(
        system, plan, settings, counter, watch.active, lambda t, y, bound, h: _solver(system, t, y, bound, settings, h)
    )
    at = np.flatnonzero(plan.stops)
    columns = (plan.times[at], plan.ends[at], plan.starts[at])
    solver = _solver(system, float(columns[0][0]), y0, float(columns[1][1]), settings)
    for time, stop, start in zip(*(column[1:].tolist() for column in columns), strict=True):
        solver.t_bound, solver.status = stop, "running" if solver.t < stop else "finished"
        while solver.status == "running":
            t_old, y_old = solver.t, solver.y
            _advance(solver, counter)
            event = watch.crossed(solver) if watch.active else None
            if event is not None and event < solver.t:
                # Take the step again so that it ends on the switch, and start afresh behind it.
                solver = _solver(system, t_old, y_old, event, settings, first=event - t_old)
                while solver.status == "running":
                    _advance(solver, counter)
                    system.rate(solver.t, solver.y)
                    look(solver)
                    yield from inside.rows(solver, stopped=False)
                y = system.project(solver.y) if settings.projection else solver.y
                solver = _solver(system, event, y, stop, settings)
                watch.settle()
                counter.switches += 1
                continue
            if settings.projection:
                solver.y = system.project(solver.y)
                solver.f = system.rate(solver.t, solver.y)
                counter.evaluations += 1
            elif settings.method == "Radau" or watch.active:
                system.rate(solver.t, solver.y)
            look(solver)
            yield from inside.rows(solver, solver.status == "finished")
        if start > stop:
            # The length of the last step is a good first guess behind a jump, and is tried like any other.
            first, last = getattr(solver, "h_abs", None), plan.ends[-1]
            solver = _solver(system, start, solver.y, max(last, start), settings, first=first)
            system.rate(solver.t, solver.y)
        yield inside.at_stop(time, solver.y)


def _looked(look: Look, solver: Any) -> StoppedError | None:
    try:
        look(solver)
    except StoppedError as stopped:
        return stopped
    return None


def _multistep(
    system: System, y0: Array, plan: Plan, settings: Settings, counter: Counter, look: Look
) -> Iterator[State]:
    watch = _Watch(system, y0)
    samples = plan.times
    t, y, next_sample = float(samples[0]), y0, 1
    # Rows lie on the interpolant: only a break ends its steps.
    ends = plan.breaks.copy()
    ends[-1] = True
    for bound, start in zip(plan.ends[1:][ends[1:]].tolist(), plan.starts[1:][ends[1:]].tolist(), strict=True):
        solver = _solver(system, t, y, bound, settings)
        while solver.status == "running" and solver.t < bound:
            t_old = solver.t
            _advance(solver, counter)
            system.rate(solver.t, solver.y)
            curve, end = solver.dense_output(), solver.t
            stopped = _looked(look, solver)
            if stopped is not None:
                # A step of many samples: those before a singular position lie on the path that leads there.
                end = stopped.time - EARLY * (solver.t - t_old) if stopped.status is Status.SINGULAR else t_old
            event = watch.crossed(solver) if watch.active else None
            if event is not None and event < end:
                end = event
            while next_sample < len(samples) and samples[next_sample] <= end:
                t = float(samples[next_sample])
                y = curve(t) if t < solver.t else solver.y
                system.rate(t, y)
                yield Kind.ROW, t, y
                next_sample += 1
            if stopped is not None:
                raise stopped
            if event is not None and t_old < event < solver.t:
                # The history before a switch says nothing about what comes behind it.
                solver = _solver(system, event, curve(event), bound, settings)
                watch.settle()
                counter.switches += 1
        t, y = (start if start > bound else float(solver.t)), solver.y
        if start > bound and next_sample < len(samples) and samples[next_sample] <= start:
            system.rate(t, y)
            yield Kind.ROW, float(samples[next_sample]), y
            next_sample += 1


class _Watch:
    """Remembers the signs of the switching functions and finds where one changes."""

    def __init__(self, system: System, y: Array) -> None:
        self._system = system
        self._signs = system.switches(y) > 0
        self._next = self._signs
        self.active = bool(self._signs.size)

    def crossed(self, solver: Any) -> float | None:
        """Time just behind the first sign change within the solver's last step, or None."""
        t_old, t = solver.t_old, solver.t
        curve = solver.dense_output()
        left = t_old
        for fraction in LOOKS:
            right = t if fraction == 1.0 else t_old + fraction * (t - t_old)
            signs = self._system.switches(curve(right)) > 0
            changed = np.flatnonzero(signs != self._signs)
            if changed.size:
                times = [self._root(curve, int(i), left, right) for i in changed]
                first = int(np.argmin(times))
                self._next = self._signs.copy()
                self._next[changed[first]] = signs[changed[first]]
                return min(times[first] + 2 * SWITCH_TIME, t) if t - times[first] > 4 * SWITCH_TIME else self._pass(t)
            left = right
        return None

    def _pass(self, t: float) -> float:
        """The change lies at the very end of the step: nothing to take again."""
        self._signs = self._next
        return t

    def settle(self) -> None:
        """The integration now stands behind the switch found last."""
        self._signs = self._next

    def _root(self, curve: Any, index: int, left: float, right: float) -> float:
        def value(t: float) -> float:
            return float(self._system.switches(curve(t))[index])

        if not value(left) * value(right) <= 0:
            # The start already lies on the new side by rounding: the switch was at the start.
            return left
        root: float = brentq(value, left, right, xtol=SWITCH_TIME, disp=False)
        return root
