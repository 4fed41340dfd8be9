#!/usr/bin/env python3
"""Times `mbsopt identify` against scipy's least_squares on models written by hand in C, in turn within one run.

    bench/peers/identify_scipy.py PROGRAM [ROUNDS] [DATA]

Tasks: the arm of problems/double_pendulum/identify_windows.json on a synthetic record of 16 s at 100 Hz in 16 windows
of 1 s, 8 shared parameters and 64 of the starts; and, where DATA (../shared/data) has them, two measured records in
windows of 0.5 s: the same arm from 0.5 to 4.5 s, and a joint whose motor's current gives its torque.

The C models take steps of RK4 between the samples. Their Jacobians are by forward differences, of each window in its
own unknowns only. mbsopt takes steps of the third order (bs3), which suit torques with a kink at every sample. Sigmas
are given. Both programs are on one core, mbsopt then on two. Times are medians. Processor times count all cores; that
of the fit of mbsopt with its n evaluations is n/(n - 1) times what the command takes beyond --preflight, which checks,
compares derivatives with differences, and evaluates once. Needs numpy, scipy and a C compiler.
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
ARM = ROOT / "problems/double_pendulum/identify_windows.json"
TRUTH = {"h1": 0.25, "J1": 0.06, "h2": 0.16, "J2": 0.05, "coulomb1": 0.1, "coulomb2": 0.08,
         "viscous1": 0.02, "viscous2": 0.01}
COLUMNS = ["pos_meas1", "pos_meas2", "vel_meas1", "vel_meas2"]

# y' = f(p, y, tau): n states, torques at the samples between which they are linear.
MOTION = r"""
#include <math.h>
void motion(const double *p, const double *y0, const double *t, const double *tau, int n, int substeps, double *out) {
  double y[N], k[4][N], z[N], torque[T];
  for (int i = 0; i < N; ++i) out[i] = y[i] = y0[i];
  for (int row = 1; row < n; ++row) {
    const double *a = tau + T * (row - 1), *b = a + T, h = (t[row] - t[row - 1]) / substeps;
    for (int sub = 0; sub < substeps; ++sub) {
      for (int stage = 0; stage < 4; ++stage) {
        const double c = stage == 0 ? 0 : stage == 3 ? 1 : 0.5, x = (sub + c) / substeps;
        for (int i = 0; i < N; ++i) z[i] = stage == 0 ? y[i] : y[i] + c * h * k[stage - 1][i];
        for (int i = 0; i < T; ++i) torque[i] = a[i] + x * (b[i] - a[i]);
        rates(p, z, torque, k[stage]);
      }
      for (int i = 0; i < N; ++i) y[i] += h / 6 * (k[0][i] + 2 * k[1][i] + 2 * k[2][i] + k[3][i]);
    }
    for (int i = 0; i < N; ++i) out[N * row + i] = y[i];
  }
}
"""

# p = h1 J1 h2 J2 coulomb1 coulomb2 viscous1 viscous2, y = (q1, q2, q1', q2'): M(q2) q'' = tau - friction - c - g
ARM_MODEL = r"""
#include <math.h>
enum { N = 4, T = 2 };
static inline void rates(const double *p, const double *y, const double *tau, double *f) {
  const double l1 = 0.2, g = 9.81, s = 0.1, w1 = y[2], w2 = y[3];
  const double h = p[2] * l1, C = h * cos(y[1]), S = h * sin(y[1]), g2 = g * p[2] * sin(y[0] + y[1]);
  const double r1 = tau[0] - p[4] * w1 / sqrt(w1 * w1 + s * s) - p[6] * w1 + S * (2 * w1 + w2) * w2
                    - g * p[0] * sin(y[0]) - g2;
  const double r2 = tau[1] - p[5] * w2 / sqrt(w2 * w2 + s * s) - p[7] * w2 - S * w1 * w1 - g2;
  const double m11 = p[1] + p[3] + 2 * C, m12 = p[3] + C, m22 = p[3], det = m11 * m22 - m12 * m12;
  f[0] = w1, f[1] = w2, f[2] = (m22 * r1 - m12 * r2) / det, f[3] = (m11 * r2 - m12 * r1) / det;
}
""" + MOTION

# p = J h coulomb viscous offset, y = (q, q'): J q'' = tau - offset - g h sin q - friction
JOINT_MODEL = r"""
#include <math.h>
enum { N = 2, T = 1 };
static inline void rates(const double *p, const double *y, const double *tau, double *f) {
  const double w = y[1];
  f[0] = w;
  f[1] = (tau[0] - p[4] - 9.81 * p[1] * sin(y[0]) - p[2] * w / sqrt(w * w + 0.01) - p[3] * w) / p[0];
}
""" + MOTION


def joint_problem(record):
    """The joint as a problem file."""
    bounds = {"J": (0.08, 0.01, 1, "kg m^2"), "h": (0.15, 0.01, 1, "kg m"), "coulomb": (0.1, 0, 1, "N m"),
              "viscous": (0.02, 0, 1, "N m s/rad"), "offset": (0, -1, 1, "N m")}
    parameters = {k: dict(zip(("value", "lower", "upper", "unit"), v)) for k, v in bounds.items()}
    parameters |= {"q": {"value": 0, "unit": "rad"}, "w": {"value": 0, "unit": "rad/s"}}
    z = [0, 0, 1]
    return {
        "format": 1, "name": "joint", "gravity": [0, -9.81, 0], "parameters": parameters,
        "definitions": {"m": 1, "c": "h/m", "I": "J - m*c^2"},
        "signals": {"tau": {"file": record, "column": "torque", "time": "time", "interpolation": "linear"}},
        "bodies": [{"name": "arm", "mass": "m", "com": ["c", 0, 0], "inertia": ["I/2", "I/2", "I"],
                    "orientation": {"axis": z, "angle": "-90 [deg]"}}],
        "joints": [{"name": "shaft", "type": "revolute", "body2": "arm", "axis1": z, "axis2": z,
                    "normal1": [0, -1, 0], "normal2": [1, 0, 0]}],
        "forces": [{"name": "motor", "type": "torque", "body": "arm", "components": [0, 0, "tau - offset"]},
                   {"name": "friction", "type": "friction", "joint": "shaft", "coulomb": "coulomb",
                    "viscous": "viscous", "smooth_velocity": 0.1}],
        "initial": {"conditions": [{"sensor": "position", "value": "q", "rate": "w"}]},
        "sensors": {"position": {"quantity": "angle", "joint": "shaft"},
                    "velocity": {"quantity": "rate", "joint": "shaft"}},
        "simulation": {"end_time": 3, "integrator": {"type": "dopri5"}},
        "identification": {
            "experiments": [{"name": "joint", "data": record, "time": "time", "free": ["q", "w"],
                             "channels": [{"column": "position", "sensor": "position"},
                                          {"column": "velocity", "sensor": "velocity"}],
                             "windows": {"length": 0.5}}],
            "variables": list(bounds)}}


class Task:
    """A fit by both programs. windows: (start, end, length); rtol: of bs3, substeps: of RK4 between two samples."""

    def __init__(self, name, problem, sets, record, torques, channels, sigmas, windows, model, rtol, substeps):
        self.name, self.problem, self.model, self.substeps = name, str(problem), model, substeps
        start, end, length = windows
        experiment = "identification.experiments[0]."
        self.sets = sets + ["simulation.integrator.type=bs3", f"simulation.integrator.rtol={rtol}",
                            f"simulation.integrator.atol={rtol / 100}",
                            f"{experiment}windows.start_time={start}", f"{experiment}windows.end_time={end}",
                            f"{experiment}windows.length={length}", "identification.optimizer.tolerance=1e-8"]
        for c, sigma in enumerate(sigmas):
            self.sets += [f"{experiment}channels[{c}].sigma={sigma}", f"{experiment}channels[{c}].estimate_sigma=false"]
        self.t = np.ascontiguousarray(record["time"])
        self.measured = np.column_stack([record[c] for c in channels])
        self.torque, self.sigma = np.column_stack([record[c] for c in torques]), np.array(sigmas)
        count = max(1, round((end - start) / length))
        edges = [np.searchsorted(self.t, start + i * length) for i in range(count)]
        edges.append(np.searchsorted(self.t, end, side="right"))
        self.windows = list(zip(edges, edges[1:]))
        problem = json.loads("\n".join(line for line in pathlib.Path(problem).read_text().splitlines()
                                       if not line.lstrip().startswith("//")))
        self.names = problem["identification"]["variables"]
        shared = [problem["parameters"][k] for k in self.names]
        starts = [problem["parameters"][k]["value"] for k in self.names]
        free = np.full(len(channels) * count, np.inf)
        self.start = np.concatenate([starts] + [self.measured[first] for first, _ in self.windows])
        self.bounds = (np.concatenate([[p["lower"] for p in shared], -free]),
                       np.concatenate([[p["upper"] for p in shared], free]))

    def build(self, folder):
        (folder / "model.c").write_text(self.model)
        library = str(folder / f"{self.name.split()[0]}_{len(self.windows)}.so")
        subprocess.run(["cc", "-O3", "-march=native", "-shared", "-fPIC", str(folder / "model.c"), "-o", library,
                        "-lm"], check=True)
        self.call = ctypes.CDLL(library).motion

    def motion(self, p, y0, first, end):
        out = np.empty((end - first, self.measured.shape[1]))
        pointer = lambda a: a.ctypes.data_as(ctypes.c_void_p)
        self.call(pointer(p), pointer(y0), pointer(self.t[first:]), pointer(self.torque[first:]), int(end - first),
                  self.substeps, pointer(out))
        return out / self.sigma

    def own(self, i):
        shared, n = len(self.names), self.measured.shape[1]
        return range(shared + n * i, shared + n * (i + 1))

    def split(self, u, i):
        return np.ascontiguousarray(u[:len(self.names)]), np.ascontiguousarray(u[self.own(i)])

    def residuals(self, u):
        model = [self.motion(*self.split(u, i), *w) for i, w in enumerate(self.windows)]
        first, end = self.windows[0][0], self.windows[-1][1]
        return (np.concatenate(model) - self.measured[first:end] / self.sigma).ravel()

    def jacobian(self, u):
        n, rows = self.measured.shape[1], 0
        J = np.zeros((n * (self.windows[-1][1] - self.windows[0][0]), u.size))
        for i, (first, end) in enumerate(self.windows):
            base = self.motion(*self.split(u, i), first, end)
            for k in [*range(len(self.names)), *self.own(i)]:
                moved, h = u.copy(), 1e-7 * max(1, abs(u[k]))
                moved[k] += h
                J[rows:rows + base.size, k] = (self.motion(*self.split(moved, i), first, end) - base).ravel() / h
            rows += base.size
        return J

    def fit(self):
        begin, used = time.perf_counter(), time.process_time()
        found = least_squares(self.residuals, self.start, self.jacobian, x_scale="jac", bounds=self.bounds, ftol=1e-8)
        return found, time.perf_counter() - begin, time.process_time() - used


def run(program, command, problem, folder, sets, *more):
    """result.json and the processor time of the command."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([program, command, problem, "--out", str(folder), "--quiet", *more] +
                          [x for s in sets for x in ("--set", s)], capture_output=True, text=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode:
        raise SystemExit(f"{command}: {done.stderr}")
    used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return json.loads((folder / "result.json").read_text()), used


