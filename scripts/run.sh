#!/usr/bin/env bash
# The main job on a fresh machine: install, simulate test hole no. 9, leave run.nc and figures/.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
. scripts/environment.sh
prepare_environment requirements.lock
.venv/bin/drillrig run -o run.nc "$@"
.venv/bin/drillrig plot run.nc -o figures
