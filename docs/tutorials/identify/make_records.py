#!/usr/bin/env python3
"""Writes swing.csv and check.csv, records of a simulated rig, as its logger would write them.

A bar hangs from a bearing with viscous and dry friction:  J theta'' = -m g a sin(theta) - c theta' - T tanh(theta'/w).
J = 0.0215 kg m^2, m g a = 0.5*9.81*0.15 N m, c = 0.0020 N m s, T = 0.006 N m, w = 0.05 rad/s. An encoder on the axle
adds normal noise of 0.3 degrees. This integration (Runge-Kutta of order 4) shares nothing with the program.
"""
import math
import pathlib
import random

J, MGA, C, T, W = 0.0215, 0.5 * 9.81 * 0.15, 0.0020, 0.006, 0.05
STEP, EVERY = 0.001, 20  # [s], steps between samples


def rate(theta, omega):
    return omega, (-MGA * math.sin(theta) - C * omega - T * math.tanh(omega / W)) / J


def record(name, start, seconds, seed):
    noise = random.Random(seed)
    theta, omega = math.radians(start), 0.0
    rows = ["time [ms],theta [deg]"]
    for k in range(round(seconds / STEP) + 1):
        if k % EVERY == 0:
            rows.append(f"{k * STEP * 1000:.0f},{math.degrees(theta) + noise.gauss(0, 0.3):.2f}")
        k1 = rate(theta, omega)
        k2 = rate(theta + STEP / 2 * k1[0], omega + STEP / 2 * k1[1])
        k3 = rate(theta + STEP / 2 * k2[0], omega + STEP / 2 * k2[1])
        k4 = rate(theta + STEP * k3[0], omega + STEP * k3[1])
        theta += STEP / 6 * (k1[0] + 2 * k2[0] + 2 * k3[0] + k4[0])
        omega += STEP / 6 * (k1[1] + 2 * k2[1] + 2 * k3[1] + k4[1])
    pathlib.Path(__file__).with_name(name).write_text("\n".join(rows) + "\n")


record("swing.csv", 50, 6, 1)
record("check.csv", 25, 4, 2)
