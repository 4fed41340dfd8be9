#!/usr/bin/env bash
# Makes the records in data/identification/: motions of the problems that identify, simulated at known parameters, with
# repeatable noise.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
out="$(mktemp -d)"
trap 'rm -rf "$out"' EXIT
mkdir -p data/identification

# motion NAME PROBLEM SET...: the trajectory at other values of the parameters
motion() {
  local name="$1" problem="$2" sets=()
  shift 2
  for set in "$@"; do sets+=(--set "$set"); done
  ./dev run simulate "problems/$problem.json" --out "$out/$name" --quiet "${sets[@]}" \
    --set simulation.integrator.rtol=1e-11 --set simulation.integrator.atol=1e-13
}

# record NAME SEED SIGMA COLUMN...: these columns with noise. Sum of twelve uniform numbers minus six: close to normal
# with unit variance. Generator: x <- 16807 x mod (2^31 - 1). Environment: LATE [s] and FAST: a stamp t is that of the
# instant t - LATE - FAST t; OFFSET + DRIFT t is in the columns; WRONG (every so many rows a gross error, of 20 to 60
# sigma); DIALECT=semicolon (with decimal commas).
record() {
  local name="$1" seed="$2" sigma="$3"
  shift 3
  awk -F, -v seed="$seed" -v sigma="$sigma" -v wanted="$*" -v late="${LATE:-0}" -v fast="${FAST:-0}" \
    -v offset="${OFFSET:-0}" -v drift="${DRIFT:-0}" -v wrong="${WRONG:-0}" '
    function uniform() { x = (16807 * x) % 2147483647; return x / 2147483647 }
    function normal(  k, sum) { sum = -6; for (k = 0; k < 12; ++k) sum += uniform(); return sum }
    BEGIN { x = seed; n = split(wanted, name, " "); printf "t"; for (k = 1; k <= n; ++k) printf ",%s", name[k]; print "" }
    NR == 1 { for (i = 1; i <= NF; ++i) column[$i] = i; next }
    { t = ($column["t"] + late) / (1 - fast)
      printf "%.4f", t
      for (k = 1; k <= n; ++k) {
        error = sigma * normal() + offset + drift * t
        if (wrong && NR % wrong == 5) error += sigma * (20 + 40 * uniform())
        printf ",%.6f", $column[name[k]] + error
      }
      print "" }' "$out/$name/trajectory.csv" |
    if [[ "${DIALECT:-comma}" == semicolon ]]; then tr ',.' ';,'; else cat; fi >"data/identification/$name.csv"
}

# A problem is read with its records, so that there must be some to begin with.
for name in release_empty release_loaded inertia_markers ride_slow ride_fast run_down; do
  printf 't,x,z,omega,Ax,Ay,Az,Bx,By,Bz\n%s\n' 1,0,0,0,0,0,0,0,0,0 >"data/identification/$name.csv"
done

# Roads: sums of sines that start with no height and no speed.
awk 'BEGIN { print "t,road"; for (i = 0; i <= 420; ++i) { t = i / 100
  printf "%.2f,%.6f\n", t, 0.04 * (sin(5 * t) - sin(2.5 * t) * 2) } }' >data/identification/road_slow.csv
awk 'BEGIN { print "t,road"; for (i = 0; i <= 420; ++i) { t = i / 100
  printf "%.2f,%.6f\n", t, 0.02 * (sin(14 * t) - 14. / 9 * sin(9 * t)) + 0.01 * (sin(21 * t) - 21. / 3 * sin(3 * t)) } }' \
  >data/identification/road_fast.csv
truth=(parameters.m.value=4 parameters.k.value=250 parameters.c.value=3)
motion release_empty spring_damper/identify "${truth[@]}" parameters.x0.value=0.12 parameters.v0.value=0.05
motion release_loaded spring_damper/identify "${truth[@]}" parameters.x0.value=0.09 parameters.v0.value=-0.1 \
  parameters.load.value=1.5
record release_empty 11 0.001 x
record release_loaded 12 0.001 x

motion inertia_markers double_pendulum/identify_inertia parameters.m.value=1.8 parameters.cx.value=0.03 \
  parameters.cy.value=-0.02 parameters.cz.value=-0.25 parameters.ex.value=0.05 parameters.ey.value=0.08 \
  parameters.ez.value=0.12 parameters.sxy.value=0.01 parameters.sxz.value=-0.02 parameters.syz.value=0.015
record inertia_markers 13 0.0005 Ax Ay Az Bx By Bz

truth=(parameters.k.value=18000 parameters.c.value=1500 parameters.r.value=600 parameters.vs.value=0.4)
for ride in slow fast; do
  motion "ride_$ride" damper/identify_law "${truth[@]}" \
    "drives[0].law={\"csv\": \"../../data/identification/road_$ride.csv\", \"time\": \"t\", \"column\": \"road\"}"
done
LATE=0.012 record ride_slow 14 0.0005 z
LATE=0.012 record ride_fast 15 0.0005 z

motion run_down friction/identify parameters.coulomb.value=1.2 parameters.viscous.value=0.05 parameters.slip.value=0.4 \
  parameters.omega0.value=20
WRONG=20 DIALECT=semicolon record run_down 16 0.05 omega

printf 't,theta\n1,0\n' >data/identification/swing_angle.csv
printf 't,omega\n1,0\n' >data/identification/swing_rate.csv
for name in swing_angle swing_rate; do
  motion $name pendulum/gyroscope parameters.J.value=0.00334 parameters.k.value=1.8e-4 parameters.theta0.value=1.52 \
    parameters.omega0.value=1.85
done
record swing_angle 19 0.005 theta
LATE=0.03 FAST=0.002 OFFSET=0.05 DRIFT=0.01 record swing_rate 20 0.02 omega

# The arm's torques, and its motion by them from rest. Its columns are those of an arm with measured torques.
awk 'BEGIN { print "time,tau_meas1,tau_meas2"; for (i = 0; i <= 400; ++i) { t = i / 100
  printf "%.2f,%.6f,%.6f\n", t, 0.5 * sin(4.5 * t) + 0.3 * sin(7.9 * t), 0.4 * sin(5.7 * t) - 0.3 * sin(10.3 * t) } }' \
  >data/identification/arm_torque.csv
printf 'time,pos_meas1,pos_meas2,vel_meas1,vel_meas2\n0,0,0,0,0\n1,0,0,0,0\n4,0,0,0,0\n' >data/identification/arm.csv
motion arm double_pendulum/identify_windows parameters.h1.value=0.25 parameters.J1.value=0.06 parameters.h2.value=0.16 \
  parameters.J2.value=0.05 parameters.coulomb1.value=0.1 parameters.coulomb2.value=0.08 parameters.viscous1.value=0.02 \
  parameters.viscous2.value=0.01
record arm 17 0.005 pos_meas1 pos_meas2 vel_meas1 vel_meas2
sed -i '1s/^t,/time,/' data/identification/arm.csv
data/smooth_motion.py data/identification/arm.csv 0.04 time pos_meas1:vel_meas1 pos_meas2:vel_meas2 \
  >data/identification/arm_smooth.csv

printf 't,angle1,angle2\n0,0,0\n1,0,0\n5,0,0\n' >data/identification/tumbling.csv
motion tumbling double_pendulum/identify_tumbling simulation.end_time=5 parameters.J1.value=0.06 \
  parameters.h2.value=0.16 \
  parameters.J2.value=0.05 parameters.viscous1.value=0.002 parameters.viscous2.value=0.001
record tumbling 18 0.003 angle1 angle2
