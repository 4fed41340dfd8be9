#!/usr/bin/env python3
"""Times `mbsopt identify` against scipy's least_squares on a model written by hand in C, in turn within one run.

    bench/peers/identify_scipy.py PROGRAM [ROUNDS]

The model is that of problems/double_pendulum/identify_windows.json: a record of 16 s at 100 Hz in 16 windows of 1 s, 8
shared parameters and 64 of the starts. The C model takes steps of RK4 between the samples. Its Jacobian is by forward
differences, of each window in its own 12 parameters only. Both programs are on one core, mbsopt then on two. Times are
medians. Processor times count all cores; that of the fit of mbsopt is what the command takes beyond --preflight, which
checks, compares derivatives with differences and simulates once. Needs numpy, scipy and a C compiler.
"""
import ctypes
import json
import math
import os
import pathlib
import random
import resource
import statistics
import subprocess
import sys
import tempfile
import time

for library in ("OPENBLAS", "OMP", "MKL"):
    os.environ[f"{library}_NUM_THREADS"] = "1"
import numpy as np
from scipy.optimize import least_squares

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROBLEM = str(ROOT / "problems/double_pendulum/identify_windows.json")
TRUTH = {"h1": 0.25, "J1": 0.06, "h2": 0.16, "J2": 0.05, "coulomb1": 0.1, "coulomb2": 0.08,
         "viscous1": 0.02, "viscous2": 0.01}
START = [0.2, 0.05, 0.12, 0.06, 0.15, 0.15, 0, 0]  # of the problem file, as its bounds
LOWER, UPPER = [0.05, 0.03, 0.02, 0.01, 0, 0, 0, 0], [1, 0.5, 0.5, 0.3, 1, 1, 0.2, 0.2]
COLUMNS = ["pos_meas1", "pos_meas2", "vel_meas1", "vel_meas2"]
STEP, ROWS, WINDOWS, SIGMA, TOLERANCE = 0.01, 1601, 16, 0.005, 1e-8
SUBSTEPS, RTOL = 2, 1e-6  # of RK4 per sample, of DOPRI5: either raises the least cost by 4e-4 of itself

MODEL = r"""
#include <math.h>
/* y = (q1, q2, q1', q2'), p = h1 J1 h2 J2 coulomb1 coulomb2 viscous1 viscous2; M(q2) q'' = tau - friction - c - g */
static void rates(const double *p, const double *y, double tau1, double tau2, double *f) {
  const double l1 = 0.2, g = 9.81, s = 0.1, w1 = y[2], w2 = y[3];
  const double h = p[2] * l1, C = h * cos(y[1]), S = h * sin(y[1]), g2 = g * p[2] * sin(y[0] + y[1]);
  const double r1 = tau1 - p[4] * w1 / sqrt(w1 * w1 + s * s) - p[6] * w1 + S * (2 * w1 + w2) * w2
                    - g * p[0] * sin(y[0]) - g2;
  const double r2 = tau2 - p[5] * w2 / sqrt(w2 * w2 + s * s) - p[7] * w2 - S * w1 * w1 - g2;
  const double m11 = p[1] + p[3] + 2 * C, m12 = p[3] + C, m22 = p[3], det = m11 * m22 - m12 * m12;
  f[0] = w1, f[1] = w2, f[2] = (m22 * r1 - m12 * r2) / det, f[3] = (m11 * r2 - m12 * r1) / det;
}
/* n samples from y0 on, with torques at the samples */
void motion(const double *p, const double *y0, const double *tau, int n, int substeps, double step, double *out) {
  double y[4], k[4][4], z[4];
  const double h = step / substeps;
  for (int i = 0; i < 4; ++i) out[i] = y[i] = y0[i];
  for (int row = 1; row < n; ++row) {
    const double *a = tau + 2 * (row - 1), *b = a + 2;
    for (int sub = 0; sub < substeps; ++sub) {
      for (int stage = 0; stage < 4; ++stage) {
        const double c = stage == 0 ? 0 : stage == 3 ? 1 : 0.5, x = (sub + c) / substeps;
        for (int i = 0; i < 4; ++i) z[i] = stage == 0 ? y[i] : y[i] + c * h * k[stage - 1][i];
        rates(p, z, a[0] + x * (b[0] - a[0]), a[1] + x * (b[1] - a[1]), k[stage]);
      }
      for (int i = 0; i < 4; ++i) y[i] += h / 6 * (k[0][i] + 2 * k[1][i] + 2 * k[2][i] + k[3][i]);
    }
    for (int i = 0; i < 4; ++i) out[4 * row + i] = y[i];
  }
}
"""


