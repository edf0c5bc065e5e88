# Sourced by run.sh and test.sh: makes .venv from a lock file, or leaves it alone if it already matches.

python_for_venv() {
    local candidate
    for candidate in "${PYTHON:-}" python3 python3.14 python3.13 python3.12 python3.11; do
        if [ -n "$candidate" ] && command -v "$candidate" >/dev/null 2>&1 &&
            "$candidate" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then
            command -v "$candidate"
            return
        fi
    done
    echo "Python 3.11 or newer is needed and was not found. Install it, or name it: PYTHON=/path/to/python3 bash $0" >&2
    return 1
}

prepare_environment() {
    local lock=$1 stamp=.venv/installed.txt python wanted
    python=$(python_for_venv)
    wanted="$(cat "$lock" pyproject.toml | cksum) $PWD"
    if [ ! -f "$stamp" ] || [ "$(cat "$stamp")" != "$wanted" ]; then
        echo "Installing into $PWD/.venv (a minute or two) ..."
        "$python" -m venv .venv || {
            echo "Making .venv failed. On Debian and Ubuntu: apt-get install python3-venv" >&2
            return 1
        }
        .venv/bin/python -m pip install --quiet --disable-pip-version-check --require-hashes -r "$lock"
        .venv/bin/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e .
        echo "$wanted" >"$stamp"
    fi
}
