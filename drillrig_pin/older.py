"""Results that an earlier version wrote, taken over into the variables of this one."""

from __future__ import annotations

import numpy as np

from drillrig_pin.kinematics import Array


def count_turns(arrays: dict[str, Array], labels: dict[str, list[str]]) -> None:
    """Replace the cosine and sine of every continuous joint by its angle [rad], in place.

    Version 0.1 kept two columns ``joint.cos`` and ``joint.sin``. The angle starts in (-pi, pi]; of all angles with the
    same cosine and sine each sample takes the one nearest to what the velocities on both sides make of the one before,
    so that turns count also where there are fewer than two samples in each.
    """
    names, q, kept = labels["joint"], arrays["q"], []
    columns = {name: i for i, name in enumerate(names)}
    for i, name in enumerate(names):
        joint, _, part = name.rpartition(".")
        if part == "cos" and f"{joint}.sin" in columns and joint in labels["dof"]:
            angle = np.arctan2(q[:, columns[f"{joint}.sin"]], q[:, i])
            speed = arrays["v"][:, labels["dof"].index(joint)]
            kept.append((joint, _counted(angle, speed, arrays["time"])))
        elif not (part == "sin" and f"{joint}.cos" in columns and joint in labels["dof"]):
            kept.append((name, q[:, i]))
    if len(kept) < len(names):
        labels["joint"] = [name for name, _ in kept]
        arrays["q"] = np.stack([column for _, column in kept], axis=1)


def _counted(angle: Array, speed: Array, time: Array) -> Array:
    expected = 0.5 * (speed[1:] + speed[:-1]) * np.diff(time)
    turned = np.diff(angle)
    turned += 2.0 * np.pi * np.round((expected - turned) / (2.0 * np.pi))
    return angle[0] + np.concatenate([np.zeros(1), np.cumsum(turned)]) if len(angle) else angle
