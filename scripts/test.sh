#!/usr/bin/env bash
# Everything run.sh does, then style, types and all tests.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
. scripts/environment.sh
prepare_environment requirements-test.lock
.venv/bin/drillrig run -o run.nc
.venv/bin/drillrig plot run.nc -o figures
.venv/bin/ruff check .
.venv/bin/ruff format --check .
.venv/bin/mypy
browser
# In the order of tests/conftest.py: xdist would begin with the files of most tests, which are not the longest.
.venv/bin/python -m pytest -n auto --dist loadfile --no-loadscope-reorder "$@"
