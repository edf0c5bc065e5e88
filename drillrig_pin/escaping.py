"""Text of other people where it could be taken for more than text: on terminals, in pages, in tables of numbers.

Names, titles and reasons come out of model files, results and requests. They are kept as they are and escaped where
they are written, each place in its own way.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from typing import Any

#: Characters that a terminal obeys, or that turn round or hide what is read: controls, marks of direction, blanks.
_OBEYED = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\xad\u061c\u180e\u200b-\u200f\u2028-\u202e\u2060-\u206f\ufeff\ufff9-\ufffb"
    "\U000e0000-\U000e0fff]"
)
#: A cell, or what looks like one to a program that splits at another separator, that a spreadsheet takes for a formula.
_FORMULA = re.compile(r"(^|[;,|\t\r\n])(?=[\s\"']*[=+\-@\uff1d\uff0b\uff0d\uff20])|^(?=[\t\r])")
_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")


def visible(text: str) -> str:
    r"""Text as a terminal may have it: what it would obey is written out, as ``\x1b``. Lines and tabs stay."""
    return _OBEYED.sub(lambda found: _written(ord(found[0])), text)


def json_visible(text: str) -> str:
    """A JSON document that means the same and holds nothing a terminal obeys."""
    return _OBEYED.sub(lambda found: json.dumps(found[0])[1:-1].replace("\x7f", "\\u007f"), text)


def script_json(document: Mapping[str, Any]) -> str:
    """JSON that may stand inside a script element: no tag and no comment can begin in it."""
    text = json.dumps(document, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029")


def cell(text: str) -> str:
    """A text as a cell of CSV: an apostrophe stands before what a spreadsheet would run; a number stays one."""
    return text if _NUMBER.fullmatch(text) else _FORMULA.sub(lambda found: f"{found[1] or ''}'", text)


def _written(number: int) -> str:
    return f"\\x{number:02x}" if number < 0x100 else f"\\u{number:04x}" if number < 0x10000 else f"\\U{number:08x}"
