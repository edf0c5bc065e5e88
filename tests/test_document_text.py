"""The text of a model is the same however and whenever it is read: results are compared by its hash."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from xml.sax.saxutils import escape, quoteattr

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rigs import pendulum, point_mass

from drillrig_pin import load_rig_text
from drillrig_pin.model.document_text import document_text
from drillrig_pin.model.modelfile import read_model_text
from drillrig_pin.model.nodes import parse_bytes, root_element, take_nodes

READ = "from drillrig_pin.model.modelfile import read_model; print(read_model({path!r}).text, end='')"


def test_a_plain_file_reads_alike_before_and_after_the_first_xacro_model(tmp_path: Path) -> None:
    """xacro replaces the writer of Python's DOM when it is imported; a hash must not know of it."""
    path = tmp_path / "pendulum.urdf"
    path.write_text(pendulum())
    texts = [
        subprocess.run([sys.executable, "-c", first + READ.format(path=str(path))], stdout=subprocess.PIPE, check=True)
        for first in ("", "import xacro; ")
    ]
    assert texts[0].stdout == texts[1].stdout
    assert texts[0].stdout.decode() == read_model_text(path.read_text()).text


@pytest.mark.parametrize("rows", ["0,1\n1,2", "<![CDATA[0,1\n1,2]]>"])
def test_rows_in_a_cdata_section_are_rows(rows: str) -> None:
    load = '<load name="push" point="P" axis="1 0 0" frame="world" kind="force">'
    rig = load_rig_text(point_mass(2.0, f'{load}<table reading="linear">{rows}</table></load>'))
    assert "1,2" in rig.file.text


words = st.text(st.characters(codec="utf-8", categories=("L", "N", "P", "S", "Zs")), min_size=1, max_size=12)
names = st.from_regex(r"[a-z][a-z0-9_]{0,6}", fullmatch=True)
trees = st.recursive(
    st.tuples(names, st.dictionaries(names, words, max_size=4), words.map(str.strip)),
    lambda inner: st.tuples(names, st.dictionaries(names, words, max_size=4), st.lists(inner, min_size=1, max_size=4)),
)


@given(trees)
def test_what_is_written_reads_back_as_what_was_written(tree: tuple) -> None:
    def xml(element: tuple) -> str:
        name, attributes, inside = element
        head = " ".join([name, *(f"{key}={quoteattr(value)}" for key, value in attributes.items())])
        return f"<{head}>{escape(inside) if isinstance(inside, str) else ''.join(map(xml, inside))}</{name}>"

    def plain(node: object) -> tuple:
        return node.tag, dict(node.attributes), node.text, [plain(child) for child in node.children]

    root = root_element(parse_bytes(xml(tree).encode(), "given"))
    given_nodes = take_nodes(root)
    text = document_text(root)
    again = root_element(parse_bytes(text.encode(), "written"))
    assert plain(take_nodes(again)) == plain(given_nodes)
    assert document_text(again) == text
