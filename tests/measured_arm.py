#!/usr/bin/env python3
"""Fits the measured arm of ../shared/data by problems/double_pendulum/identify_windows.json, in windows of 0.5 s, and
prints the tables of docs/identification.md: bounds, sigmas, and disjoint parts without and with Stribeck's friction.

    tests/measured_arm.py build/release/mbsopt [RECORD]

The sigmas are 8 mrad and 0.25 rad/s. Stribeck's velocity comes from 8.5 to 9.99 s, which no part contains.
"""
import json
import math
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[1]
PROBLEM = ROOT / "problems/double_pendulum/identify_windows.json"
RECORD = ROOT / "../shared/data/measured/dfki_double_pendulum_torque/record.csv"
EXPERIMENT = "identification.experiments[0]."
SHARED = ["h1", "J1", "h2", "J2", "coulomb1", "coulomb2", "viscous1", "viscous2"]
COMPARED = {"h2": "m2 r2", "coulomb1": "Coulomb 1", "coulomb2": "Coulomb 2"}
PARTS = [(0.5, 2.5), (2.5, 4.5), (4.5, 6.5), (6.5, 8.5)]


def fitted(program, record, start, end, rtol, sets=(), estimate=False):
    """result.json of a fit."""
    given = [f"signals.tau1.file={record}", f"signals.tau2.file={record}", f"{EXPERIMENT}data={record}",
             f"{EXPERIMENT}windows.start_time={start}", f"{EXPERIMENT}windows.end_time={end}",
             f"simulation.integrator.rtol={rtol}", f"simulation.integrator.atol={rtol / 100}",
             "identification.optimizer.tolerance=1e-6"]
    for c in range(4):
        given.append(f"{EXPERIMENT}channels[{c}].sigma={0.008 if c < 2 else 0.25}")
        if not estimate:
            given.append(f"{EXPERIMENT}channels[{c}].estimate_sigma=false")
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run([program, "identify", str(PROBLEM), "--out", folder, "--quiet"] +
                              [x for s in [*given, *sets] for x in ("--set", s)], capture_output=True, text=True)
        if done.returncode:
            raise SystemExit(done.stderr)
        return json.loads((pathlib.Path(folder) / "result.json").read_text())


def evaluations(result):
    return result["optimizer"]["evaluations"]


def print_parts(results, more=()):
    header = [*COMPARED.values(), *more]
    print("| part | evaluations | cost | " + " | ".join(header) + " |\n" + "| --- " * (3 + len(header)) + "|")
    for (start, end), result in results.items():
        cells = ["[{:.3f}, {:.3f}]".format(*result["parameters"][k]["ci95"]) for k in COMPARED]
        cells += ["{value:.2f} +- {std_error:.2f}".format(**result["parameters"][k]) for k in more]
        print(f"| {start} to {end} s | {evaluations(result)} | {result['optimizer']['objective_final']:.0f} | " +
              " | ".join(cells) + " |")
    parts = [results[part]["parameters"] for part in PARTS]
    for name, words in COMPARED.items():
        apart = max(abs(a[name]["value"] - b[name]["value"]) / math.hypot(a[name]["std_error"], b[name]["std_error"])
                    for a in parts for b in parts if a is not b)
        held = all(a[name]["ci95"][0] < b[name]["value"] < a[name]["ci95"][1] for a in parts for b in parts)
        print(f"{words}: parts are at most {apart:.2f} combined standard errors apart; each interval "
              f"{'holds' if held else 'does not hold'} the values of all parts")
    for (start, end), result in results.items():
        print(f"{start} to {end} s: condition number {result['identifiability']['condition_number']:.3g}")


def main():
    program, record = sys.argv[1], str(pathlib.Path(sys.argv[2] if len(sys.argv) > 2 else RECORD).resolve())
    fit = lambda *arguments, **more: fitted(program, record, *arguments, **more)
    unbounded = [f"parameters.viscous{i}.lower=-1" for i in (1, 2)]
    print("| 0.5 to 4.5 s | evaluations | with an active bound | with estimated sigmas |\n| --- | --- | --- | --- |")
    for rtol in (1e-5, 1e-7):
        print(f"| rtol {rtol:g} | {evaluations(fit(0.5, 4.5, rtol, unbounded))} | {evaluations(fit(0.5, 4.5, rtol))} | "
              f"{evaluations(fit(0.5, 4.5, rtol, estimate=True))} |")
    print()
    print_parts({part: fit(*part, 1e-5) for part in [(0.5, 4.5), *PARTS]})
    law = ['parameters.rise2={"value": 0.05, "lower": 0, "upper": 2, "unit": "N m"}',
           "forces[3].breakaway=coulomb2 + rise2", "forces[3].stribeck_velocity="]
    variables = lambda names: f"identification.variables={json.dumps(names)}"
    apart = fit(8.5, 9.99, 1e-5, [*law[:2], law[2] + "vs2", variables([*SHARED, "rise2", "vs2"]), 'parameters.vs2='
                                  '{"value": 1, "lower": 0.2, "upper": 10, "scale": "log", "unit": "rad/s"}'])
    velocity = apart["parameters"]["vs2"]
    print(f"\nStribeck's velocity: {velocity['value']:.2f} +- {velocity['std_error']:.2f} rad/s\n")
    stribeck = [*law[:2], f"{law[2]}{velocity['value']!r}", variables([*SHARED, "rise2"])]
    print_parts({part: fit(*part, 1e-5, stribeck) for part in PARTS}, ["rise2"])


main()
