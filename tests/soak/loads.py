"""Drives and forces, of sizes that fit the scene's length, mass and time."""

import math

from formulas import Formula
from mechanism import ACROSS
from rotations import add, norm, random_direction, rotate, sub, times, unrotate


class Loads:
    def __init__(self, rng, mechanism, csv_name):
        self.rng, self.m, self.family, self.csv_name = rng, mechanism, mechanism.family, csv_name
        self.drives, self.forces, self.sensors, self.files, self.signals = [], [], {}, {}, {}
        self.driven_joints = set()
        self.add_drives()
        for _ in range(rng.choices([0, 1, 2, 3, 4], [2, 3, 3, 2, 1])[0]):
            self.add_force()
        if self.family.has("pulse"):
            self.add_pulse()
        if self.family.has("equilibrium"):
            self.hold_everything()

    # ---- drives

    def add_drives(self):
        rng = self.rng
        movable = [j for j in self.m.joints if j.in_tree and (j.angle is not None or j.displacement is not None)]
        rng.shuffle(movable)
        if self.family.has("driven"):
            movable, count = self.free_of_loops(movable), self.m.freedoms
        else:
            count = min(1 if rng.random() < 0.2 else 0, self.m.freedoms - 1)
        for joint in movable[:max(count, 0)]:
            if joint.type == "screw" or self.family.has("equilibrium"):
                continue
            if not self.family.has("driven") and rng.random() < 0.3:
                self.add_point_drive(joint.bodies[1])
            elif joint.angle is not None:
                self.add_drive({"type": "angle", "joint": joint.name}, joint.angle, 1)
                self.driven_joints.add(joint.name)
            else:
                self.add_drive({"type": "displacement", "joint": joint.name}, joint.displacement, self.family.length)
                self.driven_joints.add(joint.name)

    def free_of_loops(self, movable):
        """Joints to drive: each loop moves two joints of its own (one in space), which must not be driven."""
        followers = []
        for loop in (j for j in self.m.joints if not j.in_tree and j.bodies != (0, 0)):
            way = [j for j in self.m.path(*loop.bodies) if j not in followers]
            need = {"revolute": 2, "spherical": 3}.get(loop.type, 1)
            followers += self.rng.sample(way, min(need, len(way)))
        return [j for j in movable if j not in followers]

    def add_point_drive(self, body):
        rng, pose = self.rng, self.m.poses[body]
        if rng.random() < 0.5:
            point = self.m.local_point(pose)
            at = add(pose.position, rotate(pose.turn, point))
            anchor = add(at, times(self.family.length * rng.uniform(0.5, 2), random_direction(rng)))
            self.add_drive({"type": "distance", "body2": pose.name, "point1": anchor, "point2": point},
                           norm(sub(at, anchor)), self.family.length)
            return
        fields = self.m.bodies[body - 1]
        center = add(pose.position, rotate(pose.turn, fields["com"]))
        if rng.random() < 0.25:
            e = rng.randrange(4)
            self.add_drive({"type": "coordinate", "body": pose.name, "coordinate": f"e{e}"}, pose.turn[e], 0.05)
        else:
            k = rng.randrange(3)
            fields = {"type": "coordinate", "body": pose.name, "coordinate": "xyz"[k]}
            self.add_drive(fields, center[k], self.family.length)

    def add_drive(self, fields, start, size):
        rng, T = self.rng, self.family.time
        reach, rate, w = size * rng.uniform(0.05, 0.4), size * rng.uniform(-0.3, 0.3) / T, rng.uniform(0.5, 3) / T
        fields["name"] = f"m{len(self.drives) + 1}"
        if rng.random() < 0.2:
            name = self.csv_name.format(len(self.drives) + 1)
            rows = ["t,x"]
            for k in range(41):
                t = self.family.end_time * (1.25 * k / 40 - 0.1)
                rows.append(f"{t!r},{start + reach * (1 - math.cos(w * t)) + rate * t!r}")
            self.files[name] = "\n".join(rows) + "\n"
            fields["law"] = {"csv": name, "time": "t", "column": "x"}
        else:
            fields["law"] = rng.choice([
                Formula("{} + {}*(1 - cos({}*t))", start, reach, w),
                Formula("{} + {}*t", start, rate),
                Formula("{} + {}*t + {}*sin({}*t)^2", start, rate, reach, w),
                Formula("{} + {}*tanh({}*t)", start, reach, w),
                Formula("{}", start)])
            if self.family.has("swift"):
                instant, width = self.brief(-4)
                step = Formula("{}*(1 + tanh((t - {})/{}))", 0.2 * reach, instant, width)
                if rng.random() < 0.5:  # its second derivative jumps twice
                    step = Formula("{}*min(1, max(0, (t - {})/{}))^2*(3 - 2*min(1, max(0, (t - {})/{})))", 0.4 * reach,
                                   instant, width, instant, width)
                law = fields["law"]
                fields["law"] = Formula(law.template + " + " + step.template, *law.values, *step.values)
        self.drives.append(fields)

    def brief(self, least):
        """An instant of the run, and a length of time that steps of the whole motion pass over."""
        end = self.family.end_time
        return end * self.rng.uniform(0.1, 0.9), end * 10 ** self.rng.uniform(least, -2.3)

    # ---- forces

    def add_pulse(self):
        """A blow on a body: a formula of time, or samples in a file."""
        rng, f = self.rng, self.family
        k = rng.randrange(1, len(self.m.poses))
        impulse = self.least((k,), "mass") * f.length / f.time * rng.uniform(0.1, 1)
        sampled = rng.random() < 0.5
        start, width = self.brief(-3.2 if sampled else -4)
        if sampled:
            name, step = self.csv_name.format("blow"), width / 8
            rows, count = ["t,F"], math.ceil(f.end_time / step) + 2
            for i in range(count):
                s = (i * step - start) / width
                rows.append(f"{i * step!r},{impulse / width * math.sin(math.pi * s) if 0 < s < 1 else 0.0!r}")
            self.files[name] = "\n".join(rows) + "\n"
            self.signals["blow"] = {"file": name, "column": "F", "interpolation": rng.choice(["linear", "spline"])}
            component = "blow"
        else:
            component = rng.choice([Formula("{}*max(0, 1 - abs(t - {})/{})", impulse / width, start, width),
                                    Formula("{}*exp(-((t - {})/{})^2)", impulse / width, start, width)])
        components = [component, 0, 0]
        rng.shuffle(components)
        self.forces.append({"name": f"f{len(self.forces) + 1}", "type": "force", "body": self.m.poses[k].name,
                            "point": self.m.local_point(self.m.poses[k]), "components": components})

    def stiffness(self, inertia):
        rng, T = self.rng, self.family.time
        rate = 10 ** rng.uniform(1, 2.5) / T if self.family.has("stiff") else rng.uniform(0.5, 4) / T
        c = inertia * rate * rng.choice([0, 0.1, 0.5])
        return inertia * rate**2, c

    def least(self, bodies, what):
        values = [getattr(self.m.poses[b], what) for b in bodies if getattr(self.m.poses[b], what) > 0]
        f = self.family
        return min(values, default=f.mass if what == "mass" else f.mass * f.length**2 / 10)

    def add_force(self):
        rng = self.rng
        makers = [self.tsda, self.tsda, self.rsda, self.force, self.torque, self.bushing, self.friction,
                  self.stop, self.contact, self.switched]
        fields = rng.choice(makers)()
        if fields:
            self.forces.append({"name": f"f{len(self.forces) + 1}", **fields})

    def two_points(self):
        """Of two bodies, far enough apart for a direction."""
        rng, poses = self.rng, self.m.poses
        for _ in range(10):
            i, j = sorted(rng.sample(range(len(poses)), 2))
            ends = []
            for k in (i, j):
                local = self.m.local_point(poses[k])
                ends.append(add(poses[k].position if k else self.family.origin, rotate(poses[k].turn, local)))
            if self.family.planar and rng.random() < 0.7:
                n = self.family.normal
                ends[1] = [ends[0][k] if n[k] else ends[1][k] for k in range(3)]
            length = norm(sub(ends[1], ends[0]))
            if length > max(0.2 * self.family.length, ACROSS * self.family.length):
                points = [unrotate(poses[k].turn, sub(end, poses[k].position)) for k, end in zip((i, j), ends)]
                return (i, j), points, length
        return None

    def tsda(self):
        rng, f = self.rng, self.family
        found = self.two_points()
        if not found:
            return None
        (i, j), points, length = found
        k, c = self.stiffness(self.least((i, j), "mass"))
        fields = {"type": "tsda", "body1": self.m.poses[i].name, "body2": self.m.poses[j].name,
                  "point1": points[0], "point2": points[1]}
        l0 = length * rng.uniform(0.7, 1.3)
        if rng.random() < 0.7:
            fields |= {"stiffness": k, "damping": c, "free_length": l0}
            if rng.random() < 0.2:
                fields["actuator"] = k * l0 * rng.uniform(-0.2, 0.2)
        else:
            fields["law"] = rng.choice([
                Formula("{}*(l - {}) + {}*ldot", k, l0, c),
                Formula("{}*(l - {})^3 + {}*ldot", k / f.length**2, l0, c),
                Formula("{}*(l - {}) + {}*sin({}*t)", k, l0, 0.3 * k * l0, 2 / f.time),
                Formula("{}*(l - {}) + {}*tanh(ldot/{})", k, l0, c * f.length / f.time, f.length / f.time)])
        return fields

    def turning(self):
        return [j for j in self.m.joints if j.angle is not None]

    def rsda(self):
        rng = self.rng
        joints = self.turning()
        if not joints:
            return None
        joint = rng.choice(joints)
        k, c = self.stiffness(self.least(joint.bodies, "inertia"))
        fields = {"type": "rsda", "joint": joint.name}
        rest = joint.angle + rng.uniform(-0.5, 0.5)
        if rng.random() < 0.7:
            return fields | {"stiffness": k, "damping": c, "free_angle": rest}
        return fields | {"law": rng.choice([
            Formula("{}*(angle - {}) + {}*rate", k, rest, c),
            Formula("{}*sin(angle - {}) + {}*rate", k, rest, c),
            Formula("{}*(angle - {}) + {}*cos({}*t)", k, rest, 0.3 * k, 2 / self.family.time)])}

    def pushed(self, size, measured):
        """Three components: constant, of time, or of what a sensor measures."""
        rng = self.rng
        components = []
        for k in range(3):
            kind = rng.choice(["none", "constant", "time", "state"])
            amount = size * rng.uniform(-0.5, 0.5)
            if kind == "constant":
                components.append(amount)
            elif kind == "time":
                components.append(Formula("{}*sin({}*t)", amount, rng.uniform(0.5, 4) / self.family.time))
            elif kind == "state":
                name, scale = measured("xyz"[k])
                components.append(Formula("{}*" + name, -abs(amount) / scale))
            else:
                components.append(0)
        return components

    def sensor(self, fields):
        for name, other in self.sensors.items():
            if other == fields:
                return name
        name = f"s{len(self.sensors) + 1}"
        self.sensors[name] = fields
        return name

    def force(self):
        rng, f = self.rng, self.family
        pose = rng.choice(self.m.poses[1:])
        speed = f.length / f.time

        def measured(component):
            return self.sensor({"quantity": "velocity", "body": pose.name, "component": component}), speed

        size = self.least((self.m.poses.index(pose),), "mass") * f.length / f.time**2
        fields = {"type": "force", "body": pose.name, "point": self.m.local_point(pose),
                  "components": self.pushed(size, measured)}
        if rng.random() < 0.3:
            fields["frame"] = "body"
        return fields

    def torque(self):
        rng, f = self.rng, self.family
        pose = rng.choice(self.m.poses[1:])

        def measured(component):
            return self.sensor({"quantity": "angular_velocity", "body": pose.name, "component": component}), 1 / f.time

        size = self.least((self.m.poses.index(pose),), "inertia") / f.time**2
        fields = {"type": "torque", "body": pose.name, "components": self.pushed(size, measured)}
        if rng.random() < 0.3:
            fields["frame"] = "body"
        return fields

    def bushing(self):
        rng, f = self.rng, self.family
        i, j = sorted(rng.sample(range(len(self.m.poses)), 2))
        return self.bushing_between(i, j, 0.1 * rng.uniform(0, 1) * f.length)

    def bushing_between(self, i, j, apart):
        rng = self.rng
        b1, b2 = self.m.poses[i], self.m.poses[j]
        P2 = add(b2.position, rotate(b2.turn, self.m.local_point(b2)))
        P1 = add(P2, times(apart, random_direction(rng)))
        k, c = self.stiffness(self.least((i, j), "mass"))
        kt, ct = self.stiffness(self.least((i, j), "inertia"))
        return {"type": "bushing", "body1": b1.name, "body2": b2.name,
                "point1": unrotate(b1.turn, sub(P1, b1.position)), "point2": unrotate(b2.turn, sub(P2, b2.position)),
                "stiffness": [k * rng.uniform(0.5, 2) for _ in range(3)], "damping": [c, c, c],
                "torsional_stiffness": [kt * rng.uniform(0.5, 2) for _ in range(3)], "torsional_damping": [ct, ct, ct]}

    def movable(self):
        """A joint with an angle or a displacement, and whether it is an angle."""
        joints = [j for j in self.m.joints if j.angle is not None or j.displacement is not None]
        joint = self.rng.choice(joints) if joints else None
        return joint, joint is not None and joint.angle is not None

    def friction(self):
        rng, f = self.rng, self.family
        joint, turns = self.movable()
        if not joint:
            return None
        inertia = self.least(joint.bodies, "inertia" if turns else "mass")
        rate = (1 if turns else f.length) / f.time
        friction = {"type": "friction", "joint": joint.name, "motion": "rotation" if turns else "translation",
                    "coulomb": 0.3 * inertia * rate / f.time, "smooth_velocity": rate * rng.uniform(0.2, 1),
                    "viscous": rng.choice([0, 0.1]) * inertia / f.time}
        if rng.random() < 0.5:
            friction |= {"breakaway": 1.5 * friction["coulomb"], "stribeck_velocity": rate * rng.uniform(0.2, 1)}
        return friction

    def one_sided_spring(self, inertia, size):
        rng = self.rng
        k = self.stiffness(inertia)[0] * 10 ** rng.uniform(0, 3)
        n = rng.choice([1, 1, 1.5, 2])
        return {"stiffness": k / size ** (n - 1), "exponent": n,
                "damping": rng.choice([0, rng.uniform(0.01, 0.5) * self.family.time / size])}

    def stop(self):
        """In a joint, which the motion may come to."""
        rng, f = self.rng, self.family
        joint, turns = self.movable()
        if not joint:
            return None
        size, start = (1, joint.angle) if turns else (f.length, joint.displacement)
        bounds = {key: start + sign * size * rng.uniform(0, 0.4) for key, sign in (("lower", -1), ("upper", 1))
                  if rng.random() < 0.7}
        if not bounds:
            return None
        return ({"type": "stop", "joint": joint.name, "motion": "rotation" if turns else "translation"} | bounds |
                self.one_sided_spring(self.least(joint.bodies, "inertia" if turns else "mass"), size))

    def contact(self):
        """Of a ball with a plane of the ground, another ball or the inside of one."""
        rng, f = self.rng, self.family
        found = self.two_points()
        if not found:
            return None
        (i, j), points, length = found
        fields = {"type": "contact", "body1": self.m.poses[i].name, "body2": self.m.poses[j].name,
                  "point1": points[0], "point2": points[1], "radius2": length * rng.uniform(0, 0.4)}
        gap = length * rng.uniform(-0.01, 0.3)
        kind = rng.choice(["plane", "ball", "ring"])
        if kind == "plane":
            ends = [add(self.m.poses[k].position if k else f.origin, rotate(self.m.poses[k].turn, p))
                    for k, p in ((i, points[0]), (j, points[1]))]
            towards = times(1 / length, sub(ends[1], ends[0]))
            fields["point1"] = unrotate(self.m.poses[i].turn, sub(
                add(ends[0], times(length - fields["radius2"] - gap, towards)), self.m.poses[i].position if i else f.origin))
            fields["normal1"] = unrotate(self.m.poses[i].turn, towards)
        elif kind == "ball":
            fields["radius1"] = max(0.0, length - gap - fields["radius2"])
        else:
            fields |= {"radius1": length + abs(gap) + fields["radius2"], "inside": True}
        return fields | self.one_sided_spring(self.least((i, j), "mass"), length)

    def switched(self):
        """A torque that begins at a time, or changes where a rate or an angle passes a value."""
        rng, f = self.rng, self.family
        pose = rng.choice(self.m.poses[1:])
        size = self.least((self.m.poses.index(pose),), "inertia") / f.time**2
        amount = size * rng.uniform(-0.5, 0.5)
        joints = self.turning()
        if joints and (f.has("equilibrium") or rng.random() < 0.6):
            joint = rng.choice(joints)
            name = self.sensor({"quantity": "angle", "joint": joint.name})
            where = Formula(name + " - {}", joint.angle + rng.uniform(-0.3, 0.3))
        elif f.has("equilibrium"):
            return None
        else:
            where = Formula("t - {}", rng.uniform(0.1, 0.9) * f.end_time)
        d = self.sensor({"quantity": "expression", "value": where})
        component = rng.choice([Formula("{}*(1 + abs(" + d + ")/" + d + ")", amount), Formula("{}*abs(" + d + ")", amount),
                                Formula("{}*max(0, " + d + ")^1.5", amount),
                                Formula("{}*table(" + d + ", [-1, 0, 0.2, 1], [0, 0, 1, 2])", amount)])
        components = [0, 0, component]
        rng.shuffle(components)
        return {"type": "torque", "body": pose.name, "components": components}

    def hold_everything(self):
        """An equilibrium exists for sure where every body is held; only then is one worth asking for."""
        for i in range(1, len(self.m.poses)):
            self.forces.append({"name": f"f{len(self.forces) + 1}", **self.bushing_between(0, i, 0.0)})
        for _ in range(self.rng.choice([0, 1, 2, 3])):
            fields = self.one_sided()
            if fields:
                self.forces.append({"name": f"f{len(self.forces) + 1}", **fields})

    def one_sided(self):
        """A stop or a slack cable: it has a force on one side of its kink only."""
        rng = self.rng
        joints, x, harder = self.turning(), "l", 10 ** rng.uniform(0, 3)
        if joints and rng.random() < 0.5:
            joint = rng.choice(joints)
            k, x = self.stiffness(self.least(joint.bodies, "inertia"))[0], "angle"
            kink = joint.angle + rng.uniform(-0.5, 0.5)
            fields = {"type": "rsda", "joint": joint.name}
        else:
            found = self.two_points()
            if not found:
                return None
            (i, j), points, length = found
            k, kink = self.stiffness(self.least((i, j), "mass"))[0], length * rng.uniform(0.8, 1.2)
            fields = {"type": "tsda", "body1": self.m.poses[i].name, "body2": self.m.poses[j].name,
                      "point1": points[0], "point2": points[1]}
        law = rng.choice(["{}*max(0, " + x + " - {})", "-{}*max(0, {} - " + x + ")"])
        return fields | {"law": Formula(law, harder * k, kink)}
