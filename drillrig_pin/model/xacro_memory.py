"""What every expansion of a model repeats, kept from one to the next: a study expands the same files a thousand times.

Nothing here changes what xacro computes. Tables of numbers are read again when their file changed.
"""

from __future__ import annotations

import copy
import errno
import stat
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from drillrig_pin.yamlfile import require_plain

_tables: dict[str, tuple[tuple[int, int], Any]] = {}
MAX_TABLES = 16


@contextmanager
def remembering(xacro: Any) -> Iterator[None]:
    """Put the quicker functions in place for one expansion; the caller sees to it that it is the only one."""
    read = xacro.load_yaml

    def load_yaml(name: str) -> Any:
        path = xacro.abs_filename_spec(name)
        return copy.deepcopy(_table(xacro, read, path))

    visible = xacro._global_symbols
    places = [symbols for symbols in (visible, visible["xacro"]) if "load_yaml" in symbols]
    before = [symbols["load_yaml"] for symbols in places]
    for symbols in places:
        symbols["load_yaml"] = load_yaml
    try:
        yield
    finally:
        for symbols, function in zip(places, before, strict=True):
            symbols["load_yaml"] = function


def _table(xacro: Any, read: Callable[[str], Any], path: str) -> Any:
    """The table of a YAML file, read by xacro itself if the file is new or has changed."""
    try:
        state = Path(path).stat()
    except OSError:
        return read(path)
    if not stat.S_ISREG(state.st_mode):
        raise OSError(errno.EINVAL, "it is no regular file", path)
    stamp = (state.st_mtime_ns, state.st_size)
    known = _tables.get(path)
    if known is not None and known[0] == stamp:
        xacro.all_includes.append(path)
        return known[1]
    require_plain(Path(path), "a table of numbers")
    table = read(path)
    if len(_tables) >= MAX_TABLES:
        _tables.clear()
    _tables[path] = (stamp, table)
    return table
