"""All sections, in the order of the page."""

from __future__ import annotations

from validation import constraints, drilling, library, measured, mechanisms, mujoco_trees, oil, orders, speed
from validation.record import Section

SECTIONS = (
    Section("Mass matrix and bias against MuJoCo", mujoco_trees.MATRICES, mujoco_trees.matrix_rows),
    Section("Free motion against MuJoCo", mujoco_trees.MOTION, mujoco_trees.motion_rows),
    Section("The loaded rig in other engines", drilling.TEXT, drilling.rows),
    Section("Speed at equal error", speed.TEXT, speed.rows),
    Section("IFToMM benchmark problems A01 and A02", library.TEXT, library.rows),
    Section("Mechanisms in closed form", mechanisms.TEXT, mechanisms.rows),
    Section("The locked cylinder", oil.TEXT, oil.rows),
    Section("Order of the integrators", orders.TEXT, orders.rows),
    Section("Drift of the constraints", constraints.DRIFT, constraints.drift_rows),
    Section("Near a singular configuration", constraints.SINGULAR, constraints.singular_rows),
    Section("Hostile files, coverage, planted faults", measured.TEXT, measured.rows),
)
