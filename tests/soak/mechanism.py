"""Bodies and joints: first poses that fit, then joints that hold there, so that every loop closes by construction."""

import math
from dataclasses import dataclass

from families import log_uniform
from rotations import (about, add, cross, dot, multiply, norm, perpendicular, random_direction, random_turn,
                       rotate, sub, times, unit, unrotate)

# Equations of each joint in space; of the motion in a plane.
ROWS = {"revolute": 5, "spherical": 3, "universal": 4, "translational": 5, "cylindrical": 4, "screw": 5, "planar": 3,
        "fixed": 6, "distance": 1, "point_on_line": 2, "point_on_plane": 1, "perpendicular": 1}
PLANE_ROWS = {"revolute": 2, "translational": 2, "planar": 0, "fixed": 3, "distance": 1, "point_on_line": 1,
              "point_on_plane": 1}
TREE_SPACE = {"revolute": 6, "spherical": 4, "universal": 2, "cylindrical": 2, "translational": 2, "screw": 1,
              "planar": 1, "fixed": 1, "distance": 1, "point_on_line": 1, "point_on_plane": 1, "perpendicular": 1,
              None: 1}
TREE_PLANE = {"revolute": 10, "translational": 3, "planar": 1, "fixed": 1}
LOOP_SPACE = {"spherical": 5, "distance": 5, "universal": 1, "point_on_line": 2, "point_on_plane": 2, "cylindrical": 1,
              "perpendicular": 1, "revolute": 1}
LOOP_PLANE = {"revolute": 8, "distance": 3, "translational": 1, "point_on_line": 1, "point_on_plane": 1}
WITH_ANGLE, WITH_DISPLACEMENT = {"revolute", "cylindrical", "screw"}, {"translational", "cylindrical", "screw"}
ACROSS = 1e-3  # a point's least distance, of the length of a body, where a direction or a length is made of it


@dataclass
class Pose:
    name: str
    position: list
    turn: list
    mass: float
    length: float
    inertia: float


@dataclass
class Joint:
    name: str
    type: str
    bodies: tuple
    angle: float | None = None  # where sensors, drives and springs may ask for it
    displacement: float | None = None
    in_tree: bool = True


