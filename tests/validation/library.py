"""Problems A01 and A02 of the IFToMM library of computational benchmark problems, against their closed forms."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from rigs import joint, link, point, robot
from scipy.optimize import brentq
from scipy.special import ellipj, ellipk

from drillrig_pin import Scenario, Status, Trajectory, load_rig_text, simulate
from drillrig_pin.kinematics import Array
from validation.record import Row
from validation.settings import ENGINES, TIGHT, deviation

TEXT = """\
M. González, D. Dopico, U. Lugrís and J. Cuadrado proposed the problems in *A benchmarking system for MBS simulation
software: problem standardization and performance measurement*, Multibody System Dynamics 16 (2006) 179–190; data and
measures are those of [A01](http://lim.ii.udc.es/mbsbenchmark/dist/A01/A01_specification.xml) and
[A02](http://lim.ii.udc.es/mbsbenchmark/dist/A02/A02_specification.xml). Both specifications allow errors of 1e-1 (low
precision) and 1e-3 (high precision) with a threshold of 1e-3. Shown is the largest |y − y_ref| / max(|y_ref|, 1e-3)
over all output steps and variables, which no average of the same errors can exceed.

Their reference solutions are numerical. Both motions have closed forms in Jacobi's elliptic functions, used here
instead. A01, released at rest from the horizontal: sin(θ/2) = k sn(K(k) + ω t, k) with θ from the hanging position, k
= sin(π/4), ω² = g / l. A02 is a parallelogram linkage: N + 1 turning and N translating bars are one pendulum with I =
(N + 1) / 3 + N and W = g ((N + 1) / 2 + N); it starts upright at 1 rad/s and turns over, θ = 2 am(K(k) + ω t / 2, k),
ω² = 1 + 4 W / I, k² = 4 W / (I ω²).

In the horizontal position of A02 the constraint Jacobian loses rank and every four-bar may go on as a parallelogram
or as an antiparallelogram. A run stops there with status *singular configuration* rather than choose: compared up to
there, with the moment of the stop. The damped formulation lets go of the directions that the constraints hardly hold
and follows the smooth path, which is that of the closed form: compared over the whole 20 s.
"""
G = 9.81
PRECISE, THRESHOLD = 1e-3, 1e-3
#: What the Python engine is run for in the short form [s]: more than a turn of A02, three times past the horizontal. It
#: takes more than a second for each; the core, as the long form, goes on to the end.
SHORT_IN_PYTHON = 3.0
LATE_PHASE = (
    "each of 844 periods adds to the phase what the tolerance of 1e-8 allows; so long a run needs a tighter one"
)


def pendulum_a01() -> str:
    """1 kg on a massless bar of 1 m, at q = 0 along +x; gravity along -y."""
    return robot(
        link("bar", 1.0, (1, 0, 0), (0.0, 0.0, 0.0)),
        joint("hinge", "revolute", "world", "bar"),
        extension=f'<gravity xyz="0 -{G} 0"/>' + point("P1", "bar", (1, 0, 0)),
    ).replace('lower="-100" upper="100"', 'lower="-1e6" upper="1e6"')


def n_four_bar(n: int) -> str:
    """n + 1 bars on hinges 1 m apart, their ends joined by n bars; uniform bars of 1 m and 1 kg; gravity along -y."""
    bar = ((0.5, 0, 0), (0.0, 1 / 12, 1 / 12))
    parts, extension = [], f'<gravity xyz="0 -{G} 0"/>' + point("B0", "upright_0", (1, 0, 0))
    for i in range(n + 1):
        parts += [link(f"upright_{i}", 1.0, *bar), joint(f"foot_{i}", "revolute", "world", f"upright_{i}", (i, 0, 0))]
    for i in range(n):
        parts += [
            link(f"coupler_{i}", 1.0, *bar),
            joint(f"knee_{i}", "revolute", f"upright_{i}", f"coupler_{i}", (1, 0, 0)),
        ]
        extension += point(f"end_{i}", f"coupler_{i}", (1, 0, 0)) + point(f"top_{i}", f"upright_{i + 1}", (1, 0, 0))
        extension += f'<loop name="window_{i}" from="top_{i}" to="end_{i}" translations="x y"/>\n'
    return robot(*parts, extension=extension)


def a01_exact(t: Array) -> Array:
    """Position of P1, (n, 2) [m]."""
    k = np.sin(np.pi / 4)
    half = np.arcsin(k * ellipj(ellipk(k**2) + np.sqrt(G) * t, k**2)[0])
    return np.stack([np.sin(2 * half), -np.cos(2 * half)], axis=1)


def a02_exact(t: Array, n: int) -> tuple[Array, Array]:
    """Angle of the bars from +x and its rate; upright and turning towards +x at t = 0."""
    inertia, weight = (n + 1) / 3 + n, G * ((n + 1) / 2 + n)
    omega = np.sqrt(1 + 4 * weight / inertia)
    m = 4 * weight / inertia / omega**2
    _, _, dn, phase = ellipj(ellipk(m) + omega * t / 2, m)
    return 1.5 * np.pi - 2 * phase, -omega * dn


def rows(short: bool) -> Iterator[Row]:
    """Measure both problems."""
    yield from _a01(short)
    yield from _a02(short)


def _a01(short: bool) -> Iterator[Row]:
    rig = load_rig_text(pendulum_a01())
    for engine in ENGINES:
        seconds = 2000.0 if not short else SHORT_IN_PYTHON if engine == "python" else 20.0
        for tolerances, words in (({}, "default tolerances"), (TIGHT, "tolerance 1e-12")):
            run = simulate(rig, Scenario(duration=seconds, output_rate=2.0, engine=engine).changed(tolerances))
            position = run.point_position[:, run.labels["point"].index("P1"), :2]
            about = f"A01 simple pendulum, {seconds:g} s, {engine}, {words}"
            error = deviation(position, a01_exact(run.time), THRESHOLD)
            loose = LATE_PHASE if not short and not tolerances else ""
            yield Row(f"{about}: position", "closed form; bar: high precision of A01", error, high=PRECISE, miss=loose)
            drift = float(np.abs(run.energy_residual).max()) / G
            yield Row(f"{about}: energy over m g l", "conservation", drift, high=1e-4 if not tolerances else 1e-8)


def _a02(short: bool) -> Iterator[Row]:
    for n in (1, 2) if short else (1, 2, 40):
        rig = load_rig_text(n_four_bar(n))
        start = {f"foot_{i}": np.pi / 2 for i in range(n + 1)} | {f"knee_{i}": -np.pi / 2 for i in range(n)}
        turning = {f"foot_{i}": -1.0 for i in range(n + 1)} | {f"knee_{i}": 1.0 for i in range(n)}
        case = Scenario(output_rate=20.0, positions=start, velocities=turning)
        flat = float(brentq(lambda t, n=n: float(a02_exact(np.array(t), n)[0]), 0.1, 2.0))
        for engine in ENGINES if n < 10 else ENGINES[:1]:
            seconds = SHORT_IN_PYTHON if short and engine == "python" else 20.0
            about = f"A02 with N = {n}, {engine}"
            before = np.floor(flat * 20.0) / 20.0
            run = simulate(rig, case.changed({"duration": before, "engine": engine}))
            yield _b0(f"{about}: position and velocity of B0 up to {before:g} s", run, n)
            drift = float(np.abs(run.energy_residual).max() / np.ptp(run.energy_potential))
            yield Row(f"{about}: energy over the energy exchanged", "conservation", drift, high=1e-7)
            whole = simulate(rig, case.changed({"duration": 20.0, "engine": engine}))
            stopped = whole.outcome.status is Status.SINGULAR
            late = abs(whole.outcome.time - flat) if stopped else np.inf
            words = f"{about}: stop against the first horizontal position"
            yield Row(words, f"closed form, {flat:.6f} s", late, high=0.05, unit="s")
            passed = simulate(rig, case.changed({"duration": seconds, "engine": engine, "formulation": "damped"}))
            yield _b0(f"{about}, damped: position and velocity of B0 over {passed.time[-1]:g} s", passed, n)
            drift = float(np.abs(passed.energy_residual).max() / np.ptp(passed.energy_potential))
            yield Row(f"{about}, damped: energy over the energy exchanged", "conservation", drift, high=1e-7)


def _b0(claim: str, run: Trajectory, n: int) -> Row:
    """Position and velocity of B0 against the closed form; a run that stopped early proves nothing."""
    angle, rate = a02_exact(run.time, n)
    exact = np.stack([np.cos(angle), np.sin(angle), -np.sin(angle) * rate], axis=1)
    q, v = run.of("q", "foot_0"), run.of("v", "foot_0")
    measured = np.column_stack([run.point_position[:, run.labels["point"].index("B0"), :2], -np.sin(q) * v])
    error = deviation(measured, exact, THRESHOLD) if run.outcome.completed else np.inf
    return Row(claim, "closed form; bar: high precision of A02", error, high=PRECISE)
