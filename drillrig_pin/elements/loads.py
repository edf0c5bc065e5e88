"""Loads given over time: the drilling force F_G(t) and torque M_G(t) of [Tram2023] eqs. (11)-(22)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any, ClassVar, Literal, Self, TypeVar

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, ValidationError, field_validator

from drillrig_pin.coordinates import Coordinate, Slide, Turn
from drillrig_pin.elements.base import Element, Law, Remark, Resolver
from drillrig_pin.elements.fields import Direction, Name, quantity, reference, sized
from drillrig_pin.elements.table_file import TO_CHOOSE, read_samples, read_table, table_remarks
from drillrig_pin.elements.tables import Reading, TableLaw
from drillrig_pin.errors import ModelError, legal_names
from drillrig_pin.kinematics import Array, world_point
from drillrig_pin.model.nodes import Node
from drillrig_pin.series import LARGEST

T = TypeVar("T", bound=BaseModel)

__all__ = ["LAWS", "Constant", "HarmonicLaw", "Harmonics", "Load", "Table", "TableLaw", "Term", "read_samples"]


@dataclass(frozen=True, slots=True)
class HarmonicLaw(Law):
    """F(t) = r(t) (mean + sum_i A_i sin(2 pi f_i t + phi_i)), r = 6 s^5 - 15 s^4 + 10 s^3, s = min(t / ramp, 1)."""

    stackable: ClassVar[bool] = True

    mean: Any
    ramp: Any
    amplitude: Any
    frequency: Any
    phase: Any

    def force(self, x: Array, xdot: Array, t: float) -> Array:
        """F(t) [N or N m]."""
        waves = self.amplitude * np.sin((2 * math.pi * t) * self.frequency + self.phase)
        series = self.mean + np.add.reduce(waves, axis=-1)
        if t >= np.max(self.ramp):
            return series  # type: ignore[no-any-return]
        # Without a ramp the series acts in full from t = 0 on.
        s = np.where(self.ramp > t, t / np.maximum(self.ramp, 1e-300), 1.0)
        return (s * s * s * (10.0 + s * (6.0 * s - 15.0))) * series  # type: ignore[no-any-return]

    def breakpoints(self) -> Array:
        """The end of the ramp."""
        return np.atleast_1d(np.asarray(self.ramp, dtype=float))

    def jumps(self) -> Array:
        """None: the ramp ends without one."""
        return np.zeros(0)

    def frequencies(self) -> Array:
        """Those of the terms that have an amplitude [Hz]."""
        frequency = np.asarray(self.frequency, dtype=float)
        return np.asarray(frequency[(np.asarray(self.amplitude) != 0) & (frequency > 0)])

    @classmethod
    def stack(cls, laws: Sequence[Self]) -> Self:
        """Pad the terms to the longest series: a term of no amplitude adds nothing."""
        terms = max(len(law.amplitude) for law in laws)

        def padded(name: str) -> Array:
            return np.array([[*getattr(law, name), *[0.0] * (terms - len(law.amplitude))] for law in laws])

        return cls(
            np.array([law.mean for law in laws]),
            np.array([law.ramp for law in laws]),
            padded("amplitude"),
            padded("frequency"),
            padded("phase"),
        )


def _auto_or_number(value: Any) -> Any:
    return value if value == "auto" else float(value)


class _LoadLaw(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    _sized = field_validator("*")(sized)


class Constant(_LoadLaw):
    """A value that is reached after a smooth ramp."""

    tag: ClassVar[str] = "constant"

    value: float = quantity("N or N*m", "value")
    ramp: float = quantity("s", "time of the smooth start from zero", default=0.0, ge=0)

    def law(self) -> Law:
        """A series without terms."""
        return HarmonicLaw(self.value, self.ramp, np.zeros(0), np.zeros(0), np.zeros(0))


class Term(_LoadLaw):
    """One sine of the series."""

    tag: ClassVar[str] = "term"

    amplitude: float = quantity("N or N*m", "amplitude A")
    frequency: float = quantity("Hz", "frequency f", ge=0)
    phase: float = quantity("rad", "phase phi", default=0.0)


class Harmonics(_LoadLaw):
    """Mean plus sines, r(t) (mean + sum A sin(2 pi f t + phi)), after a smooth ramp; holds `<term>` children."""

    tag: ClassVar[str] = "harmonics"

    mean: float = quantity("N or N*m", "mean value", default=0.0)
    ramp: float = quantity("s", "time of the smooth start from zero", default=0.0, ge=0)
    terms: tuple[Term, ...] = ()

    def law(self) -> Law:
        """The series."""
        terms = self.terms
        return HarmonicLaw(
            self.mean,
            self.ramp,
            np.array([term.amplitude for term in terms]),
            np.array([term.frequency for term in terms]),
            np.array([term.phase for term in terms]),
        )


class Table(_LoadLaw):
    """Samples over time, `time,value` a line, in a CSV file beside the model or as text of the element.

    A header may name units, as in `time [ms],force [kN]`; without units times are seconds, values N or N*m. Two rows at
    one time are a jump. Between rows: `linear` straight lines, `hold` the value of the last row, `spline` a curve that
    stays between neighbouring rows, `cubic` one that may leave them; `auto` takes `cubic` for smooth, dense samples and
    `linear` for all others, and the run and `drillrig check` say which and why. A time in the file is multiplied by
    `time_scale`, then `time_offset` is added.
    """

    tag: ClassVar[str] = "table"

    file: str = reference("CSV file beside the model; its text is kept in the expanded model", default="")
    reading: Reading = reference("how to read between the rows", default="auto")
    scale: float = quantity("-", "factor on all values", default=1.0, ge=-LARGEST, le=LARGEST)
    time_scale: float = quantity("-", "factor on all times", default=1.0, gt=0, le=LARGEST)
    time_offset: Annotated[Literal["auto"] | float, BeforeValidator(_auto_or_number)] = quantity(
        "s", "added to all times; `auto`: the table starts at t = 0", default=0.0
    )
    ramp: float = quantity("s", "time of the smooth start from zero", default=0.0, ge=0)
    header_units: tuple[str, str] = ("", "")
    samples: tuple[tuple[float, float], ...] = ()

    def law(self) -> TableLaw:
        """The curve through the samples."""
        table = np.array(self.samples)
        return TableLaw(table[:, 0], self.scale * table[:, 1], self.reading, self.ramp)


LAWS: dict[str, type[Constant | Harmonics | Table]] = {cls.tag: cls for cls in (Constant, Harmonics, Table)}


class Load(Element):
    """Force at a point, or torque on its link, along an axis fixed in the link or in the world.

    Its child is exactly one of `<constant>`, `<harmonics>` and `<table>`.
    """

    tag: ClassVar[str] = "load"
    load: ClassVar[bool] = True

    kind: Literal["force", "torque"] = reference("force at the point, or torque on its link")
    point: Name = reference("where it acts")
    axis: Direction = quantity("-", "its direction")
    frame: Literal["body", "world"] = reference("whose axes the direction is given in", default="body")
    law: Constant | Harmonics | Table

    @classmethod
    def from_node(cls, node: Node) -> Self:
        """Attributes from the element, the law from its child."""
        children = [child for child in node.children if child.tag in LAWS]
        wrong = next((child for child in node.children if child.tag not in LAWS), None)
        if wrong is not None:
            raise ModelError(
                f"<{wrong.tag}> does not belong in a load",
                where=wrong.source,
                todo=legal_names(wrong.tag, LAWS, "laws"),
            )
        if len(children) != 1:
            raise ModelError(
                f"a load needs exactly one of <{'>, <'.join(LAWS)}>, this one has {len(children)}", where=node.source
            )
        kind = node.attributes.get("kind", "")
        return cls.model_validate({**node.attributes, "law": _law_from(children[0], kind)})

    @cached_property
    def bound(self) -> Law:
        """The law, which needs no initial state."""
        return self.law.law()

    def coordinate(self, resolver: Resolver) -> Coordinate:
        """Along the axis at the point, or about it."""
        point = resolver.point(self.point)
        direction = resolver.direction(self.point, self.axis, self.frame)
        if self.kind == "torque":
            return Turn(point.joint, direction)
        return Slide(point, direction, world_point())

    def bind(self, x0: float, held: float) -> Law:
        """Nothing depends on the initial state."""
        return self.bound

    def remarks(self) -> list[Remark]:
        """How its table was read, and what of that is doubtful."""
        if not isinstance(self.law, Table) or not isinstance(self.bound, TableLaw):
            return []
        return table_remarks(self.name, self.bound, self.law.header_units, self.kind, self.law.scale)

    def end_of_table(self) -> float:
        """Time up to which the load is known [s]."""
        return self.law.samples[-1][0] if isinstance(self.law, Table) else math.inf

    def start_of_table(self) -> float:
        """Time from which the load is known [s]."""
        return self.law.samples[0][0] if isinstance(self.law, Table) else -math.inf


def _law_from(node: Node, kind: str) -> Constant | Harmonics | Table:
    values: dict[str, Any] = dict(node.attributes)
    if node.tag == "harmonics":
        values["terms"] = tuple(_term(child) for child in node.children)
    law = _validated(LAWS[node.tag], values, node)
    if isinstance(law, Table):
        where = node.attributes.get("file") or node.source
        # Another kind is refused with the load itself.
        measures: Literal["force", "torque"] = "torque" if kind == "torque" else "force"
        samples, units = read_table(node.text, where, measures, law.reading, law.time_scale, law.time_offset)
        law = law.model_copy(update={"samples": samples, "header_units": units})
        if not np.isfinite(law.law().knots()).all():
            raise ModelError(f"no {law.reading} curve can be laid through the load table", where=where, todo=TO_CHOOSE)
    return law


def _term(node: Node) -> Term:
    if node.tag != "term":
        raise ModelError(f"<{node.tag}> does not belong in <harmonics>", where=node.source, todo="Legal: term.")
    return _validated(Term, dict(node.attributes), node)


def _validated(cls: type[T], values: dict[str, Any], node: Node) -> T:
    from drillrig_pin.elements.problems import model_error

    try:
        return cls.model_validate(values)
    except ValidationError as error:
        raise model_error(error, cls, node) from None
