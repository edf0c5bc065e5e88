#!/usr/bin/env bash
# The whole suite again and again, where a test that leans on chance falls over: tests in random order, two busy processes
# beside them, another kernel of OpenBLAS each time.      bash scripts/soak.sh [TIMES, 20]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
times=${1:-20}
kernels=(Haswell Zen)
grep -qw avx512f /proc/cpuinfo && kernels+=(SkylakeX)
mkdir -p build/soak

busy=()
trap 'kill "${busy[@]}" 2>/dev/null || true' EXIT
for _ in 1 2; do
    (while :; do :; done) &
    busy+=($!)
done

passed=0
for ((i = 1; i <= times; i++)); do
    kernel=${kernels[$(((i - 1) % ${#kernels[@]}))]}
    log=build/soak/$i-$kernel.log
    if OPENBLAS_CORETYPE=$kernel bash scripts/test.sh -p randomly >"$log" 2>&1; then
        passed=$((passed + 1))
        echo "$i $kernel passed"
    else
        echo "$i $kernel FAILED:"
        grep -E "^(FAILED|ERROR)|Using --randomly-seed" "$log" || tail -5 "$log"
    fi
done
echo "$passed of $times passed; logs in build/soak"
[ "$passed" = "$times" ]
