"""The command ``drillrig``. No physics: it reads words, calls the package and prints."""

from __future__ import annotations

from collections.abc import Sequence


def main(arguments: Sequence[str] | None = None) -> None:
    """Entry point: run the command line (that of the process if none is given) and exit with its code."""
    from drillrig_pin.cli.guard import run_guarded

    run_guarded(arguments)
