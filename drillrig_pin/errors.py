"""What can go wrong, said once for every layer: what happened, where, what to do.

Everything the package raises on purpose derives from :class:`DrillrigError`, so a caller needs one ``except``.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum
from functools import partial
from typing import Any


@dataclass(frozen=True, slots=True)
class Source:
    """A place in a file a person can open: ``file`` and 1-based ``line`` (0: the file as a whole)."""

    file: str
    line: int = 0

    def __str__(self) -> str:
        return f"{self.file}:{self.line}" if self.line else self.file


class DrillrigError(Exception):
    """Base of all errors of this package.

    Args:
        what: one sentence about what is wrong, without a full stop.
        where: the file and line, element, joint or time it concerns.
        todo: one sentence about what to do.

    Attributes:
        field: dotted name of the field of a request or a scenario that is at fault, if it is one.
    """

    field: str | None = None

    def __init__(self, what: str, *, where: object = None, todo: str = "") -> None:
        self.what = what
        self.where = where
        self.todo = todo
        super().__init__(what, where, todo)

    def __reduce__(self) -> tuple[Any, ...]:
        """What carries it to another process: exceptions are made anew of their arguments, here of words by name."""
        return partial(type(self), self.what, where=self.where, todo=self.todo), (), self.__dict__

    def __str__(self) -> str:
        place = f"{_cut(str(self.where))}: " if self.where is not None else ""
        advice = f" {_cut(self.todo)}" if self.todo else ""
        return f"{place}{_cut(self.what)}.{advice}"


def _cut(sentence: str) -> str:
    """A sentence that a name of thousands of letters does not drown: the middle is left out."""
    return sentence if len(sentence) <= SENTENCE else f"{sentence[: SENTENCE // 2]}...{sentence[-SENTENCE // 2 :]}"


class AccuracyWarning(UserWarning):
    """A run was computed to its end, and its numbers should not be used."""


class ModelError(DrillrigError):
    """The model file, its arguments or its elements cannot be used."""


class ScenarioError(DrillrigError):
    """The scenario is not valid, or does not fit the model."""


class LockedError(ScenarioError):
    """A pose, position or velocity that would move a locked joint."""


class ResultSizeError(ScenarioError):
    """The result would not fit the memory there is: ``needed`` and ``available`` bytes."""

    needed: float = 0.0
    available: float = 0.0


class FieldError(ScenarioError):
    """A field of a scenario or a study is not valid; ``way`` leads to it: keys and positions from the outside in."""

    def __init__(self, what: str, *, where: object = None, todo: str = "", way: tuple[str | int, ...] = ()) -> None:
        super().__init__(what, where=where, todo=todo)
        self.way = way


class AssemblyError(DrillrigError):
    """No configuration near the nominal one satisfies the constraints."""


class SimulationError(DrillrigError):
    """The equations cannot be solved at the given state."""


class SingularConfigurationError(SimulationError):
    """The constraint Jacobian has lost rank: the multipliers are no longer determined."""


class EngineError(DrillrigError):
    """The compiled core is installed but cannot be used."""


class ResultFileError(DrillrigError):
    """A result file cannot be read or written."""


def shown(value: object) -> str:
    """A given value as it appears in a sentence: quoted, and cut if it is long."""
    text = repr(value)
    return text if len(text) <= SHOWN else f"{text[:SHOWN]}..."


#: Longer values would hide the sentence they belong to.
SHOWN = 80
#: Longer sentences nobody reads.
SENTENCE = 900
#: Longer lists of legal names would hide the sentence they belong to.
LISTED = 40


def legal_names(given: str, legal: Iterable[str], kind: str) -> str:
    """Advice for a misspelt name: the nearest legal one first, then all of them (of a long list the nearest few)."""
    names = sorted(legal)
    near = difflib.get_close_matches(given, names, n=1, cutoff=0.6)
    hint = f"Did you mean {near[0]!r}? " if near else ""
    if len(names) > LISTED:
        nearest = difflib.get_close_matches(given, names, n=6, cutoff=0.0)
        return f"{hint}There are {len(names)} legal {kind}, nearest: {', '.join(nearest)}."
    return f"{hint}Legal {kind}: {', '.join(names) if names else 'none'}."


class Status(Enum):
    """How a run ended: a short word, a message and an advice."""

    COMPLETED = ("completed", "the run reached its end", "")
    INTERRUPTED = ("interrupted", "the run was stopped by the user", "What was computed so far is kept.")
    DIVERGED = (
        "diverged",
        "the motion left the range of a machine's numbers or of the oil's law",
        "Look at the last samples; try a smaller step or tolerance, or softer loads.",
    )
    STEP_TOO_SMALL = (
        "step too small",
        "the integrator could not meet its tolerance with any step",
        "Try an implicit integrator.method (RODAS, Radau), or a looser tolerance.",
    )
    SINGULAR = (
        "singular configuration",
        "the constraints lose rank: the machine is stuck there, or may go on in more than one way",
        "Look at the named rows; another pose or fewer held axes avoids it.",
    )

    DRIFTED = (
        "constraints left",
        "the machine has moved off its constraints",
        "Look at the named row; switch scenario.stabilization.projection on, or take a smaller step or tolerance.",
    )

    TOO_LONG = (
        "too long",
        "the run would take more processor time than it may",
        "Soften or weigh down what is named, take a stiff integrator.method (RODAS, Radau), shorten the run, or raise "
        "scenario.integrator.budget.",
    )

    def __init__(self, word: str, message: str, advice: str) -> None:
        self.word = word
        self.message = message
        self.advice = advice

    def __repr__(self) -> str:
        return f"<Status {self.word}: {self.message}. {self.advice}>".replace(" >", ">")


@dataclass(frozen=True, slots=True)
class Outcome:
    """The status of one run with the time it ended and, if it stopped early, the cause.

    A run may reach its end and yet hold numbers that no machine shows, such as oil in tension: ``valid_until`` is the
    time of the first of them [s], and ``doubt`` says in words what it is. None: there is none.
    """

    status: Status
    time: float
    steps: int
    cause: str = ""
    valid_until: float | None = None
    doubt: str = ""

    @property
    def completed(self) -> bool:
        """True when the run reached its end."""
        return self.status is Status.COMPLETED

    @property
    def invalid(self) -> str:
        """From when on the run is not valid and why, in words; empty if nothing speaks against it."""
        if self.valid_until is None:
            return ""
        return f"not valid from t = {self.valid_until:.4g} s: {self.doubt}"

    def __str__(self) -> str:
        text = f"{self.status.word} at t = {self.time:.6g} s after {self.steps} steps"
        if self.cause:
            text += f": {self.cause}"
        if self.invalid:
            text += f"; {self.invalid}"
        return f"{text}. {self.status.advice}".rstrip() if not self.completed else text