def run(program, command, folder, sets, *more):
    """result.json and the processor time of the command."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([program, command, PROBLEM, "--out", str(folder), "--quiet", *more] +
                          [x for s in sets for x in ("--set", s)], capture_output=True, text=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode:
        raise SystemExit(f"{command}: {done.stderr}")
    used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return json.loads((folder / "result.json").read_text()), used


def make_record(program, folder):
    rng = random.Random(1)
    waves = [[(rng.uniform(0.15, 0.4), rng.uniform(3, 11), rng.uniform(0, 2 * math.pi)) for _ in range(3)]
             for _ in range(2)]
    rows = ["time,tau_meas1,tau_meas2"] + [
        ",".join(f"{x:.6f}" for x in [i * STEP] + [sum(a * math.sin(w * i * STEP + p) for a, w, p in wave)
                                                   for wave in waves]) for i in range(ROWS)]
    (folder / "torque.csv").write_text("\n".join(rows) + "\n")
    signals = [f"signals.tau{i}.file={folder / 'torque.csv'}" for i in (1, 2)]
    run(program, "simulate", folder / "motion", signals + [f"parameters.{k}.value={v}" for k, v in TRUTH.items()] + [
        f"simulation.end_time={STEP * (ROWS - 1)}", f"simulation.output_step={STEP}"])
    motion = np.genfromtxt(folder / "motion/trajectory.csv", delimiter=",", names=True)
    measured = np.column_stack([motion[c] for c in COLUMNS])
    measured += SIGMA * np.random.default_rng(1).standard_normal(measured.shape)
    np.savetxt(folder / "record.csv", np.column_stack([STEP * np.arange(ROWS), measured]), fmt="%.7g", delimiter=",",
               header=",".join(["time"] + COLUMNS), comments="")
    return signals, measured, np.genfromtxt(folder / "torque.csv", delimiter=",", skip_header=1)[:, 1:].copy()


class HandWritten:
    """Residuals and Jacobian by the C model."""

    def __init__(self, folder, measured, torque):
        (folder / "model.c").write_text(MODEL)
        library = str(folder / "model.so")
        source = str(folder / "model.c")
        subprocess.run(["cc", "-O3", "-march=native", "-shared", "-fPIC", source, "-o", library, "-lm"], check=True)
        self.call = ctypes.CDLL(library).motion
        self.measured, self.torque = measured, torque
        rows = (ROWS - 1) // WINDOWS
        self.windows = [(i * rows, (i + 1) * rows + (i == WINDOWS - 1)) for i in range(WINDOWS)]  # samples once

    def motion(self, p, y0, first, end):
        out = np.empty((end - first, 4))
        pointer = lambda a: a.ctypes.data_as(ctypes.c_void_p)
        self.call(pointer(p), pointer(y0), pointer(self.torque[first:]), end - first, SUBSTEPS, ctypes.c_double(STEP),
                  pointer(out))
        return out.ravel()

    def split(self, u, i):
        return np.ascontiguousarray(u[:8]), np.ascontiguousarray(u[8 + 4 * i:12 + 4 * i])

    def residuals(self, u):
        model = [self.motion(*self.split(u, i), *w) for i, w in enumerate(self.windows)]
        return (np.concatenate(model) - self.measured.ravel()) / SIGMA

    def jacobian(self, u):
        J = np.zeros((self.measured.size, u.size))
        for i, (first, end) in enumerate(self.windows):
            base = self.motion(*self.split(u, i), first, end)
            for k in [*range(8), *range(8 + 4 * i, 12 + 4 * i)]:
                moved, h = u.copy(), 1e-7 * max(1, abs(u[k]))
                moved[k] += h
                J[4 * first:4 * end, k] = (self.motion(*self.split(moved, i), first, end) - base) / (h * SIGMA)
        return J

    def fit(self):
        starts = np.concatenate([self.measured[first] for first, _ in self.windows])
        free = np.full(starts.size, np.inf)
        begin, used = time.perf_counter(), time.process_time()
        found = least_squares(self.residuals, np.concatenate([START, starts]), self.jacobian, x_scale="jac",
                              bounds=(np.concatenate([LOWER, -free]), np.concatenate([UPPER, free])), ftol=TOLERANCE)
        return found, time.perf_counter() - begin, time.process_time() - used


def main():
    program, rounds = str(pathlib.Path(sys.argv[1]).resolve()), int(sys.argv[2]) if len(sys.argv) > 2 else 5
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        signals, measured, torque = make_record(program, folder)
        by_hand = HandWritten(folder, measured, torque)
        sets = signals + [f"identification.experiments[0].{s}" for s in
                          [f"data={folder / 'record.csv'}", "windows.length=1"] +
                          [f"channels[{c}].estimate_sigma=false" for c in range(4)]] + [
            f"simulation.integrator.rtol={RTOL}", f"simulation.integrator.atol={RTOL / 100}",
            f"identification.optimizer.tolerance={TOLERANCE}"]
        rows = {"scipy, C by hand": [], "mbsopt, one core": [], "mbsopt, two cores": []}
        for _ in range(rounds):
            found, elapsed, used = by_hand.fit()
            rows["scipy, C by hand"].append((found.nfev, elapsed, used, math.nan))
            for threads, row in (("1", "mbsopt, one core"), ("2", "mbsopt, two cores")):
                _, before = run(program, "identify", folder / "fit", sets, "--threads", threads, "--preflight")
                result, command = run(program, "identify", folder / "fit", sets, "--threads", threads)
                fit = result["optimizer"]
                rows[row].append((fit["evaluations"], fit["wall_seconds"], command - before, command))
        found_values = [result["parameters"][k] for k in TRUTH]
        apart = max(abs(x - p["value"]) / p["std_error"] for x, p in zip(found.x, found_values))
    print("| program | evaluations | fit, elapsed [s] | fit, processor [s] | command, processor [s] |\n"
          "| --- | --- | --- | --- | --- |")
    for row, values in rows.items():
        cells = [statistics.median(column) for column in zip(*values)]
        seconds = ["" if math.isnan(c) else f"{c:.2f}" for c in cells[1:]]
        print(f"| {row} | {cells[0]:.0f} | " + " | ".join(seconds) + " |")
    print(f"\nThe costs are {found.cost:.1f} and {fit['objective_final']:.1f}. The shared parameters differ by at most "
          f"{apart:.2g} standard errors.")


main()
