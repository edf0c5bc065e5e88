# Sourced by run.sh, test.sh and docker/Dockerfile: one way to install, wherever it happens.

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

# The compiled core needs g++. As root on Debian and Ubuntu it is installed; elsewhere the package says how it runs without.
compiler() {
    if ! command -v g++ >/dev/null 2>&1; then
        if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null 2>&1; then
            echo "Installing g++ ..."
            { apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq g++; } >/dev/null || true
        fi
    fi
    command -v g++ >/dev/null 2>&1 ||
        echo "No C++ compiler: drillrig will run its Python engine, about a hundred times slower. Install g++ and run again."
}

# The browser tests need Chromium, the film among them ffmpeg. CI must run them; elsewhere pytest says that it skips them.
browser() {
    if [ -n "${CI:-}" ] && [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null 2>&1; then
        if ! command -v chromium >/dev/null 2>&1 || ! command -v ffmpeg >/dev/null 2>&1; then
            echo "Installing chromium and ffmpeg ..."
            { apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends chromium ffmpeg; } >/dev/null
        fi
    fi
}

# install_into VENV LOCK [-e]: the libraries of the lock, every one by its hash, then this package; -e: as a checkout.
install_into() {
    local venv=$1 lock=$2 pip
    shift 2
    pip="$venv/bin/python -m pip install --quiet --disable-pip-version-check"
    $pip --require-hashes -r "$lock"
    $pip --no-deps --no-build-isolation "$@" .
}

# Makes .venv from a lock file, or leaves it alone if it already matches.
prepare_environment() {
    local lock=$1 stamp=.venv/installed.txt python wanted
    python=$(python_for_venv)
    wanted="$(cat "$lock" pyproject.toml drillrig_pin/_core/* | cksum) $PWD"
    if [ ! -f "$stamp" ] || [ "$(cat "$stamp")" != "$wanted" ]; then
        echo "Installing into $PWD/.venv (about three minutes) ..."
        compiler
        "$python" -m venv .venv || {
            echo "Making .venv failed. On Debian and Ubuntu: apt-get install python3-venv" >&2
            return 1
        }
        install_into .venv "$lock" -e
        echo "$wanted" >"$stamp"
    fi
}
