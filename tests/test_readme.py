"""The README's own examples run as they stand."""

import re
from pathlib import Path

import pytest

README = Path(__file__).parent.parent / "README.md"
EXAMPLES = re.findall(r"```python\n(.*?)```", README.read_text(), flags=re.DOTALL)


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda text: text.splitlines()[-1][:40])
def test_example_of_the_readme_runs(example: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    exec(compile(example, "README.md", "exec"), {"__name__": "readme"})


def test_plugin_of_the_readme_takes_at_most_twenty_lines() -> None:
    (plugin,) = [text for text in EXAMPLES if "PluginElement" in text]
    body = plugin[plugin.index("class") : plugin.index("rig =")]
    assert len([line for line in body.splitlines() if line.strip()]) <= 20


def test_every_file_of_the_readme_exists() -> None:
    text = README.read_text()
    for name in set(re.findall(r"`((?:scripts|urdf)/[\w./]+)`", text)) | set(re.findall(r"\]\((urdf/[\w.]+)\)", text)):
        assert (README.parent / name).exists(), name
