#!/usr/bin/env python3
"""Do estimates from disjoint parts of a record agree within what they claim?

    tests/disjoint_parts.py PROGRAM [RECORDS]

Each record is a motion of problems/double_pendulum/identify_windows.json by random torques, 8 s at 100 Hz, with noise.
Four parts of 2 s are fitted. The table has the share of pairs of parts that agree within 3 combined standard errors,
and of 95 % intervals that hold the truth. Seeded: the same numbers each time.
"""
import concurrent.futures
import csv
import itertools
import json
import math
import pathlib
import random
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[1]
PROBLEM = str(ROOT / "problems/double_pendulum/identify_windows.json")
TRUTH = {"h1": 0.25, "J1": 0.06, "h2": 0.16, "J2": 0.05, "coulomb1": 0.1, "coulomb2": 0.08,
         "viscous1": 0.02, "viscous2": 0.01}
COLUMNS = ["pos_meas1", "pos_meas2", "vel_meas1", "vel_meas2"]
EXPERIMENT = "identification.experiments[0]."
STEP, DURATION, PART = 0.01, 8, 2  # [s]
SIGMA = 0.005  # of the noise [rad], [rad/s]

# Friction that falls with the rate, to 0.1 and 0.08 N m from 1.8 times that, as in the elbow of a measured arm.
STRIBECK = [f"forces[{2 + i}].{field}" for i in range(2)
            for field in (f"breakaway=1.8*coulomb{i + 1}", "stribeck_velocity=2")]
# name, correlation time of half the noise's variance [s], the truth's law, the fitted law
CASES = [("white noise", 0, [], []), ("coloured noise, 0.05 s", 0.05, [], []), ("coloured noise, 0.3 s", 0.3, [], []),
         ("Stribeck's law, fitted with it", 0, STRIBECK, STRIBECK),
         ("Stribeck's law, fitted without it", 0, STRIBECK, [])]


def run(program, command, folder, sets):
    arguments = [program, command, PROBLEM, "--out", str(folder), "--quiet", "--threads", "1"]
    done = subprocess.run(arguments + [x for s in sets for x in ("--set", s)], capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"{command} in {folder}: {done.stderr}")
    return json.loads((folder / "result.json").read_text())


def make_torques(rng, file):
    """Three sines per joint, with the amplitudes of data/identification/arm_torque.csv."""
    waves = [[(rng.uniform(0.15, 0.4), rng.uniform(3, 11), rng.uniform(0, 2 * math.pi)) for _ in range(3)]
             for _ in range(2)]
    with open(file, "w") as out:
        out.write("time,tau_meas1,tau_meas2\n")
        for i in range(round(DURATION / STEP) + 1):
            t = i * STEP
            out.write(",".join(f"{x:.6f}" for x in [t] + [sum(a * math.sin(w * t + p) for a, w, p in wave)
                                                          for wave in waves]) + "\n")


def add_noise(rng, trajectory, file, correlation):
    keep = math.exp(-STEP / correlation) if correlation else 0
    coloured = {c: SIGMA * rng.gauss(0, 1) for c in COLUMNS}
    share = math.sqrt(0.5)  # of the two kinds
    with open(trajectory) as rows, open(file, "w") as out:
        out.write(",".join(["time"] + COLUMNS) + "\n")
        for row in csv.DictReader(rows):
            values = [float(row["t"])]
            for c in COLUMNS:
                coloured[c] = keep * coloured[c] + math.sqrt(1 - keep * keep) * SIGMA * rng.gauss(0, 1)
                values.append(float(row[c]) + share * (coloured[c] + SIGMA * rng.gauss(0, 1)))
            out.write(",".join(f"{v:.7g}" for v in values) + "\n")


def estimates(program, case, seed):
    """Value, standard error and interval of each shared parameter in each part."""
    _, correlation, true_law, fitted_law = case
    rng = random.Random(seed)
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        make_torques(rng, folder / "torque.csv")
        signals = [f"signals.tau{i}.file={folder / 'torque.csv'}" for i in (1, 2)]
        run(program, "simulate", folder / "motion", signals + true_law +
            [f"parameters.{k}.value={v}" for k, v in TRUTH.items()] +
            [f"simulation.end_time={DURATION}", f"simulation.output_step={STEP}"])
        add_noise(rng, folder / "motion/trajectory.csv", folder / "record.csv", correlation)
        parts = []
        for start in range(0, DURATION, PART):
            fit = run(program, "identify", folder / f"part{start}", signals + fitted_law + [
                f"{EXPERIMENT}data={folder / 'record.csv'}", f"{EXPERIMENT}windows.start_time={start}",
                f"{EXPERIMENT}windows.end_time={start + PART}", "simulation.integrator.rtol=1e-6",
                "simulation.integrator.atol=1e-8", "identification.optimizer.tolerance=1e-6"])
            parts.append({k: fit["parameters"][k] for k in TRUTH})
    return parts


def main():
    program, records = str(pathlib.Path(sys.argv[1]).resolve()), int(sys.argv[2]) if len(sys.argv) > 2 else 20
    print("| case | pairs that agree | worst parameter | intervals that hold the truth |\n| --- | --- | --- | --- |")
    for case in CASES:
        with concurrent.futures.ThreadPoolExecutor() as workers:
            found = list(workers.map(lambda seed: estimates(program, case, seed), range(1, records + 1)))
        agree = {k: [abs(a[k]["value"] - b[k]["value"]) <= 3 * math.hypot(a[k]["std_error"], b[k]["std_error"])
                     for parts in found for a, b in itertools.combinations(parts, 2)] for k in TRUTH}
        holds = [p[k]["ci95"][0] <= v <= p[k]["ci95"][1] for parts in found for p in parts for k, v in TRUTH.items()]
        worst = min(agree, key=lambda k: sum(agree[k]))
        pairs = sum(map(sum, agree.values()))
        print(f"| {case[0]} | {pairs} of {sum(map(len, agree.values()))} ({100 * pairs / sum(map(len, agree.values())):.1f} %) "
              f"| {worst}: {sum(agree[worst])} of {len(agree[worst])} | {100 * sum(holds) / len(holds):.1f} % |", flush=True)


main()
