"""One finding about a model file."""

from __future__ import annotations

from dataclasses import dataclass

from drillrig_pin.errors import Source


@dataclass(frozen=True, slots=True)
class Problem:
    """One finding. An error keeps the model from being used; a warning does not."""

    severity: str
    message: str
    source: Source
    advice: str = ""

    def __str__(self) -> str:
        return f"{self.source}: {self.severity}: {self.message}." + (f" {self.advice}" if self.advice else "")
