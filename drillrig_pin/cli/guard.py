"""The only way in and out of the command line: every failure is one sentence on stderr and an exit code."""

from __future__ import annotations

import contextlib
import sys
import warnings
from collections.abc import Sequence

from drillrig_pin.cli import streams
from drillrig_pin.cli.signals import ending_softly, interrupted_code
from drillrig_pin.cli.system import about_memory, refusal
from drillrig_pin.errors import AccuracyWarning, DrillrigError

OK = 0
#: Something given cannot be used, the system refused something, or ``check`` found an error.
FAILED = 1
#: Unknown command or option (2 is what every command-line parser returns).
USAGE = 2
#: The simulation stopped before its end; what it has is kept.
STOPPED_EARLY = 3
#: The simulation reached its end, but its numbers must not be used: oil in tension, drift, energy from nowhere.
NOT_VALID = 4
#: A bug of this program (EX_SOFTWARE).
UNEXPECTED = 70
#: Ctrl-C (128 + SIGINT); other signals that ask to end have their own, see ``signals``.
INTERRUPTED = 130


def run_guarded(arguments: Sequence[str] | None = None) -> None:
    """Run the app and leave through ``SystemExit``; no traceback unless ``--debug`` asks for it."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    # The line about trust says it.
    warnings.simplefilter("ignore", AccuracyWarning)
    streams.settle()
    with ending_softly():
        sys.exit(_guarded(given))


def _guarded(given: list[str]) -> int:
    """The exit code of a command line, once all it has to say is said."""
    try:
        code = _carried_out(given)
        streams.finish()
    except KeyboardInterrupt:
        _say("interrupted")
        return interrupted_code()
    except DrillrigError as error:
        if "--debug" in given:
            raise
        return _failed(f"error: {error}")
    except MemoryError as error:
        if "--debug" in given:
            raise
        return _failed(f"error: {about_memory(error)}")
    except Exception as error:
        if "--debug" in given:
            raise
        sentence = refusal(error)
        if sentence:
            return _failed(f"error: {sentence}")
        reason = " ".join(str(error).split())[:300]
        return _failed(
            f"unexpected {type(error).__name__}: {reason}; run with --debug for the traceback", code=UNEXPECTED
        )
    return code


def _carried_out(given: list[str]) -> int:
    from drillrig_pin.cli.app import app

    try:
        app(given, prog_name="drillrig")
    except SystemExit as left:
        # The parser takes Ctrl-C for itself and says nothing.
        if isinstance(getattr(left.__context__, "__cause__", None), KeyboardInterrupt):
            raise KeyboardInterrupt from None
        return left.code if isinstance(left.code, int) else OK if left.code is None else FAILED
    return OK


def _failed(sentence: str, code: int = FAILED) -> int:
    # What was said before stands before the sentence.
    with contextlib.suppress(DrillrigError):
        streams.finish()
    streams.forget()
    _say(sentence)
    return code


def _say(sentence: str) -> None:
    # Names may hold letters that begin a new line.
    print("".join(c if c.isprintable() or c == " " else repr(c)[1:-1] for c in sentence), file=sys.stderr)
