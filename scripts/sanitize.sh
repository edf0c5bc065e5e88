#!/usr/bin/env bash
# The core under AddressSanitizer and UBSan: its own build (cached in build/sanitized), then states and runs against Python.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
python="$PWD/.venv/bin/python"
PATH="$PWD/.venv/bin:$PATH"
folder="$PWD/build/sanitized"
mkdir -p build
# Eigen takes another allocator under ASan, which would not match the one inside libpinocchio: EIGEN_MALLOC_ALREADY_ALIGNED.
cmake -G Ninja -S drillrig_pin/_core -B "$folder" -DCMAKE_BUILD_TYPE=Release -DPython_EXECUTABLE="$python" \
  -Dnanobind_DIR="$("$python" -m nanobind --cmake_dir)" \
  -DCMAKE_CXX_FLAGS="-fsanitize=address,undefined -fno-sanitize-recover=undefined -fno-omit-frame-pointer -g1 -DEIGEN_MALLOC_ALREADY_ALIGNED=1" \
  -DCMAKE_CXX_FLAGS_RELEASE="-O1 -DNDEBUG" > "$folder.log" 2>&1 || { cat "$folder.log"; exit 1; }
ninja -C "$folder" >> "$folder.log" 2>&1 || { tail -50 "$folder.log"; exit 1; }
# Python itself is not sanitized: the library goes in front, and what Python never frees is no leak of ours.
LD_PRELOAD="$(gcc -print-file-name=libasan.so) $(gcc -print-file-name=libubsan.so)" \
  ASAN_OPTIONS=detect_leaks=0 UBSAN_OPTIONS=print_stacktrace=1 \
  "$python" tests/core/run_sanitized.py "$folder" tests/test_core_parity.py tests/test_core_runs.py tests/test_core_threads.py tests/test_exponential.py \
  --capture=sys -k "not ctrl_c and not shipped_scenario and not RK4" "$@"
