"""Standard input, output and error as a command finds them: closed, full, without readers, unable to show a letter.

Words that cannot be read by anybody must not stop work, and must not be lost in silence either:

- a stream that was closed is not given to the next file that is opened: words would be written into a result;
- what cannot be shown in the encoding of the terminal is shown in plain letters;
- a reader that leaves (`| head`, a pager) has seen enough: the command goes on to its end without a word;
- output that cannot be written, to a full disk or a closed descriptor, is an error;
- complaints that cannot be written are dropped: there is nobody to complain to.
"""

from __future__ import annotations

import codecs
import errno
import io
import os
import select
import sys
import unicodedata
from typing import Any

from drillrig_pin.errors import DrillrigError

#: What stands for letters of ours that plain letters cannot show.
PLAIN = {
    "µ": "u",
    "μ": "u",
    "°": "deg",
    "⌀": "dia ",
    "×": "x",
    "·": "*",
    "–": "-",
    "—": "-",
    "−": "-",
    "…": "...",
    "→": "->",
    "≤": "<=",
    "≥": ">=",
    "±": "+-",
    "²": "2",
    "³": "3",
    "đ": "d",
    "Đ": "D",
}
#: Columns a terminal may have; with fewer there is nothing to read.
WIDTHS = range(20, 1000)
_HANDLER = "drillrig-plain"


class OutputError(DrillrigError):
    """What a command has to say cannot be written to standard output."""


def settle() -> None:
    """Make the streams of this process what the module says. Streams that a program has put there are left alone."""
    _occupy()
    if not os.environ.get("COLUMNS", "").isdecimal() or int(os.environ["COLUMNS"]) not in WIDTHS:
        # Set by programs that know of no terminal: nothing, a word or 0.
        os.environ.pop("COLUMNS", None)
    codecs.register_error(_HANDLER, _plain)
    for name, number in (("stdout", 1), ("stderr", 2)):
        stream = getattr(sys, name)
        if stream is not None and stream is not getattr(sys, f"__{name}__"):
            continue
        encoding = getattr(stream, "encoding", None) or "utf-8"
        if stream is not None:
            stream.flush()
        raw = io.BufferedWriter(_Descriptor(number, complaints=number == 2))
        made = io.TextIOWrapper(
            raw, encoding=encoding, errors=_HANDLER, line_buffering=number == 2 or os.isatty(number)
        )
        setattr(sys, name, made)
        # Else the interpreter flushes the old one at its end, and says so if that fails.
        setattr(sys, f"__{name}__", made)


def finish() -> None:
    """Write out what is left. OutputError if it cannot be written."""
    if sys.stdout is not None:
        sys.stdout.flush()


def forget() -> None:
    """Let nothing be written at the end of the interpreter any more: that it cannot be has been said."""
    if isinstance(raw := getattr(getattr(sys.stdout, "buffer", None), "raw", None), _Descriptor):
        raw.deaf = True


class _Descriptor(io.RawIOBase):
    """A descriptor to write to, with what happens when that fails."""

    def __init__(self, number: int, *, complaints: bool) -> None:
        self._number, self.deaf, self._complaints = number, False, complaints

    def fileno(self) -> int:
        return self._number

    def isatty(self) -> bool:
        return os.isatty(self._number)

    def writable(self) -> bool:
        return True

    def write(self, content: Any) -> int:
        view = memoryview(content).cast("B")
        if self.deaf:
            return len(view)
        while True:
            try:
                return os.write(self._number, view)
            except BlockingIOError:
                # Somebody who shares the terminal asked for writes that do not wait.
                select.select([], [self._number], [])
            except OSError as error:
                # Whatever is said later is not wanted either.
                self.deaf = True
                if self._complaints or error.errno == errno.EPIPE:
                    return len(view)
                raise OutputError(
                    f"cannot be written ({error.strerror})",
                    where="standard output",
                    todo="Make room, or send it elsewhere.",
                ) from None


def _occupy() -> None:
    """Put something harmless where a standard stream was closed. Written to, standard output says that it was."""
    for number, flags in ((0, os.O_RDONLY), (1, os.O_RDONLY), (2, os.O_WRONLY)):
        try:
            os.fstat(number)
        except OSError:
            # The lowest free number is taken, which is this one.
            os.open(os.devnull, flags)


def _plain(error: UnicodeError) -> tuple[str | bytes, int]:
    """Plain letters for some that an encoding does not have; bytes of names that are none of any as ``\\xff``."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    shown = []
    for letter in error.object[error.start : error.end]:
        if "\udc80" <= letter <= "\udcff":
            shown.append(f"\\x{ord(letter) - 0xDC00:02x}")
            continue
        found = PLAIN.get(letter)
        if found is None:
            bare = unicodedata.normalize("NFKD", letter)
            found = "".join(PLAIN.get(c, c if c.isascii() else "") for c in bare) or "?"
        shown.append(found)
    return "".join(shown), error.end
