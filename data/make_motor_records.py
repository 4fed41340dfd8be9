#!/usr/bin/env python3
"""Makes data/motor/*.csv: a pendulum on a motor with a logged torque, integrated apart from the program.

(J + m a^2) theta'' = tau(t) - d(theta') - m g a sin(theta),   tau(t) = 1.06 f(t - 0.015 s) + 0.012 N m
f: straight lines between the logged samples; d(w) = p w + q w^3, the spline through (2, 0.024) and (6, 0.168), odd.
"""
import math
import pathlib

J, M, A, G = 0.021, 0.6, 0.12, 9.81
P, Q = (27 * 0.024 - 0.168) / 48, (0.168 - 3 * 0.024) / 192  # 2 p + 8 q = 0.024, 6 p + 216 q = 0.168
STEP = 1e-3  # of RK4 and of the grid on which kinks lie [s]
START, END, SAMPLE = 0.1, 4.0, 0.02
FOLDER = pathlib.Path(__file__).parent / "motor"

state = 20261124


def uniform():  # x <- 16807 x mod (2^31 - 1)
    global state
    state = 16807 * state % 2147483647
    return state / 2147483647


def normal():
    return sum(uniform() for _ in range(12)) - 6


def torques(mean, size):
    """Logged samples [N mm], one per 20 ms, past the end of the motion."""
    values, x = [], 0.0
    for _ in range(round(END / SAMPLE) + 5):
        x += 0.3 * (size * (2 * uniform() - 1) * 3 - x)
        values.append(round(1e3 * (mean + x), 1))
    return values


def motion(logged):
    def tau(t):
        k, rest = divmod((t - 0.015) / SAMPLE, 1)
        f = logged[int(k)] + rest * (logged[int(k) + 1] - logged[int(k)])
        return 1.06e-3 * f + 0.012

    def rates(t, y):
        theta, omega = y
        torque = tau(t) - P * omega - Q * omega**3 - M * G * A * math.sin(theta)
        return omega, torque / (J + M * A * A)

    y, angles = (0.0, 0.0), [0.0] * round(START / STEP)
    for n in range(round(START / STEP), round(END / STEP) + 1):
        angles.append(y[0])
        # A hair inside the step, whose ends may be kinks.
        t, h = n * STEP + 1e-12, STEP - 2e-12
        k1 = rates(t, y)
        k2 = rates(t + h / 2, [a + h / 2 * b for a, b in zip(y, k1)])
        k3 = rates(t + h / 2, [a + h / 2 * b for a, b in zip(y, k2)])
        k4 = rates(t + h, [a + h * b for a, b in zip(y, k3)])
        y = tuple(a + STEP / 6 * (b + 2 * c + 2 * d + e) for a, b, c, d, e in zip(y, k1, k2, k3, k4))
    return angles


def degrees(angle, wrapped):
    noisy = math.degrees(angle) + 0.1 * normal()
    return (noisy + 180) % 360 - 180 if wrapped else noisy


def main():
    FOLDER.mkdir(exist_ok=True)
    logged, every = torques(0.1, 0.6), round(SAMPLE / STEP)
    angles = motion(logged)
    with open(FOLDER / "run1.csv", "w") as file:
        file.write('"stamp [ms]","torque [N mm]","angle [deg]"\n')
        for k, torque in enumerate(logged):
            angle = f"{degrees(angles[k * every], False):.3f}" if k * every < len(angles) else ""
            file.write(f"{171000000 + round(1e3 * k * SAMPLE)},{torque},{angle}\n")
    logged = torques(0.9, 0.6)
    angles = motion(logged)
    with open(FOLDER / "run2_torque.csv", "w") as file:
        file.write("stamp [ms];torque [N mm]\n")
        for k, torque in enumerate(logged):
            file.write(f"{172000000 + round(1e3 * k * SAMPLE)};{torque}\n")
    rows = [f"{172000000 + n},{degrees(angles[n], True):.3f}\n" for n in range(0, len(angles), 10)]
    for name, part in (("run2_a.csv", rows[:200]), ("run2_b.csv", rows[200:])):
        (FOLDER / name).write_text("stamp [ms],angle [deg]\n" + "".join(part))


if __name__ == "__main__":
    main()
