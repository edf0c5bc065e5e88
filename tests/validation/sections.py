"""All sections, in the order of the page."""

from __future__ import annotations

from validation import constraints, library, mechanisms, oil, orders
from validation.record import Section

SECTIONS = (
    Section("IFToMM benchmark problems A01 and A02", library.TEXT, library.rows),
    Section("Mechanisms in closed form", mechanisms.TEXT, mechanisms.rows),
    Section("The locked cylinder", oil.TEXT, oil.rows),
    Section("Order of the integrators", orders.TEXT, orders.rows),
    Section("Drift of the constraints", constraints.DRIFT, constraints.drift_rows),
    Section("Near a singular configuration", constraints.SINGULAR, constraints.singular_rows),
)
