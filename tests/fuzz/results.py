"""Ways to spoil a result file: its bytes, and what NetCDF holds."""

from __future__ import annotations

import contextlib
import io
from random import Random
from typing import Any

import numpy as np

from fuzz.mutators import WORDS, anything, spoil_bytes


def spoil_result(data: bytes, random: Random) -> bytes:
    """Variables and attributes dropped, renamed, given another shape, type or value; bytes flipped, cut out, moved."""
    way = random.random()
    if way < 0.05:
        return anything(random)
    if way < 0.4:
        return spoil_bytes(data, random)
    import h5py

    stream = io.BytesIO(data)
    with h5py.File(stream, "r+") as file:
        for _ in range(random.choice((1, 1, 2, 4))):
            # Some changes no HDF5 file can hold; then the file stays as it is.
            with contextlib.suppress(OSError, ValueError, LookupError, TypeError, RuntimeError):
                _spoil(file, random)
    return stream.getvalue()


def _spoil(file: Any, random: Random) -> None:
    name = random.choice(list(file))
    attribute = random.choice(list(file.attrs))
    act = random.randrange(8)
    if act == 0:
        del file[name]
    elif act == 1:
        file.move(name, random.choice(("x", "time", "label")))
    elif act == 2:
        values = file[name][...]
        values.flat[random.randrange(max(values.size, 1))] = random.choice((np.nan, np.inf, 1e308, -1.0, 0.0))
        file[name][...] = values
    elif act == 3:
        shape = tuple(random.choice((0, 1, 3, 10)) for _ in range(random.choice((0, 1, 2, 3))))
        del file[name]
        file[name] = np.zeros(shape)
    elif act == 4:
        del file[name]
        file[name] = random.choice(("text", b"\xff", 5, np.array([b"a", b"b"]), np.zeros(2, "i4"), np.zeros(2, "c16")))
    elif act == 5:
        del file.attrs[attribute]
    elif act == 6:
        file.attrs[attribute] = random.choice((*WORDS, 5, 1e308, np.zeros(3), "{}", "[]", "null", "[1]", '{"a": 1}'))
    else:
        text = file.attrs[attribute]
        if isinstance(text, str):
            file.attrs[attribute] = spoil_bytes(text.encode(), random).decode(errors="replace").replace("\0", "")
