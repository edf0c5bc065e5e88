"""A console on which text is text: whatever of it a terminal would obey is written out."""

from __future__ import annotations

from collections.abc import Iterable

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment

from drillrig_pin.escaping import visible


class PlainConsole(Console):
    """Every piece of text passes here on its way out; colours and bars, which the program itself makes, are no text."""

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """See :meth:`rich.console.Console.render`."""
        for segment in super().render(renderable, options):
            yield segment if segment.control else Segment(visible(segment.text), segment.style)