class Mechanism:
    def __init__(self, rng, family):
        self.rng, self.family = rng, family
        self.poses = [Pose("ground", [0, 0, 0], [1, 0, 0, 0], 0, family.length, 0)]
        self.joints, self.bodies, self.joint_fields = [], [], []
        self.freedoms = 0
        for _ in range(family.bodies):
            self.add_body()
        if family.has("massless"):
            self.take_masses()
        self.close_loops()
        self.add_gears()

    # ---- bodies

    def add_body(self):
        rng, f = self.rng, self.family
        last = len(self.poses) - 1
        parent = 0 if last == 0 or rng.random() < 0.25 else last if rng.random() < 0.6 else rng.randint(1, last)
        kinds = TREE_PLANE if f.planar else TREE_SPACE
        if f.has("driven"):
            kinds = {k: w for k, w in kinds.items() if k in ("revolute", "translational")}
        kind = rng.choices(list(kinds), kinds.values())[0]
        length = f.length * rng.uniform(0.4, 1.2)
        same_axes = kind in WITH_ANGLE and rng.random() < 0.6
        p = self.poses[parent]
        axis = self.global_axis(kind)
        angle = rng.uniform(-1.2, 1.2)
        if same_axes:
            turn = multiply(about(axis, angle), p.turn)
        elif f.planar:
            turn = about(f.normal, rng.uniform(-3, 3))
            if rng.random() < 0.15:
                turn = multiply(turn, random_turn(rng))
        else:
            turn = random_turn(rng)
        P1 = add(p.position if parent else f.origin, rotate(p.turn, self.local_point(p)))
        P2 = add(P1, self.apart(kind, axis))
        body = Pose(f"b{last + 1}", None, turn, *self.mass_of(length))
        body.position = sub(P2, rotate(turn, self.local_point(body)))
        self.poses.append(body)
        self.bodies.append(self.body_fields(body))
        self.freedoms += 3 if f.planar else 6
        if kind:
            self.add_joint(kind, parent, last + 1, P1, P2, axis, angle if same_axes else None)

    def global_axis(self, kind):
        rng, f = self.rng, self.family
        if not f.planar:
            return random_direction(rng)
        axis = f.normal
        if kind in ("translational", "point_on_line", "point_on_plane"):
            axis = perpendicular(rng, f.normal)
        if f.off_plane:
            axis = unit(add(axis, times(f.off_plane, random_direction(rng))))
        return [float(x) for x in axis]

    def local_point(self, pose):
        size = pose.length if pose.name != "ground" else self.family.length
        if self.rng.random() < 0.2:
            return [0.0, 0.0, 0.0]
        return times(size * self.rng.uniform(0.3, 1), random_direction(self.rng))

    def apart(self, kind, axis):
        """From point1 to point2, as far as the joint lets them be."""
        rng, size = self.rng, self.family.length
        if kind in WITH_DISPLACEMENT or kind == "point_on_line":
            return times(size * rng.uniform(-0.5, 0.5), axis)
        if kind in ("planar", "point_on_plane"):
            return times(size * rng.uniform(0, 0.7), perpendicular(rng, axis))
        if kind in ("distance", "perpendicular", None):
            way = perpendicular(rng, self.family.normal) if self.family.planar else random_direction(rng)
            return times(size * rng.uniform(0.3, 1), way)
        return [0, 0, 0]

    def mass_of(self, length):
        rng, f = self.rng, self.family
        mass = f.mass * 10 ** rng.uniform(-f.mass_decades, f.mass_decades)
        return mass, length, mass * length**2 / 10

    def body_fields(self, pose):
        rng, f = self.rng, self.family
        com = [0.0, 0.0, 0.0]
        if rng.random() > 0.3:
            com = times(pose.length * rng.uniform(0.1, 0.5), random_direction(rng))
        fields = {"name": pose.name, "mass": pose.mass, "com": com, "inertia": self.inertia_of(pose),
                  "position": list(pose.position), "orientation": self.orientation_of(pose.turn)}
        speed, rate = f.length / f.time, f.spin or 1 / f.time
        if rng.random() < 0.7:
            flat = f.planar and rng.random() < 0.8
            speed *= rng.uniform(0, 1)
            fields["velocity"] = times(speed, perpendicular(rng, f.normal) if flat else random_direction(rng))
            along = f.normal if flat else random_direction(rng)
            fields["angular_velocity"] = [float(x) for x in times(rate * rng.uniform(-1, 1), along)]
        if rng.random() < 0.3:
            fields["points"] = {"tip": self.local_point(pose)}
        return fields

    def inertia_of(self, pose):
        rng = self.rng
        extents = [pose.length * rng.uniform(0.15, 0.5) for _ in range(3)]
        if rng.random() < 0.15:
            return {"consistent": dict(zip("xyz", extents)) | {"xy": 0.1 * pose.length}}
        squares = [pose.mass * x * x for x in extents]
        moments = [squares[1] + squares[2], squares[0] + squares[2], squares[0] + squares[1]]
        if rng.random() < 0.6:
            return moments
        turn = random_turn(rng)
        columns = [rotate(turn, [float(i == k) for i in range(3)]) for k in range(3)]
        tensor = {a + b: sum(moments[k] * columns[k]["xyz".index(a)] * columns[k]["xyz".index(b)] for k in range(3))
                  for a, b in ("xx", "yy", "zz", "xy", "xz", "yz")}
        return tensor

    def orientation_of(self, turn):
        if abs(turn[0]) < 1 and self.rng.random() < 0.3:
            size = norm(turn[1:])
            return {"axis": times(1 / size, turn[1:]), "angle": 2 * math.atan2(size, turn[0])}
        return list(turn)

    def take_masses(self):
        """From bodies that carry another one by a joint, which lends them its inertia in every direction that the joint
        to their own carrier leaves."""
        held = {"revolute", "translational", "fixed"}
        holder = {joint.bodies[1]: joint.type for joint in self.joints}
        for joint in self.joints:
            i, j = joint.bodies
            if i and holder.get(i) in held and joint.type in held and self.poses[i].mass and self.poses[j].mass and self.rng.random() < 0.6:
                self.poses[i].mass = self.poses[i].inertia = 0
                self.bodies[i - 1].update(mass=0, inertia=[0, 0, 0])

    def path(self, i, j):
        """The joints of the tree between two bodies."""
        up = {joint.bodies[1]: joint for joint in self.joints if joint.in_tree}
        ways = []
        for k in (i, j):
            way = []
            while k in up:
                way.append(up[k])
                k = up[k].bodies[0]
            ways.append(way)
        return [joint for joint in ways[0] + ways[1] if (joint in ways[0]) != (joint in ways[1])]

    # ---- joints

    def add_joint(self, kind, i, j, P1, P2, axis, angle=None, in_tree=True):
        rng, b1, b2 = self.rng, self.poses[i], self.poses[j]
        joint = Joint(f"j{len(self.joints) + 1}", kind, (i, j), in_tree=in_tree)
        fields = {"name": joint.name, "type": kind, "body1": b1.name, "body2": b2.name}
        local1 = lambda v: unrotate(b1.turn, v)
        local2 = lambda v: unrotate(b2.turn, v)
        if kind != "perpendicular":
            fields["point1"], fields["point2"] = local1(sub(P1, b1.position)), local2(sub(P2, b2.position))
        if kind in ("revolute", "cylindrical", "screw", "translational", "planar"):
            fields["axis1"], fields["axis2"] = local1(axis), local2(axis)
        if kind in ("universal", "perpendicular"):
            fields["axis1"], fields["axis2"] = local1(axis), local2(perpendicular(rng, axis))
        if kind in ("point_on_line", "point_on_plane"):
            fields["axis1"] = local1(axis)
        if kind == "distance":
            fields["length"] = norm(sub(P2, P1))
        if kind == "screw":
            fields["pitch"] = self.family.length * rng.choice([-1, 1]) * rng.uniform(0.2, 2)
        if kind in WITH_DISPLACEMENT:
            joint.displacement = dot(axis, sub(P2, P1))
        if kind in WITH_ANGLE:
            joint.angle = angle
            if angle is not None:  # both bodies have the axis in the same direction of their own
                fields["axis2"] = list(fields["axis1"])
            elif rng.random() < 0.7:
                joint.angle, n = rng.uniform(-2.5, 2.5), perpendicular(rng, axis)
                fields["normal1"], fields["normal2"] = local1(n), local2(rotate(about(axis, joint.angle), n))
        if kind == "translational" and rng.random() < 0.5:
            n = perpendicular(rng, axis)
            fields["normal1"], fields["normal2"] = local1(n), local2(n)
        if "axis1" in fields and rng.random() < 0.15 and angle is None:
            fields["axis1"] = times(log_uniform(rng, 0.1, 10), fields["axis1"])
        self.joints.append(joint)
        self.joint_fields.append(fields)
        self.freedoms -= (PLANE_ROWS if self.family.planar else ROWS)[kind]

    def close_loops(self):
        rng, f = self.rng, self.family
        wanted = rng.choices([0, 1, 2, 3], [3, 4, 2, 1])[0] if f.planar else rng.choices([0, 1, 2], [4, 2, 1])[0]
        kinds, rows = (LOOP_PLANE, PLANE_ROWS) if f.planar else (LOOP_SPACE, ROWS)
        if f.has("driven"):
            kinds = {"revolute": 1} if f.planar else {"distance": 1}
        for _ in range(wanted):
            i, j = sorted(rng.sample(range(len(self.poses)), 2))
            kind = rng.choices(list(kinds), kinds.values())[0]
            if self.freedoms - rows[kind] < 1 or any(joint.bodies == (i, j) for joint in self.joints):
                continue
            axis, b1 = self.global_axis(kind), self.poses[i]
            P1 = add(b1.position if i else f.origin, rotate(b1.turn, self.local_point(b1)))
            P2 = add(P1, self.apart(kind, axis))
            if kind == "distance":  # any two points; in a plane at one height
                b2 = self.poses[j]
                P2 = add(b2.position, rotate(b2.turn, self.local_point(b2)))
                if f.planar:
                    P2 = add(P2, times(dot(f.normal, sub(P1, P2)), f.normal))
                if norm(sub(P2, P1)) < ACROSS * f.length:
                    continue
            self.add_joint(kind, i, j, P1, P2, axis, in_tree=False)

    def add_gears(self):
        """Between joints without normals: only these count from the file's orientations whatever their angles are."""
        rng = self.rng
        plain = [k for k, joint in enumerate(self.joints) if "normal1" not in self.joint_fields[k]]
        turning = [k for k in plain if self.joints[k].type in ("revolute", "cylindrical")]
        sliding = [k for k in plain if self.joints[k].type in ("translational", "cylindrical")]
        if rng.random() > 0.15 or self.freedoms < 2 or not turning:
            return
        first = rng.choice(turning)
        rack = bool(sliding) and rng.random() < 0.5
        others = [k for k in (sliding if rack else turning) if k != first]
        if not others:
            return
        fields = {"name": f"j{len(self.joints) + 1}", "type": "rack_pinion" if rack else "gear",
                  "joint1": self.joints[first].name, "joint2": self.joints[rng.choice(others)].name}
        ratio = rng.choice([-1, 1]) * rng.uniform(0.3, 3)
        fields["radius" if rack else "ratio"] = ratio * (self.family.length if rack else 1)
        self.joints.append(Joint(fields["name"], fields["type"], (0, 0), in_tree=False))
        self.joint_fields.append(fields)
        self.freedoms -= 1
