"""The README's own examples run as they stand."""

import math
import re
from pathlib import Path

import pytest
from command import Command

#: A boom of 400 kg on a pin, as any CAD program exports it.
MACHINE = """<robot name="machine">
  <link name="base"/>
  <link name="boom"><inertial>
    <origin xyz="1.5 0 0"/><mass value="400"/><inertia ixx="10" ixy="0" ixz="0" iyy="300" iyz="0" izz="300"/>
  </inertial></link>
  <joint name="boom_pin" type="revolute">
    <origin xyz="0 0 1"/><parent link="base"/><child link="boom"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" effort="1e5" velocity="1"/>
  </joint>
</robot>"""

README = Path(__file__).parent.parent / "README.md"
EXAMPLES = re.findall(r"```python\n(.*?)```", README.read_text(), flags=re.DOTALL)


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda text: text.splitlines()[-1][:40])
def test_example_of_the_readme_runs(example: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    exec(compile(example, "README.md", "exec"), {"__name__": "readme"})


def test_an_overlay_takes_in_a_machine_and_leaves_its_file_alone(tmp_path: Path, drillrig: Command) -> None:
    (overlay,) = re.findall(r"```xml\n(<robot.*?)```", README.read_text(), flags=re.DOTALL)
    (tmp_path / "machine.urdf").write_text(MACHINE)
    (tmp_path / "my_rig.urdf.xacro").write_text(overlay)
    assert "nothing wrong found" in drillrig("check", "my_rig.urdf.xacro").out
    assert drillrig("run", "my_rig.urdf.xacro", "--set", "scenario.duration=0.1", "-o", "own.nc").code == 0
    # The spring holds the boom's weight where the pose puts it: m g r cos(0.6).
    held = drillrig("static", "my_rig.urdf.xacro", "--json").document["elements"]["boom_hose"]["held"]
    assert held == pytest.approx(-400 * 9.81 * 1.5 * math.cos(0.6), rel=1e-9)
    assert (tmp_path / "machine.urdf").read_text() == MACHINE


def test_plugin_of_the_readme_takes_at_most_twenty_lines() -> None:
    (plugin,) = [text for text in EXAMPLES if "PluginElement" in text]
    body = plugin[plugin.index("class") : plugin.index("rig =")]
    assert len([line for line in body.splitlines() if line.strip()]) <= 20


def test_every_file_of_the_readme_exists() -> None:
    text = README.read_text()
    for name in set(re.findall(r"`((?:scripts|urdf)/[\w./]+)`", text)) | set(re.findall(r"\]\((urdf/[\w.]+)\)", text)):
        assert (README.parent / name).exists(), name