def synthetic_arm(program, folder):
    step, rows, sigma = 0.01, 1601, 0.005
    rng = random.Random(1)
    waves = [[(rng.uniform(0.15, 0.4), rng.uniform(3, 11), rng.uniform(0, 2 * math.pi)) for _ in range(3)]
             for _ in range(2)]
    lines = ["time,tau_meas1,tau_meas2"] + [
        ",".join(f"{x:.6f}" for x in [i * step] + [sum(a * math.sin(w * i * step + p) for a, w, p in wave)
                                                   for wave in waves]) for i in range(rows)]
    (folder / "torque.csv").write_text("\n".join(lines) + "\n")
    signals = [f"signals.tau{i}.file={folder / 'torque.csv'}" for i in (1, 2)]
    truth = [f"parameters.{k}.value={v}" for k, v in TRUTH.items()]
    run(program, "simulate", str(ARM), folder / "motion",
        signals + truth + [f"simulation.end_time={step * (rows - 1)}", f"simulation.output_step={step}"])
    motion = np.genfromtxt(folder / "motion/trajectory.csv", delimiter=",", names=True)
    measured = np.column_stack([motion[c] for c in COLUMNS])
    measured += sigma * np.random.default_rng(1).standard_normal(measured.shape)
    np.savetxt(folder / "record.csv", np.column_stack([step * np.arange(rows), measured]), fmt="%.7g", delimiter=",",
               header=",".join(["time"] + COLUMNS), comments="")
    record = np.genfromtxt(folder / "record.csv", delimiter=",", names=True)
    torque = np.genfromtxt(folder / "torque.csv", delimiter=",", names=True)
    record = {name: record[name] for name in record.dtype.names} | {c: torque[c] for c in ("tau_meas1", "tau_meas2")}
    # Both integrate so that the least cost is right to 4e-4 of itself.
    return Task("arm, synthetic, 16 s", ARM, signals + [f"identification.experiments[0].data={folder / 'record.csv'}"],
                record, ["tau_meas1", "tau_meas2"], COLUMNS, [sigma] * 4, (0, 16, 1), ARM_MODEL, 1e-4, 2)


