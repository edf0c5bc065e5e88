"""The only way in and out of the command line: every failure is one sentence on stderr and an exit code."""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Sequence

from drillrig_pin.errors import AccuracyWarning, DrillrigError

OK = 0
#: Something given cannot be used, or ``check`` found an error.
FAILED = 1
#: Unknown command or option (2 is what every command-line parser returns).
USAGE = 2
#: The simulation stopped before its end; what it has is kept.
STOPPED_EARLY = 3
#: The simulation reached its end, but its numbers must not be used: oil in tension, drift, energy from nowhere.
NOT_VALID = 4
#: A bug of this program (EX_SOFTWARE).
UNEXPECTED = 70
#: Ctrl-C (128 + SIGINT).
INTERRUPTED = 130


def run_guarded(arguments: Sequence[str] | None = None) -> None:
    """Run the app and leave through ``SystemExit``; no traceback unless ``--debug`` asks for it."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    # The line about trust says it.
    warnings.simplefilter("ignore", AccuracyWarning)
    try:
        from drillrig_pin.cli.app import app

        app(given, prog_name="drillrig")
        sys.stdout.flush()
    except BrokenPipeError:
        # The reader (`head`, a pager) has seen enough; keep the interpreter from flushing into it once more.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(OK)
    except KeyboardInterrupt:
        _say("interrupted")
        sys.exit(INTERRUPTED)
    except DrillrigError as error:
        if "--debug" in given:
            raise
        _say(f"error: {error}")
        sys.exit(FAILED)
    except Exception as error:
        if "--debug" in given:
            raise
        reason = " ".join(str(error).split())[:300]
        _say(f"unexpected {type(error).__name__}: {reason}; run with --debug for the traceback")
        sys.exit(UNEXPECTED)


def _say(sentence: str) -> None:
    print(sentence, file=sys.stderr)
