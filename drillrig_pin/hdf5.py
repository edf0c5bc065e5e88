"""HDF5 files of anybody, read as data: what is asked for by name, of plain kinds, within bounds that are known before.

A small file can declare arrays of any size, keep a gigabyte of zeros in a kilobyte, point into other files, and ask for
filters that are programs. All of that is refused before anything is read.
"""

from __future__ import annotations

import math
import os
import zlib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from drillrig_pin.memory import available_memory

#: What a file may declare [bytes]: as much as this, or as many times its own size.
LEAST, TIMES = 100_000_000, 100
#: Names along one dimension, characters of all of them, attributes of one group.
MAX_NAMES, MAX_LETTERS, MAX_ATTRIBUTES = 10_000, 10_000_000, 200
#: Filters of the HDF5 library itself, by number; every other one is a program that it would load.
DEFLATE = 1
FILTERS = {DEFLATE: "deflate", 2: "shuffle", 3: "fletcher32"}


class HostileError(ValueError):
    """The file holds what is not read; the text says what."""


def member(group: Any, name: str) -> Any:
    """What lies under a name in this very file: links to elsewhere are not followed."""
    import h5py

    link = group.get(name, getlink=True)
    if link is None:
        raise HostileError(f"{name!r} is missing")
    if not isinstance(link, h5py.HardLink):
        raise HostileError(f"{name!r} is a link to somewhere else")
    return group[name]


def arrays(path: Path, group: Any, names: Iterable[str]) -> dict[str, Any]:
    """Arrays of numbers by name, as floats.

    Raises:
        HostileError: one is missing or of another kind; all together are larger than the file or the memory allow.
    """
    found = {name: member(group, name) for name in names}
    for name, data in found.items():
        _require_numbers(name, data)
    declared, size = sum(8.0 * math.prod(data.shape) for data in found.values()), os.path.getsize(path)
    if declared > max(LEAST, TIMES * size):
        raise HostileError(f"its {size / 1e6:.3g} MB declare {declared / 1e6:.3g} MB of numbers")
    if declared > available_memory():
        raise HostileError(f"it declares {declared / 1e6:.3g} MB of numbers, more than the memory that is free")
    for name, data in found.items():
        _require_plain(name, data, max(LEAST, TIMES * size))
    return {name: np.asarray(data[...], dtype=float) for name, data in found.items()}


def words(group: Any, name: str) -> list[Any]:
    """Names along a dimension, as they are kept: text or bytes."""
    import h5py

    data = member(group, name)
    if not isinstance(data, h5py.Dataset) or len(data.shape) != 1 or h5py.check_string_dtype(data.dtype) is None:
        raise HostileError(f"{name!r} is no list of names")
    if data.shape[0] > MAX_NAMES or data.shape[0] * data.dtype.itemsize > MAX_LETTERS:
        raise HostileError(f"{name!r} declares {data.shape[0]} names")
    _require_plain(name, data, MAX_LETTERS)
    found, letters = [], 0
    for i in range(data.shape[0]):
        # One by one: many names may be one and the same long text of the file.
        found.append(data[i])
        letters += len(found[-1])
        if letters > MAX_LETTERS:
            raise HostileError(f"{name!r} holds more than {MAX_LETTERS} characters")
    return found


def attributes(group: Any) -> dict[str, Any]:
    """Attributes that are one number or one text; others are passed over."""
    import h5py

    count = h5py.h5a.get_num_attrs(group.id)
    if count > MAX_ATTRIBUTES:
        raise HostileError(f"it has {count} attributes")
    found = {}
    for i in range(count):
        attribute = h5py.h5a.open(group.id, index=i)
        kind = attribute.dtype
        if math.prod(attribute.shape) == 1 and (kind.kind in "biuf" or h5py.check_string_dtype(kind) is not None):
            name = attribute.name.decode()
            value = group.attrs[name]
            found[name] = value.reshape(())[()] if isinstance(value, np.ndarray) else value
    return found


def _require_numbers(name: str, data: Any) -> None:
    import h5py

    if not isinstance(data, h5py.Dataset) or data.shape is None or data.dtype.kind not in "biuf":
        raise HostileError(f"{name!r} is no array of numbers")


def _require_plain(name: str, data: Any, most: float) -> None:
    """HostileError for an array that lies in other files, needs a filter that is a program, or unfolds to more."""
    if data.is_virtual or data.external:
        raise HostileError(f"{name!r} lies in another file")
    settings = data.id.get_create_plist()
    filters = [settings.get_filter(i)[0] for i in range(settings.get_nfilters())]
    strange = [number for number in filters if number not in FILTERS]
    if strange or filters.count(DEFLATE) > 1:
        told = f"with the filter {strange[0]}" if strange else "twice"
        raise HostileError(f"{name!r} is packed {told}; known: {', '.join(FILTERS.values())}")
    if data.chunks is None:
        return
    chunk = math.prod(data.chunks) * data.dtype.itemsize
    if chunk > most:
        raise HostileError(f"{name!r} is kept in pieces of {chunk / 1e6:.3g} MB")
    if DEFLATE in filters:
        _require_unpacked(name, data, chunk)


def _require_unpacked(name: str, data: Any, chunk: int) -> None:
    """HostileError for a piece that unfolds to more than the piece it stands for."""
    for i in range(data.id.get_num_chunks()):
        skipped, packed = data.id.read_direct_chunk(data.id.get_chunk_info(i).chunk_offset)
        if not skipped and len(zlib.decompressobj().decompress(packed, chunk + 1)) > chunk:
            raise HostileError(f"{name!r} unfolds to more than it declares")
