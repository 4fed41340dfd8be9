#!/usr/bin/env python3
"""Compares designs by mbsopt with those of scipy on a model in closed form of the same problem.

    bench/optimise.py PROGRAM        or ./dev bench --scipy

Prints a table: the objective, evaluations and processor time of the search of both, and the ratio of the times. The
files of problems/ are solved in their plain form, without `optimizer`; scipy starts where they do, with variables
scaled to their bounds and derivatives by differences. Needs python3-scipy.
"""

import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares, minimize

PROBLEMS = Path(__file__).resolve().parent.parent / "problems"


class Model:
    """A problem with its start and bounds; `evaluations` counts calls of the model."""

    def __init__(self, start, lower, upper, logarithmic=False):
        scale = np.log if logarithmic else np.asarray
        self.lower, self.width = scale(lower), scale(upper) - scale(lower)
        self.start = (scale(start) - self.lower) / self.width
        self.logarithmic, self.evaluations = logarithmic, 0

    def parameters(self, x):
        self.evaluations += 1
        p = self.lower + x * self.width
        return np.exp(p) if self.logarithmic else p

    def by_slsqp(self, f, limits=()):
        found = minimize(f, self.start, method="SLSQP", bounds=[(0, 1)] * len(self.start), constraints=limits,
                         options={"maxiter": 500, "ftol": 1e-12})
        return found.fun


def absorber():
    """Least largest answer of a machine with an absorber: a bound t above the answers at 400 frequencies."""
    model = Model([12000, 100], [1000, 1], [100000, 1000], logarithmic=True)
    w = 2 * np.pi * np.linspace(2, 20, 400)

    def answers(x):
        k, c = model.parameters(x)
        link = k + 1j * w * c
        return 360000 * np.abs(1 / (360000 - 100 * w**2 + link - link**2 / (link - 5 * w**2)))

    start = np.append(model.start, answers(model.start).max())
    found = minimize(lambda z: z[-1], start, method="SLSQP", bounds=[(0, 1), (0, 1), (None, None)],
                     constraints={"type": "ineq", "fun": lambda z: z[-1] - answers(z[:2])},
                     options={"maxiter": 500, "ftol": 1e-12})
    return model, found.x[-1] / 360000


class QuarterCar(Model):
    """A wheel and a body after a kerb: a sum of four exponentials."""

    T = np.linspace(0, 3, 6001)

    def __init__(self):
        super().__init__([30000, 3000], [2000, 200], [100000, 10000], logarithmic=True)

    def motion(self, x):
        k, c = self.parameters(x)
        mw, mb, kt = 40, 300, 180000
        A = np.array([[0, 0, 1, 0], [0, 0, 0, 1], [-(k + kt) / mw, k / mw, -c / mw, c / mw],
                      [k / mb, -k / mb, c / mb, -c / mb]])
        rates, V = np.linalg.eig(A)
        y = (V * np.linalg.solve(V, np.array([-0.05, -0.05, 0, 0]))) @ np.exp(np.outer(rates, self.T))
        wheel, body = y[0].real, y[1].real
        acceleration = (A[3] @ y).real
        return self.integral(acceleration**2), wheel - body, self.integral(1e4 * wheel**2)

    def integral(self, g):
        h = self.T[1] - self.T[0]
        return h / 3 * (g[0] + g[-1] + 4 * g[1:-1:2].sum() + 2 * g[2:-1:2].sum())

    @staticmethod
    def peak(x):
        k = min(max(int(np.argmax(x)), 1), len(x) - 2)
        a, b, c = x[k - 1:k + 2]
        return b + (a - c)**2 / (8 * (2 * b - a - c)) if 2 * b > a + c else b


def compromise():
    car = QuarterCar()

    def f(x):
        comfort, stroke, _ = car.motion(x)
        return comfort + 1000 * car.peak(stroke) + 300 * car.peak(-stroke)

    return car, car.by_slsqp(f)


def ride():
    car = QuarterCar()
    limits = ({"type": "ineq", "fun": lambda x: 2 * (0.5 - car.motion(x)[2])},
              {"type": "ineq", "fun": lambda x: (0.035 - car.peak(car.motion(x)[1])) / 0.035})
    return car, car.by_slsqp(lambda x: car.motion(x)[0], limits)


def eighteen_points():
    """The path of a four-bar: two circles meet."""
    # crank, coupler, rocker, Ax, Ay, Bx, By, Px, Py, phase
    model = Model([0.4, 1.5, 1.2, 0, 0.2, 1.5, 0.5, 0.5, 0.5, 1], 3 * [0.05] + 6 * [-5] + [-7],
                  3 * [10] + 6 * [5] + [7])
    data = np.loadtxt(PROBLEMS.parent / "data/synthesis/eighteen_points.csv", delimiter=",", skiprows=1, comments="#")

    def residuals(x):
        crank, coupler, rocker, Ax, Ay, Bx, By, Px, Py, phase = model.parameters(x)
        angle = phase + np.radians(20) * data[:, 0]
        C = Ax + 1j * Ay + crank * np.exp(1j * angle)
        to_B = Bx + 1j * By - C
        cosine = (coupler**2 + np.abs(to_B)**2 - rocker**2) / (2 * coupler * np.abs(to_B))
        bar = np.exp(1j * (np.angle(to_B) + np.arccos(np.clip(cosine, -1, 1))))
        P = C + (Px + 1j * Py) * bar
        return np.concatenate([P.real - data[:, 1], P.imag - data[:, 2]])

    found = least_squares(residuals, model.start, bounds=(0, 1), xtol=1e-12, ftol=1e-12, gtol=1e-12)
    return model, 2 * found.cost


def by_mbsopt(program, name, folder):
    out = Path(folder) / name.replace("/", "_")
    subprocess.run([program, "design", PROBLEMS / f"{name}.json", "--quiet", "--threads", "1", "--out", out, "--set",
                    "design.optimizer={}"], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    return json.loads((out / "result.json").read_text())["optimizer"]


def main():
    program = str(Path(sys.argv[1]).resolve())
    cases = {"damper/absorber": absorber, "quarter_car/compromise": compromise, "quarter_car/ride": ride,
             "synthesis/eighteen_points": eighteen_points}
    print("| problem | mbsopt: objective, evaluations, s | scipy: objective, evaluations, s | s/s |")
    print("| --- | --- | --- | --- |")
    with tempfile.TemporaryDirectory() as folder:
        for name, solve in cases.items():
            ours = by_mbsopt(program, name, folder)
            begin = time.process_time()
            model, objective = solve()
            seconds = time.process_time() - begin
            print(f"| `{name}` | {ours['objective_final']:.7g}, {ours['evaluations']}, {ours['wall_seconds']:.3g} | "
                  f"{objective:.7g}, {model.evaluations}, {seconds:.3g} | {ours['wall_seconds'] / seconds:.2g} |",
                  flush=True)


if __name__ == "__main__":
    main()
