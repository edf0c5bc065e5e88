"""Run pytest with the compiled module of another build folder in place of the installed one."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import pinocchio  # noqa: F401 - brings the libraries the module needs
import pytest

folder, *arguments = sys.argv[1:]
(path,) = Path(folder).glob("_drillrig*.so")
spec = importlib.util.spec_from_file_location("drillrig_pin._drillrig", path)
assert spec is not None
assert spec.loader is not None
module = importlib.util.module_from_spec(spec)
sys.modules["drillrig_pin._drillrig"] = module
spec.loader.exec_module(module)


class SaysWhich:
    """One line of the report: it is easy to test the wrong build."""

    def pytest_report_header(self) -> str:
        import drillrig_pin.core

        assert drillrig_pin.core._drillrig is module
        return f"compiled module: {path}"


sys.exit(pytest.main([*arguments, "-v" if "-v" in arguments else "-q"], plugins=[SaysWhich()]))
