"""A second solver, where there is one: ../shared/oracle, which needs numpy and scipy. It is slow and sees small scenes
only."""

import csv
import subprocess
from functools import lru_cache
from pathlib import Path

from checks import watched
from tilt import names_in

ORACLE = Path(__file__).resolve().parents[3] / "shared/oracle/oracle.py"
PYTHON = "/usr/bin/python3"
NOT_COVERED_JOINTS = {"rack_pinion", "screw"}
NOT_COVERED_FORCES = {"bushing", "friction"}
LONGEST = 20  # [s]


@lru_cache(1)
def missing():
    """Why there is no second solver; empty where there is."""
    if not ORACLE.exists():
        return f"no {ORACLE}"
    found = subprocess.run([PYTHON, "-c", "import numpy, scipy"], capture_output=True)
    return "" if found.returncode == 0 else f"{PYTHON} has no numpy and scipy"


def covers(problem):
    return (len(problem["bodies"]) <= 3 and not problem.get("initial")
            and not {joint["type"] for joint in problem.get("joints", [])} & NOT_COVERED_JOINTS
            and not {force["type"] for force in problem.get("forces", [])} & NOT_COVERED_FORCES
            and not any(isinstance(drive["law"], dict) for drive in problem.get("drives", [])))


def agrees(lab):
    if missing() or not covers(lab.problem):
        return []
    base = watched(lab)
    if not base.ok:
        return []
    problem = {key: value for key, value in lab.problem.items() if key not in ("sensors", "objectives", "design")}
    used = names_in([force.get("components", []) for force in problem.get("forces", [])])
    sensors = lab.problem.get("sensors", {})
    problem["sensors"] = {name: fields for name, fields in sensors.items() if name in used}
    lab.variant("oracle", problem)
    told = lab.folder / "oracle.csv"
    try:
        line = [PYTHON, ORACLE, lab.files["oracle"], "--trajectory", told]
        run = subprocess.run(line, capture_output=True, timeout=LONGEST)
    except subprocess.TimeoutExpired:
        return []
    if run.returncode or not told.exists():
        return []
    with open(told, newline="") as file:
        rows = list(csv.reader(file))
    columns = {name: [float(row[k]) for row in rows[1:]] for k, name in enumerate(rows[0])}
    worst, where = lab.apart(base.trajectory(), columns)
    if worst > 1e-6 and not lab.doubts(base):
        return [("oracle", f"{where}: {worst:.1e} apart")]
    return []
