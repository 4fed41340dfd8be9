#!/usr/bin/env python3
"""Smooths a measured motion for drives: the cubic spline that fits a coordinate and its rate best.

    data/smooth_motion.py RECORD.csv SPACING TIME ANGLE:RATE... >SMOOTH.csv

Least squares over the spline's coefficients, knots every SPACING seconds; angle [rad] and rate [rad/s] with the same
sigma. A drive along the printed values at the knots follows this spline, but for the first and last few knots.
"""
import csv
import sys


def basis(u):
    """The four cubic B-splines that are not 0 in a knot interval, at its part u, and their slopes in u."""
    w = 1 - u
    return ([w**3 / 6, (3 * u**3 - 6 * u**2 + 4) / 6, (3 * w**3 - 6 * w**2 + 4) / 6, u**3 / 6],
            [-w**2 / 2, (3 * u**2 - 4 * u) / 2, -(3 * w**2 - 4 * w) / 2, u**2 / 2])


def solved(A, b):
    """A x = b, A symmetric positive definite with three diagonals beside the main one, by elimination."""
    n = len(b)
    for k in range(n):
        for i in range(k + 1, min(k + 4, n)):
            f = A[i][k] / A[k][k]
            for j in range(k, min(k + 4, n)):
                A[i][j] -= f * A[k][j]
            b[i] -= f * b[k]
    for k in reversed(range(n)):
        b[k] = (b[k] - sum(A[k][j] * b[j] for j in range(k + 1, min(k + 4, n)))) / A[k][k]
    return b


def values_at_knots(times, angles, rates, first, spacing, intervals):
    n = intervals + 3
    A, b = [[0.0] * n for _ in range(n)], [0.0] * n
    for t, angle, rate in zip(times, angles, rates):
        k = min(int((t - first) / spacing), intervals - 1)
        values, slopes = basis((t - first) / spacing - k)
        for row, measured in ((values, angle), ([s / spacing for s in slopes], rate)):
            for i in range(4):
                b[k + i] += row[i] * measured
                for j in range(4):
                    A[k + i][k + j] += row[i] * row[j]
    c = solved(A, b)
    return [(c[k] + 4 * c[k + 1] + c[k + 2]) / 6 for k in range(intervals + 1)]


def main():
    record, spacing, time, pairs = sys.argv[1], float(sys.argv[2]), sys.argv[3], [p.split(":") for p in sys.argv[4:]]
    with open(record) as file:
        rows = [{k: float(v) for k, v in row.items()} for row in csv.DictReader(file)]
    times = [row[time] for row in rows]
    intervals = int((times[-1] - times[0]) / spacing + 1e-9)
    columns = [values_at_knots(times, [r[a] for r in rows], [r[w] for r in rows], times[0], spacing, intervals)
               for a, w in pairs]
    print(",".join([time] + [a for a, _ in pairs]))
    for k, values in enumerate(zip(*columns)):
        print(",".join([f"{times[0] + k * spacing:.4f}"] + [f"{v:.7f}" for v in values]))


main()
