"""Write urdf/GRAMMAR.md from the classes that read the elements."""

from drillrig_pin.files import shipped_folder, write_aside
from drillrig_pin.grammar import grammar_page

if __name__ == "__main__":
    with write_aside(shipped_folder() / "GRAMMAR.md") as aside:
        aside.write_text(grammar_page())
