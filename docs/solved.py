#!/usr/bin/env python3
"""Compares solved with integrated runs, as a table: each problem of the gallery whose drives leave nothing free.

    docs/solved.py PROGRAM

`mbsopt gradient` runs with "solve": "auto" and "dynamics". The differences of values and gradients are relative to the
largest entry of an objective. Times are the shortest of RUNS runs.
"""
import json
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[1]
RUNS = 7


def gradient(program, file, folder, *sets):
    """result.json of one run; None where it fails or takes more than a minute."""
    command = [program, "gradient", str(file), "--json", "--quiet", "--out", folder]
    try:
        done = subprocess.run(command + [a for s in sets for a in ("--set", s)], capture_output=True, timeout=60)
        return json.loads(done.stdout) if done.returncode == 0 else None
    except (subprocess.TimeoutExpired, json.JSONDecodeError):
        return None


def seconds(result):
    return min(method["wall_seconds"] for method in result["methods"].values())


def differences(solved, integrated):
    """The largest relative differences of values and of gradients."""
    values = gradients = 0
    for name, a in solved["objectives"].items():
        b = integrated["objectives"][name]
        values = max(values, abs(a["value"] - b["value"]) / max(abs(b["value"]), 1e-300))
        size = max((abs(g) for g in b["gradient"].values()), default=0)
        if size > 0:
            gradients = max(gradients, max(abs(a["gradient"][p] - g) / size for p, g in b["gradient"].items()))
    return values, gradients


def row(program, file, folder):
    first = gradient(program, file, folder) if '"drives"' in file.read_text() else None
    if first is None or first["simulation"].get("solve") != "kinematics":
        return None
    runs = [first] + [gradient(program, file, folder) for _ in range(RUNS - 1)]
    name = file.relative_to(ROOT / "problems").with_suffix("")
    others = [gradient(program, file, folder, "simulation.solve=dynamics") for _ in range(RUNS)]
    if others[0] is None:
        return f"| `{name}` | {1e3 * min(map(seconds, runs)):.2g} | fails | | |"
    times = min(map(seconds, runs)), min(map(seconds, others))
    value, slope = differences(runs[0], others[0])
    return f"| `{name}` | {1e3 * times[0]:.2g} | {times[1] / times[0]:.2g} | {value:.0e} | {slope:.0e} |"


def main():
    print("| problem | solved [ms] | integrated/solved | values differ by | gradients differ by |\n| --- | --- | --- | --- | --- |")
    with tempfile.TemporaryDirectory() as folder:
        for file in sorted((ROOT / "problems").glob("*/*.json")):
            if (line := row(sys.argv[1], file, folder + "/" + file.stem)) is not None:
                print(line, flush=True)


main()
