#!/usr/bin/env bash
# The core under sanitizers, in a build of its own (cached in build/), driven by the tests:
#     bash scripts/sanitize.sh [what pytest takes]           memory and undefined behaviour: states and runs against Python
#     bash scripts/sanitize.sh thread [what pytest takes]    data races: runs side by side, as simulate_many makes them
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
python="$PWD/.venv/bin/python"
PATH="$PWD/.venv/bin:$PATH"
mkdir -p build

# build FOLDER FLAGS: the compiled module with these flags.
build() {
  local folder=$1 log=$1.log
  cmake -G Ninja -S drillrig_pin/_core -B "$folder" -DCMAKE_BUILD_TYPE=Release -DPython_EXECUTABLE="$python" \
    -Dnanobind_DIR="$("$python" -m nanobind --cmake_dir)" \
    -DCMAKE_CXX_FLAGS="$2 -fno-omit-frame-pointer -g1" \
    -DCMAKE_CXX_FLAGS_RELEASE="-O1 -DNDEBUG" > "$log" 2>&1 || { cat "$log"; exit 1; }
  ninja -C "$folder" >> "$log" 2>&1 || { tail -50 "$log"; exit 1; }
}

if [ "${1:-}" = thread ]; then
  shift
  folder="$PWD/build/sanitized-thread"
  build "$folder" "-fsanitize=thread"
  # Only the core is instrumented: its own accesses are watched, and those of the C library whoever calls it. Its threads
  # meet in locks of Python, which are locks of the C library and so are seen. What interpreter, NumPy and their likes do
  # inside themselves is no concern of ours; a report with a frame of the core in it is not suppressed by these.
  cat > "$folder/suppressions.txt" <<'RULES'
called_from_lib:libpython
called_from_lib:_multiarray_umath
called_from_lib:openblas
RULES
  # Without randomised addresses: newer kernels spread them wider than the sanitizer of GCC 12 knows.
  LD_PRELOAD="$(gcc -print-file-name=libtsan.so)" OPENBLAS_NUM_THREADS=1 \
    TSAN_OPTIONS="suppressions=$folder/suppressions.txt exitcode=66 halt_on_error=0" \
    setarch "$(uname -m)" -R \
    "$python" tests/core/run_sanitized.py "$folder" tests/test_core_threads.py --capture=sys -p no:cacheprovider "$@"
  exit
fi

folder="$PWD/build/sanitized"
# Eigen takes another allocator under ASan, which would not match the one inside libpinocchio: EIGEN_MALLOC_ALREADY_ALIGNED.
build "$folder" "-fsanitize=address,undefined -fno-sanitize-recover=undefined -DEIGEN_MALLOC_ALREADY_ALIGNED=1"
# Python itself is not sanitized: the library goes in front, and what Python never frees is no leak of ours.
LD_PRELOAD="$(gcc -print-file-name=libasan.so) $(gcc -print-file-name=libubsan.so)" \
  ASAN_OPTIONS=detect_leaks=0 UBSAN_OPTIONS=print_stacktrace=1 \
  "$python" tests/core/run_sanitized.py "$folder" tests/test_core_parity.py tests/test_core_runs.py tests/test_core_threads.py tests/test_exponential.py \
  --capture=sys -k "not ctrl_c and not shipped_scenario and not RK4" "$@"
