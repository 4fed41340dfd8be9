#!/usr/bin/env bash
# Makes data/crane/trolley.csv and slow.csv: a trolley's travel of 4 m in 4 s and in 5 s, and standstill after it, at
# 5 Hz, rounded to 0.1 mm as a log would be: x = 4 m (10 s^3 - 15 s^4 + 6 s^5), s = t/4 s or t/5 s.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
mkdir -p data/crane
travel() {
  awk -v duration="$1" 'BEGIN {
    print "t,x"
    for (i = 0; i <= 30; ++i) {
      s = i / 5 < duration ? i / 5 / duration : 1
      printf "%.1f,%.4f\n", i / 5, 4 * s^3 * (10 - 15 * s + 6 * s^2)
    }
  }'
}
travel 4 >data/crane/trolley.csv
travel 5 >data/crane/slow.csv
