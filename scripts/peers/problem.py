"""What every engine has to solve, as numbers, and what it has to offer."""

from __future__ import annotations

import time
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from typing import Protocol, Self

import numpy as np

from drillrig_pin import Rig, Scenario, load_rig
from drillrig_pin.coordinates import JointCoordinate, Line, Slide, Turn
from drillrig_pin.dynamics import Dynamics
from drillrig_pin.elements.contact import BilateralContact
from drillrig_pin.elements.cylinder import LockedOil
from drillrig_pin.elements.loads import HarmonicLaw
from drillrig_pin.elements.springs import SpringDamper
from drillrig_pin.kinematics import Array
from drillrig_pin.simulation import prepare

DURATION = 2.0
#: Samples per second at which positions are compared, the same for every engine.
RATE = 200


@dataclass(frozen=True)
class Setting:
    """One way to run an engine.

    Attributes:
        method: name of the integrator, as the engine calls it.
        step: fixed step [s]; 0: the engine chooses.
        rtol: relative tolerance; 0: none.
    """

    method: str
    step: float = 0.0
    rtol: float = 0.0

    def __str__(self) -> str:
        parts = [f"step {1e3 * self.step:.3g} ms"] if self.step else []
        parts += [f"tolerance {self.rtol:.0e}"] if self.rtol else []
        return ", ".join(parts)


class Stopwatch:
    """Measures what happens inside its ``with``.

    Attributes:
        wall: seconds that passed.
        processor: seconds of them in which this process was at work. All engines run on one thread and wait for
            nothing: on an idle machine the two are equal, on a busy one only this is the engine's own.
    """

    def __enter__(self) -> Self:
        self._start = time.perf_counter(), time.process_time()
        return self

    def __exit__(self, *error: object) -> None:
        self.wall, self.processor = time.perf_counter() - self._start[0], time.process_time() - self._start[1]


class Engine(Protocol):
    """What the comparison asks of an engine bound to a problem."""

    name: str
    #: What it is installed as.
    package: str
    #: Order of the integrators with a fixed step.
    orders: dict[str, int]

    def sweep(self) -> list[list[Setting]]:
        """Settings worth trying, a list per method, each from coarse to fine."""

    def run(self, setting: Setting) -> tuple[Stopwatch, Array]:
        """Time of the loop over time alone, and positions at all samples behind the start, (samples, nq)."""

    def acceleration(self, t: float, q: Array, v: Array) -> Array:
        """Joint accelerations at a state with all loads and the hold."""


class Problem:
    """A case taken apart into what other engines know.

    Attributes:
        rig, scenario: the case.
        dynamics: the same, bound.
        urdf: the expanded model without pictures and without the elements of this package.
        q, v: state at the start.
        cylinders, springs, contacts, forces, torques: coordinate and law of every force element.
        holds: held coordinate and its value.
        samples: times at which positions are compared, the start left out [s].
    """

    def __init__(self, rig: Rig, scenario: Scenario) -> None:
        self.dynamics: Dynamics = prepare(rig, scenario)
        self.rig, self.scenario = rig, scenario
        self.urdf = plain_urdf(rig)
        assembly = self.dynamics.equilibrium.assembly
        self.q, self.v = assembly.q, assembly.v
        self.cylinders: list[tuple[Line, LockedOil]] = []
        self.springs: list[tuple[JointCoordinate, SpringDamper]] = []
        self.contacts: list[tuple[Slide, BilateralContact]] = []
        self.forces: list[tuple[Slide, HarmonicLaw]] = []
        self.torques: list[tuple[Turn, HarmonicLaw]] = []
        kinds = {
            (Line, LockedOil): self.cylinders,
            (JointCoordinate, SpringDamper): self.springs,
            (Slide, BilateralContact): self.contacts,
            (Slide, HarmonicLaw): self.forces,
            (Turn, HarmonicLaw): self.torques,
        }
        for element, law in zip(self.dynamics.forces, self.dynamics.laws, strict=True):
            coordinate = element.coordinate(rig)
            kinds[type(coordinate), type(law)].append((coordinate, law))
        self.holds = [(row.coordinate, float(x)) for row, x in zip(rig.rows, self.dynamics.targets, strict=True)]
        count = round(scenario.duration * RATE)
        self.samples = np.arange(1, count + 1) / RATE

    def moving_state(self) -> tuple[Array, Array]:
        """A state on the constraints with every joint in motion."""
        y, n = self.dynamics.initial(), self.rig.model.nq
        y[n:-2] = 0.05 * np.random.default_rng(1).standard_normal(self.rig.model.nv)
        y = self.dynamics.project(y)
        return y[:n], y[n:-2]

    def free_acceleration(self, t: float, q: Array, v: Array) -> Array:
        """This package's joint accelerations with all loads but without the hold."""
        equations = self.dynamics.assemble(t, q, v)
        return np.asarray(np.linalg.solve(equations.M, equations.p1))

    def acceleration(self, t: float, q: Array, v: Array) -> Array:
        """This package's joint accelerations."""
        return self.dynamics.solve(self.dynamics.assemble(t, q, v))[0]

    def states(self) -> list[tuple[float, Array, Array]]:
        """Where accelerations are compared: at rest while the loads grow, and in motion under all of them."""
        return [(0.2, self.q, self.v), (0.5, *self.moving_state())]


def drilling(duration: float = DURATION) -> Problem:
    """The default case of the shipped rig."""
    return Problem(load_rig("mkz49"), Scenario(duration=duration, output_rate=RATE))


def apart(theirs: Array, ours: Array) -> float:
    """Largest difference over the largest of ours."""
    return float(np.abs(theirs - ours).max() / np.abs(ours).max())


def plain_urdf(rig: Rig) -> str:
    """The expanded model with nothing but links and joints."""
    root = ET.fromstring(rig.file.text)
    for child in list(root):
        if child.tag not in ("link", "joint"):
            root.remove(child)
    for link in root.findall("link"):
        for child in [*link.findall("visual"), *link.findall("collision")]:
            link.remove(child)
    return ET.tostring(root, encoding="unicode")


def divided(*counts: int) -> list[float]:
    """Steps that divide the time between two samples [s]."""
    return [1.0 / (RATE * k) for k in counts]
