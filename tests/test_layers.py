"""Who may import whom: a file imports only from layers below its own, and nothing imports the package root."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

import drillrig_pin

ROOT = Path(drillrig_pin.__file__).parent

#: Lowest first. Files within one entry may import each other; an entry ending in a dot is a folder.
LAYERS: list[tuple[str, ...]] = [
    ("errors", "_drillrig", "words", "units", "escaping"),
    ("files", "memory", "beat", "budget", "litter", "modest"),
    ("model.", "yamlfile", "series"),
    ("storage", "hdf5", "tree_data"),
    ("kinematics",),
    ("arrays", "finite", "linear"),
    ("coordinates",),
    ("elements.",),
    ("declarations", "constraints"),
    ("locks",),
    ("tree",),
    ("rig", "grammar"),
    ("workspace", "joint_limits", "plausible"),
    ("dependence",),
    ("assembly",),
    ("sharing", "statics", "stabilization"),
    ("dynamics", "scenario", "stepping"),
    ("inside", "sampling", "fitting", "stiffness"),
    ("constraint_watch", "integrators", "core", "trajectory", "older", "columns"),
    ("validity",),
    ("recorder", "balance"),
    ("marching",),
    ("methods", "modes"),
    ("simulation",),
    ("accuracy",),
    ("analysis.",),
    ("scene.",),
    ("replay.",),
    ("batch.",),
    ("check", "check_pose", "figures."),
    ("report.",),
    ("studyreport.",),
    ("service.", "client"),
    ("cli.",),
]


def module_name(path: Path) -> str:
    """Dotted name below the package; a folder's own file is named with a trailing dot."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1]) + "." if parts[-1] == "__init__" else ".".join(parts)


def layer(module: str) -> int | None:
    """Index of the layer of a module, e.g. ``elements.base`` or ``rig``."""
    for index, names in enumerate(LAYERS):
        for name in names:
            if module == name or (name.endswith(".") and (module + ".").startswith(name)):
                return index
    return None


def imported(path: Path, only_at_once: bool = False) -> set[str]:
    """Modules of the package that a file imports; the root is the empty name.

    Wherever in it the import stands, or ``only_at_once``: those carried out as soon as the file is imported.
    """
    found = set()
    tree = ast.parse(path.read_text())
    for node in tree.body if only_at_once else ast.walk(tree):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: imports are absolute"
            names = {f"{node.module}.{alias.name}" for alias in node.names}
            # `from package.folder import file` names a module, `from package.file import name` does not.
            modules = {n for n in names if (ROOT.parent / Path(*n.split("."))).with_suffix(".py").exists()}
            found |= modules or {node.module or ""}
    prefix = drillrig_pin.__name__
    return {n.removeprefix(prefix).removeprefix(".") for n in found if n == prefix or n.startswith(prefix + ".")}


FILES = {module_name(path): path for path in sorted(ROOT.rglob("*.py")) if path != ROOT / "__init__.py"}


@pytest.mark.parametrize("module", FILES)
def test_every_file_has_its_layer_and_imports_only_from_below(module: str) -> None:
    own = layer(module)
    assert own is not None, f"{module} has no layer: give it its place in LAYERS"
    for other in sorted(imported(FILES[module])):
        assert other, f"{module} imports the package root"
        below = layer(other)
        assert below is not None, f"{module} imports {other}, which has no layer"
        assert below <= own, f"{module} (layer {own}) imports {other} (layer {below}) from above"


def test_no_file_needs_itself_to_be_imported() -> None:
    graph = {module: imported(path, only_at_once=True) for module, path in FILES.items()}

    free: set[str] = set()

    def visit(module: str, trail: tuple[str, ...]) -> None:
        assert module not in trail, " -> ".join((*trail, module))
        if module not in free:
            for other in graph.get(module, ()):
                visit(other, (*trail, module))
            free.add(module)

    for module in graph:
        visit(module, ())


def test_the_model_files_know_no_element_and_the_engine_no_rig() -> None:
    for module, path in FILES.items():
        names = {node.id for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.Name)}
        strings = {
            node.value
            for node in ast.walk(ast.parse(path.read_text()))
            if isinstance(node, ast.Constant) and isinstance(node.value, str)
        }
        if module.startswith("model."):
            assert not names & {"Cylinder", "Contact", "Load", "Spring"}, module
        if (layer(module) or 0) < len(LAYERS) - 5 and module != "scenario":
            assert not any(
                "boom" in text or "mkz49" in text for text in strings if "\n" not in text and " " not in text
            ), module


def test_importing_the_package_imports_nothing_heavy() -> None:
    import subprocess
    import sys

    heavy = "{'pinocchio', 'scipy', 'xarray', 'pydantic', 'numpy'}"
    code = f"import sys, drillrig_pin; print(sorted({heavy} & set(sys.modules)))"
    output = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert output.strip() == "[]"


def test_no_run_in_the_core_waits_for_scipy() -> None:
    # SciPy takes a third of a second to import: whoever needs it imports it then. `integrators` itself comes late.
    waiting = {
        module
        for module, path in FILES.items()
        for node in ast.parse(path.read_text()).body
        if isinstance(node, ast.Import | ast.ImportFrom) and "scipy" in ast.unparse(node)
    }
    assert waiting == {"integrators"}


def test_every_public_name_can_be_had_from_the_root() -> None:
    assert set(drillrig_pin.__all__) == set(drillrig_pin._HOMES)
    for name in drillrig_pin.__all__:
        assert getattr(drillrig_pin, name).__name__ == name
    with pytest.raises(AttributeError, match="no attribute 'Rigg'"):
        _ = drillrig_pin.Rigg
