"""The grammar page says what the classes read."""

from drillrig_pin.elements.registry import FORCES
from drillrig_pin.files import shipped_folder
from drillrig_pin.grammar import grammar_page


def test_grammar_page_is_up_to_date() -> None:
    page = (shipped_folder() / "GRAMMAR.md").read_text()
    assert page == grammar_page(), "run python scripts/write_grammar.py"


def test_grammar_page_lists_every_force_with_its_attributes() -> None:
    page = grammar_page()
    for tag, cls in FORCES.items():
        section = page[page.index(f"### `<{tag}>`") :].split("### ")[1]
        for name, field in cls.model_fields.items():
            if field.json_schema_extra is not None:
                assert f"`{field.alias or name}`" in section
