#!/usr/bin/env bash
# Makes data/crane/trolley.csv: a trolley's travel of 4 m in 4 s and standstill after it, at 5 Hz, rounded to 0.1 mm as a
# log would be: x = 4 m (10 s^3 - 15 s^4 + 6 s^5), s = t/4 s.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
mkdir -p data/crane
awk 'BEGIN {
  print "t,x"
  for (i = 0; i <= 30; ++i) {
    s = i < 20 ? i / 20 : 1
    printf "%.1f,%.4f\n", i / 5, 4 * s^3 * (10 - 15 * s + 6 * s^2)
  }
}' >data/crane/trolley.csv