def measured_tasks(folder, data):
    tasks = []
    record = data / "measured/dfki_double_pendulum_torque/record.csv"
    if record.exists():
        sets = [f"signals.tau{i}.file={record}" for i in (1, 2)] + [f"identification.experiments[0].data={record}"]
        tasks.append(Task("arm, measured, 4 s", ARM, sets, np.genfromtxt(record, delimiter=",", names=True),
                          ["tau_meas1", "tau_meas2"], COLUMNS, [0.008, 0.008, 0.25, 0.25], (0.5, 4.5, 0.5), ARM_MODEL,
                          1e-5, 1))
    record = data / "measured/dfki_simple_pendulum_torque/pd_sysid_measured.csv"
    if record.exists():
        (folder / "joint.json").write_text(json.dumps(joint_problem(str(record))))
        tasks.append(Task("joint, measured, 3.5 s", folder / "joint.json", [],
                          np.genfromtxt(record, delimiter=",", names=True), ["torque"], ["position", "velocity"],
                          [0.03, 0.6], (0, 3.5, 0.5), JOINT_MODEL, 1e-4, 1))
    return tasks


def compare(task, program, folder, rounds):
    task.build(folder)
    fit_folder = folder / f"fit{len(task.start)}"
    rows = {"scipy, C by hand": [], "mbsopt, one core": [], "mbsopt, two cores": []}
    for _ in range(rounds):
        found, elapsed, used = task.fit()
        rows["scipy, C by hand"].append((found.nfev, elapsed, used, math.nan, math.nan))
        for threads, row in (("1", "mbsopt, one core"), ("2", "mbsopt, two cores")):
            _, before = run(program, "identify", task.problem, fit_folder, task.sets, "--threads", threads,
                            "--preflight")
            begin = time.perf_counter()
            result, command = run(program, "identify", task.problem, fit_folder, task.sets, "--threads", threads)
            whole, fit = time.perf_counter() - begin, result["optimizer"]
            n = fit["evaluations"]
            rows[row].append((n, fit["wall_seconds"], n / (n - 1) * (command - before), whole, command))
    for row, values in rows.items():
        cells = [statistics.median(column) for column in zip(*values)]
        seconds = ["" if math.isnan(c) else f"{c:.2f}" for c in cells[1:]]
        print(f"| {task.name} | {len(task.start)} | {row} | {cells[0]:.0f} | " + " | ".join(seconds) + " |")
    apart = max(abs(x - result["parameters"][k]["value"]) / result["parameters"][k]["std_error"]
                for x, k in zip(found.x, task.names))
    return (f"{task.name}: the costs are {found.cost:.1f} and {fit['objective_final']:.1f}, parameters are at most "
            f"{apart:.2g} standard errors apart")


def main():
    program, rounds = str(pathlib.Path(sys.argv[1]).resolve()), int(sys.argv[2]) if len(sys.argv) > 2 else 5
    data = pathlib.Path(sys.argv[3] if len(sys.argv) > 3 else ROOT / "../shared/data").resolve()
    print("| task | unknowns | program | evaluations | fit, elapsed [s] | fit, processor [s] | command, elapsed [s] | "
          "command, processor [s] |\n| --- | --- | --- | --- | --- | --- | --- | --- |")
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        tasks = [synthetic_arm(program, folder)] + measured_tasks(folder, data)
        words = [compare(task, program, folder, rounds) for task in tasks]
    print("\n" + "\n".join(words))


main()
