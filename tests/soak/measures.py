"""Sensors, conditions on the start, and objectives of a scene."""

from formulas import Formula
from rotations import add, norm, rotate, sub

RATES = {"velocity", "rate", "distance_rate", "angular_velocity"}
SETTLED_BY_MOTION = {"acceleration", "reaction", "drive_force", "force", "energy", "constraint_violation"}


class Measures:
    def __init__(self, rng, mechanism, loads):
        self.rng, self.m, self.loads, self.family = rng, mechanism, loads, mechanism.family
        self.sensors, self.sizes, self.starts = dict(loads.sensors), {}, {}
        f = self.family
        for name, fields in self.sensors.items():
            self.sizes[name] = f.length / f.time if fields["quantity"] == "velocity" else 1 / f.time
        for _ in range(rng.randint(1, 5)):
            self.add_sensor()
        self.conditions = self.some_conditions()
        self.objectives = {f"J{k + 1}": self.objective() for k in range(rng.choices([1, 2, 3], [3, 2, 1])[0])}

    # ---- sensors

    def add_sensor(self):
        found = self.rng.choice([self.at_point, self.at_point, self.of_joint, self.of_joint, self.between, self.turning,
                                 self.of_load, self.of_all])()
        if not found:
            return
        fields, size, start = found
        name = f"q{len(self.sensors) + 1}"
        self.sensors[name], self.sizes[name] = fields, size
        if start is not None:
            self.starts[name] = start

    def at_point(self):
        rng, f = self.rng, self.family
        pose = rng.choice(self.m.poses[1:])
        quantity = rng.choice(["position", "position", "velocity", "acceleration"])
        point, component = self.m.local_point(pose), rng.choice(["x", "y", "z", "norm"])
        fields = {"quantity": quantity, "body": pose.name, "point": point, "component": component}
        start = None
        if quantity == "position":
            at = add(pose.position, rotate(pose.turn, point))
            start = norm(at) if component == "norm" else at["xyz".index(component)]
        if rng.random() < 0.3:
            other = rng.choice(self.m.poses)
            if other is not pose:
                local = self.m.local_point(other)
                fields["relative_to"] = {"body": other.name, "point": local}
                if quantity == "position":
                    away = sub(at, add(other.position, rotate(other.turn, local)))
                    start = norm(away) if component == "norm" else away["xyz".index(component)]
        elif rng.random() < 0.2:
            fields["frame"], start = "body", start if component == "norm" else None
        return fields, f.length / f.time ** ["position", "velocity", "acceleration"].index(quantity), start

    def of_joint(self):
        rng, f = self.rng, self.family
        joints = [j for j in self.m.joints if j.type not in ("gear", "rack_pinion")]
        if not joints:
            return None
        joint = rng.choice(joints)
        kinds = ["reaction"]
        if joint.angle is not None:
            kinds += ["angle", "angle", "rate"]
        if joint.displacement is not None:
            kinds += ["displacement"] * 2
        kind = rng.choice(kinds)
        if kind == "reaction":
            of = rng.choice(["force", "torque"])
            size = f.mass * f.length / f.time**2 * (f.length if of == "torque" else 1)
            component = rng.choice(["x", "y", "z", "norm"])
            return {"quantity": kind, "joint": joint.name, "kind": of, "component": component}, size, None
        size = {"angle": 1, "rate": 1 / f.time, "displacement": f.length}[kind]
        start = {"angle": joint.angle, "displacement": joint.displacement}.get(kind)
        return {"quantity": kind, "joint": joint.name}, size, start

    def between(self):
        found = self.loads.two_points()
        if not found:
            return None
        (i, j), points, length = found
        f, rate = self.family, self.rng.random() < 0.4
        fields = {"quantity": "distance_rate" if rate else "distance", "body1": self.m.poses[i].name,
                  "body2": self.m.poses[j].name, "point1": points[0], "point2": points[1]}
        return fields, f.length / f.time if rate else f.length, None if rate else length

    def turning(self):
        pose, f = self.rng.choice(self.m.poses[1:]), self.family
        if self.rng.random() < 0.3:
            e = self.rng.randrange(4)
            return {"quantity": "orientation", "body": pose.name, "component": f"e{e}"}, 1, pose.turn[e]
        component = self.rng.choice(["x", "y", "z", "norm"])
        fields = {"quantity": "angular_velocity", "body": pose.name, "component": component}
        if self.rng.random() < 0.3:
            fields["frame"] = "body"
        return fields, f.spin or 1 / f.time, None

    def of_load(self):
        f, springs = self.family, [s for s in self.loads.forces if s["type"] in ("tsda", "rsda")]
        weight = f.mass * f.length / f.time**2
        if self.loads.drives and (not springs or self.rng.random() < 0.5):
            drive = self.rng.choice(self.loads.drives)["name"]
            return {"quantity": "drive_force", "drive": drive}, weight * max(1, f.length), None
        if not springs:
            return None
        spring = self.rng.choice(springs)
        size = weight * (1 if spring["type"] == "tsda" else f.length)
        return {"quantity": "force", "force": spring["name"]}, size, None

    def of_all(self):
        f = self.family
        if self.rng.random() < 0.2:
            return {"quantity": "constraint_violation"}, 1, None
        return ({"quantity": "energy", "component": self.rng.choice(["kinetic", "potential", "total"])},
                f.mass * f.length**2 / f.time**2, None)

    # ---- conditions

    def some_conditions(self):
        """At most one of a value, the start's own, and one of a rate: more could contradict each other. Of a coordinate
        of a body no rate: joints may hold it."""
        rng, f = self.rng, self.family
        if f.has("equilibrium") or f.has("driven") or f.has("rough") or self.m.freedoms - len(self.loads.drives) < 1:
            return []
        able = [name for name, s in self.sensors.items() if s["quantity"] not in SETTLED_BY_MOTION | RATES
                and name in self.starts and s.get("component") != "norm"
                and s.get("joint") not in self.loads.driven_joints]
        if not able or rng.random() < 0.6:
            return []
        name = rng.choice(able)
        condition = {"sensor": name, "value": self.starts[name]}
        if rng.random() < 0.7 and self.sensors[name]["quantity"] in ("angle", "displacement", "distance"):
            condition["rate"] = self.sizes[name] / f.time * rng.uniform(-0.5, 0.5)
        return [condition]

    # ---- objectives

    def measured(self):
        """A sensor from its start on, divided by its size."""
        able = [name for name, s in self.sensors.items() if s["quantity"] != "constraint_violation"]
        if not able:
            return Formula("sin({}*t)", 1 / self.family.time)
        name = self.rng.choice(able)
        return Formula("({} - {})*{}", name, self.starts.get(name, 0.0), 1 / self.sizes[name])

    def cost(self):
        rng, u = self.rng, self.measured()
        shape = rng.choice(["({})^2", "{}", "sin({})", "({})^2 + 0.1*({})", "cos({})*t*{:.17g}"])
        if shape == "({})^2 + 0.1*({})":
            v = self.measured()
            return Formula(f"({u.template})^2 + 0.1*({v.template})", *u.values, *v.values)
        if shape.startswith("cos"):
            return Formula(f"cos({u.template})*t*{{}}", *u.values, 1 / self.family.time)
        return Formula(shape.format(u.template), *u.values)

    def objective(self):
        rng, f = self.rng, self.family
        rest = ["samples", "both", "maximum_of", "minimum_of", "rms_of"]
        kind = rng.choice(["running"] * 4 + ["terminal"] * 3 + rest)
        if kind in ("running", "terminal"):
            return {kind: self.cost()}
        if kind == "both":
            return {"running": self.cost(), "terminal": self.cost()}
        if kind == "samples":
            count = rng.randint(1, 3)
            return {"samples": [{"time": f.end_time * rng.uniform(0, 1), "value": self.cost()} for _ in range(count)]}
        if kind == "rms_of":
            return {kind: self.cost()}
        return {kind: self.measured(), "sharpness": rng.uniform(5, 50)}
