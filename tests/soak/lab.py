"""One scene on the bench: its runs, kept by what was asked, and measures to compare them by."""

import math
import re
import shutil
from pathlib import Path

from scene import Scene

# Warnings of the program that say its motion may be off by more than usual.
DOUBT = re.compile(r"singular|energy changed|came apart|accelerations of the constraints|not resolve|stability|stiff|"
                   r"zero length|cannot change|not smooth|jump|peak|disagree|rounding|has no (mass|inertia)|"
                   r"faster than|penalty|contradict|give way|not determined|could not be evaluated|pulse|kink",
                   re.IGNORECASE)
# Of these, the ones that explain why two sweeps differentiate the same steps differently,
SWEEP_DOUBT = re.compile(r"rounding|masses differ|cannot change|penalty|contradict|do not resolve the gradient|"
                         r"derivatives leave out|give way", re.IGNORECASE)
# and why two models do, whose steps may differ.
STEP_DOUBT = re.compile(SWEEP_DOUBT.pattern + "|do not resolve|not determined", re.IGNORECASE)
KINK = re.compile(r"is not smooth in \w+: its slope")  # of `check`
FUNCTIONS = {name: getattr(math, name) for name in ("sin", "cos", "tan", "exp", "log", "sqrt", "tanh", "pi")}


class Lab:
    def __init__(self, scene, program, folder):
        self.scene, self.program, self.folder = scene, program, Path(folder)
        self.problem, self.outcomes, self.files = scene.problem, {}, {}
        self.explained = []
        self.end_time = float(self.problem["simulation"]["end_time"])
        self.length = self.body_length()
        self.mass = max(self.number(body.get("mass", 0)) for body in self.problem["bodies"])
        self.distance = 1 + self.farthest() / self.length  # what coordinates lose of lengths, in units of rounding
        self.write("scene", scene)

    def close(self):
        shutil.rmtree(self.folder, ignore_errors=True)

    # ---- runs

    def write(self, name, scene):
        self.files[name] = self.folder / f"{name}.json"
        scene.save(self.files[name])

    def variant(self, name, problem):
        self.write(name, Scene(problem, self.scene.files))

    def run(self, command, settings=None, arguments=(), file="scene", patience=1.0, interrupt=None):
        key = (command, str(settings), tuple(arguments), file)
        if key not in self.outcomes:
            folder = self.folder / f"{file}_{len(self.outcomes)}"
            self.outcomes[key] = self.program.run(command, self.files[file], folder, settings or {}, arguments,
                                                  patience, interrupt)
        return self.outcomes[key]

    def resume(self, outcome):
        """Goes on with an interrupted run, in its folder."""
        return self.program.run("resume", outcome.folder, None)

    def tight(self, **others):
        """An integrator whose errors do not count."""
        small = max(1e-12 * min(1, self.length), 1e-15)
        rate = max(small, 1e-14 * self.spin())  # rounding of a rate may be as large in components that are 0
        atol = small if rate == small else {"position": small, "angle": small, "velocity": small, "rate": rate}
        integrator = {"type": "dopri853", "rtol": 1e-11, "atol": atol, "max_step": self.end_time / 40}
        return {"simulation.integrator": integrator | others}

    def complaints(self):
        return [complaint for outcome in self.outcomes.values() for complaint in outcome.complaints]

    def doubts(self, *outcomes, about=DOUBT):
        """What the program itself said against its numbers; remembered as an explanation."""
        words = [words for outcome in outcomes for words in outcome.warnings + [outcome.message] if about.search(words)]
        self.explained += words[:1]
        return bool(words)

    # ---- the scene's own sizes

    def number(self, x):
        if isinstance(x, (int, float)):
            return float(x)
        parameters = self.problem.get("parameters", {})
        names = {name: p["value"] if isinstance(p, dict) else p for name, p in parameters.items()}
        text = x
        for _ in range(10):
            for name, definition in self.problem.get("definitions", {}).items():
                text = re.sub(rf"\b{name}\b", f"({definition})", text)
        return float(eval(text.replace("^", "**"), {"__builtins__": {}}, FUNCTIONS | names))

    def spin(self):
        turns = [body.get("angular_velocity", []) for body in self.problem["bodies"]]
        return max((math.hypot(*map(self.number, turn)) for turn in turns), default=0)

    def farthest(self):
        positions = [body.get("position", []) for body in self.problem["bodies"]]
        return max((math.hypot(*map(self.number, position)) for position in positions), default=0)

    def body_length(self):
        """The longest arm of a body: its own points and its centre of mass."""
        arms = [body.get("com", []) for body in self.problem["bodies"]]
        arms += [point for body in self.problem["bodies"] for point in body.get("points", {}).values()]
        for item in self.problem.get("joints", []) + self.problem.get("forces", []):
            arms.append(item.get("point2", []))
            if item.get("body1", "ground") != "ground":
                arms.append(item.get("point1", []))
        lengths = [math.hypot(*(self.number(x) for x in arm)) for arm in arms if isinstance(arm, list) and arm]
        return max(lengths, default=0.0) or 1.0

    def apart(self, a, b, bodies=None):
        """The largest difference of two trajectories, relative to the size of each kind of number; and where."""
        worst, where = 0.0, ""
        names = [body["name"] for body in self.problem["bodies"]] if bodies is None else bodies
        speeds = {"v": self.length / self.end_time, "w": 1 / self.end_time}
        for kind in speeds:
            for name in names:
                for axis in "xyz":
                    speeds[kind] = max(speeds[kind], max(map(abs, a[f"{name}.{kind}{axis}"])))
        for name in names:
            groups = [([f"{name}.{c}" for c in "xyz"], self.length), ([f"{name}.e{k}" for k in range(4)], 1.0),
                      ([f"{name}.v{c}" for c in "xyz"], speeds["v"]), ([f"{name}.w{c}" for c in "xyz"], speeds["w"])]
            for columns, size in groups:
                for column in columns:
                    if len(a[column]) != len(b[column]):
                        return math.inf, f"{column}: {len(a[column])} and {len(b[column])} rows"
                    difference = max(abs(x - y) for x, y in zip(a[column], b[column])) / size
                    if not difference <= worst:
                        worst, where = difference, f"{column} {a[column][-1]!r} and {b[column][-1]!r} at the end"
        return worst, where

    def parameter_sizes(self):
        sizes = {}
        for name, p in self.problem.get("parameters", {}).items():
            value, spread = (p["value"], p.get("upper", 1) - p.get("lower", 0)) if isinstance(p, dict) else (p, 1)
            sizes[name] = abs(value) or abs(spread) / 2 or 1.0
        return sizes
