"""A wheel carries the models and works where there is no checkout."""

import json
import re
import subprocess
import sys
import venv
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    command = [
        sys.executable,
        "-m",
        "pip",
        "wheel",
        "--quiet",
        "--no-deps",
        "--no-build-isolation",
        "-w",
        str(folder),
        ".",
    ]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    (path,) = folder.glob("*.whl")
    return path


def test_wheel_holds_models_scenarios_and_parameters(wheel: Path) -> None:
    names = set(zipfile.ZipFile(wheel).namelist())
    for name in ("mkz49.urdf.xacro", "params/mkz49.yaml", "scenarios/hole_9.yaml", "limits.yaml", "GRAMMAR.md"):
        assert f"drillrig_pin/urdf/{name}" in names
    for name in ("report.html", "report.css", "report.js", "drawing.js"):
        assert f"drillrig_pin/report/templates/{name}" in names
    for name in ("study.html", "study.css", "study.js"):
        assert f"drillrig_pin/studyreport/templates/{name}" in names
    for name in ("page.html", "page.css", "payload.js", "film.js", "player.js"):
        assert f"drillrig_pin/replay/assets/{name}" in names
    page = ROOT / "drillrig_pin" / "service" / "web"
    files = {path.relative_to(ROOT).as_posix() for path in page.rglob("*") if path.is_file()}
    assert f"{page.relative_to(ROOT).as_posix()}/index.html" in files
    assert files <= names


def test_unpacked_wheel_finds_its_models_outside_the_checkout(wheel: Path, tmp_path: Path) -> None:
    zipfile.ZipFile(wheel).extractall(tmp_path)
    code = (
        "import sys; sys.meta_path = [f for f in sys.meta_path if 'Scikit' not in type(f).__name__];"
        f"sys.path.insert(0, {str(tmp_path)!r}); import drillrig_pin, json;"
        "rig = drillrig_pin.load_rig('mkz49');"
        "print(json.dumps([drillrig_pin.__file__, rig.file.path, rig.joints]))"
    )
    run = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, check=True, capture_output=True, text=True)
    package, model, joints = json.loads(run.stdout)
    assert package.startswith(str(tmp_path))
    assert (tmp_path / model).is_relative_to(tmp_path)
    assert len(joints) == 6


def test_wheel_installs_into_an_empty_environment_and_runs_the_core(wheel: Path, tmp_path: Path) -> None:
    pytest.importorskip("drillrig_pin.core", reason="the package was built without a C++ compiler")
    environment = tmp_path / "empty"
    venv.create(environment)
    # Its own dependencies, in the versions that everything else here is tested with.
    locked = re.findall(r"^\S+==.*?(?= \\)", (ROOT / "requirements.lock").read_text(), re.MULTILINE)
    (tmp_path / "versions.txt").write_text("\n".join(locked))
    # By the pip that is here already, and without compiling every module of sixty libraries: it takes most of the time.
    pip = [sys.executable, "-m", "pip", "--python", str(environment / "bin/python")]
    install = ["install", "--quiet", "--no-compile", "-c", str(tmp_path / "versions.txt"), str(wheel)]
    subprocess.run([*pip, *install], check=True, capture_output=True)
    command = [environment / "bin/drillrig", "run", "--set", "scenario.duration=0.05", "--json"]
    run = subprocess.run(command, cwd=tmp_path, check=True, capture_output=True, text=True)
    assert json.loads(run.stdout)["metrics"]["trust"]["engine"].endswith("in the compiled core")
    assert (tmp_path / "run.nc").exists()
