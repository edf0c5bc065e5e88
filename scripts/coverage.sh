#!/usr/bin/env bash
# Which lines of the Python part the tests run, in child processes as well: all tests, about twice as long as without.
# Prints the files with lines missed and the total, leaves tests/measured/coverage.json, and fails under 95 %.
#     bash scripts/coverage.sh [what pytest takes, e.g. -n 2]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
rm -rf build/coverage
mkdir -p build/coverage
failed=0
.venv/bin/python -m coverage run -m pytest --dist loadfile --no-loadscope-reorder "${@:--nauto}" || failed=$?
.venv/bin/python -m coverage combine --quiet
.venv/bin/python -m coverage json --quiet --fail-under=0 -o build/coverage/report.json
.venv/bin/python -m coverage report || failed=1
.venv/bin/python - <<'PYTHON'
import json, sys
sys.path.insert(0, "tests")
from validation.measured import keep
total = json.load(open("build/coverage/report.json"))["totals"]
print(keep("coverage", {"percent": total["percent_covered"], "lines": total["num_statements"], "missed": total["missing_lines"]}))
PYTHON
exit "$failed"
