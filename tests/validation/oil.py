"""A mass on one locked cylinder: potential and period of the logarithmic law, by quadrature."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from rigs import mass_on_cylinder
from scipy.integrate import quad
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import brentq

from drillrig_pin import Scenario, load_rig_text, simulate
from drillrig_pin.kinematics import Array
from validation.record import Row
from validation.settings import ENGINES, TIGHT

MASS, LENGTH, G = 500.0, 0.65, 9.81
#: Cylinder no. 4 of [Tram2023] table 5, as `rigs.CYLINDER` has it.
BORE, ROD, RETRACTED, DEAD, MODULUS = 0.063, 0.030, 0.472, 0.100, 2.85e9
S_A, S_B = np.pi * BORE**2 / 4, np.pi * (BORE**2 - ROD**2) / 4
L_A = LENGTH - RETRACTED
L_B = RETRACTED - DEAD - L_A

TEXT = f"""\
{MASS:g} kg rest on cylinder no. 4 of [Tram2023] table 5, locked at {LENGTH:g} m. The force is written
down here once more from eqs. (28)–(34), F(u) = m g − E₀ S_A ln(1 + u / l_A) + E₀ S_B ln(1 − u / l_B) (as printed: −
E₀ S_B ln(1 + u / l_B)). Its potential is integrated numerically and compared with the energy the run reports. The
period is T = 2 ∫ du / √(2 (E − U) / m) between the turning points; the measured one comes from the passages through
equilibrium of the sampled motion. At 1 µm it is that of the linear oil spring k = E₀ (S_A / l_A + S_B / l_B), at
larger amplitudes it is not.
"""


def force(u: float, law: str) -> float:
    """Force of the cylinder beyond the weight it holds at rest, less friction [N]."""
    b = np.log1p(-u / L_B) if law == "geometric" else -np.log1p(u / L_B)
    return float(MODULUS * (S_B * b - S_A * np.log1p(u / L_A)))


def potential(u: float, law: str) -> float:
    """Work against that force from u = 0 [J]."""
    return -float(quad(force, 0.0, u, args=(law,), epsabs=0.0, epsrel=1e-13)[0])


def period(energy: float, law: str) -> float:
    """Period at a total energy [J], by quadrature [s]."""
    limit = 0.999 * min(L_A, L_B)
    low, high = (
        float(brentq(lambda u: potential(u, law) - energy, *ends, xtol=1e-16, rtol=1e-15))
        for ends in ((-limit, 0.0), (0.0, limit))
    )
    middle, reach = (low + high) / 2, (high - low) / 2

    def slowness(s: float) -> float:
        u = middle + reach * np.sin(s)
        return float(reach * np.cos(s) / np.sqrt(2 * max(energy - potential(u, law), 1e-300) / MASS))

    # The middle rule of Chebyshev's substitution: the integrand is smooth and periodic, so it converges exponentially.
    n = 64
    at = (np.arange(n) + 0.5) * np.pi / n - np.pi / 2
    return 2 * np.pi / n * sum(slowness(float(s)) for s in at)


def rows(short: bool) -> Iterator[Row]:
    """Potential and period at several amplitudes, both readings of the law, every engine."""
    linear = 2 * np.pi * np.sqrt(MASS / (MODULUS * (S_A / L_A + S_B / L_B)))
    for engine in ENGINES:
        for law in ("geometric", "printed"):
            for amplitude in (1e-6, 6e-2) if short else (1e-6, 1e-3, 1e-2, 3e-2, 6e-2):
                yield from _oscillation(engine, law, amplitude, float(linear))


def _oscillation(engine: str, law: str, amplitude: float, linear: float) -> Iterator[Row]:
    rig = load_rig_text(mass_on_cylinder(MASS, LENGTH, f'law="{law}"'))
    speed = amplitude * 2 * np.pi / linear
    case = Scenario(duration=6.3 * linear, output_rate=10_000, velocities={"slide": speed}, engine=engine)
    run = simulate(rig, case.changed(TIGHT | {"integrator.atol": 1e-10 * amplitude}))
    about = f"{law} law, {1e3 * amplitude:g} mm, {engine}"
    expected = period(0.5 * MASS * speed**2, law)
    measured = _period(run.time, run.q[:, 0], run.v[:, 0])
    yield Row(
        f"{about}: period, {100 * (expected / linear - 1):+.3f} % off the linear one",
        f"quadrature, {1e3 * expected:.6f} ms",
        abs(measured / expected - 1),
        high=1e-8,
    )
    if amplitude < 1e-5:
        yield Row(
            f"{about}: period", f"linear oil spring, {1e3 * linear:.6f} ms", abs(measured / linear - 1), high=1e-8
        )
        return
    looked = slice(0, None, max(1, len(run.time) // 40))
    stored = (run.energy_elastic + MASS * G * run.q[:, 0])[looked]
    exact = np.array([potential(float(u), law) for u in run.q[looked, 0]])
    off = float(np.abs(stored - exact).max() / exact.max())
    yield Row(f"{about}: stored energy over its largest", "quadrature of the force", off, high=1e-9)


def _period(t: Array, q: Array, v: Array) -> float:
    """Mean time between upward passages through zero, from the cubic through samples and rates."""
    roots = CubicHermiteSpline(t, q, v).roots(extrapolate=False)
    upward = roots[np.interp(roots, t, v) > 0]
    upward = upward[upward > t[1]]
    return float(np.diff(upward).mean())
