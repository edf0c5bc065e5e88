#!/usr/bin/env bash
# Faults planted in the force laws and in what assembles and solves the constraints: how many do the tests notice?
# About half an hour on one core. Writes tests/MUTATION.md and tests/measured/mutation.json; fails under 90 %, or if a fault
# that nothing notices is not explained in tests/mutation_survivors.yaml. What was done is kept in mutants/ and not done again.
#     bash scripts/mutation.sh [--summary: only write the page of what mutants/ holds]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
.venv/bin/python -c "import mutmut" 2>/dev/null || .venv/bin/python -m pip install --quiet "mutmut>=3.3"
nice -n 10 .venv/bin/python scripts/mutation.py "$@"
