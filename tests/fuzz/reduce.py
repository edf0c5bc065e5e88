"""The smallest input that still ends in the same way: whatever of its files can go, goes."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterator
from multiprocessing import get_context
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import yaml

from fuzz.campaign import REFUSED, USED, attempt
from fuzz.moment import warm_up

Files = dict[str, bytes]
#: What a process that is still busy after this time came to [s].
HANGS, HUNG = 30.0, "took too long"
#: What numbers and words become, if nothing else is as simple.
SIMPLE = ("0", "1", "0 0 0", "1 0 0", "0.5")


def reduced(files: Files, number: int, table: str, say: Callable[[str], None] = print) -> tuple[Files, str]:
    """Smaller files of the same fault, and the fault."""
    with _Judge(number, table) as judge:
        fault = judge(files)
        if fault in (USED, REFUSED):
            return files, fault
        changed = True
        while changed:
            changed = False
            for name in files:
                for smaller in _smaller(name, files[name]):
                    if judge({**files, name: smaller}) == fault:
                        files, changed = {**files, name: smaller}, True
                        say(f"{name}: {len(smaller)} bytes")
                        break
    return files, fault


class _Judge:
    """What an input comes to, asked of a process that may hang."""

    def __init__(self, number: int, table: str) -> None:
        self.number, self.table = number, table
        self.process: Any = None

    def __enter__(self) -> _Judge:
        return self

    def __exit__(self, *_: object) -> None:
        if self.process is not None:
            self.process.kill()

    def __call__(self, files: Files) -> str:
        """One word for how it ended: kind and innermost place of a fault, so that another fault is another word."""
        if self.process is None:
            context = get_context("spawn")
            self.here, there = context.Pipe()
            self.process = context.Process(target=_serve, args=(there, self.number, self.table), daemon=True)
            self.process.start()
            self.here.recv()
        self.here.send(files)
        try:
            if self.here.poll(HANGS):
                end, where = self.here.recv()
                return end if end in (USED, REFUSED) else f"{end.partition(':')[0]} {where.partition(' <')[0]}"
            end = HUNG
        except EOFError:
            end = "the process died"
        self.process.kill()
        self.process = None
        return end


def _serve(there: Any, number: int, table: str) -> None:
    os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
    warm_up()
    there.send("ready")
    while True:
        files = there.recv()
        with tempfile.TemporaryDirectory() as folder:
            there.send(attempt(number, files, Path(folder), table))


def _smaller(name: str, data: bytes) -> Iterator[bytes]:
    """The file with one thing less, larger things first."""
    if name.endswith(".urdf"):
        yield from _smaller_model(data)
    elif name.endswith(".yaml"):
        yield from _smaller_yaml(data)
    else:
        lines = data.splitlines(keepends=True)
        yield from (b"".join(lines[:i] + lines[i + 1 :]) for i in range(len(lines)))


def _smaller_model(data: bytes) -> Iterator[bytes]:
    count = sum(1 for _ in ElementTree.fromstring(data).iter())
    for i in range(count - 1, 0, -1):
        root = ElementTree.fromstring(data)
        every = list(root.iter())
        parent = next(p for p in every if every[i] in list(p))
        parent.remove(every[i])
        if every[i].tag == "joint" and (child := every[i].find("child")) is not None:
            for link in [link for link in root.findall("link") if link.get("name") == child.get("link")]:
                root.remove(link)
        yield ElementTree.tostring(root)
    for i in range(count):
        for key, value in list(ElementTree.fromstring(data).iter())[i].attrib.items():
            root = ElementTree.fromstring(data)
            del list(root.iter())[i].attrib[key]
            yield ElementTree.tostring(root)
            for simple in SIMPLE:
                if len(simple) < len(value) and len(simple.split()) == len(value.split()):
                    root = ElementTree.fromstring(data)
                    list(root.iter())[i].attrib[key] = simple
                    yield ElementTree.tostring(root)
    lines = data.splitlines(keepends=True)
    yield from (b"".join(lines[:i] + lines[i + 1 :]) for i in range(len(lines)))


def _smaller_yaml(data: bytes) -> Iterator[bytes]:
    for way in _ways(yaml.safe_load(data)):
        fields = yaml.safe_load(data)
        place = fields
        for key in way[:-1]:
            place = place[key]
        del place[way[-1]]
        yield yaml.safe_dump(fields).encode()


def _ways(value: Any, way: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    keys = list(value) if isinstance(value, dict) else range(len(value)) if isinstance(value, list) else ()
    for key in keys:
        yield (*way, key)
        yield from _ways(value[key], (*way, key))
