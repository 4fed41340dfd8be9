#!/usr/bin/env bash
# Makes data/pendulum/free_swing.csv: the simulated swing of problems/pendulum/swing.json with repeatable noise.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
out="$(mktemp -d)"
trap 'rm -rf "$out"' EXIT
./dev run simulate problems/pendulum/swing.json --out "$out/run" --quiet
# Sum of twelve uniform numbers minus six: close to normal with unit variance. Generator: x <- 16807 x mod (2^31 - 1).
awk -F, 'BEGIN { x = 20240917; print "t,theta" }
  function uniform() { x = (16807 * x) % 2147483647; return x / 2147483647 }
  NR == 1 { for (i = 1; i <= NF; ++i) column[$i] = i; next }
  { noise = -6; for (k = 0; k < 12; ++k) noise += uniform()
    printf "%.3f,%.6f\n", $column["t"], $column["theta"] + 0.005 * noise }' "$out/run/trajectory.csv" >data/pendulum/free_swing.csv
