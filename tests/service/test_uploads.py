"""A model from outside is plain text within bounds, or it is refused with the place and the way out."""

from __future__ import annotations

from dataclasses import replace

import pytest

from drillrig_pin.errors import ModelError
from drillrig_pin.service.settings import Limits
from drillrig_pin.service.uploads import upload_facts

PENDULUM = """<robot name="pendulum"><link name="base"/><link name="bob"><inertial><mass value="1"/>
<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>{inside}</link>
<joint name="swing" type="continuous"><parent link="base"/><child link="bob"/><axis xyz="0 1 0"/></joint>
<drillrig>{elements}</drillrig></robot>"""


def text(inside: str = "", elements: str = "") -> bytes:
    return PENDULUM.format(inside=inside, elements=elements).encode()


def many(begin: str) -> str:
    """More attributes than anything has."""
    return " ".join(f'{begin.format(i)}"v{i}"' for i in range(101))


def test_plain_model_is_counted() -> None:
    facts = upload_facts(text(elements='<point name="P" on="bob" xyz="0 0 1"/>'), Limits())
    assert facts == {"name": "pendulum", "links": 2, "joints": 1, "elements": 1}


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"\xff\xfe", "UTF-8"),
        (b"<robot>", "upload"),
        (b'<robot name="empty"/>', "no link"),
        (text(inside='<xacro:if xmlns:xacro="http://www.ros.org/wiki/xacro" value="1"/>'), "uses xacro"),
        (text(inside='<visual><geometry><mesh filename="/etc/passwd"/></geometry></visual>'), "names a file"),
        (text(elements='<table file="loads.csv"/>'), "names a file"),
        (text(inside='<visual name="http://elsewhere"/>'), "names a place"),
        (b'<!DOCTYPE r [<!ENTITY a "b">]><robot>&a;</robot>', "upload"),
        (text(inside=f"<visual {many('a{}=')}/>"), "<visual> with more than 100 attributes"),
        (text(inside=f"<visual {many('xmlns:a{}=')}/>"), "<visual> with more than 100 attributes"),
        (text(inside="<!---->" * 25_000), "more than 20000 comments"),
        (text(inside="<?a?>" * 25_000), "more than 20000 comments"),
    ],
)
def test_what_is_not_plain_is_refused_in_words(content: bytes, words: str) -> None:
    with pytest.raises(ModelError, match=words):
        upload_facts(content, Limits())


@pytest.mark.parametrize(
    ("bound", "words"),
    [({"links": 1}, "2 links"), ({"elements": 0}, "1 elements"), ({"dofs": 0}, "1 degrees of freedom")],
)
def test_a_model_beyond_the_bounds_is_refused_with_its_count(bound: dict[str, int], words: str) -> None:
    with pytest.raises(ModelError, match=words):
        upload_facts(text(elements='<point name="P" on="bob" xyz="0 0 1"/>'), replace(Limits(), **bound))
