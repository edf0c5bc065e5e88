#!/usr/bin/env bash
# Pin every dependency again, for all platforms, with hashes. Needs uv (pip install uv).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
compile() { uv pip compile pyproject.toml --universal --python-version 3.11 --generate-hashes --no-annotate --no-header -q "$@"; }
compile --extra build -o requirements.lock
compile --extra build --extra test -o requirements-test.lock
compile --extra build --extra test --extra peers -o requirements-peers.lock
