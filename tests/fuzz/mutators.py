"""Ways to spoil a valid file: bytes, and the structure of XML, YAML, JSON lines and tables."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable
from random import Random
from typing import Any
from xml.etree import ElementTree

import yaml

ElementTree.register_namespace("xacro", "http://www.ros.org/wiki/xacro")

#: What stands where a number or a name should.
WORDS = (
    "", " ", "nan", "inf", "-inf", "-1", "0", "-0", "1e308", "-1e308", "1e-320", "1e999", "9" * 400, "1" * 5000,
    "0x10", "1,5", "1 2", "1 2 3", "0 0 0", "1e200 1e200 1e200", "nan nan nan", "1 2 3 4", "true", "null", "initial",
    "none", "world", "x y z", "x x", "a" * 5000, "\u00e9\u4e2d\U0001f600", "\u0661\u0662", "\u200b", "é.ü",
    "../../etc/passwd", "/", ".", "%s%n", "{}", "{0}", "${1/0}", "$(arg x)", "$(find x)", "<", "&", "'", '"', "]]>",
    "a.b", "*", "model.x", "1_000", "package://x/y.stl", "file:///dev/null", "-", "+", "1e", "e1", "__class__", "~",
    "1:30", "2024-01-01", "@", "\\",
)  # fmt: skip
SPLINTERS = (
    *(word.encode() for word in WORDS if len(word) < 100),
    b"\x00", b"\xff", b"\xef\xbb\xbf", b"\r\n", b"\n", b"\t", b"<!--", b"-->", b"<![CDATA[", b"&a;", b"&#0;",
    b"<!DOCTYPE r [<!ENTITY a 'b'>]>", b"&#xD800;", b"<?x?>", b'<?xml version="1.0" encoding="utf-16"?>', b"</",
    b'<?xml version="1.1"?>', b"/>", b"<a>", b" xmlns:x='y'", b"&x [1]", b"*x", b"!!python/name:os.system", b"!!float",
    b"!!set", b": ", b"- ", b"[", b"{", b"|", b">", b"? ", b"<<: ", b"---\n", b"%YAML 9.9\n",
)  # fmt: skip


def anything(random: Random) -> bytes:
    """Random bytes."""
    return random.randbytes(random.choice((0, 1, 7, 64, 1000, 20_000)))


def spoil_bytes(data: bytes, random: Random) -> bytes:
    """A few bytes flipped, cut out, doubled, moved or put in."""
    text = bytearray(data)
    for _ in range(random.choice((1, 1, 1, 2, 3, 8, 30))):
        at, to = sorted((random.randint(0, len(text)), random.randint(0, len(text))))
        to = min(to, at + random.choice((1, 2, 10, 100, 5000)))
        act = random.randrange(7)
        if act == 0 and at < len(text):
            text[at] ^= 1 << random.randrange(8)
        elif act == 1 and at < len(text):
            text[at] = random.randrange(256)
        elif act == 2:
            del text[at:to]
        elif act == 3:
            text[at:at] = text[at:to] * random.choice((1, 1, 2, 50))
        elif act == 4:
            text[at:at] = random.choice(SPLINTERS)
        elif act == 5:
            text[at:to] = random.choice(SPLINTERS)
        elif random.random() < 0.2:
            del text[at:]
    return bytes(text)


def spoil_xml(data: bytes, random: Random) -> bytes:
    """Elements dropped, doubled, renamed, moved, wrapped; attributes dropped, renamed, given other values."""
    root = ElementTree.fromstring(data)
    for _ in range(random.choice((1, 1, 1, 2, 4))):
        every = list(root.iter())
        parents = {child: parent for parent in every for child in parent}
        element = random.choice(every)
        parent = parents.get(element)
        act = random.randrange(10)
        if act == 0 and parent is not None:
            parent.remove(element)
        elif act == 1 and parent is not None:
            parent.insert(random.randint(0, len(parent)), copy.deepcopy(element))
        elif act == 2:
            element.tag = random.choice([random.choice(every).tag, "x", "robot", "drillrig", "table"])
        elif act == 3 and parent is not None:
            parent.remove(element)
            target = random.choice([e for e in every if e not in set(element.iter())])
            target.insert(random.randint(0, len(target)), element)
        elif act == 5:
            element.text = random.choice(WORDS)
        elif element.attrib:
            key = random.choice(list(element.attrib))
            if act == 6:
                del element.attrib[key]
            elif act == 7:
                other = random.choice(every)
                element.attrib[random.choice([*other.attrib, "x", "name"])] = element.attrib.pop(key)
            else:
                element.attrib[key] = _other_value(element.attrib[key], every, random)
    data = ElementTree.tostring(root)
    if random.random() < 0.03:
        at = random.choice([i for i in range(len(data)) if data[i : i + 1] == b"<"])
        depth = random.choice((5, 150, 250, 30_000))
        data = data[:at] + b"<x>" * depth + b"</x>" * depth + data[at:]
    return data


def _other_value(value: str, every: list[Any], random: Random) -> str:
    words = value.split()
    way = random.randrange(4)
    if way == 0 and len(words) > 1:
        words[random.randrange(len(words))] = random.choice(WORDS)
        return " ".join(words)
    if way == 1:
        donor = random.choice(every)
        return random.choice([*donor.attrib.values(), ""])
    if way == 2:
        try:
            return repr(float(value) * random.choice((-1, 0, 1e-9, 1e9, 1e300, 0.5, 1 + 1e-12)))
        except ValueError:
            pass
    return random.choice(WORDS)


#: What stands where a value of a field should.
VALUES = (
    None, True, False, 0, -1, 1, 10**30, 1e308, -1e308, 1e-320, float("nan"), float("inf"), "", "nan", "x", "all",
    "a" * 20_000, [], {}, [1], [1, 2, 3], [[]], {"a": 1}, {"x": {"y": 1}}, ["x", None], "\u4e2d", "../x", "1e6", "*",
    "model.x", "scenario.duration", "none", "5mm", "1e5", 3.5, "auto", "python", "core", "hole_9", 1000000, 2**20,
    "/dev/null", ".", "a\nb", "a\x00b", {"": 1}, 0.001, 1000001,
)  # fmt: skip


def spoil_value(value: Any, random: Random) -> Any:
    """One place in nested lists and dictionaries dropped, doubled, renamed, wrapped or given another value."""
    value = copy.deepcopy(value)
    for _ in range(random.choice((1, 1, 1, 2, 4))):
        places = list(_places(value))
        if not places:
            return copy.deepcopy(random.choice(VALUES))
        holder, key = random.choice(places)
        act = random.randrange(7)
        if act == 0:
            del holder[key]
        elif act == 1 and isinstance(holder, list):
            holder.extend(copy.deepcopy(holder[key]) for _ in range(random.choice((1, 2, 1000))))
        elif act == 1:
            holder[random.choice([*WORDS[:20], "x"])] = copy.deepcopy(holder[key])
        elif act == 2 and isinstance(holder, dict):
            _, other = random.choice(places)
            holder[other if random.random() < 0.7 else random.choice(WORDS)] = holder.pop(key)
        elif act == 3:
            for _ in range(random.choice((1, 1, 15, 25))):
                holder[key] = [holder[key]] if random.random() < 0.5 else {"x": holder[key]}
        elif act == 4:
            donor, other = random.choice(places)
            holder[key] = copy.deepcopy(donor[other])
        else:
            holder[key] = copy.deepcopy(random.choice(VALUES))
    return value


def _places(value: Any) -> Any:
    keys = value if isinstance(value, dict) else range(len(value)) if isinstance(value, list) else ()
    for key in list(keys):
        yield value, key
        yield from _places(value[key])


def spoil_yaml(data: bytes, random: Random) -> bytes:
    """Another value somewhere in a YAML file."""
    value = spoil_value(yaml.load(data, getattr(yaml, "CSafeLoader", yaml.SafeLoader)), random)
    dumper = getattr(yaml, "CSafeDumper", yaml.SafeDumper)
    return yaml.dump(value, Dumper=dumper, allow_unicode=True, default_flow_style=random.choice((True, False))).encode()


def spoil_json_lines(data: bytes, random: Random) -> bytes:
    """Another value somewhere in one line of JSON; lines dropped and doubled."""
    lines = data.splitlines()
    i = random.randrange(len(lines))
    lines[i] = json.dumps(spoil_value(json.loads(lines[i]), random)).encode()
    if random.random() < 0.2:
        lines.insert(random.randint(0, len(lines)), random.choice(lines))
    return b"\n".join(lines)


def spoil_table(data: bytes, random: Random) -> bytes:
    """Rows and cells of a CSV file dropped, doubled, exchanged, given other values."""
    rows = [line.split(",") for line in data.decode().splitlines()]
    for _ in range(random.choice((1, 1, 2, 5))):
        row = random.choice(rows) if rows else [""]
        i = random.randrange(len(row))
        act = random.randrange(6)
        if act == 0 and len(rows) > 1:
            rows.remove(row)
        elif act == 1:
            rows.insert(random.randint(0, len(rows)), list(row))
        elif act == 2:
            row.insert(i, random.choice(WORDS))
        elif act == 3 and len(row) > 1:
            del row[i]
        elif act == 4:
            random.shuffle(rows)
        else:
            row[i] = random.choice(WORDS)
    end = random.choice(("\n", "\n", "\r\n", "\r"))
    mark = random.choice((",", ",", ",", ",", ",", ";", "\t"))
    return end.join(mark.join(row) for row in rows).encode()


Mutator = Callable[[bytes, Random], bytes]


def spoiled(data: bytes, random: Random, structure: Mutator | None = None) -> bytes:
    """A file spoiled in its structure, in its bytes, in both, or replaced by random bytes."""
    way = random.random()
    if way < 0.03:
        return anything(random)
    if structure is not None and way < 0.75:
        data = structure(data, random)
    return spoil_bytes(data, random) if structure is None or way > 0.65 else data
