"""What a stored run says about the machine itself: kinds of joints, limits of its cylinders, its contacts and loads."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from pydantic import ValidationError

from drillrig_pin.analysis.bodies import placed, ties
from drillrig_pin.analysis.feed import feed_points
from drillrig_pin.analysis.spectra import HAMMER_BAND, table_frequency
from drillrig_pin.elements.contact import Contact
from drillrig_pin.elements.cylinder import Cylinder
from drillrig_pin.elements.loads import Harmonics, Load, Table
from drillrig_pin.errors import ModelError
from drillrig_pin.model.modelfile import ModelFile, read_model_text
from drillrig_pin.model.numbers import vector
from drillrig_pin.model.tree_text import child
from drillrig_pin.trajectory import Trajectory

Axis = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Design:
    """Facts of the model that a result needs in order to be judged.

    Attributes:
        kinds: URDF type of every joint, by name.
        relief: gauge pressure at which a cylinder's relief valve opens [Pa], by cylinder.
        vapour: absolute pressure below which a cylinder's oil tears [Pa], by cylinder; those that leave it to the
            assumed default are missing.
        contacts: unit world axis into the rock, by contact element.
        ramp: longest smooth start among the loads that acted [s]; 0 without one.
        shortest_ramp: shortest of them [s]; 0 if one acts in full at once.
        slowest: lowest frequency among the sines of these loads [Hz]; 0 without one.
        percussion: frequency of the blows [Hz]: the lowest of these sines in the hammer's band; 0 without one.
        sines: frequencies of the sines of every load that acted [Hz], by load.
        tables: frequency up to which a load table that acted has something to say [Hz], by load.
        torques: names of the loads that are torques.
        feed: points at the two ends of the feed line, where a drilling force acts and where the tip touches the rock;
            None for a machine without one.
        no_feed: why there is none, in words; empty where there is one, or no contact that would have it.
        touching: the contacts themselves.
        ties: constraints that hold the body of a contact's point, in words, by contact.
        placed: what every constraint is: ``tip``, ``hold`` or ``loop``, by its name.
        limits: least and greatest position of every joint that states them [rad or m], by joint.
    """

    kinds: dict[str, str]
    relief: dict[str, float]
    vapour: dict[str, float]
    contacts: dict[str, Axis]
    ramp: float
    shortest_ramp: float
    slowest: float
    percussion: float
    sines: dict[str, tuple[float, ...]]
    tables: dict[str, float]
    torques: frozenset[str]
    feed: tuple[str, str] | None
    no_feed: str
    touching: tuple[Contact, ...]
    ties: dict[str, tuple[str, ...]]
    placed: dict[str, str]
    limits: dict[str, tuple[float, float]] = field(default_factory=dict)


def design_of(trajectory: Trajectory, file: ModelFile | None = None) -> Design:
    """Read the model text that the run carries, or take it as it was read already.

    Elements that cannot be read any more (a plugin that is not installed here) are left out.
    """
    file = file or read_model_text(trajectory.model)
    kinds = {joint.attributes.get("name", ""): joint.attributes.get("type", "") for joint in file.root.named("joint")}
    cylinders, contacts, loads = _built_in(file)
    acting = [load for load in loads if load.name in trajectory.labels["load"]]
    ramps = [load.law.ramp for load in acting]
    tables = {load.name: np.array(load.law.samples) for load in acting if isinstance(load.law, Table)}
    sines = {
        load.name: tuple(term.frequency for term in load.law.terms if term.frequency > 0 and term.amplitude != 0)
        for load in acting
        if isinstance(load.law, Harmonics)
    }
    frequencies = [frequency for found in sines.values() for frequency in found]
    return Design(
        kinds,
        {cylinder.name: cylinder.relief_pressure for cylinder in cylinders},
        {c.name: c.vapour_pressure for c in cylinders if "vapour_pressure" in c.model_fields_set},
        {contact.name: contact.axis for contact in contacts},
        max(ramps, default=0.0),
        min(ramps, default=0.0),
        min(frequencies, default=0.0),
        min((f for f in frequencies if HAMMER_BAND[0] <= f < HAMMER_BAND[1]), default=0.0),
        sines,
        {name: table_frequency(samples[:, 0], samples[:, 1]) for name, samples in tables.items()},
        frozenset(load.name for load in loads if load.kind == "torque"),
        *feed_points(trajectory, file, contacts, loads),
        tuple(contacts),
        {contact.name: ties(file, contact.point) for contact in contacts},
        placed(file, [contact.point for contact in contacts]),
        dict(_limits(file)),
    )


def _limits(file: ModelFile) -> Iterator[tuple[str, tuple[float, float]]]:
    for joint in file.root.named("joint"):
        limit = child(joint, "limit")
        if limit is None or joint.attributes.get("type") not in ("revolute", "prismatic"):
            continue
        low, high = (vector(limit, key, (0.0,))[0] for key in ("lower", "upper"))
        yield joint.attributes.get("name", ""), (low, high)


def relief_pressures(file: ModelFile) -> dict[str, float]:
    """Gauge pressure at which the relief valve of every cylinder opens [Pa], by cylinder."""
    return {cylinder.name: cylinder.relief_pressure for cylinder in _built_in(file)[0]}


def first_contact(file: ModelFile) -> Axis | None:
    """Unit world axis into the rock of the first contact; None for a machine without one."""
    return next((contact.axis for contact in _built_in(file)[1]), None)


def _built_in(file: ModelFile) -> tuple[list[Cylinder], list[Contact], list[Load]]:
    found = list(_parsed(file))
    return (
        [element for element in found if isinstance(element, Cylinder)],
        [element for element in found if isinstance(element, Contact)],
        [element for element in found if isinstance(element, Load)],
    )


def _parsed(file: ModelFile) -> Iterator[Cylinder | Contact | Load]:
    classes: dict[str, type[Cylinder | Contact | Load]] = {cls.tag: cls for cls in (Cylinder, Contact, Load)}
    for node in file.elements():
        if node.tag in classes:
            try:
                yield classes[node.tag].from_node(node)
            except (ModelError, ValidationError):
                continue
